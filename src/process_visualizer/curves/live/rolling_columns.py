# SPDX-License-Identifier: BSD-3-Clause
"""The extremes of a number over the last minutes, in columns of equal time."""
from __future__ import annotations

from typing import Tuple

import numpy as np

COLUMN_S = 0.02
"""The duration of a column: a pixel, if half a minute is shown on a screen."""


class RollingColumns:
    """Least and greatest value of each column; times before the oldest column are forgotten."""

    def __init__(self, duration_s: float) -> None:
        """Keep at least so much, at most twice as much."""
        self._count = int(round(duration_s / COLUMN_S))
        self._begin = 0  # the number of the first column since time 0
        self._low = np.full(2 * self._count, np.nan)
        self._high = self._low.copy()

    def add(self, times_s: np.ndarray, values: np.ndarray) -> None:
        """Take finite values (n,) at times (n,) [s], of any order."""
        if not len(times_s):
            return
        columns = np.floor(times_s / COLUMN_S).astype(np.int64)
        self._make_room(int(columns.max()))
        rows = columns - self._begin
        is_kept = rows >= 0
        np.fmin.at(self._low, rows[is_kept], values[is_kept])
        np.fmax.at(self._high, rows[is_kept], values[is_kept])

    def window(self, end: int, count: int, joined: int) -> Tuple[np.ndarray, np.ndarray]:
        """Return the extremes (count,) of columns that are ``joined`` of ours each.

        The last one ends before our column with the number ``end``, counted from time 0.
        """
        rows = np.arange(end - count * joined, end) - self._begin
        is_kept = (rows >= 0) & (rows < len(self._low))
        low, high = np.full(len(rows), np.nan), np.full(len(rows), np.nan)
        low[is_kept], high[is_kept] = self._low[rows[is_kept]], self._high[rows[is_kept]]
        if joined == 1:
            return low, high
        return (np.fmin.reduce(low.reshape(count, joined), axis=1),
                np.fmax.reduce(high.reshape(count, joined), axis=1))

    def _make_room(self, column: int) -> None:
        """Move on so far that there is a place for a column."""
        over = column - self._begin - len(self._low) + 1
        if over <= 0:
            return
        step = max(over, self._count)
        for values in (self._low, self._high):
            kept = values[step:].copy()
            values[:] = np.nan
            values[:len(kept)] = kept
        self._begin += step
