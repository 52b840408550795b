# SPDX-License-Identifier: BSD-3-Clause
"""Decides how long a value holds before it is stale, by the usual intervals of its topic.

A driver that sends at a rate has stopped when it is silent for longer than usual. A driver that
sends only when a value changes may be silent for any time.
"""
from __future__ import annotations

import math
from bisect import bisect_right
from collections import deque
from typing import Deque, Optional, Sequence, Tuple

import numpy as np

STALE_AFTER_S = 0.7
"""Age [s] from which a value that is sent at a rate is stale, unless a parameter sets another one.
Including all other delays, stale data is then marked as such within a second."""
_MIN_INTERVALS = 3
_MAINLY = 0.8  # of the time
_EVEN, _SLACK = 1.5, 3.0  # ratios: longest to a short interval; silence to longest interval


def value_holds_for_s(intervals_s: Sequence[float], quick_s: float) -> float:
    """Return how long [s] a value holds; infinite if its topic has no known rate.

    Args:
        intervals_s: times between the messages of the topic.
        quick_s: a value that usually arrives within this time holds only for this time.
    """
    known_s = sorted(intervals_s)
    if len(known_s) < _MIN_INTERVALS:
        return math.inf
    if sum(it for it in known_s if it <= quick_s) >= _MAINLY * sum(known_s):
        return quick_s
    slow_s = [it for it in known_s if it > quick_s]  # between bursts, if there are any
    is_even = len(slow_s) >= _MIN_INTERVALS and slow_s[-1] <= _EVEN * slow_s[len(slow_s) // 4]
    return _SLACK * slow_s[-1] if is_even else math.inf


_MAX_SILENT = 0.3  # of the time
_KEPT_SILENCES = 100


class CommonSilences:
    """Silences common to all topics of a running cell, which say nothing about a single topic.

    In such a silence, the recorder or the computer had stopped. If a cell is silent for much of the
    time, silence is normal for all its topics.
    """

    def __init__(self, quick_s: float) -> None:
        """Initialize with the duration of the shortest silence [s]."""
        self._quick_s = quick_s
        self._first_s: Optional[float] = None
        self._last_s = self._silent_s = 0.0
        self._ends_s: Deque[float] = deque(maxlen=_KEPT_SILENCES)
        self._forgotten = 0

    def add(self, times_s: np.ndarray) -> None:
        """Add the arrival times (n,) [s] of messages of any topic, in any order, none twice."""
        times_s = np.sort(times_s)
        if not len(times_s):
            return
        if self._first_s is None:
            self._first_s = self._last_s = float(times_s[0])
        intervals_s = np.diff(times_s, prepend=self._last_s)
        self._last_s = max(self._last_s, float(times_s[-1]))
        silent = intervals_s > self._quick_s
        self._silent_s += float(intervals_s[silent].sum())
        for end_s in times_s[silent].tolist():
            self._forgotten += len(self._ends_s) == _KEPT_SILENCES
            self._ends_s.append(end_s)

    def before(self, time_s: float) -> int:
        """Return the number of silences before a time [s]; 0 if they are a habit."""
        if self._first_s is None or self._silent_s > _MAX_SILENT * (self._last_s - self._first_s):
            return 0
        return self._forgotten + bisect_right(self._ends_s, time_s)


class SendingHabit:
    """Learner of the habit of a topic from its messages as they arrive."""

    _WINDOW = 500  # intervals; a single delay of a fast topic is soon forgotten

    def __init__(self) -> None:
        """Begin without messages."""
        self._last: Optional[Tuple[float, int]] = None
        self._intervals_s: Deque[float] = deque(maxlen=self._WINDOW)

    def add(self, time_s: float, segment: int = 0) -> None:
        """Add the time [s] of a message, and the segment of playback without a jump that it is in.

        Messages that are sent again after a jump, or while the clock is stopped, say nothing
        about the habit of the topic.
        """
        if self._last is not None and self._last[1] == segment and time_s != self._last[0]:
            self._intervals_s.append(abs(time_s - self._last[0]))  # playback may run backwards
        self._last = time_s, segment

    def holds_for_s(self, quick_s: float) -> float:
        """Return how long [s] the last value holds; see `value_holds_for_s`."""
        return value_holds_for_s(tuple(self._intervals_s), quick_s)
