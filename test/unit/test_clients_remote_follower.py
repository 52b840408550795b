# SPDX-License-Identifier: BSD-3-Clause
"""A node of another master that is followed, and ends before or after its follower."""
from __future__ import annotations

import io
import socket
import threading
from typing import Iterator, List
from xmlrpc.server import SimpleXMLRPCServer

import pytest
from rosgraph.network import read_ros_handshake_header, write_ros_handshake_header
from std_msgs.msg import String

from process_visualizer.clients.remote_follower import RemoteFollower

TIMEOUT_S = 60.0


class Publisher:
    """Node that publishes a text to one subscriber, and the master that knows it."""

    def __init__(self) -> None:
        self._listening = socket.create_server(('127.0.0.1', 0))
        self._listening.settimeout(TIMEOUT_S)
        self._api = SimpleXMLRPCServer(('127.0.0.1', 0), logRequests=False)
        self.uri = f'http://127.0.0.1:{self._api.server_address[1]}/'
        port = self._listening.getsockname()[1]
        self._api.register_function(lambda *_: (1, '', self.uri), 'lookupNode')
        self._api.register_function(lambda *_: (1, '', ['TCPROS', '127.0.0.1', port]),
                                    'requestTopic')
        self._thread = threading.Thread(target=self._api.serve_forever, args=[0.05])
        self._thread.start()

    def send(self, text: str) -> socket.socket:
        """Wait for the subscriber, send it a text, and return the connection."""
        connection, _ = self._listening.accept()
        read_ros_handshake_header(connection, io.BytesIO(), 65536)
        write_ros_handshake_header(connection, {
            'type': String._type, 'md5sum': String._md5sum, 'callerid': '/node'})
        buffer = io.BytesIO()
        String(text).serialize(buffer)
        data = buffer.getvalue()
        connection.sendall(len(data).to_bytes(4, 'little') + data)
        return connection

    def close(self) -> None:
        """End both."""
        self._api.shutdown()
        self._api.server_close()
        self._listening.close()
        self._thread.join()


@pytest.fixture
def publisher() -> Iterator[Publisher]:
    """A publisher that ends with the test."""
    found = Publisher()
    yield found
    found.close()


@pytest.mark.parametrize('ends_by_itself', [True, False])
def test_a_follower_can_be_closed_whether_or_not_its_node_has_ended(
        publisher: Publisher, ends_by_itself: bool) -> None:
    came, ended = threading.Event(), threading.Event()
    texts: List[str] = []

    def take(message: String) -> None:
        texts.append(message.data)
        came.set()

    follower = RemoteFollower('/topic', String, '/node', publisher.uri, take, ended.set)
    connection = publisher.send('hello')
    assert came.wait(TIMEOUT_S)
    if ends_by_itself:
        connection.close()
        assert ended.wait(TIMEOUT_S)
    follower.close()
    follower.close()  # as the last follower does not know
    assert (texts, ended.is_set()) == (['hello'], ends_by_itself)
    connection.close()
