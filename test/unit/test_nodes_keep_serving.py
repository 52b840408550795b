# SPDX-License-Identifier: BSD-3-Clause
"""rospy's servers in our nodes go on after a shortage of memory, threads or files."""
from __future__ import annotations

import errno
import queue
import socket
import threading
from typing import Any, List
from xmlrpc.client import ServerProxy

import pytest
from rosgraph.xmlrpc import ThreadingXMLRPCServer
from rospy.impl.tcpros_base import TCPServer

from process_visualizer.nodes.common.node_handle import keep_serving

TIMEOUT_S = 60.0


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
        socket.create_connection(('localhost', server.port)).close()
        taken.get(timeout=TIMEOUT_S).close()
    finally:
        server.shutdown()


def test_a_thread_that_cannot_be_started_costs_one_connection() -> None:
    keep_serving()
    taken: 'queue.Queue[Any]' = queue.Queue()
    shortages: List[Exception] = [RuntimeError("can't start new thread")]

    def take(connection: socket.socket, _address: Any) -> None:
        if shortages:
            connection.close()
            raise shortages.pop()
        taken.put(connection)

    server = TCPServer(take)
    server.start()
    try:
        for _ in range(2):
            socket.create_connection(('localhost', server.port)).close()
        taken.get(timeout=TIMEOUT_S).close()
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
