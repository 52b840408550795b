# SPDX-License-Identifier: BSD-3-Clause
"""Detection of nodes that hang or have ended, by asking all nodes for their process ids.

A hanging node is detected within half a second, or later on a busy computer and while it starts.
"""
from __future__ import annotations

import errno
import math
import selectors
import socket
import xmlrpc.client
from typing import Callable, Dict, Iterable, Mapping, Optional
from urllib.parse import urlsplit

import rosgraph

from process_visualizer.launching.ros_api import Master, addresses_of
from process_visualizer.ros_names import SCENE_WATCH

PERIOD_S = 0.3
ANSWER_WITHIN_S = 0.5
"""Time limit for an answer on an idle computer; on a busy one, all are late: see `AnswerLimit`."""
_FIRST_ANSWER_WITHIN_S = 5.0
"""Time for the start of a node that is expected but has not answered yet."""
_YOUNG_S = 5.0
"""Time after a node's first answer in which it may be late, because it and others are starting."""
_UNKNOWN_PERIOD_S = 2.0
"""Time between two questions to the master for a node that nobody expects and that it never knew:
most devices have not all nodes that a device may have, and each question takes the master's time.
"""
ENDED, SILENT = 'stopped', 'is not responding'
_MAX_ANSWER = 1 << 16
_UNREACHABLE = errno.EHOSTUNREACH, errno.ENETUNREACH, errno.ENETDOWN, errno.ETIMEDOUT
"""Errors of a connection while the link to another computer is down."""
_QUESTION = xmlrpc.client.dumps((f'/{SCENE_WATCH}',), 'getPid').encode()

Lookup = Callable[[str], Optional[str]]
"""Returns the URI of a node's slave API, or None for an unknown node; raises LookupUnanswered."""
Connect = Callable[[str], socket.socket]


class LookupUnanswered(Exception):
    """The master did not answer, so it is unknown whether a node is registered."""


class MasterLookup:
    """Asks the master for URIs of nodes, unless it ``is_silent``, which the owner resets."""

    def __init__(self, master: Master) -> None:
        """Initialize with the master to ask."""
        self._master, self.is_silent = master, False

    def __call__(self, node: str) -> Optional[str]:
        """See Lookup."""
        if self.is_silent:
            raise LookupUnanswered
        try:
            return self._master.lookupNode(node)
        except rosgraph.MasterException:
            return None
        except OSError:
            self.is_silent = True
            raise LookupUnanswered from None


def connecting(uri: str) -> socket.socket:
    """Return a socket that is being connected.

    Raises:
        OSError: a connection is impossible.
    """
    parts = urlsplit(uri)
    family, kind, protocol, _, address = addresses_of(parts.hostname, parts.port)[0]
    connection = socket.socket(family, kind, protocol)
    connection.setblocking(False)
    connection.connect_ex(address)
    return connection


class AnswerLimit:
    """Time limit for an answer [s], which is longer while other nodes answer slowly, too.

    The single slowest node does not count: it may have hung for a while and then answered.
    """

    MAX_S = 2.0
    _FACTOR, _REMEMBERED_S = 3.0, 10.0

    def __init__(self) -> None:
        """Start without knowing the speed of this computer."""
        self._slowest_s: Dict[str, float] = {}
        self._slowest_before_s: Dict[str, float] = {}
        self._since_s = -math.inf

    def learn(self, node: str, answer_s: float, now_s: float) -> None:
        """Learn from the duration of a node's answer."""
        if now_s - self._since_s > self._REMEMBERED_S:
            self._slowest_before_s, self._slowest_s = self._slowest_s, {}
            self._since_s = now_s
        self._slowest_s[node] = max(self._slowest_s.get(node, 0.0), answer_s)

    @property
    def answer_within_s(self) -> float:
        """Return the time limit for an answer [s]."""
        second_s = max(map(_second, (self._slowest_s, self._slowest_before_s)))
        return min(max(ANSWER_WITHIN_S, self._FACTOR * second_s), self.MAX_S)


def _second(slowest_s: Mapping[str, float]) -> float:
    return sorted((0.0, 0.0, *slowest_s.values()))[-2]


class NodePulse:
    """The state of one node: whether it answers."""

    def __init__(self, name: str, connect: Connect) -> None:
        """``name`` is the node's name; see `Pulses` for ``connect``."""
        self.name, self._connect = name, connect
        self.problem = ''  # ENDED, SILENT or nothing
        self.problem_since_s = math.inf  # when the question was asked that showed it
        self.is_expected = False  # has been up already, or is known to the master
        self._seen = self._is_sent = False
        self._late_from_s: Optional[float] = None  # when silence becomes a problem
        self._uri: Optional[str] = None
        self._silent_uri: Optional[str] = None  # address of a node that hangs
        self._received = b''
        self._connection: Optional[socket.socket] = None
        self._due_s = self._deadline_s = self._asked_s = 0.0
        self._is_late = self._has_news = self._is_overdue = self._is_new = False
        self._young_until_s = -math.inf

    @property
    def has_answered(self) -> bool:
        """Return whether the node has ever answered."""
        return self._seen

    def postpone(self, late_s: float) -> None:
        """Exclude from the node's silence a time in which this program could not listen."""
        self._deadline_s += late_s
        self._asked_s += late_s
        if self._late_from_s is not None:
            self._late_from_s += late_s

    def next_s(self) -> float:
        """Return the time of the next action for this node."""
        return self._deadline_s if self._connection else self._due_s

    def take_answer_s(self, now_s: float) -> Optional[float]:
        """Return the duration of a new answer, once."""
        has_news, self._has_news = self._has_news, False
        return now_s - self._asked_s if has_news else None

    def act(self, now_s: float, lookup: Lookup, selector: selectors.BaseSelector,
            answer_within_s: float = ANSWER_WITHIN_S) -> None:
        """Ask the node if it is due.

        A node that does not answer in time is silent; the question is abandoned only later, as a
        late answer shows that the computer is busy.
        """
        if now_s < self.next_s():
            return
        if self._late_from_s is None:
            self._late_from_s = now_s + _FIRST_ANSWER_WITHIN_S
        self._is_late = now_s >= self._late_from_s
        if self._is_new:
            self._is_new, self._young_until_s = False, now_s + _YOUNG_S
        if now_s < self._young_until_s:
            answer_within_s = AnswerLimit.MAX_S
        if self._connection is not None and not self._is_overdue:
            self._is_overdue, self._deadline_s = True, now_s + AnswerLimit.MAX_S - answer_within_s
            self._note(SILENT)
        elif self._connection is not None:
            self._end(selector, SILENT)
        else:
            self._deadline_s = now_s + answer_within_s
            self._ask(now_s, lookup, selector)

    def receive(self, selector: selectors.BaseSelector) -> None:
        """Send the question or read the answer, when the node's socket is ready."""
        assert self._connection is not None
        try:
            if self._received == b'' and not self._is_sent:
                self._send(selector)
                return
            part = self._connection.recv(65536)
        except OSError as error:
            self._take_refusal(error)
            self._end(selector, _problem_of(error))
            return
        self._received += part
        if not part or _is_complete(self._received) or len(self._received) > _MAX_ANSWER:
            self._end(selector, '' if self._received else ENDED)

    def _ask(self, now_s: float, lookup: Lookup, selector: selectors.BaseSelector) -> None:
        self._asked_s, self._due_s = now_s, now_s + PERIOD_S
        try:
            self._uri = self._uri or lookup(self.name)
        except LookupUnanswered:
            self._uri = self._silent_uri
            if self._uri is None:
                return  # the state is unchanged
        if self._uri is None:
            if not (self._seen or self.is_expected):
                self._due_s = now_s + _UNKNOWN_PERIOD_S
            self._note(ENDED)
            return
        self._received, self._is_sent, self._is_overdue = b'', False, False
        try:
            self._connection = self._connect(self._uri)
        except OSError as error:
            self._take_refusal(error)
            self._uri = None
            self._note(_problem_of(error))
            return
        selector.register(self._connection, selectors.EVENT_WRITE, self)

    def _take_refusal(self, error: OSError) -> None:
        """Note that a node was up: the master knows it, but its computer refuses the connection."""
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
            self._is_new = self._is_new or not self._seen or self.problem == ENDED
            self._seen = self._has_news = True
        self._note(problem)

    def _note(self, problem: str) -> None:
        """Note the problem, unless the node may not have started yet."""
        is_there = self._seen or (self.is_expected and self._is_late)
        problem = problem if is_there else ''
        if problem != self.problem:
            self.problem_since_s = self._asked_s if problem else math.inf
        self.problem = problem


class Pulses:
    """The watched nodes; call ``step`` in a separate thread."""

    def __init__(self, lookup: Lookup, connect: Connect = connecting) -> None:
        """Watch no node at first.

        Args:
            lookup: see Lookup.
            connect: returns a socket that is being connected to a URI, or raises OSError.
        """
        self._lookup, self._connect = lookup, connect
        self._selector = selectors.DefaultSelector()
        self._listened_s: Optional[float] = None
        self._limit = AnswerLimit()
        self.nodes: Dict[str, NodePulse] = {}

    def watch(self, names: Iterable[str], are_expected: bool = False) -> None:
        """Watch further nodes; if ``are_expected``, they are soon reported if they do not start."""
        for name in names:
            node = self.nodes.setdefault(name, NodePulse(name, self._connect))
            node.is_expected = node.is_expected or are_expected

    def step(self, now_s: float, longest_s: float) -> None:
        """Ask the nodes that are due, and wait for answers for a limited time.

        Args:
            now_s: the present time of a clock that does not jump.
            longest_s: the maximum time to wait.
        """
        self._receive(0.0)  # answers that arrived in the meantime
        late_s = 0.0 if self._listened_s is None else now_s - self._listened_s
        self._listened_s = now_s
        for node in self.nodes.values():
            answer_s = node.take_answer_s(now_s)
            if late_s > ANSWER_WITHIN_S:
                node.postpone(late_s)
            elif answer_s is not None:
                self._limit.learn(node.name, answer_s, now_s)
        for node in self.nodes.values():
            node.act(now_s, self._lookup, self._selector, self._limit.answer_within_s)
        next_s = min((node.next_s() for node in self.nodes.values()), default=now_s + longest_s)
        self._receive(min(max(next_s - now_s, 0.0), longest_s))

    def _receive(self, longest_s: float) -> None:
        for key, _ in self._selector.select(longest_s):
            key.data.receive(self._selector)


def _problem_of(error: OSError) -> str:
    """Return the problem of a node that cannot be asked.

    If its computer cannot be reached, it may well be running; Linux says so every few seconds.
    """
    return SILENT if error.errno in _UNREACHABLE else ENDED


def _is_complete(answer: bytes) -> bool:
    return b'</methodResponse>' in answer[-64:]
