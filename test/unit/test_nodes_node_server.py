# SPDX-License-Identifier: BSD-3-Clause
"""The server of our rospy nodes continues after a shortage, and next to silent connections."""
from __future__ import annotations

import errno
import queue
import socket
import struct
import threading
from contextlib import suppress
from functools import partial
from types import SimpleNamespace
from typing import Any, List, Optional, Tuple
from xmlrpc.client import ServerProxy

import pytest
import rospy
from rosgraph.xmlrpc import XmlRpcHandler, XmlRpcNode

from process_visualizer.clients import connector as connector_module
from process_visualizer.clients.connector import Connector
from process_visualizer.nodes.common import node_server
from process_visualizer.nodes.common.node_server import (
    NodeServer,
    QuestionServer,
    answer_patiently,
)

TIMEOUT_S = 60.0


HEADER = struct.pack('<I', 5) + b'hello'


def connected(server: NodeServer) -> socket.socket:
    """Connect to the server, and send the connection header."""
    connection = socket.create_connection(('localhost', server.port))
    connection.sendall(HEADER)
    return connection


class ShortOf:
    """Listening socket that accepts nothing the first time."""

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
    """Its thread ended, and no other node was connected after that."""
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
            with suppress(ConnectionResetError):  # because not all of it was read
                assert not connection.recv(1)
    finally:
        server.shutdown()


class Answers(XmlRpcHandler):
    """The answers of a node to requests."""

    def __init__(self) -> None:
        self.is_ready = threading.Event()
        self.done = False
        self.reg_man = SimpleNamespace()
        self.connected: 'queue.Queue[Tuple[str, str]]' = queue.Queue()

    def _connect_topic(self, topic: str, uri: str) -> None:
        self.connected.put((topic, uri))

    def _ready(self, _uri: str) -> None:
        self.is_ready.set()

    def getPid(self, _caller: str) -> int:  # noqa: N802 (the name in ROS)
        return 7


def waited_for_without_end(_thread: threading.Thread) -> None:
    """Act like threading.Thread.start without enough memory to start the thread."""
    pytest.fail('it would be waited for without end')


def test_no_thread_is_waited_for_that_may_never_begin(monkeypatch: pytest.MonkeyPatch) -> None:
    """A node that ran out of memory once never answered again, as it waited for a thread."""
    handler = Answers()
    node = XmlRpcNode(0, handler)
    node.start()
    assert handler.is_ready.wait(TIMEOUT_S)
    monkeypatch.setattr(rospy.core, '_shutdown_hooks', [node.shutdown])
    answer_patiently()
    for thread in threading.enumerate():
        if thread.name == 'end of a server':
            thread.join(TIMEOUT_S)
    taken: 'queue.Queue[Any]' = queue.Queue()
    server = NodeServer(lambda connection, _: taken.put(connection))
    server.start()
    monkeypatch.setattr(threading.Thread, 'start', waited_for_without_end)
    try:
        for _ in range(3):
            with ServerProxy(f'http://localhost:{node.port}/') as asked:
                assert asked.getPid('/test') == 7
            with connected(server):
                taken.get(timeout=TIMEOUT_S).close()
        handler.reg_man.publisher_update('/a', ['http://driver'])
        assert handler.connected.get(timeout=TIMEOUT_S) == ('/a', 'http://driver')
    finally:
        handler.done = True
        node.shutdown('the test is over')
        server.shutdown()


def test_a_server_that_does_not_serve_yet_is_not_waited_for(monkeypatch: pytest.MonkeyPatch
                                                           ) -> None:
    """A node whose thread was slow to start hung at its start."""
    node = XmlRpcNode(0, Answers())
    node._run_init()
    monkeypatch.setattr(rospy.core, '_shutdown_hooks', [node.shutdown])
    starting = threading.Thread(target=answer_patiently, daemon=True)
    starting.start()
    starting.join(TIMEOUT_S)
    has_started = not starting.is_alive()
    node.handler.done = True
    node.server.server_close()
    assert has_started


class Master:
    """Master that knows a publisher of a topic, but fails to answer once."""

    def __init__(self, *_arguments: Any, **_values: Any) -> None:
        pass

    lost: List[Exception] = []

    def getSystemState(self) -> List[Any]:  # noqa: N802 (the name in ROS)
        if self.lost:
            raise self.lost.pop()
        return [[['/a', ['/driver']]], [], []]

    def lookupNode(self, name: str) -> str:  # noqa: N802
        return f'http:/{name}'


class Subscriptions:
    """Stand-in for rospy's topic manager."""

    def check_all(self) -> None:
        pass

    def get_subscriptions(self) -> List[Tuple[str, str]]:
        return [('/a', 'std_msgs/String')]


def test_a_publisher_of_which_the_node_could_not_hear_is_asked_for(
        monkeypatch: pytest.MonkeyPatch) -> None:
    """The master reports it once, and the node had no thread to listen."""
    monkeypatch.setattr(connector_module, '_RETRY_S', 0.01)
    monkeypatch.setattr(connector_module, 'MasterClient', Master)
    monkeypatch.setattr(connector_module, 'get_topic_manager', Subscriptions)
    monkeypatch.setattr(Master, 'lost', [OSError('timed out')])
    handler: Any = Connecting([])
    connector = Connector(handler)
    node = XmlRpcNode(0, Answers())
    node._run_init()
    server = QuestionServer(node.server, handler, connector.ask_again)
    running = threading.Thread(target=connector.run, daemon=True)
    with monkeypatch.context() as short:
        short.setattr(node_server._thread, 'start_new_thread', no_thread)
        with pytest.raises(RuntimeError):
            server.process_request(None, None)
    running.start()
    try:
        assert handler.connected.get(timeout=TIMEOUT_S) == ('/a', 'http://driver')
    finally:
        handler.done = True
        running.join(TIMEOUT_S)
        server.server_close()


def no_thread(*_arguments: Any) -> None:
    raise RuntimeError("can't start new thread")


class Connecting:
    """Stand-in for a node's handler: notes the connections, after some shortages."""

    done = False

    def __init__(self, shortages: List[Exception]) -> None:
        self._shortages = shortages
        self.connected: 'queue.Queue[Tuple[str, str]]' = queue.Queue()

    def _connect_topic(self, topic: str, uri: str) -> Tuple[int, str, int]:
        if self._shortages:
            raise self._shortages.pop()
        self.connected.put((topic, uri))
        return 1, '', 0


@pytest.mark.parametrize('is_inside', [False, True], ids=['no thread', 'no thread in it'])
def test_a_publisher_that_comes_during_a_shortage_is_connected_later(
        is_inside: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """Before the fix, the node connected to no more publishers: rospy's thread had ended."""
    monkeypatch.setattr(connector_module, '_RETRY_S', 0.01)
    shortages: List[Exception] = [RuntimeError("can't start new thread"), MemoryError()]
    start = node_server._thread.start_new_thread

    def start_if_possible(*arguments: Any) -> Any:
        if shortages:
            raise shortages.pop()
        return start(*arguments)

    handler = Connecting(shortages if is_inside else [])
    connector = Connector(handler)
    running = threading.Thread(target=connector.run, daemon=True)
    running.start()
    if not is_inside:
        monkeypatch.setattr(node_server._thread, 'start_new_thread', start_if_possible)
    try:
        for topic in ('/a', '/b'):
            connector.publisher_update(topic, [f'http://{topic}'])
            assert handler.connected.get(timeout=TIMEOUT_S) == (topic, f'http://{topic}')
    finally:
        handler.done = True
        running.join(TIMEOUT_S)
