# SPDX-License-Identifier: BSD-3-Clause
"""A request reaches a node at most once, also if the node ends before its answer."""
from __future__ import annotations

import socket
import threading
from typing import Iterator, List, Tuple

import pytest
from rosgraph.network import encode_ros_handshake_header
from std_srvs.srv import Trigger
from surroundings import PATIENCE_S

from process_visualizer.clients.service_connection import ServiceConnection, ServiceUnreachable

ANSWER = b'\x01' + (5).to_bytes(4, 'little') + b'\x01' + (0).to_bytes(4, 'little')
"""Success; the response has five bytes: true, and an empty text."""


class Node:
    """A node that answers requests, or closes the connection instead."""

    def __init__(self) -> None:
        self.requests = 0
        self.closes: List[Tuple[int, bool]] = []
        """For each connection, the request after which it is closed, and whether it is answered."""
        self._server = socket.create_server(('127.0.0.1', 0))
        self.closed = threading.Semaphore(0)
        threading.Thread(target=self._serve, daemon=True).start()

    def address(self) -> Tuple[str, int]:
        return '127.0.0.1', int(self._server.getsockname()[1])

    def close(self) -> None:
        self._server.close()

    def _serve(self) -> None:
        while True:
            try:
                connection, _ = self._server.accept()
            except OSError:
                return
            with connection:
                length = int.from_bytes(connection.recv(4), 'little')
                connection.recv(length)
                header = encode_ros_handshake_header(
                    {'callerid': '/node', 'md5sum': Trigger._md5sum, 'type': Trigger._type})
                connection.sendall(header if isinstance(header, bytes) else header.encode())
                last, is_answered = self.closes.pop(0)
                for number in range(1, last + 1):
                    if not connection.recv(4):
                        break
                    self.requests += 1
                    if number < last or is_answered:
                        connection.sendall(ANSWER)
            self.closed.release()


@pytest.fixture
def node() -> Iterator[Node]:
    made = Node()
    yield made
    made.close()


@pytest.fixture
def connection(node: Node) -> Iterator[ServiceConnection]:
    made = ServiceConnection('/node/act', Trigger, PATIENCE_S, 'http://127.0.0.1:9',
                             node.address)
    yield made
    made.close()


def test_a_request_that_a_node_took_before_it_closed_is_not_sent_again(
        node: Node, connection: ServiceConnection) -> None:
    node.closes = [(2, False), (9, True)]
    assert connection.call().success
    with pytest.raises(ServiceUnreachable, match='has closed the connection'):
        connection.call()
    assert node.requests == 2
    assert connection.call().success
    assert node.requests == 3


def test_a_node_that_closed_an_idle_connection_is_looked_up_again(
        node: Node, connection: ServiceConnection) -> None:
    node.closes = [(1, True), (9, True)]
    assert connection.call().success
    assert node.closed.acquire(timeout=PATIENCE_S)
    assert connection.call().success
    assert node.requests == 2
