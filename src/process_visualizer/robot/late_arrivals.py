# SPDX-License-Identifier: BSD-3-Clause
"""Messages that arrived late in a bunch, so that their arrival times are meaningless.

This happens when the recorder, its computer or the network hung. Without stamps the time of such a
message is unknown, and a velocity computed with it would be wrong.
"""
from __future__ import annotations

from typing import Dict, List, NamedTuple, Optional, Tuple

import numpy as np

SILENCE_S = 1.0
"""Minimum duration of a silence [s]."""
UNSURE_S, _MAX_UNSURE_S, _UNSURE_SHARE = 0.1, 0.5, 0.1
"""Time after a silence or a bunch [s] in which messages may still be delayed ones: a share of the
silence, within limits. On a busy computer, the reader of many delayed messages pauses, too."""
_SILENCE_NS = int(1e9 * SILENCE_S)
_SILENCE_PERIODS = 5.0
_MAX_PERIOD_NS = 200_000_000
"""Maximum period of a checked topic; slower ones are often sent on change, after any silence."""
_BUNCHED = 0.5
"""Messages after a silence that take less than this share of the usual time were held up."""
_WINDOW, _MIN_MESSAGES = 8, 2  # messages before a message by which it is judged
_CATCHES_UP_NS = 2_000_000_000
"""Maximum time after a silence in which messages that were held up arrive."""
_KEPT, _MIN_INTERVALS = 200, 10  # intervals by which the usual one is determined


class LateArrivals:
    """Finds the messages of one connection that were held up; the messages are given in parts."""

    def __init__(self, period_s: float = 0.0, since_ns: int = 0) -> None:
        """Set what is known about the messages before the first part.

        Args:
            period_s: their usual period; 0 to learn it.
            since_ns: the time since which none has arrived; 0 if unknown.
        """
        self._period_ns = 1e9 * period_s
        self._last_ns = since_ns
        self._begun_ns = -np.inf  # start of the current uninterrupted stretch
        self._intervals = np.empty(0)
        self._silence_end_ns: Optional[int] = None
        self._unsure_ns = 0
        self._wait_ns = 0  # from a bunch to messages that are certain
        self._since = np.empty(0, np.int64)  # when the last messages after a silence arrived

    def find(self, times_ns: np.ndarray) -> np.ndarray:
        """Return a mask of messages (n,) that were held up, from their arrivals (n,) [ns]."""
        if not len(times_ns):
            return np.zeros(0, bool)
        if not self._last_ns:
            self._last_ns = self._begun_ns = int(times_ns[0])
        passed = np.diff(np.concatenate(([self._last_ns], times_ns)))
        self._last_ns = int(times_ns[-1])
        silences = np.flatnonzero(passed >= _SILENCE_NS)
        return np.concatenate([self._find(*it) for it in zip(np.split(times_ns, silences),
                                                             np.split(passed, silences))])

    def _find(self, times_ns: np.ndarray, passed: np.ndarray) -> np.ndarray:
        """Return the mask for messages of which at most the first ends a silence."""
        if not len(times_ns):
            return np.zeros(0, bool)
        usual = self._usual_ns()
        if passed[0] >= max(_SILENCE_NS, _SILENCE_PERIODS * usual):
            begin_ns = int(times_ns[0])
            lasted_ns = begin_ns - passed[0] - self._begun_ns  # shorter if it comes in bursts
            if 0.0 < usual <= _MAX_PERIOD_NS and lasted_ns >= _SILENCE_NS:
                self._silence_end_ns, self._since = begin_ns, np.empty(0, np.int64)
                self._wait_ns = int(1e9 * min(max(UNSURE_S, 1e-9 * _UNSURE_SHARE * passed[0]),
                                              _MAX_UNSURE_S))
                self._unsure_ns = begin_ns + self._wait_ns
            self._begun_ns = begin_ns
        if self._silence_end_ns is not None:
            self._follow_bunch(times_ns, self._silence_end_ns, usual)
        late = times_ns < self._unsure_ns
        is_usual = ~late & (passed > 0) & (passed < _SILENCE_NS)
        self._intervals = np.concatenate((self._intervals, passed[is_usual]))[-_KEPT:]
        return late

    def _usual_ns(self) -> float:
        if len(self._intervals) < _MIN_INTERVALS:
            return self._period_ns
        return float(np.median(self._intervals))

    def _follow_bunch(self, times_ns: np.ndarray, silence_end_ns: int, usual: float) -> None:
        """Extend the unsure time while messages arrive too fast.

        Later bunches do not count: these messages were delayed for a moment, not by the silence.
        """
        since = np.concatenate((self._since, times_ns))
        rows = np.arange(len(since))
        first = np.maximum(rows - _WINDOW, 0)
        count = rows - first
        fast = (since - since[first] < _BUNCHED * usual * count) & (count >= _MIN_MESSAGES) & (
            since - silence_end_ns <= _CATCHES_UP_NS)
        for time_ns in since[fast].tolist():
            if time_ns < self._unsure_ns:
                self._unsure_ns = time_ns + self._wait_ns
        if since[-1] >= self._unsure_ns:
            self._silence_end_ns = None
        self._since = since[-_WINDOW - 1:]


class LateConnections:
    """Finds the messages of several connections that were held up."""

    def __init__(self) -> None:
        self._of: Dict[int, LateArrivals] = {}

    def find(self, numbers: np.ndarray, times_ns: np.ndarray) -> np.ndarray:
        """Return a mask of messages (n,), from the numbers of their connections (n,)."""
        late: np.ndarray = np.zeros(len(numbers), bool)
        for number in np.unique(numbers).tolist():
            rows = np.flatnonzero(numbers == number)
            late[rows] = self._of.setdefault(number, LateArrivals()).find(times_ns[rows])
        return late


# Shorter delays. The messages of a driver that sends evenly can be dated if none of them was lost:
# each was measured a period before the next one. If some were lost, it is unknown where.

_MAX_EVEN_PERIOD_S = 0.05
_UNEVEN, _EVEN_MESSAGES = 0.5, 20
_DELAY_PERIODS, _DELAY_S = 3.0, 0.02
_AT_ONCE = 0.3
"""Interval, as a share of the period, below which messages arrived together."""
_BUNCHES = 0.5
"""Minimum number of intervals between messages that arrived together, for each delay."""
_SPREAD = 0.2
"""Spread of intervals, as a share of the usual one, from which on a driver is irregular."""
_MAX_DELAY_S = 0.3
"""Delay [s] above which the driver itself may have hung."""
_LOST_PERIODS, _LOST_S = 2.5, 0.02


class Undated(NamedTuple):
    """Messages whose time of measurement is unknown: a mask (n,).

    Messages from row ``open_from`` on arrive irregularly; later messages may show more.
    """

    rows: np.ndarray
    open_from: int


def is_even(intervals_s: np.ndarray, period_s: float) -> bool:
    """Return whether messages with these intervals (n,) [s] are sent with a period, by a timer."""
    return (len(intervals_s) >= _EVEN_MESSAGES and 0.0 < period_s <= _MAX_EVEN_PERIOD_S and bool(
        np.median(np.abs(intervals_s - period_s)) <= _UNEVEN * period_s))


def undated(arrival_s: np.ndarray, measured_s: np.ndarray, period_s: float) -> Undated:
    """Return the messages between which others were lost while they arrived irregularly.

    Args:
        arrival_s: the times of arrival (n,), ascending.
        measured_s: the latest possible times of measurement (n,), ascending.
        period_s: of the driver; its intervals satisfy `is_even`.
    """
    count = len(arrival_s)
    delay_s = max(_DELAY_PERIODS * period_s, _DELAY_S)
    delayed = np.flatnonzero(np.diff(arrival_s) > delay_s) + 1
    ahead = arrival_s[_WINDOW:] - arrival_s[:-_WINDOW]  # n - 8, or none
    calm = np.flatnonzero(ahead >= _BUNCHED * _WINDOW * period_s) + _WINDOW
    ends = np.append(calm, count)[np.searchsorted(calm, delayed + _WINDOW)]
    rows = np.zeros(count, bool)
    stretches = _joined(delayed.tolist(), ends.tolist())
    for begin, end in stretches:
        last = min(end, count - 1)
        lost_s = measured_s[last] - measured_s[begin - 1] - (last - begin + 1) * period_s
        steps_s = np.diff(arrival_s[begin - 1:end])
        longest_s = float(steps_s.max(initial=0.0))
        long = np.flatnonzero(steps_s > delay_s)
        if np.count_nonzero(steps_s < _AT_ONCE * period_s) < _BUNCHES * len(long) \
                and _are_alike(steps_s[:long[-1] + 1]):
            continue  # the driver sends less often here: nothing arrived late
        rows[begin:end] = longest_s > _MAX_DELAY_S or lost_s > max(
            _LOST_PERIODS * period_s, _LOST_S)
    is_open = bool(stretches) and stretches[-1][1] == count
    return Undated(rows, stretches[-1][0] if is_open else count)


def _are_alike(steps_s: np.ndarray) -> bool:
    """Return whether most of some intervals (n,) are alike, whatever the others are."""
    usual_s = float(np.median(steps_s))
    return bool(np.median(np.abs(steps_s - usual_s)) <= _SPREAD * usual_s)


def _joined(begins: List[int], ends: List[int]) -> List[Tuple[int, int]]:
    """Return spans in their order, those that touch as one."""
    found: List[Tuple[int, int]] = []
    for begin, end in zip(begins, ends):
        if found and begin <= found[-1][1]:
            begin = found.pop()[0]
        found.append((begin, end))
    return found
