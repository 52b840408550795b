# SPDX-License-Identifier: BSD-3-Clause
"""The server of our rospy nodes goes on after a shortage, and beside silent connections."""
from __future__ import annotations

import errno
import queue
import socket
import struct
from contextlib import suppress
from functools import partial
from typing import Any, Optional

import pytest

from process_visualizer.nodes.common.node_server import NodeServer

TIMEOUT_S = 60.0


HEADER = struct.pack('<I', 5) + b'hello'


def connected(server: NodeServer) -> socket.socket:
    """Connect to it, and say who it is."""
    connection = socket.create_connection(('localhost', server.port))
    connection.sendall(HEADER)
    return connection


class ShortOf:
    """A listening socket that accepts nothing the first time."""

    def __init__(self, listening: socket.socket, shortage: Exception) -> None:
        self._listening, self._shortages = listening, [shortage]

    def accept(self) -> Any:
        if self._shortages:
            raise self._shortages.pop()
        return self._listening.accept()

    def close(self) -> None:
        self._listening.close()


@pytest.mark.parametrize('shortage', [MemoryError(), OSError(errno.EMFILE, 'files')])
def test_other_nodes_are_still_connected(shortage: Exception) -> None:
    """Its thread ended, and nobody was connected any more."""
    taken: 'queue.Queue[Any]' = queue.Queue()
    server = NodeServer(lambda connection, _: taken.put(connection))
    server.server_sock = ShortOf(server.server_sock, shortage)
    server.start()
    try:
        with connected(server):
            taken.get(timeout=TIMEOUT_S).close()
    finally:
        server.shutdown()


@pytest.mark.parametrize('default_s', [None, 60.0])
def test_who_says_nothing_keeps_nobody_waiting(default_s: Optional[float],
                                               request: pytest.FixtureRequest) -> None:
    """One such connection was enough; rospy sets a default timeout when it subscribes."""
    request.addfinalizer(partial(socket.setdefaulttimeout, socket.getdefaulttimeout()))
    socket.setdefaulttimeout(default_s)
    taken: 'queue.Queue[bytes]' = queue.Queue()
    server = NodeServer(lambda connection, _: taken.put(connection.recv(100)))
    server.start()
    try:
        with socket.create_connection(('localhost', server.port)), \
                socket.create_connection(('localhost', server.port)) as slow:
            slow.sendall(HEADER[:-1])
            with connected(server):
                assert taken.get(timeout=TIMEOUT_S) == HEADER
            slow.sendall(HEADER[-1:])
            assert taken.get(timeout=TIMEOUT_S) == HEADER
    finally:
        server.shutdown()


def test_a_header_that_claims_too_much_is_refused() -> None:
    server = NodeServer(lambda *_: pytest.fail('it is read'))
    server.start()
    try:
        with socket.create_connection(('localhost', server.port)) as connection:
            connection.sendall(b'\xff' * 4)
            with suppress(ConnectionResetError):  # as not all of it was read
                assert not connection.recv(1)
    finally:
        server.shutdown()
