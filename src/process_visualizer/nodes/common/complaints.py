# SPDX-License-Identifier: BSD-3-Clause
"""Reports problems of a node: in the log, and on /diagnostics for as long as they last."""
from __future__ import annotations

import math
import threading
from typing import Dict, List, Mapping, Optional, Tuple

import rospy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue

from process_visualizer.nodes.common.complaint_book import Complaint, ComplaintBook
from process_visualizer.nodes.common.node_handle import NodeHandle

DIAGNOSTICS = '/diagnostics'
PERIOD_S = 0.5
LOG_PERIOD_S = 5.0
_Said = Tuple[str, Complaint]


class Complaints:
    """The complaints of this node about a device; any thread may call it.

    Each is logged when it begins, and repeatedly while it lasts; see `ComplaintBook` for when it
    ends. Nothing is published without a problem.
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
        """Complain of a message; complaints with the same key, such as a topic, count together.

        The ``values`` are for programs.
        """
        now_s = self._node.monotonic_s()
        with self._lock:
            self._book.add(key, text, now_s, is_error, values)
        self._log(key, text, now_s, is_error, LOG_PERIOD_S)

    def state(self, key: str, text: str, values: Optional[Mapping[str, str]] = None,
              log_period_s: float = LOG_PERIOD_S, is_error: bool = False) -> None:
        """Complain of something until `end`; values are for programs."""
        now_s = self._node.monotonic_s()
        with self._lock:
            self._book.state(key, text, now_s, values, is_error)
        self._log(key, text, now_s, is_error, log_period_s)

    def note_good(self, key: str) -> None:
        """Note a message without a problem."""
        with self._lock:
            self._book.note_good(key, self._node.monotonic_s())

    def end(self, key: str) -> None:
        """End all complaints about something."""
        with self._lock:
            self._book.end(key)

    def _log(self, key: str, text: str, now_s: float, is_error: bool, period_s: float) -> None:
        self._reporter.wake()
        if now_s >= self._next_log_s.get(key, 0.0):
            self._next_log_s[key] = now_s + period_s
            (self._node.error if is_error else self._node.warn)(f'{self._device}: {text}')

    def _report(self) -> Optional[float]:
        """Publish what there is to say; return when to look again [s], None without problems."""
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
        except rospy.ROSException:  # its topics are closed already
            if not self._node.is_shutdown():
                raise

    def _statuses(self, now_s: float) -> List[DiagnosticStatus]:
        """Return the present problems, and once those that have ended."""
        with self._lock:
            present = self._book.present(now_s)
            statuses = [self._status(key, it, now_s) for key, it in present.items()]
            ended = self._book.take_ended()
            statuses += [DiagnosticStatus(DiagnosticStatus.OK, self._name(key), 'all is well',
                                          self._device, []) for key in ended]
            for key in ended:
                self._next_log_s.pop(key, None)
        return statuses

    def _status(self, key: str, complaint: Complaint, now_s: float) -> DiagnosticStatus:
        level = DiagnosticStatus.ERROR if complaint.is_error else DiagnosticStatus.WARN
        values = {'messages': str(complaint.count), **complaint.values,
                  'for_s': f'{now_s - complaint.since_s:.1f}'}
        return DiagnosticStatus(level, self._name(key), complaint.text, self._device,
                                [KeyValue(*pair) for pair in values.items()])

    def _name(self, key: str) -> str:
        return f'{self._node.name}: {key}'
