# SPDX-License-Identifier: BSD-3-Clause
"""Reports problems of a node in the log, and on /diagnostics while they last."""
from __future__ import annotations

import math
import threading
from dataclasses import dataclass, field
from typing import Dict, List, Mapping, NamedTuple, Optional

import rospy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue

from process_visualizer.health.node_warnings import OVER
from process_visualizer.nodes.common.node_handle import NodeHandle
from process_visualizer.robot.limit_alarms import Limits, LimitWatch
from process_visualizer.ros_names import (
    CONCERNED_KEY,
    EXCESS_KEY,
    LIMIT_KEY,
    SILENT_NODE_KEY,
    TIMES_KEY,
)

# Present problems of a node.

HOLD_S = 3.0
"""Time for which a complaint outlasts the last bad message [s], so that it does not flicker."""


@dataclass
class Complaint:
    """A problem; its times are those of a monotonic clock [s]."""

    text: str
    since_s: float
    last_s: float
    is_error: bool = False
    count: int = 0  # bad messages; 0 if the problem is not about messages
    values: Mapping[str, str] = field(default_factory=dict)  # for programs
    good_s: Optional[float] = None  # arrival of the last good message since a bad one


class ComplaintBook:
    """The complaints by key; the key names the subject, such as a topic or a frame.

    A complaint about messages ends when good messages arrive and no bad one has arrived for
    ``HOLD_S``. If no message arrives at all, the complaint remains.
    """

    def __init__(self) -> None:
        """Begin without complaints."""
        self._complaints: Dict[str, Complaint] = {}
        self._ended: Dict[str, Complaint] = {}
        self._dropped: Dict[str, Complaint] = {}

    def add(self, key: str, text: str, now_s: float, is_error: bool = False,
            values: Optional[Mapping[str, str]] = None) -> None:
        """Note a bad message."""
        complaint = self._write(key, text, now_s, is_error)
        complaint.count, complaint.values = complaint.count + 1, values or {}

    def state(self, key: str, text: str, now_s: float,
              values: Optional[Mapping[str, str]] = None, is_error: bool = False,
              since_s: Optional[float] = None) -> None:
        """Set a complaint that lasts until `end`; ``since_s`` is when its cause began, if known."""
        complaint = self._write(key, text, now_s, is_error)
        complaint.values = values or {}
        if since_s is not None:
            complaint.since_s = min(complaint.since_s, since_s)

    def note_good(self, key: str, now_s: float) -> None:
        """Note a good message."""
        complaint = self._complaints.get(key)
        if complaint is not None:
            complaint.good_s = now_s

    def end(self, key: str, now_s: Optional[float] = None) -> bool:
        """End a complaint, now or with its last bad message; return whether there was one."""
        complaint = self._complaints.pop(key, None) or self._dropped.pop(key, None)
        if complaint is None:
            return False
        complaint.last_s = complaint.last_s if now_s is None else now_s
        self._ended[key] = complaint
        return True

    def drop(self, key: str) -> None:
        """Stop reporting a complaint, as it is unknown whether it is over; `end` still ends it."""
        complaint = self._complaints.pop(key, None)
        if complaint is not None:
            self._dropped[key] = complaint

    def present(self, now_s: float) -> Dict[str, Complaint]:
        """Return the present complaints."""
        for key in [key for key, it in self._complaints.items()
                    if it.good_s is not None and now_s - it.last_s > HOLD_S]:
            self.end(key)
        return self._complaints

    def take_ended(self) -> Dict[str, Complaint]:
        """Return the complaints that have ended since the last call."""
        ended, self._ended = self._ended, {}
        return {key: it for key, it in ended.items() if key not in self._complaints}

    def _write(self, key: str, text: str, now_s: float, is_error: bool = False) -> Complaint:
        self._dropped.pop(key, None)
        complaint = self._complaints.setdefault(key, Complaint(text, now_s, now_s))
        complaint.text, complaint.last_s = text, now_s
        complaint.is_error, complaint.good_s = is_error, None
        return complaint


DIAGNOSTICS = '/diagnostics'
PERIOD_S = 0.5
LOG_PERIOD_S = 5.0


class Complaints:
    """The complaints of this node about a device; may be called from any thread.

    Each complaint is logged when it begins, repeatedly while it lasts, and when it is over; see
    `ComplaintBook` for its end. Without a problem nothing is published.
    """

    def __init__(self, node: NodeHandle, device: str) -> None:
        """``device`` is the name of the device."""
        self._node, self._device = node, device
        self._lock = threading.Lock()
        self._book = ComplaintBook()
        self._next_log_s: Dict[str, float] = {}
        self._next_report_s = -math.inf
        self._publisher = node.publisher(DIAGNOSTICS, DiagnosticArray)
        self._reporter = node.worker(self._report, 'complaints')

    def add(self, key: str, text: str, is_error: bool = False,
            values: Optional[Mapping[str, str]] = None) -> None:
        """Complain about a message; those with the same key, such as a topic, are counted together.

        The ``values`` are for programs.
        """
        now_s = self._node.monotonic_s()
        with self._lock:
            self._book.add(key, text, now_s, is_error, values)
        self._log(key, text, now_s, is_error, LOG_PERIOD_S)

    def state(self, key: str, text: str, values: Optional[Mapping[str, str]] = None,
              log_period_s: float = LOG_PERIOD_S, is_error: bool = False,
              since_s: Optional[float] = None) -> None:
        """Complain until `end`; ``values`` are for programs.

        ``since_s`` is when the cause began, on the node's monotonic clock; by default, it is now.
        """
        now_s = self._node.monotonic_s()
        with self._lock:
            self._book.state(key, text, now_s, values, is_error, since_s)
        self._log(key, text, now_s, is_error, log_period_s)

    def note_good(self, key: str) -> None:
        """Note a message without a problem."""
        with self._lock:
            self._book.note_good(key, self._node.monotonic_s())

    def end(self, key: str) -> None:
        """End the complaint with a key."""
        with self._lock:
            was_there = self._book.end(key, self._node.monotonic_s())
        if was_there:
            self._reporter.wake()

    def drop(self, key: str) -> None:
        """Stop reporting a complaint, as it is unknown whether its cause is over."""
        with self._lock:
            self._book.drop(key)

    def _log(self, key: str, text: str, now_s: float, is_error: bool, period_s: float) -> None:
        self._reporter.wake()
        if now_s >= self._next_log_s.get(key, 0.0):
            self._next_log_s[key] = now_s + period_s
            (self._node.error if is_error else self._node.warn)(f'{self._device}: {text}')

    def _report(self) -> Optional[float]:
        """Publish the complaints; return the time until the next report [s], None without any."""
        now_s = self._node.monotonic_s()
        if now_s < self._next_report_s:
            return self._next_report_s - now_s
        self._next_report_s = now_s + PERIOD_S
        statuses = self._statuses(now_s)
        if not statuses:
            return None
        message = DiagnosticArray(status=statuses)
        message.header.stamp = self._node.now()
        self._publish(message)
        return PERIOD_S

    def _publish(self, message: DiagnosticArray) -> None:
        try:
            self._publisher.publish(message)
        except rospy.ROSException:  # the publisher has been closed already
            if not self._node.is_shutdown():
                raise

    def _statuses(self, now_s: float) -> List[DiagnosticStatus]:
        """Return the present problems and, once each, those that have ended."""
        with self._lock:
            present = self._book.present(now_s)
            statuses = [self._status(key, it, now_s) for key, it in present.items()]
            ended = self._book.take_ended()
        statuses += [DiagnosticStatus(DiagnosticStatus.OK, self._name(key), 'all is well',
                                      self._device, []) for key in ended]
        for key, it in ended.items():
            if self._next_log_s.pop(key, None) is not None:
                self._node.info(f'{self._device}: {it.text}{OVER}{it.last_s - it.since_s:.1f} s')
        return statuses

    def _status(self, key: str, complaint: Complaint, now_s: float) -> DiagnosticStatus:
        level = DiagnosticStatus.ERROR if complaint.is_error else DiagnosticStatus.WARN
        values = {'messages': str(complaint.count), **complaint.values,
                  'for_s': f'{now_s - complaint.since_s:.1f}'}
        return DiagnosticStatus(level, self._name(key), complaint.text, self._device,
                                [KeyValue(*pair) for pair in values.items()])

    def _name(self, key: str) -> str:
        return f'{self._node.name}: {key}'


class LimitState:
    """Judges one variable of a device; see LimitWatch for when an alarm begins and ends."""

    def __init__(self, complaints: Complaints, key: str, label: str, limits: Limits,
                 unit: str) -> None:
        """``key`` identifies the variable within its device."""
        self._complaints, self._limits = complaints, limits
        self._key, self._label, self._unit = f'limits of {key}', label, unit
        self._watch = LimitWatch(limits)
        self._times, self._is_present = 0, False

    def take(self, time_s: float, value: float) -> None:
        """Judge the present value; ``time_s`` is a time of a monotonic clock."""
        if not self._limits.exist:
            return
        self._watch.add(time_s, value)
        present = self._watch.present
        self._times += present is not None and not self._is_present
        self._is_present = present is not None
        if present is None:
            self._complaints.end(self._key)
            return
        text = self._limits.sentence(self._label, present.extreme, self._unit)
        values = {LIMIT_KEY: self._limits.reach(present.extreme, self._unit),
                  EXCESS_KEY: repr(self._limits.excess_of(present.extreme)),
                  TIMES_KEY: str(self._times)}
        self._complaints.state(self._key, text, values, log_period_s=math.inf, is_error=True)

    def lose(self) -> None:
        """Stop judging, as values no longer arrive: whether they are beyond a limit is unknown."""
        if self._watch.present is not None:
            self._complaints.drop(self._key)
        self._watch = LimitWatch(self._limits)

    def forget(self) -> None:
        """End the alarm, because values of another time follow."""
        if self._watch.present is not None:
            self._complaints.end(self._key)
        self._watch = LimitWatch(self._limits)


# Reports nodes that do not answer on /diagnostics, for programs that display them.

_LOG_PERIOD_S = 20.0


class SilentNode(NamedTuple):
    """The device of a silent node ('': the program itself), and the effect of its silence.

    ``since_s`` is when the node was asked first without answering, on the monotonic clock.
    """

    device: str
    meaning: str
    since_s: float


class SilentNodes:
    """Reports which nodes do not answer."""

    def __init__(self, node: NodeHandle) -> None:
        """``node`` is the node that watches the others."""
        self._complaints = Complaints(node, node.name.strip('/'))
        self._reported: Mapping[str, SilentNode] = {}

    def tell(self, silent: Mapping[str, SilentNode]) -> None:
        """Report these nodes, by name, as silent, and all others as no longer silent."""
        for name in set(self._reported) - set(silent):
            self._complaints.end(name)
        for name, it in silent.items():
            values: Dict[str, str] = {SILENT_NODE_KEY: name, CONCERNED_KEY: it.device}
            short = name.rpartition('/')[2]
            self._complaints.state(name, f'{short} is not responding: {it.meaning}', values,
                                   _LOG_PERIOD_S, since_s=it.since_s)
        self._reported = dict(silent)


class Patience:
    """Decides whether something has been missing without interruption for a given time."""

    def __init__(self, period_s: float) -> None:
        """``period_s`` is the longest time [s] for which it may be missing."""
        self._period_s = period_s
        self._since_s = math.inf

    def is_over(self, is_missing: bool, now_s: float) -> bool:
        """Note whether it is missing at a time [s]; return whether to report it."""
        self._since_s = min(self._since_s, now_s) if is_missing else math.inf
        return now_s >= self._since_s + self._period_s
