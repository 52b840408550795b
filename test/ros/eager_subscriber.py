# SPDX-License-Identifier: BSD-3-Clause
"""A subscriber like those of rospy before 1.16: it renews an ended connection at once."""
from __future__ import annotations

import io
import socket
import threading
from types import TracebackType
from typing import Optional, Type
from xmlrpc.client import ServerProxy

import rosgraph
from rosgraph.network import read_ros_handshake_header, write_ros_handshake_header

NAME = '/eager_subscriber'


class EagerSubscriber:
    """Connects to a node that publishes the topic; use it in a ``with``."""

    def __init__(self, node: str, topic: str) -> None:
        self._header = {'callerid': NAME, 'topic': topic, 'md5sum': '*', 'type': '*'}
        with ServerProxy(rosgraph.Master(NAME).lookupNode(node)) as api:
            _, _, (_, *address) = api.requestTopic(NAME, topic, [['TCPROS']])  # type: ignore
        self._address = tuple(address)
        self.connections = 0
        connection = self._connected()
        assert connection is not None
        self._thread = threading.Thread(target=self._stay, args=[connection], daemon=True)
        self._thread.start()

    def __enter__(self) -> EagerSubscriber:
        return self

    def __exit__(self, kind: Optional[Type[BaseException]], error: Optional[BaseException],
                 traceback: Optional[TracebackType]) -> None:
        self._thread.join(20.0)  # ends when the node has ended

    def _stay(self, connection: Optional[socket.socket]) -> None:
        while connection is not None:
            with connection:
                while self._is_open(connection):
                    pass
            connection = self._connected()

    @staticmethod
    def _is_open(connection: socket.socket) -> bool:
        try:
            return bool(connection.recv(1 << 16))
        except ConnectionError:
            return False

    def _connected(self) -> Optional[socket.socket]:
        """Open a connection; return None if nothing accepts it."""
        try:
            connection = socket.create_connection(self._address)
            write_ros_handshake_header(connection, self._header)
            read_ros_handshake_header(connection, io.BytesIO(), 1 << 12)
        except (OSError, rosgraph.network.ROSHandshakeException):
            return None
        self.connections += 1
        return connection
