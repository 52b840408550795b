# SPDX-License-Identifier: BSD-3-Clause
"""A publisher that may break the rules: every answer and every field can be chosen."""
from __future__ import annotations

import itertools
import socket
import struct
import threading
from typing import Any, Dict, List, Optional
from xmlrpc.server import SimpleXMLRPCServer

import rosgraph
from std_msgs.msg import UInt32

_names = itertools.count()


def header_of(message_class: Any, caller: str, latching: bool = False) -> Dict[str, bytes]:
    """Return a good publisher's header, which it sends when a subscriber connects."""
    texts = {'type': message_class._type, 'md5sum': message_class._md5sum, 'callerid': caller,
             'message_definition': message_class._full_text, 'latching': str(int(latching))}
    return {name: text.encode() for name, text in texts.items()}


class OddPublisher:
    """Publishes std_msgs/UInt32 to one subscriber at a time; use it in a ``with``."""

    def __init__(self, topic: str, header: Optional[Dict[str, bytes]] = None,
                 bus_info: Any = None, name: str = '') -> None:
        """Register with the master.

        Args:
            topic: the published topic.
            header: its description of its messages.
            bus_info: its answer when it is asked for its connections; None: the truth.
            name: of the node.
        """
        self.name = name or f'/odd_{next(_names)}'
        self._topic = topic
        self._header = header_of(UInt32, self.name) if header is None else header
        self._bus_info = bus_info
        self._subscribers: List[str] = []
        self._connection: Optional[socket.socket] = None
        self._connected = threading.Event()
        self._listener = socket.create_server(('localhost', 0))
        self._server = SimpleXMLRPCServer(('localhost', 0), logRequests=False, allow_none=True)
        self._server.register_function(self._request_topic, 'requestTopic')
        self._server.register_function(self._get_bus_info, 'getBusInfo')
        self._threads = [threading.Thread(target=self._server.serve_forever),
                         threading.Thread(target=self._accept)]
        for thread in self._threads:
            thread.start()
        self._address = f'http://localhost:{self._server.server_address[1]}/'
        self._master = rosgraph.Master(self.name)
        self._master.registerPublisher(topic, UInt32._type, self._address)

    def __enter__(self) -> OddPublisher:
        return self

    def __exit__(self, *_: object) -> None:
        self.unregister()
        self.die()

    def unregister(self) -> None:
        """Unregister from the master."""
        self._master.unregisterPublisher(self._topic, self._address)

    def die(self) -> None:
        """End without telling the master."""
        self._server.shutdown()
        self._server.server_close()
        self._listener.shutdown(socket.SHUT_RDWR)
        self._listener.close()
        if self._connection is not None:
            self._connection.close()
        for thread in self._threads:
            thread.join()

    def publish(self, number: int) -> None:
        """Send a message, once there is a subscriber."""
        assert self._connected.wait(20.0), 'nobody connects'
        assert self._connection is not None
        self._connection.sendall(struct.pack('<II', 4, number))

    def _request_topic(self, *_: object) -> List[Any]:
        return [1, '', ['TCPROS', 'localhost', self._listener.getsockname()[1]]]

    def _get_bus_info(self, *_: object) -> Any:
        if self._bus_info is not None:
            return self._bus_info
        return [1, '', [[1, name, 'o', 'TCPROS', self._topic, 1] for name in self._subscribers]]

    def _accept(self) -> None:
        while True:
            try:
                connection, _ = self._listener.accept()
            except OSError:
                return  # the end
            self._subscribers = [_caller_in(_sized(connection))]
            fields = b''.join(struct.pack('<I', len(name) + 1 + len(value)) + name + b'=' + value
                              for name, value in ((name.encode(), value)
                                                  for name, value in self._header.items()))
            connection.sendall(struct.pack('<I', len(fields)) + fields)
            self._connection = connection
            self._connected.set()


def _sized(connection: socket.socket) -> bytes:
    size, = struct.unpack('<I', connection.recv(4, socket.MSG_WAITALL))
    return connection.recv(size, socket.MSG_WAITALL)


def _caller_in(header: bytes) -> str:
    while header:
        size, = struct.unpack_from('<I', header)
        name, _, value = header[4:4 + size].partition(b'=')
        if name == b'callerid':
            return value.decode()
        header = header[4 + size:]
    return ''
