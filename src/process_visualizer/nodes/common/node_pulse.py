# SPDX-License-Identifier: BSD-3-Clause
"""Finds out within half a second whether nodes answer, by asking all for their process ids."""
from __future__ import annotations

import selectors
import socket
import xmlrpc.client
from typing import Callable, Dict, Iterable, Optional
from urllib.parse import urlsplit

from process_visualizer.ros_names import SCENE_WATCH

PERIOD_S = 0.3
ANSWER_WITHIN_S = 0.5
ENDED, SILENT = 'has ended', 'does not answer'
_LONGEST_ANSWER = 1 << 16
_QUESTION = xmlrpc.client.dumps((f'/{SCENE_WATCH}',), 'getPid').encode()

Lookup = Callable[[str], Optional[str]]
Connect = Callable[[str], socket.socket]


def connecting(uri: str) -> socket.socket:
    """Return a socket that is being connected.

    Raises:
        OSError: it cannot be connected.
    """
    parts = urlsplit(uri)
    family, kind, protocol, _, address = socket.getaddrinfo(
        parts.hostname, parts.port, type=socket.SOCK_STREAM)[0]
    connection = socket.socket(family, kind, protocol)
    connection.setblocking(False)
    connection.connect_ex(address)
    return connection


class NodePulse:
    """One node, and whether it answered."""

    def __init__(self, name: str, connect: Connect) -> None:
        """``name`` is the node's name; see `Pulses` for ``connect``."""
        self.name, self._connect = name, connect
        self.problem = ''  # ENDED, SILENT or nothing
        self._seen = self._is_sent = False
        self._uri: Optional[str] = None
        self._received = b''
        self._connection: Optional[socket.socket] = None
        self._due_s = self._deadline_s = 0.0

    def next_s(self) -> float:
        """Return when something must be done for this node."""
        return self._deadline_s if self._connection else self._due_s

    def act(self, now_s: float, lookup: Lookup, selector: selectors.BaseSelector) -> None:
        """Ask the node if it is time; give up a question that was not answered in time."""
        if now_s < self.next_s():
            return
        if self._connection is not None:
            self._end(selector, SILENT)
        else:
            self._ask(now_s, lookup, selector)

    def receive(self, selector: selectors.BaseSelector) -> None:
        """Read the answer; the node's socket can be written or read."""
        assert self._connection is not None
        try:
            if self._received == b'' and not self._is_sent:
                self._send(selector)
                return
            part = self._connection.recv(65536)
        except OSError:
            self._end(selector, ENDED)
            return
        self._received += part
        if not part or _is_complete(self._received) or len(self._received) > _LONGEST_ANSWER:
            self._end(selector, '' if self._received else ENDED)

    def _ask(self, now_s: float, lookup: Lookup, selector: selectors.BaseSelector) -> None:
        self._due_s, self._deadline_s = now_s + PERIOD_S, now_s + ANSWER_WITHIN_S
        self._uri = self._uri or lookup(self.name)
        if self._uri is None:
            self._note(ENDED)
            return
        self._received, self._is_sent = b'', False
        try:
            self._connection = self._connect(self._uri)
        except OSError:
            self._uri = None
            self._note(ENDED)
            return
        selector.register(self._connection, selectors.EVENT_WRITE, self)

    def _send(self, selector: selectors.BaseSelector) -> None:
        assert self._connection is not None
        self._is_sent = True
        self._connection.sendall(
            b'POST /RPC2 HTTP/1.0\r\nHost: node\r\nContent-Type: text/xml\r\n'
            b'Content-Length: %d\r\n\r\n%b' % (len(_QUESTION), _QUESTION))
        selector.modify(self._connection, selectors.EVENT_READ, self)

    def _end(self, selector: selectors.BaseSelector, problem: str) -> None:
        assert self._connection is not None
        selector.unregister(self._connection)
        self._connection.close()
        self._connection = None
        if problem:
            self._uri = None  # a restarted node has another address
        else:
            self._seen = True
        self._note(problem)

    def _note(self, problem: str) -> None:
        """Remember the problem; a node that has never answered has not started yet."""
        self.problem = problem if self._seen else ''


class Pulses:
    """All nodes that are watched; run it in a separate thread."""

    def __init__(self, lookup: Lookup, connect: Connect = connecting) -> None:
        """Watch no node at first.

        Args:
            lookup: returns the URI of a node's slave API, None for an unknown node.
            connect: returns a socket that is being connected to a URI, or raises OSError.
        """
        self._lookup, self._connect = lookup, connect
        self._selector = selectors.DefaultSelector()
        self.nodes: Dict[str, NodePulse] = {}

    def watch(self, names: Iterable[str]) -> None:
        """Watch further nodes."""
        for name in names:
            self.nodes.setdefault(name, NodePulse(name, self._connect))

    def step(self, now_s: float, longest_s: float) -> None:
        """Ask the nodes that are due, and wait for answers for a limited time.

        Args:
            now_s: the present time of a clock that does not jump.
            longest_s: how long to wait.
        """
        for node in self.nodes.values():
            node.act(now_s, self._lookup, self._selector)
        next_s = min((node.next_s() for node in self.nodes.values()), default=now_s + longest_s)
        for key, _ in self._selector.select(min(max(next_s - now_s, 0.0), longest_s)):
            key.data.receive(self._selector)


def _is_complete(answer: bytes) -> bool:
    return b'</methodResponse>' in answer[-64:]
