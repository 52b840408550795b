"""The speed of a tool over a whole recording, as the robot processor would show it."""
from __future__ import annotations

from typing import Iterator, Tuple

import numpy as np

WINDOW_S = 0.2
GAP_S = 1.0
_BLOCK = 4096  # samples: short enough for the precision of running sums
_MOST_BUNCHED = 50  # messages
_SHORTEST = 0.99  # of the period, as in ToolVelocity
_SPAN = 20  # messages: the intervals over so many are even, although some came late
_USABLE_STAMP_S = 1.0


def speeds(times_s: np.ndarray, positions: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
    """Return times [s] (m,) and speeds [m/s] (m,), those of VelocityEstimator: the least-squares
    slope of the positions of a window of WINDOW_S, at the mean of its times.

    A position that is repeated is set aside for up to half a window; no window goes over a gap of
    more than GAP_S.

    Args:
        times_s: (n,), rising.
        positions: (n, 3) [m].
    """
    segment = np.concatenate(([0], np.cumsum(np.diff(times_s) > GAP_S)))[:len(times_s)]
    kept = _without_repetitions(times_s, positions)
    times_s, positions, segment = times_s[kept], positions[kept], segment[kept]
    first = _window_begins(times_s, segment)
    parts = [_slopes(times_s, positions, first, *block) for block in _blocks(segment)]
    if not parts:
        return np.empty(0), np.empty(0)
    middle_s, speed = (np.concatenate(column) for column in zip(*parts))
    return middle_s, speed


def measuring_times(arrival_s: np.ndarray, stamp_s: np.ndarray) -> np.ndarray:
    """Return when poses were measured [s] (n,), rising.

    That is their stamp, where it can be used. Of a driver without stamps, each was measured at
    least a period before the one that follows it: see ToolVelocity.

    Args:
        arrival_s: when they were recorded (n,), rising.
        stamp_s: their stamps (n,) on the same clock, NaN where there are none.
    """
    usable = np.abs(stamp_s - arrival_s) <= _USABLE_STAMP_S  # not for NaN
    usable[1:] &= ~(stamp_s[1:] <= stamp_s[:-1])
    measured = stamp_s if usable.any() else _unbunched(arrival_s)
    return np.maximum.accumulate(np.where(usable, measured, arrival_s)
                                 if usable.any() else measured)


def _unbunched(arrival_s: np.ndarray) -> np.ndarray:
    count = len(arrival_s)
    if count <= _SPAN:
        return arrival_s
    period_s = float(np.median(arrival_s[_SPAN:] - arrival_s[:-_SPAN])) / _SPAN
    ideal_s = np.arange(count) * (_SHORTEST * period_s)
    late_s = arrival_s - ideal_s
    least_s = late_s.copy()
    for follower in range(1, min(_MOST_BUNCHED, count - 1) + 1):
        np.minimum(least_s[:-follower], late_s[follower:], out=least_s[:-follower])
    return least_s + ideal_s


def _without_repetitions(times_s: np.ndarray, positions: np.ndarray) -> np.ndarray:
    """Return which samples (bool) are kept; see VelocityEstimator."""
    kept = np.ones(len(times_s), bool)
    repeated = np.flatnonzero((positions[1:] == positions[:-1]).all(axis=1)) + 1
    times = times_s[repeated].tolist()
    last_s, last_row = 0.0, -1
    for row, time_s in zip(repeated.tolist(), times):
        if row - 1 != last_row:  # a new run of repetitions, begun by the one before
            last_s = float(times_s[row - 1])
        if time_s - last_s < 0.5 * WINDOW_S:
            kept[row] = False
        else:
            last_s = time_s
        last_row = row
    return kept


def _window_begins(times_s: np.ndarray, segment: np.ndarray) -> np.ndarray:
    """Return the first sample of the window that ends with each one."""
    first = np.searchsorted(times_s, times_s - WINDOW_S, side='right') - 1
    return np.maximum(first, np.searchsorted(segment, segment, side='left'))


def _blocks(segment: np.ndarray) -> Iterator[Tuple[int, int]]:
    """Yield the rows (first, behind the last) of parts of segments of more than one sample."""
    bounds = np.concatenate(([0], np.flatnonzero(np.diff(segment)) + 1, [len(segment)]))
    long = np.flatnonzero(np.diff(bounds) > 1)
    for begin, end in zip(bounds[long].tolist(), bounds[long + 1].tolist()):
        for start in range(begin, end, _BLOCK):
            yield start, min(start + _BLOCK, end)


def _slopes(times_s: np.ndarray, positions: np.ndarray, first: np.ndarray, begin: int,
            end: int) -> Tuple[np.ndarray, np.ndarray]:
    """Return the windows' mean times and speeds for the samples of a block."""
    origin = int(first[begin])
    lever = times_s[origin:end] - times_s[origin]
    moved = positions[origin:end] - positions[origin]
    low, high = first[begin:end] - origin, np.arange(begin, end) + 1 - origin
    count = (high - low).astype(float)
    sums = _window_sums(np.column_stack((lever, lever * lever, moved,
                                         lever[:, np.newaxis] * moved)), low, high)
    inertia = sums[:, 1] - sums[:, 0] ** 2 / count
    leaning = sums[:, 5:8] - sums[:, 2:5] * (sums[:, 0] / count)[:, np.newaxis]
    known = lever[high - 1] - lever[low] >= 0.5 * WINDOW_S
    slopes = leaning[known] / inertia[known, np.newaxis]
    middle_s = times_s[origin] + sums[known, 0] / count[known]
    return middle_s, np.sqrt((slopes * slopes).sum(axis=1))


def _window_sums(columns: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    total = np.concatenate((np.zeros((1, columns.shape[1])), np.cumsum(columns, axis=0)))
    result: np.ndarray = total[high] - total[low]
    return result
