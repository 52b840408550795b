# SPDX-License-Identifier: BSD-3-Clause
"""Least-squares slopes over the windows of a whole series, as VelocityEstimator takes them."""
from __future__ import annotations

from typing import Iterator, NamedTuple, Tuple

import numpy as np

from process_visualizer.motion.velocity.velocity_estimator import GAP_S

_BLOCK = 4096  # windows: short enough for the precision of running sums


class SlopeWindows(NamedTuple):
    """Windows of a series, in the order of their times; one row per window.

    ``rows`` (k,) are the samples that were not set aside. A window holds those from ``first`` (m,)
    up to ``behind`` (m,), which count in ``rows``. It is of the ``segment`` (m,) of the series.
    ``middle_s`` (m,) is the mean of its times, ``slope`` (m, d) that of its values.
    """

    rows: np.ndarray
    first: np.ndarray
    behind: np.ndarray
    segment: np.ndarray
    middle_s: np.ndarray
    slope: np.ndarray


def segments(times_s: np.ndarray, gap_s: float = GAP_S) -> np.ndarray:
    """Return the number (n,) of the segment that each time is in: a greater gap ends one."""
    return np.concatenate(([0], np.cumsum(np.diff(times_s) > gap_s)))[:len(times_s)]


def slope_windows(times_s: np.ndarray, values: np.ndarray, window_s: float,
                  gap_s: float = GAP_S) -> SlopeWindows:
    """Return the windows that end with each sample, and where a segment ends, shorter ones.

    They are as long as those of VelocityEstimator, at least half of ``window_s``. A value that is
    repeated is set aside for up to half a window; no window goes over a gap of more than gap_s.

    Args:
        times_s: (n,), rising.
        values: (n, d).
        window_s, gap_s: [s].
    """
    rows = np.flatnonzero(_without_repetitions(times_s, values, 0.5 * window_s))
    segment = segments(times_s, gap_s)[rows]
    times_s, values = times_s[rows], values[rows]
    first, behind = _bounds(times_s, segment, window_s)
    parts = [_slopes(times_s, values, first[block], behind[block]) for block in _blocks(len(first))]
    middle_s, slope = (np.concatenate(column) for column in zip(*parts))
    return SlopeWindows(rows, first, behind, segment[first], middle_s, slope)


def _without_repetitions(times_s: np.ndarray, values: np.ndarray, hold_s: float) -> np.ndarray:
    """Return which samples (bool) are kept; see VelocityEstimator."""
    kept = np.ones(len(times_s), bool)
    repeated = np.flatnonzero((values[1:] == values[:-1]).all(axis=1)) + 1
    times = times_s[repeated].tolist()
    last_s, last_row = 0.0, -1
    for row, time_s in zip(repeated.tolist(), times):
        if row - 1 != last_row:  # a new run of repetitions, begun by the one before
            last_s = float(times_s[row - 1])
        if time_s - last_s < hold_s:
            kept[row] = False
        else:
            last_s = time_s
        last_row = row
    return kept


def _bounds(times_s: np.ndarray, segment: np.ndarray,
            window_s: float) -> Tuple[np.ndarray, np.ndarray]:
    """Return the first sample (m,) of each window that is long enough, and the one behind it."""
    first = np.searchsorted(times_s, times_s - window_s, side='right') - 1
    first = np.maximum(first, np.searchsorted(segment, segment, side='left'))
    behind = np.searchsorted(segment, segment, side='right')
    # Behind the windows that end with each sample, those that begin later than the last of them.
    begin_late = np.flatnonzero(np.arange(len(times_s)) > first[behind - 1])
    order = np.argsort(np.concatenate((np.arange(len(times_s)), behind[begin_late] - 1)),
                       kind='stable')
    first = np.concatenate((first, begin_late))[order]
    behind = np.concatenate((np.arange(len(times_s)) + 1, behind[begin_late]))[order]
    known = times_s[behind - 1] - times_s[first] >= 0.5 * window_s
    return first[known], behind[known]


def _blocks(count: int) -> Iterator[slice]:
    """Yield the rows of all windows in parts, at least one."""
    for start in range(0, max(count, 1), _BLOCK):
        yield slice(start, min(start + _BLOCK, count))


def _slopes(times_s: np.ndarray, values: np.ndarray, first: np.ndarray,
            behind: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
    """Return the mean times (m,) and slopes (m, d) of some windows."""
    if not len(first):
        return np.empty(0), np.empty((0, values.shape[1]))
    origin, end = int(first[0]), int(behind[-1])
    lever = times_s[origin:end] - times_s[origin]
    moved = values[origin:end] - values[origin]
    count = (behind - first).astype(float)
    sums = _window_sums(np.column_stack((lever, lever * lever, moved,
                                         lever[:, np.newaxis] * moved)),
                        first - origin, behind - origin)
    width = values.shape[1]
    inertia = sums[:, 1] - sums[:, 0] ** 2 / count
    leaning = sums[:, 2 + width:] - sums[:, 2:2 + width] * (sums[:, 0] / count)[:, np.newaxis]
    return times_s[origin] + sums[:, 0] / count, leaning / inertia[:, np.newaxis]


def _window_sums(columns: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    total = np.concatenate((np.zeros((1, columns.shape[1])), np.cumsum(columns, axis=0)))
    result: np.ndarray = total[high] - total[low]
    return result
