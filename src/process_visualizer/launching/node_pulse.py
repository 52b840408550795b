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
STARTS_WITHIN_S = 5.0
"""Of a node that should be there, and has not answered yet."""
ENDED, SILENT = 'stopped', 'is not responding'
_LONGEST_ANSWER = 1 << 16
_QUESTION = xmlrpc.client.dumps((f'/{SCENE_WATCH}',), 'getPid').encode()

Lookup = Callable[[str], Optional[str]]
"""Returns the URI of a node's slave API, None for an unknown node; or raises LookupUnanswered."""
Connect = Callable[[str], socket.socket]


class LookupUnanswered(Exception):
    """The master did not say whether it knows a node: nothing is known of that."""


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
        self.is_expected = False  # it was there already, or the master knows it
        self._seen = self._is_sent = False
        self._told_from_s: Optional[float] = None  # if it has not answered until then
        self._uri: Optional[str] = None
        self._silent_uri: Optional[str] = None  # of one that hangs
        self._received = b''
        self._connection: Optional[socket.socket] = None
        self._due_s = self._deadline_s = 0.0
        self._is_late = False

    @property
    def has_answered(self) -> bool:
        """Return whether it has answered once."""
        return self._seen

    def postpone(self, late_s: float) -> None:
        """Count the time in which nobody could listen for no silence of the node."""
        self._deadline_s += late_s
        if self._told_from_s is not None:
            self._told_from_s += late_s

    def next_s(self) -> float:
        """Return when something must be done for this node."""
        return self._deadline_s if self._connection else self._due_s

    def act(self, now_s: float, lookup: Lookup, selector: selectors.BaseSelector) -> None:
        """Ask the node if it is time; give up a question that was not answered in time."""
        if now_s < self.next_s():
            return
        if self._told_from_s is None:
            self._told_from_s = now_s + STARTS_WITHIN_S
        self._is_late = now_s >= self._told_from_s
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
        except OSError as error:
            self._take_refusal(error)
            self._end(selector, ENDED)
            return
        self._received += part
        if not part or _is_complete(self._received) or len(self._received) > _LONGEST_ANSWER:
            self._end(selector, '' if self._received else ENDED)

    def _ask(self, now_s: float, lookup: Lookup, selector: selectors.BaseSelector) -> None:
        self._due_s, self._deadline_s = now_s + PERIOD_S, now_s + ANSWER_WITHIN_S
        try:
            self._uri = self._uri or lookup(self.name)
        except LookupUnanswered:
            self._uri = self._silent_uri
            if self._uri is None:
                return  # it is as it was
        if self._uri is None:
            self._note(ENDED)
            return
        self._received, self._is_sent = b'', False
        try:
            self._connection = self._connect(self._uri)
        except OSError as error:
            self._take_refusal(error)
            self._uri = None
            self._note(ENDED)
            return
        selector.register(self._connection, selectors.EVENT_WRITE, self)

    def _take_refusal(self, error: OSError) -> None:
        """A node that the master knows, and whose computer says that nobody listens, was there."""
        self.is_expected = self.is_expected or isinstance(error, ConnectionError)

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
        self._silent_uri = self._uri if problem == SILENT else None
        if problem:
            self._uri = None  # a restarted node has another address
        else:
            self._seen = True
        self._note(problem)

    def _note(self, problem: str) -> None:
        """Remember the problem; a node that has never answered may not have started yet."""
        is_there = self._seen or (self.is_expected and self._is_late)
        self.problem = problem if is_there else ''


class Pulses:
    """All nodes that are watched; run it in a separate thread."""

    def __init__(self, lookup: Lookup, connect: Connect = connecting) -> None:
        """Watch no node at first.

        Args:
            lookup: see Lookup.
            connect: returns a socket that is being connected to a URI, or raises OSError.
        """
        self._lookup, self._connect = lookup, connect
        self._selector = selectors.DefaultSelector()
        self._listened_s: Optional[float] = None
        self.nodes: Dict[str, NodePulse] = {}

    def watch(self, names: Iterable[str], are_expected: bool = False) -> None:
        """Watch further nodes; those that ``are_expected`` are missed soon if they do not start."""
        for name in names:
            node = self.nodes.setdefault(name, NodePulse(name, self._connect))
            node.is_expected = node.is_expected or are_expected

    def step(self, now_s: float, longest_s: float) -> None:
        """Ask the nodes that are due, and wait for answers for a limited time.

        Args:
            now_s: the present time of a clock that does not jump.
            longest_s: how long to wait.
        """
        self._receive(0.0)  # what has come while nobody listened
        late_s = 0.0 if self._listened_s is None else now_s - self._listened_s
        self._listened_s = now_s
        for node in self.nodes.values():
            if late_s > ANSWER_WITHIN_S:
                node.postpone(late_s)
            node.act(now_s, self._lookup, self._selector)
        next_s = min((node.next_s() for node in self.nodes.values()), default=now_s + longest_s)
        self._receive(min(max(next_s - now_s, 0.0), longest_s))

    def _receive(self, longest_s: float) -> None:
        for key, _ in self._selector.select(longest_s):
            key.data.receive(self._selector)


def _is_complete(answer: bytes) -> bool:
    return b'</methodResponse>' in answer[-64:]
