# SPDX-License-Identifier: BSD-3-Clause
"""Node checks over TCP: nodes that answer, hang, have ended, or were restarted.

The messages and their times are tested with a fake clock in test_nodes_scene_watch.py.
"""
from __future__ import annotations

import socket
import threading
from contextlib import contextmanager
from typing import Any, Callable, Dict, Iterator, List, Optional
from xmlrpc.server import SimpleXMLRPCServer

import pytest

from process_visualizer.health.node_pulse import ENDED, SILENT, Pulses, connecting


class Node:
    """Slave API of a node, on its own port."""

    def __init__(self) -> None:
        self.server = SimpleXMLRPCServer(('127.0.0.1', 0), logRequests=False)
        self.server.register_function(lambda caller: (1, '', 42), 'getPid')
        self.uri = f'http://127.0.0.1:{self.server.server_address[1]}/'
        threading.Thread(target=self.server.serve_forever, args=(0.01,), daemon=True).start()

    def end(self) -> None:
        self.server.shutdown()
        self.server.server_close()


@contextmanager
def hanging_node() -> Iterator[str]:
    """Node that accepts connections, as the kernel does for a stopped process, but is silent."""
    with socket.create_server(('127.0.0.1', 0)) as server:
        yield f'http://127.0.0.1:{server.getsockname()[1]}/'


class Watch:
    """Node checks in simulated time, which advances by a step after each wait."""

    STEP_S, MAX_STEPS = 0.05, 2000

    def __init__(self, pulses: Pulses) -> None:
        self._pulses, self._now_s = pulses, 1000.0

    def until(self, condition: Callable[[], bool]) -> None:
        """Step until a condition holds."""
        for _ in range(self.MAX_STEPS):
            if condition():
                return
            self._pulses.step(self._now_s, self.STEP_S)
            self._now_s += self.STEP_S
        raise AssertionError('it never holds')


def test_nodes_are_asked_at_ipv4_where_localhost_is_ipv6_first(
        monkeypatch: pytest.MonkeyPatch) -> None:
    """Debian's /etc/hosts names ::1 localhost, too; nodes of ROS 1 do not listen there."""
    usual = socket.getaddrinfo

    def ipv6_first(host: object, port: int, **kind: int) -> List[Any]:
        return [(socket.AF_INET6, socket.SOCK_STREAM, 6, '', ('::1', port, 0, 0)),
                *usual('127.0.0.1', port, **kind)]

    with socket.create_server(('127.0.0.1', 0)) as server:
        server.settimeout(10.0)
        monkeypatch.setattr(socket, 'getaddrinfo', ipv6_first)
        with connecting(f'http://localhost:{server.getsockname()[1]}/'):
            server.accept()[0].close()


def test_from_answers_to_silence_to_an_end_and_back() -> None:
    known: Dict[str, Optional[str]] = {}
    pulses = Pulses(known.get)
    pulses.watch(['/a', '/never'])
    watch, node = Watch(pulses), pulses.nodes['/a']
    first = Node()
    known['/a'] = first.uri
    watch.until(lambda: node._seen)
    with hanging_node() as uri:
        known['/a'] = node._uri = uri
        watch.until(lambda: node.problem == SILENT)
    watch.until(lambda: node.problem == ENDED)
    known['/a'] = first.uri
    watch.until(lambda: node.problem == '')
    first.end()
    watch.until(lambda: node.problem == ENDED)
    known['/a'] = None  # it has unregistered from the master
    watch.until(lambda: node._uri is None)
    assert node.problem == ENDED
    assert pulses.nodes['/never'].problem == ''


def test_one_that_hangs_does_not_hold_up_the_others() -> None:
    nodes = [Node() for _ in range(3)]
    with hanging_node() as uri:
        known = {f'/{number}': node.uri for number, node in enumerate(nodes)}
        known['/hangs'] = uri
        pulses = Pulses(known.get)
        pulses.watch(known)
        watch = Watch(pulses)
        watch.until(lambda: sum(node._seen for node in pulses.nodes.values()) == 3)
        nodes[0].end()
        watch.until(lambda: pulses.nodes['/0'].problem == ENDED)
        assert pulses.nodes['/hangs'].problem == ''  # it never answered: it may still be starting
    for node in nodes[1:]:
        node.end()


def test_the_master_is_rarely_asked_for_nodes_that_nobody_expects() -> None:
    asked: List[str] = []
    pulses = Pulses(asked.append)  # knows no node
    pulses.watch(['/cell_stand/robot_proc'])
    pulses.watch(['/arm/robot_proc'], are_expected=True)
    for step in range(200):
        pulses.step(0.05 * step, 0.0)
    counts = [asked.count(it) for it in ('/cell_stand/robot_proc', '/arm/robot_proc')]
    assert counts[0] == 5 and counts[1] > 20
