# SPDX-License-Identifier: BSD-3-Clause
"""Asks the nodes that were launched whether they answer, and their master.

In the scene ``scene_watch`` does the same, and ``cell_frames`` asks that: this watch is neither a
node nor a child of roslaunch, so what stops all of those does not stop it.
"""
from __future__ import annotations

import math
import selectors
import socket
import threading
import time
import xmlrpc.client
from typing import (
    Callable,
    Collection,
    Dict,
    FrozenSet,
    Iterable,
    Mapping,
    NamedTuple,
    Optional,
    Set,
)
from urllib.parse import urlsplit

import rosgraph

from process_visualizer.launching.ros_api import CALLER_ID, AskedMaster, Master
from process_visualizer.ros_names import SCENE_WATCH

# Finds out within half a second whether nodes answer, by asking all for their process ids.

PERIOD_S = 0.3
ANSWER_WITHIN_S = 0.5
"""On a computer that is not busy. On a busy one, all nodes answer late: see `Patience`."""
STARTS_WITHIN_S = 5.0
"""Of a node that should be there, and has not answered yet."""
ENDED, SILENT = 'stopped', 'is not responding'
_MAX_ANSWER = 1 << 16
_QUESTION = xmlrpc.client.dumps((f'/{SCENE_WATCH}',), 'getPid').encode()

Lookup = Callable[[str], Optional[str]]
"""Returns the URI of a node's slave API, None for an unknown node; or raises LookupUnanswered."""
Connect = Callable[[str], socket.socket]


class LookupUnanswered(Exception):
    """The master did not say whether it knows a node: nothing is known of that."""


class MasterLookup:
    """Asks the master where nodes are; not again while it is silent, which its owner ends."""

    def __init__(self, master: Master) -> None:
        """``master`` is the one to ask."""
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
        OSError: it cannot be connected.
    """
    parts = urlsplit(uri)
    family, kind, protocol, _, address = socket.getaddrinfo(
        parts.hostname, parts.port, type=socket.SOCK_STREAM)[0]
    connection = socket.socket(family, kind, protocol)
    connection.setblocking(False)
    connection.connect_ex(address)
    return connection


class Patience:
    """How long to wait for an answer [s]: longer while other nodes answer slowly, too.

    The slowest node alone does not count: it may have hung, and its answer have come afterwards.
    """

    MOST_S = 2.0
    _FACTOR, _REMEMBERED_S = 3.0, 10.0

    def __init__(self) -> None:
        """Nothing is known of this computer yet."""
        self._slowest_s: Dict[str, float] = {}
        self._slowest_before_s: Dict[str, float] = {}
        self._since_s = -math.inf

    def learn(self, node: str, answer_s: float, now_s: float) -> None:
        """Take how long an answer of a node took."""
        if now_s - self._since_s > self._REMEMBERED_S:
            self._slowest_before_s, self._slowest_s = self._slowest_s, {}
            self._since_s = now_s
        self._slowest_s[node] = max(self._slowest_s.get(node, 0.0), answer_s)

    @property
    def answer_within_s(self) -> float:
        """Return how long a node may take."""
        second_s = max(map(_second, (self._slowest_s, self._slowest_before_s)))
        return min(max(ANSWER_WITHIN_S, self._FACTOR * second_s), self.MOST_S)


def _second(slowest_s: Mapping[str, float]) -> float:
    return sorted((0.0, 0.0, *slowest_s.values()))[-2]


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
        self._due_s = self._deadline_s = self._asked_s = 0.0
        self._is_late = self._has_news = self._is_overdue = False

    @property
    def has_answered(self) -> bool:
        """Return whether it has answered once."""
        return self._seen

    def postpone(self, late_s: float) -> None:
        """Do not count the time in which this program could not listen as silence of the node."""
        self._deadline_s += late_s
        if self._told_from_s is not None:
            self._told_from_s += late_s

    def next_s(self) -> float:
        """Return when something must be done for this node."""
        return self._deadline_s if self._connection else self._due_s

    def take_answer_s(self, now_s: float) -> Optional[float]:
        """Return how long a new answer took, once."""
        has_news, self._has_news = self._has_news, False
        return now_s - self._asked_s if has_news else None

    def act(self, now_s: float, lookup: Lookup, selector: selectors.BaseSelector,
            answer_within_s: float = ANSWER_WITHIN_S) -> None:
        """Ask the node if it is time.

        One that does not answer in time is silent; the question is given up later, as an answer
        that is late shows that the computer is busy.
        """
        if now_s < self.next_s():
            return
        if self._told_from_s is None:
            self._told_from_s = now_s + STARTS_WITHIN_S
        self._is_late = now_s >= self._told_from_s
        if self._connection is not None and not self._is_overdue:
            self._is_overdue, self._deadline_s = True, now_s + Patience.MOST_S - answer_within_s
            self._note(SILENT)
        elif self._connection is not None:
            self._end(selector, SILENT)
        else:
            self._deadline_s = now_s + answer_within_s
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
        if not part or _is_complete(self._received) or len(self._received) > _MAX_ANSWER:
            self._end(selector, '' if self._received else ENDED)

    def _ask(self, now_s: float, lookup: Lookup, selector: selectors.BaseSelector) -> None:
        self._asked_s, self._due_s = now_s, now_s + PERIOD_S
        try:
            self._uri = self._uri or lookup(self.name)
        except LookupUnanswered:
            self._uri = self._silent_uri
            if self._uri is None:
                return  # it is as it was
        if self._uri is None:
            self._note(ENDED)
            return
        self._received, self._is_sent, self._is_overdue = b'', False, False
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
            self._seen = self._has_news = True
        self._note(problem)

    def _note(self, problem: str) -> None:
        """Remember the problem; a node that has never answered may not have started yet."""
        is_there = self._seen or (self.is_expected and self._is_late)
        self.problem = problem if is_there else ''


class Pulses:
    """The nodes that are watched; run it in a separate thread."""

    def __init__(self, lookup: Lookup, connect: Connect = connecting) -> None:
        """Watch no node at first.

        Args:
            lookup: see Lookup.
            connect: returns a socket that is being connected to a URI, or raises OSError.
        """
        self._lookup, self._connect = lookup, connect
        self._selector = selectors.DefaultSelector()
        self._listened_s: Optional[float] = None
        self._patience = Patience()
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
        self._receive(0.0)  # what has come in the meantime
        late_s = 0.0 if self._listened_s is None else now_s - self._listened_s
        self._listened_s = now_s
        for node in self.nodes.values():
            answer_s = node.take_answer_s(now_s)
            if late_s > ANSWER_WITHIN_S:
                node.postpone(late_s)
            elif answer_s is not None:
                self._patience.learn(node.name, answer_s, now_s)
        for node in self.nodes.values():
            node.act(now_s, self._lookup, self._selector, self._patience.answer_within_s)
        next_s = min((node.next_s() for node in self.nodes.values()), default=now_s + longest_s)
        self._receive(min(max(next_s - now_s, 0.0), longest_s))

    def _receive(self, longest_s: float) -> None:
        for key, _ in self._selector.select(longest_s):
            key.data.receive(self._selector)


def _is_complete(answer: bytes) -> bool:
    return b'</methodResponse>' in answer[-64:]


_STEP_S = 0.2
_MASTER_PERIOD_S = 1.0
_REFUSES_S = 3.0
"""Of a node that has ended, roslaunch tells sooner; one that refuses for so long is still there."""
_MAX_FAILURES = 2
"""Most questions in a row without an answer; a busy master may miss one."""
MASTER_SILENT = ('is not responding; nodes go on, but if it does not come back, stop the cell and '
                 'start it again')
MASTER_OTHER = ('was restarted, and does not know the running nodes; stop the cell and start '
                'it again')


class CellLook(NamedTuple):
    """The nodes that do not answer, by their names, and what is wrong with the master, or ''."""

    silent: FrozenSet[str] = frozenset()
    master: str = ''


class CellWatch:
    """Asks in a thread of its own, from ``begin`` to ``close``; reports what has changed."""

    def __init__(self, running: Callable[[], Collection[str]],
                 on_change: Callable[[CellLook], None], master: Optional[Master] = None,
                 connect: Connect = connecting) -> None:
        """Ask nobody yet.

        Args:
            running: returns the names of the nodes that are up, and should answer.
            on_change: called in the thread.
            master: the one to ask; that of this process if None.
            connect: see `Pulses`.
        """
        self._running, self._on_change = running, on_change
        self._master: Master = master or AskedMaster(CALLER_ID)
        self._lookup = MasterLookup(self._master)
        self._pulses = Pulses(self._lookup, connect)
        self._look = CellLook()
        self._refused_from_s: Dict[str, float] = {}
        self._process_id: Optional[int] = None
        self._failures = 0
        self._is_other = False
        self._next_master_s = 0.0
        self._closed = threading.Event()
        self._thread = threading.Thread(target=self._run, name='watch nodes', daemon=True)

    def begin(self) -> None:
        """Start asking."""
        self._thread.start()

    def close(self) -> None:
        """Stop asking and reporting; a question under way may still be answered."""
        self._closed.set()

    def step(self, now_s: float, longest_s: float) -> None:
        """Ask who is to be asked now, wait for answers for a limited time [s], and tell.

        Args:
            now_s: the present time of a clock that does not jump.
            longest_s: how long to wait.
        """
        running = frozenset(self._running())
        if not running:
            self._process_id, self._failures, self._is_other = None, 0, False  # another cell's
            self._tell(CellLook())
            self._closed.wait(longest_s)
            return
        if now_s >= self._next_master_s:
            self._next_master_s = now_s + _MASTER_PERIOD_S
            self._ask_master()
        self._pulses.watch(running, are_expected=True)
        self._pulses.step(now_s, longest_s)
        silent = {name for name in running if self._pulses.nodes[name].problem == SILENT}
        self._tell(CellLook(frozenset(silent | self._refusing(running, now_s)),
                            self._master_problem()))

    def _refusing(self, running: Collection[str], now_s: float) -> Set[str]:
        """Return the nodes whose process runs, but which take no questions any more."""
        self._refused_from_s = {
            name: self._refused_from_s.get(name, now_s) for name in running
            if self._pulses.nodes[name].problem == ENDED and not self._is_other}
        return {name for name, from_s in self._refused_from_s.items()
                if now_s - from_s >= _REFUSES_S}

    def _run(self) -> None:
        while not self._closed.is_set():
            self.step(time.monotonic(), _STEP_S)

    def _tell(self, look: CellLook) -> None:
        if look != self._look and not self._closed.is_set():
            self._look = look
            self._on_change(look)

    def _ask_master(self) -> None:
        try:
            process_id = self._master.getPid()
        except (rosgraph.MasterException, OSError):
            self._lookup.is_silent = True  # it is asked again with the next look at it
            self._failures += 1
            return
        self._lookup.is_silent, self._failures = False, 0
        self._process_id = self._process_id or process_id
        self._is_other = process_id != self._process_id

    def _master_problem(self) -> str:
        if self._failures >= _MAX_FAILURES:
            return MASTER_SILENT
        return MASTER_OTHER if self._is_other else ''
