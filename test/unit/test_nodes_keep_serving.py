# SPDX-License-Identifier: BSD-3-Clause
"""rospy's servers in our nodes go on after a shortage, and beside who says nothing."""
from __future__ import annotations

import errno
import queue
import socket
import struct
import threading
from contextlib import suppress
from typing import Any
from xmlrpc.client import ServerProxy

import pytest
from rosgraph.xmlrpc import ThreadingXMLRPCServer
from rospy.impl.tcpros_base import TCPServer

from process_visualizer.nodes.common.node_handle import keep_serving

TIMEOUT_S = 60.0


HEADER = struct.pack('<I', 5) + b'hello'


def connected(server: TCPServer) -> socket.socket:
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
    keep_serving()
    taken: 'queue.Queue[Any]' = queue.Queue()
    server = TCPServer(lambda connection, _: taken.put(connection))
    server.server_sock = ShortOf(server.server_sock, shortage)
    server.start()
    try:
        with connected(server):
            taken.get(timeout=TIMEOUT_S).close()
    finally:
        server.shutdown()


def test_who_says_nothing_keeps_nobody_waiting() -> None:
    """One such connection was enough."""
    keep_serving()
    taken: 'queue.Queue[bytes]' = queue.Queue()
    server = TCPServer(lambda connection, _: taken.put(connection.recv(100)))
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
    keep_serving()
    server = TCPServer(lambda *_: pytest.fail('it is read'))
    server.start()
    try:
        with socket.create_connection(('localhost', server.port)) as connection:
            connection.sendall(b'\xff' * 4)
            with suppress(ConnectionResetError):  # as not all of it was read
                assert not connection.recv(1)
    finally:
        server.shutdown()


def test_other_nodes_are_still_answered(monkeypatch: pytest.MonkeyPatch) -> None:
    keep_serving()
    server = ThreadingXMLRPCServer(('localhost', 0), 0)
    server.register_function(lambda: 'here', 'ask')
    accept, shortages = server.get_request, [MemoryError()]

    def accept_later() -> Any:
        if shortages:
            raise shortages.pop()
        return accept()

    monkeypatch.setattr(server, 'get_request', accept_later)
    thread = threading.Thread(target=server.serve_forever)
    thread.start()
    try:
        assert ServerProxy(f'http://localhost:{server.server_address[1]}').ask() == 'here'
    finally:
        server.shutdown()
        thread.join(TIMEOUT_S)
        server.server_close()
    assert not thread.is_alive()
