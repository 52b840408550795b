# SPDX-License-Identifier: BSD-3-Clause
"""Present warnings of a cell's nodes, from logs and /diagnostics, and how long each one lasts."""
from __future__ import annotations

import math
import re
import threading
from collections import deque
from dataclasses import dataclass, field, replace
from enum import IntEnum
from typing import Collection, Deque, Dict, FrozenSet, Mapping, Set, Tuple

LOG_S = 20.0
"""Time for which a log line is valid unless it is repeated: most lines are throttled."""
STATE_S = 5.0
"""Time for which a state on /diagnostics is valid; states are repeated at least every second."""
_MAX_TEXTS = 20
_HARMLESS = 'terminated before handshake header received. 0 bytes'
"""Log line of rospy when a subscriber leaves while connecting: a program that starts or ends."""
OUT_OF_ORDER = 'arrived out of order (will print only once)'
"""Log line of message_filters, once in the life of a node, when stamps go back. A driver must not
send such stamps, but a recording does when it is played backward or from an earlier moment."""
OVER = ': over after '
"""Part of the log line (level INFO) in which a node reports that a problem is over."""
_NUMBER = re.compile(r'-?\d+(\.\d+)?(e[+-]?\d+)?')
_About = Tuple[str, str, str]  # node, 'log' or 'state', and the subject


class Severity(IntEnum):
    """Severity of a warning."""

    WARNING = 1
    ERROR = 2


@dataclass(frozen=True)
class NodeWarning:
    """A present warning or error of a node; times come from time.monotonic() [s].

    ``count`` is the number of log lines, or of messages if the node counts them (0: unknown).
    ``values`` are for programs. ``about`` is the name of the node's state; it stays the same while
    the text changes, which may count seconds. It is empty for log lines.
    """

    node: str
    severity: Severity
    text: str
    count: int
    since_s: float
    last_s: float
    values: Mapping[str, str] = field(default_factory=dict)
    about: str = ''


class NodeWarnings:
    """Collects warnings of nodes; methods may be called in any thread.

    A node is identified by its connection, not by the content of a message: a log line from a
    recording is not a warning.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._found: Dict[_About, NodeWarning] = {}
        self._stated: Dict[str, Deque[str]] = {}  # by node: texts that are also in its log
        self._lapsed: Dict[_About, NodeWarning] = {}

    def take_log(self, node: str, severity: Severity, text: str, now_s: float) -> None:
        """Add a line of a node's log; lines that differ only in numbers count as one warning."""
        if _HARMLESS in text:
            return
        about = node, 'log', _NUMBER.sub('#', text)
        with self._lock:
            if any(text.endswith(stated) for stated in self._stated.get(node, ())):
                return
            before = self._found.get(about)
            if before is None or now_s - before.last_s > LOG_S:
                self._make_room(node)
                before = NodeWarning(node, severity, text, 0, now_s, now_s)
            self._found[about] = replace(before, text=text, count=before.count + 1, last_s=now_s)

    def take_state(self, node: str, name: str, severity: 'Severity | None', text: str,
                   now_s: float, values: Mapping[str, str]) -> None:
        """Set a state, by name, as a node reports it; severity None means no problem."""
        about = node, 'state', name
        with self._lock:
            self._lapsed.pop(about, None)
            if severity is None:
                self._found.pop(about, None)
                return
            before = self._found.get(about)
            since_s = now_s - _number(values, 'for_s') if 'for_s' in values or before is None \
                else before.since_s
            self._found[about] = NodeWarning(node, severity, text, int(_number(values, 'messages')),
                                             since_s, now_s, values, name)
            self._remember(node, text)

    def present(self, now_s: float) -> Tuple[NodeWarning, ...]:
        """Return the present warnings, the worst first, then the oldest."""
        with self._lock:
            old = {about: it for about, it in self._found.items()
                   if now_s - it.last_s > (LOG_S if about[1] == 'log' else STATE_S)}
            self._lapsed.update((about, it) for about, it in old.items() if about[1] == 'state')
            self._found = {about: it for about, it in self._found.items() if about not in old}
            return tuple(sorted(self._found.values(), key=lambda it: (-it.severity, it.since_s)))

    def lapsed(self) -> FrozenSet[Tuple[str, str]]:
        """Return node and text of states that are no longer repeated, nor reported as over."""
        with self._lock:
            return frozenset((it.node, it.text) for it in self._lapsed.values())

    def lapse(self, nodes: Collection[str]) -> None:
        """Note that nodes have ended: their states lapse until they are reported again."""
        with self._lock:
            ended = {about: it for about, it in self._found.items()
                     if about[1] == 'state' and it.node in nodes}
            self._lapsed.update(ended)
            self._found = {about: it for about, it in self._found.items() if about not in ended}

    def forget(self) -> None:
        """Forget everything, before other nodes run."""
        with self._lock:
            self._found, self._stated, self._lapsed = {}, {}, {}

    def _remember(self, node: str, text: str) -> None:
        """Remember a state's text and drop it from the log, because a node also logs its states."""
        stated = self._stated.setdefault(node, deque(maxlen=_MAX_TEXTS))
        if text not in stated:
            stated.append(text)
        for about in [about for about, it in self._found.items()
                      if about[:2] == (node, 'log') and it.text.endswith(text)]:
            del self._found[about]

    def _make_room(self, node: str) -> None:
        """Drop the oldest log warning of a node with too many, such as one with changing texts."""
        own = [about for about in self._found if about[:2] == (node, 'log')]
        if len(own) >= _MAX_TEXTS:
            del self._found[min(own, key=lambda about: self._found[about].last_s)]


def by_node(warnings: Collection[NodeWarning], nodes: Set[str]) -> Tuple[NodeWarning, ...]:
    """Return the warnings of some nodes."""
    return tuple(it for it in warnings if it.node in nodes)


def counted(warnings: Collection[NodeWarning]) -> str:
    """Return the number of warnings, such as ``1 error, 2 warnings``; empty for none."""
    words = []
    for severity in (Severity.ERROR, Severity.WARNING):
        count = sum(it.severity is severity for it in warnings)
        if count:
            words.append(f'{count} {severity.name.lower()}{"s" if count > 1 else ""}')
    return ', '.join(words)


def _number(values: Mapping[str, str], name: str) -> float:
    try:
        number = float(values.get(name, '0'))
    except ValueError:  # from another program
        return 0.0
    return number if math.isfinite(number) else 0.0
