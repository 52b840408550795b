# SPDX-License-Identifier: BSD-3-Clause
"""Messages that were held up: they came together after a silence, so when they came says nothing.

That is so when the recorder itself hung, its computer stood still, or the network did.
"""
from __future__ import annotations

from typing import Dict, Optional

import numpy as np

_SILENCE_NS = 1_000_000_000
_SILENCE_PERIODS = 5.0
"""A silence is at least this long."""
_BUNCHED = 0.5
"""Of the usual time: messages that take less time after a silence were held up."""
_WINDOW, _FEWEST = 8, 2  # messages before one by which it is judged
_CATCHES_UP_NS = 2_000_000_000
"""After a silence, messages that were held up come within this time."""
_KEPT, _LEAST = 200, 10  # intervals, from which the usual one is known


class LateArrivals:
    """Finds them in the messages of one connection, which come part by part.

    The few that come just after those that were held up count as such.
    """

    def __init__(self) -> None:
        self._last_ns = 0
        self._intervals = np.empty(0)
        self._silence_end_ns: Optional[int] = None
        self._since = np.empty(0, np.int64)  # when the last messages after a silence came

    def find(self, times_ns: np.ndarray) -> np.ndarray:
        """Return which messages (n,) were held up, by the times (n,) [ns] at which they came."""
        if not len(times_ns):
            return np.zeros(0, bool)
        passed = np.diff(np.concatenate(([self._last_ns or times_ns[0]], times_ns)))
        self._last_ns = int(times_ns[-1])
        silences = np.flatnonzero(passed >= _SILENCE_NS)
        return np.concatenate([self._find(*it) for it in zip(np.split(times_ns, silences),
                                                             np.split(passed, silences))])

    def _find(self, times_ns: np.ndarray, passed: np.ndarray) -> np.ndarray:
        """Return the same of messages of which at most the first ends a silence."""
        late: np.ndarray = np.zeros(len(times_ns), bool)
        usual = float(np.median(self._intervals)) if len(self._intervals) >= _LEAST else 0.0
        if len(passed) and passed[0] >= max(_SILENCE_NS, _SILENCE_PERIODS * usual):
            self._silence_end_ns, self._since = int(times_ns[0]), np.empty(0, np.int64)
        if self._silence_end_ns is not None:
            late = self._bunched(times_ns, self._silence_end_ns, usual)
        is_usual = ~late & (passed > 0) & (passed < _SILENCE_NS)
        self._intervals = np.concatenate((self._intervals, passed[is_usual]))[-_KEPT:]
        return late

    def _bunched(self, times_ns: np.ndarray, silence_end_ns: int, usual: float) -> np.ndarray:
        """Return which messages (n,) are not behind the last one that came too fast."""
        since = np.concatenate((self._since, times_ns))
        rows = np.arange(len(since))
        first = np.maximum(rows - _WINDOW, 0)
        count = rows - first
        fast = np.flatnonzero((since - since[first] < _BUNCHED * usual * count)
                              & (count >= _FEWEST) & (since - silence_end_ns <= _CATCHES_UP_NS))
        late: np.ndarray = rows <= (fast[-1] if len(fast) else -1)
        if len(since) and since[-1] - silence_end_ns > _CATCHES_UP_NS:
            self._silence_end_ns = None
        known, self._since = len(self._since), since[-_WINDOW - 1:]
        return late[known:]


class LateConnections:
    """Finds them in messages of several connections."""

    def __init__(self) -> None:
        self._of: Dict[int, LateArrivals] = {}

    def find(self, numbers: np.ndarray, times_ns: np.ndarray) -> np.ndarray:
        """Return which messages (n,) were held up, by the numbers of their connections (n,)."""
        late: np.ndarray = np.zeros(len(numbers), bool)
        for number in np.unique(numbers).tolist():
            rows = np.flatnonzero(numbers == number)
            late[rows] = self._of.setdefault(number, LateArrivals()).find(times_ns[rows])
        return late
