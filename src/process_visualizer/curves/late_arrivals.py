# SPDX-License-Identifier: BSD-3-Clause
"""Messages that were held up: they came together after a silence, so when they came says nothing.

That is so when the recorder itself hung, its computer stood still, or the network did.
"""
from __future__ import annotations

from typing import Dict

import numpy as np

_SILENCE_NS = 1_000_000_000
_SILENCE_PERIODS = 5.0
"""A silence is at least this long."""
_BUNCHED = 0.25
"""Of the usual interval: what comes faster after a silence was held up."""
_KEPT, _LEAST = 200, 10  # intervals, from which the usual one is known


class LateArrivals:
    """Finds them in the messages of one connection, which come part by part."""

    def __init__(self) -> None:
        self._last_ns = 0
        self._intervals = np.empty(0)
        self._is_bunch = False  # the messages of a bunch still come

    def find(self, times_ns: np.ndarray) -> np.ndarray:
        """Return which messages (n,) were held up, by the times (n,) [ns] at which they came."""
        if not len(times_ns):
            return np.zeros(0, bool)
        passed = np.diff(np.concatenate(([self._last_ns or times_ns[0]], times_ns))).astype(float)
        self._last_ns = int(times_ns[-1])
        silences = np.flatnonzero(passed >= _SILENCE_NS)
        return np.concatenate([self._find(it) for it in np.split(passed, silences)])

    def _find(self, passed: np.ndarray) -> np.ndarray:
        """Return the same of messages of which at most the first ends a silence.

        Args:
            passed: the intervals (n,) [ns] before them.
        """
        usual = float(np.median(self._intervals)) if len(self._intervals) >= _LEAST else 0.0
        is_end = int(len(passed) > 0 and passed[0] >= max(_SILENCE_NS, _SILENCE_PERIODS * usual))
        late: np.ndarray = np.zeros(len(passed), bool)
        if is_end or self._is_bunch:
            slow = np.flatnonzero(passed[is_end:] >= _BUNCHED * usual)
            count = is_end + (int(slow[0]) if len(slow) else len(passed) - is_end)
            late[:count] = count > is_end
            self._is_bunch = usual > 0.0 and not len(slow)
        is_usual = ~late & (passed > 0.0) & (passed < _SILENCE_NS)
        self._intervals = np.concatenate((self._intervals, passed[is_usual]))[-_KEPT:]
        return late


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
