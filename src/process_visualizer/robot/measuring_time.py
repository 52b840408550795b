# SPDX-License-Identifier: BSD-3-Clause
"""The time at which a message was measured: its stamp if that is plausible, else its arrival.

Live, a topic's messages arrive one by one (MeasuringTime). In a recording all messages are known,
so those without stamps can be dated by the messages that follow (measuring_times).
"""
from __future__ import annotations

import math
from typing import Optional

import numpy as np

from process_visualizer.robot.late_arrivals import LateArrivals, is_even, undated
from process_visualizer.robot.velocity import GAP_S, MIN_PERIOD_SHARE

USABLE_WITHIN_S = 1.0  # of the arrival; other stamps are from another computer's clock


class MeasuringTime:
    """Chooses between the stamps and the arrival times of one topic."""

    def __init__(self) -> None:
        self._last_stamp_s = -math.inf
        self._did_not_advance = False

    @property
    def stamp_did_not_advance(self) -> bool:
        """Return whether the last stamp did not increase, as stamps must."""
        return self._did_not_advance

    def wall_s(self, stamp_s: float, arrival_s: float) -> float:
        """Return the wall time [s] of a message; a stamp of 0 means no stamp."""
        if not stamp_s or abs(arrival_s - stamp_s) > USABLE_WITHIN_S:
            self._did_not_advance = False
            return arrival_s
        self._did_not_advance = stamp_s <= self._last_stamp_s
        self._last_stamp_s = stamp_s
        return arrival_s if self._did_not_advance else stamp_s


_MAX_BUNCHED = 50  # messages
_SPAN = 20  # messages: intervals over a span are even, although some came late


def sending_period_s(arrival_s: np.ndarray) -> float:
    """Return the period [s] of a driver from the arrivals (n,) of messages; 0 for too few."""
    if len(arrival_s) <= _SPAN:
        return 0.0
    return float(np.median(arrival_s[_SPAN:] - arrival_s[:-_SPAN])) / _SPAN


def measuring_times(arrival_s: np.ndarray, stamp_s: np.ndarray,
                    period_s: Optional[float] = None) -> np.ndarray:
    """Return the measuring times of poses [s] (n,), ascending.

    These are the usable stamps. Without stamps from the driver, each pose was measured at least a
    period before the next one: see ToolVelocity.

    Args:
        arrival_s: the times of recording (n,), ascending.
        stamp_s: the stamps (n,) on the same clock; NaN without a stamp.
        period_s: the period of the whole recording if the poses are only a part of it.
    """
    usable = np.abs(stamp_s - arrival_s) <= USABLE_WITHIN_S  # False for NaN
    usable |= _held_up(arrival_s, stamp_s, usable)
    usable[1:] &= ~(stamp_s[1:] <= stamp_s[:-1])
    measured = stamp_s if usable.any() else _unbunched(arrival_s, period_s)
    return np.maximum.accumulate(np.where(usable, measured, arrival_s)
                                 if usable.any() else measured)


def certain_rows(arrival_s: np.ndarray, stamp_s: np.ndarray, period_s: Optional[float] = None,
                 since_s: float = 0.0) -> np.ndarray:
    """Return a mask (n,) of poses whose measuring times are known; see ``measuring_times``.

    Without stamps, the times of poses that were held up are unknown: see LateArrivals and
    ``undated``. The arguments include all poses from ``since_s`` on.
    """
    if np.isfinite(stamp_s).any():
        return np.ones(len(arrival_s), bool)
    if period_s is None:
        period_s = sending_period_s(arrival_s)
    late = LateArrivals(period_s, round(1e9 * max(since_s, 0.0)))
    result: np.ndarray = ~late.find(np.rint(1e9 * arrival_s).astype(np.int64))
    return result & dated_rows(arrival_s, stamp_s, period_s)


def dated_rows(arrival_s: np.ndarray, stamp_s: np.ndarray,
               period_s: Optional[float] = None) -> np.ndarray:
    """Return a mask (n,) of messages that have stamps or arrive evenly, or whose delay is known.

    See ``undated``; the arguments are those of ``measuring_times``.
    """
    if period_s is None:
        period_s = sending_period_s(arrival_s)
    if np.isfinite(stamp_s).any() or not is_even(np.diff(arrival_s), period_s):
        return np.ones(len(arrival_s), bool)
    return ~undated(arrival_s, _unbunched(arrival_s, period_s), period_s).rows


def _held_up(arrival_s: np.ndarray, stamp_s: np.ndarray, usable: np.ndarray) -> np.ndarray:
    """Return a mask (n,) of messages that came late because the recorder was delayed.

    Their stamps rise without a gap from usable stamps, or up to usable ones.
    """
    if not usable.any() or usable.all():
        return usable
    with np.errstate(invalid='ignore'):
        goes_on = (np.diff(stamp_s) > 0.0) & (np.diff(stamp_s) <= GAP_S)  # False for NaN
    begins = np.flatnonzero(np.concatenate(([True], ~goes_on)))
    lengths = np.diff(np.append(begins, len(stamp_s)))
    goes_on_from_usable = np.repeat(np.logical_or.reduceat(usable, begins), lengths)
    with np.errstate(invalid='ignore'):
        result: np.ndarray = goes_on_from_usable & (stamp_s <= arrival_s)
    return result


def _unbunched(arrival_s: np.ndarray, period_s: Optional[float]) -> np.ndarray:
    count = len(arrival_s)
    if period_s is None:
        period_s = sending_period_s(arrival_s)
    ideal_s = np.arange(count) * (MIN_PERIOD_SHARE * period_s)
    late_s = arrival_s - ideal_s
    least_s = late_s.copy()
    for follower in range(1, min(_MAX_BUNCHED, count - 1) + 1):
        np.minimum(least_s[:-follower], late_s[follower:], out=least_s[:-follower])
    return least_s + ideal_s
