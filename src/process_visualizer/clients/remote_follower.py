# SPDX-License-Identifier: BSD-3-Clause
"""A subscriber to a node of another ROS master: rospy knows only one master."""
from __future__ import annotations

import socket
import struct
import threading
import time
from contextlib import suppress
from typing import Any, Callable, Optional, Type

import genpy
import rospy

from process_visualizer.launching.ros_api import (
    CONNECTION_ERRORS,
    MasterClient,
    connected_by_handshake,
    publisher_address,
)

_TIMEOUT_S = 5.0
_START_S, _RETRY_S = 20.0, 0.1
_LENGTH = struct.Struct('<I')


class RemoteFollower:
    """Reads one topic of one node, in a thread of its own, until that node ends.

    The node is asked directly, as by any subscriber, but without registering at its master.
    """

    def __init__(self, topic: str, message_class: Type[Any], node: str, master_uri: str,
                 on_message: Callable[[Any], None], on_end: Callable[[], None],
                 start_s: float = _START_S) -> None:
        """``on_message`` and ``on_end`` are called in the thread, and no longer after ``close``.

        A node that does not publish within ``start_s`` counts as ended.
        """
        self._topic, self._message_class = topic, message_class
        self._node, self._master_uri = node, master_uri
        self._on_message, self._on_end, self._start_s = on_message, on_end, start_s
        self._lock = threading.Lock()
        self._connection: Optional[socket.socket] = None
        self._closed = threading.Event()
        self._thread = threading.Thread(target=self._run, name=f'follow {topic}', daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Stop following, and wait until the thread has ended."""
        with self._lock:
            self._closed.set()
            if self._connection is not None:
                with suppress(OSError):  # the node has closed it already
                    self._connection.shutdown(socket.SHUT_RDWR)
        self._thread.join()

    def _run(self) -> None:
        try:
            with self._connected(time.monotonic() + self._start_s) as connection, \
                    connection.makefile('rb') as stream:
                self._follow(stream)
        except (*CONNECTION_ERRORS, genpy.DeserializationError) as error:
            if not self._closed.is_set():
                rospy.loginfo('%s of %s is not followed: %s', self._topic, self._node, error)
        if not self._closed.is_set():
            self._on_end()

    def _follow(self, stream: Any) -> None:
        while True:
            head = stream.read(_LENGTH.size)
            if len(head) < _LENGTH.size:
                return
            data = stream.read(_LENGTH.unpack(head)[0])
            message = self._message_class().deserialize(data)
            if self._closed.is_set():
                return
            self._on_message(message)

    def _connected(self, end_s: float) -> socket.socket:
        """Return a connection; retry for a while, as a node may have just started."""
        while True:
            try:
                return self._connect()
            except CONNECTION_ERRORS:
                if time.monotonic() > end_s or self._closed.wait(_RETRY_S):
                    raise

    def _connect(self) -> socket.socket:
        master = MasterClient(rospy.get_name(), self._master_uri, _TIMEOUT_S)
        address = publisher_address(master, self._node, self._topic, _TIMEOUT_S)
        connection, _ = connected_by_handshake(address, {
            'topic': self._topic, 'type': self._message_class._type,
            'md5sum': self._message_class._md5sum, 'callerid': rospy.get_name(),
            'message_definition': self._message_class._full_text, 'tcp_nodelay': '1'}, _TIMEOUT_S)
        connection.settimeout(None)  # a publisher may have nothing to send
        with self._lock:
            if self._closed.is_set():
                connection.close()
                raise OSError('closed')
            self._connection = connection
        return connection
