# SPDX-License-Identifier: BSD-3-Clause
"""Congestion window of a connection: how much may be under way to a viewer."""
from __future__ import annotations

import math
from collections import deque
from typing import Deque, Tuple

_MIN_BYTES, _MAX_WINDOW_BYTES = 24 << 10, 2 << 20
"""Limits of the window. The maximum bounds the old data when a fast link becomes slow: 1.7 s of
10 Mbit/s."""
_BEGIN_BYTES, _BEGIN_S = 64 << 10, 0.1
_LARGE_S, _MIN_LARGE_BYTES = 0.15, 16 << 10
_QUEUED_S = 0.06
"""Maximum delay of an answer beyond the quickest one, caused by queues along the route."""
_SHRINK, _MIN_SHRINK = 0.8, 0.1
_OVERDUE = 2.0
"""Factor by which an answer exceeds its maximum time when a link has become slow."""
_RESERVE = 2.0
_QUICKEST_S = 20.0
"""Time for which the quickest answer counts: the route may change."""
_RATE_S = 0.5
_PROBE, _PROVED_S = 8.0, 20.0
"""Factor by which large messages may exceed the highest rate that the link has carried lately, and
time for which that rate counts [s]: small messages alone do not show what a link can carry."""


class LinkWindow:
    """Adapts a window to the viewer's acknowledgments; times [s] come from a clock without jumps.

    TCP alone fills every buffer along the route, which delays data by seconds on a slow link. So
    the data in flight are limited to what the link carries during an answer: the window grows while
    answers are as quick as possible, and shrinks when they become slower. When a link becomes slow,
    answers are overdue at first, and nothing large is sent meanwhile.
    """

    def __init__(self, least_bytes: int = _MIN_BYTES, begin_bytes: int = _BEGIN_BYTES,
                 queued_s: float = _QUEUED_S, longest_s: float = math.inf) -> None:
        """Begin without knowledge of the link.

        Args:
            least_bytes, begin_bytes: minimum and initial size of the window.
            queued_s: maximum delay of an answer beyond the quickest one.
            longest_s: maximum time of an answer, however quick others were.
        """
        self._least_bytes, self._window = least_bytes, float(begin_bytes)
        self._queued_s, self._longest_s = queued_s, longest_s
        self._sent = self._acknowledged = 0
        self._marks: Deque[Tuple[int, float]] = deque()  # bytes sent up to a time
        self._quickest: Deque[Tuple[float, float]] = deque()  # ascending: time, answer [s]
        self._shrunk_s = self._rate_begin_s = float('-inf')
        self._rate_bytes = 0
        self._bytes_s = 0.0
        self._proved: Deque[Tuple[float, float]] = deque()  # falling: time, rate [bytes/s]
        self.answer_s = 0.0

    @property
    def under_way(self) -> int:
        """The number of unacknowledged bytes."""
        return self._sent - self._acknowledged

    @property
    def bytes_s(self) -> float:
        """Return the rate at which the viewer receives data [bytes/s]; 0 while unknown."""
        return self._bytes_s

    @property
    def carries_bytes_s(self) -> float:
        """Return the capacity of the link [bytes/s]; a cautious guess while it is unknown."""
        return self._window / (self.answer_s or _BEGIN_S)

    def large_bytes(self, count: int) -> float:
        """Return the size [bytes] up to which each of ``count`` large messages arrives soon."""
        proved_bytes_s = self._proved[0][1] if self._proved else 0.0
        carries_bytes_s = min(self.carries_bytes_s, _PROBE * proved_bytes_s)
        return max(_MIN_LARGE_BYTES, _LARGE_S * carries_bytes_s / max(1, count))

    def may_send(self) -> bool:
        """Return whether small data may be sent now, which need not wait for large data."""
        return self.under_way < _RESERVE * self._window

    def may_send_large(self, now_s: float) -> bool:
        """Return whether data of any size may be sent now."""
        is_overdue = (self.under_way > self._least_bytes
                      and now_s - self._marks[0][1] > _OVERDUE * self._patience_s)
        return self.under_way < self._window and not is_overdue

    @property
    def _patience_s(self) -> float:
        """The maximum time of an answer [s]."""
        quickest_s = self._quickest[0][1] if self._quickest else math.inf
        return min(quickest_s + self._queued_s, self._longest_s)

    def sent(self, count: int, now_s: float) -> None:
        """Note the number of bytes that were sent."""
        self._sent += count
        self._marks.append((self._sent, now_s))

    def acknowledged(self, total: int, now_s: float) -> None:
        """Note the total number of bytes that the viewer has received."""
        if not self._acknowledged < total <= self._sent:
            return
        was_full = self.under_way > 0.5 * self._window
        new, self._acknowledged = total - self._acknowledged, total
        begun_s = now_s
        while self._marks and self._marks[0][0] <= total:
            begun_s = self._marks.popleft()[1]
        self._count(new, now_s)
        if begun_s < now_s:
            self._adapt(now_s - begun_s, new, was_full, now_s)

    def _adapt(self, answer_s: float, new: int, was_full: bool, now_s: float) -> None:
        self.answer_s = answer_s
        while self._quickest and self._quickest[-1][1] >= answer_s:
            self._quickest.pop()
        self._quickest.append((now_s, answer_s))
        while self._quickest[0][0] < now_s - _QUICKEST_S:
            self._quickest.popleft()
        if answer_s > self._patience_s:
            if now_s - self._shrunk_s > answer_s:  # once for all data in flight
                is_far_too_slow = answer_s > _OVERDUE * self._patience_s
                shrink = _SHRINK
                if is_far_too_slow:
                    shrink = max(self._patience_s / answer_s, _MIN_SHRINK)
                self._window = max(self._least_bytes, self._window * shrink)
                self._shrunk_s = now_s
        elif was_full:
            self._window = min(_MAX_WINDOW_BYTES, self._window + 0.5 * new)

    def _count(self, new: int, now_s: float) -> None:
        self._rate_bytes += new
        passed_s = now_s - self._rate_begin_s
        if passed_s > _RATE_S:
            self._bytes_s = self._rate_bytes / passed_s
            self._rate_begin_s, self._rate_bytes = now_s, 0
            while self._proved and self._proved[-1][1] <= self._bytes_s:
                self._proved.pop()
            self._proved.append((now_s, self._bytes_s))
            while self._proved[0][0] < now_s - _PROVED_S:
                self._proved.popleft()
