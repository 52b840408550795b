# SPDX-License-Identifier: BSD-3-Clause
"""The speed of a tool over a whole recording, as the robot processor would show it."""
from __future__ import annotations

from typing import Optional, Tuple

import numpy as np

from process_visualizer.motion.velocity.slope_windows import slope_windows

WINDOW_S = 0.2
_MOST_BUNCHED = 50  # messages
_SHORTEST = 0.99  # of the period, as in ToolVelocity
_SPAN = 20  # messages: the intervals over so many are even, although some came late
_USABLE_STAMP_S = 1.0


def speeds(times_s: np.ndarray, positions: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
    """Return times [s] (m,) and speeds [m/s] (m,), those of RecordedVelocity.

    A speed is the least-squares slope of the positions of a window of WINDOW_S, at the mean of its
    times.

    Args:
        times_s: (n,), rising.
        positions: (n, 3) [m].
    """
    windows = slope_windows(times_s, positions, WINDOW_S)
    return windows.middle_s, np.sqrt((windows.slope * windows.slope).sum(axis=1))


def sending_period_s(arrival_s: np.ndarray) -> float:
    """Return the period [s] of a driver by the arrivals (n,) of its messages; 0 for too few."""
    if len(arrival_s) <= _SPAN:
        return 0.0
    return float(np.median(arrival_s[_SPAN:] - arrival_s[:-_SPAN])) / _SPAN


def measuring_times(arrival_s: np.ndarray, stamp_s: np.ndarray,
                    period_s: Optional[float] = None) -> np.ndarray:
    """Return when poses were measured [s] (n,), rising.

    That is their stamp, where it can be used. Of a driver without stamps, each was measured at
    least a period before the one that follows it: see ToolVelocity.

    Args:
        arrival_s: when they were recorded (n,), rising.
        stamp_s: their stamps (n,) on the same clock, NaN where there are none.
        period_s: of a whole recording, if these are a part of it.
    """
    usable = np.abs(stamp_s - arrival_s) <= _USABLE_STAMP_S  # not for NaN
    usable[1:] &= ~(stamp_s[1:] <= stamp_s[:-1])
    measured = stamp_s if usable.any() else _unbunched(arrival_s, period_s)
    return np.maximum.accumulate(np.where(usable, measured, arrival_s)
                                 if usable.any() else measured)


def _unbunched(arrival_s: np.ndarray, period_s: Optional[float]) -> np.ndarray:
    count = len(arrival_s)
    if period_s is None:
        period_s = sending_period_s(arrival_s)
    ideal_s = np.arange(count) * (_SHORTEST * period_s)
    late_s = arrival_s - ideal_s
    least_s = late_s.copy()
    for follower in range(1, min(_MOST_BUNCHED, count - 1) + 1):
        np.minimum(least_s[:-follower], late_s[follower:], out=least_s[:-follower])
    return least_s + ideal_s
