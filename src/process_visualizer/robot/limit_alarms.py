# SPDX-License-Identifier: BSD-3-Clause
"""Decides when a variable beyond its limits becomes an alarm: minimum time and hysteresis."""
from __future__ import annotations

import math
from dataclasses import dataclass
from typing import List, NamedTuple, Optional, Tuple

import numpy as np

BEGIN_S = 0.2
"""Minimum time beyond a limit for an alarm."""
END_S = 0.5
"""Time for which the value must be back inside before an alarm ends."""
_MARGIN = 0.05


@dataclass(frozen=True)
class Limits:
    """The lower and the upper limit, in the variable's unit."""

    low: float = -math.inf
    high: float = math.inf

    @property
    def exist(self) -> bool:
        """Return whether there is any limit."""
        return self.low > -math.inf or self.high < math.inf

    @property
    def margin(self) -> float:
        """Return the distance inside a limit at which an alarm ends; noise does not end it."""
        if -math.inf < self.low and self.high < math.inf:
            return _MARGIN * (self.high - self.low)
        return _MARGIN * abs(self.low if self.low > -math.inf else self.high)

    def excess(self, values: np.ndarray) -> np.ndarray:
        """Return the distance (n,) of values beyond the nearer limit; negative inside."""
        return np.maximum(values - self.high, self.low - values)

    def excess_of(self, value: float) -> float:
        """Return the distance of a value beyond the nearer limit; negative inside."""
        return max(value - self.high, self.low - value)

    def sentence(self, label: str, value: float, unit: str) -> str:
        """Return the exceeded limit in words, such as 'oven is above 200 °C'."""
        side = f'above {self.high:g}' if value > self.high else f'below {self.low:g}'
        return f'{label} is {side} {unit}'.rstrip()

    def reach(self, extreme: float, unit: str) -> str:
        """Return an extreme value in words, such as 'up to 230 °C'."""
        return f'{"up" if extreme > self.high else "down"} to {extreme:g} {unit}'.rstrip()


class LimitAlarm(NamedTuple):
    """An alarm: start and end [s], and the value farthest beyond a limit."""

    begin_s: float
    end_s: float
    extreme: float


class _Run(NamedTuple):
    """Consecutive samples that are all beyond (1), inside (-1), or in the margin between (0)."""

    begin_s: float
    end_s: float
    side: int
    extreme: float
    excess: float


class LimitWatch:
    """Judges a variable as its values arrive; each value holds until the next one."""

    def __init__(self, limits: Limits) -> None:
        self._limits = limits
        self._open: Optional[LimitAlarm] = None
        self._excess = 0.0  # of its extreme
        self._inside_since_s: Optional[float] = None
        self._ended: List[LimitAlarm] = []

    @property
    def present(self) -> Optional[LimitAlarm]:
        """The present alarm, up to the last value; None if there is none."""
        return self._open if self._open is not None and _is_long(self._open) else None

    def add(self, time_s: float, value: float) -> None:
        """Add a value; times [s] must not decrease."""
        self.add_all(np.array([time_s]), np.array([value], dtype=float))

    def add_all(self, times_s: np.ndarray, values: np.ndarray) -> None:
        """Add values (n,) in the order of their times (n,) [s]."""
        for run in _runs(self._limits, times_s, values):
            self._take(run)

    def take_ended(self) -> Tuple[LimitAlarm, ...]:
        """Return the alarms that have ended since the last call."""
        ended, self._ended = self._ended, []
        return tuple(ended)

    def _take(self, run: _Run) -> None:
        if run.side > 0:
            self._take_beyond(run)
        elif self._open is not None:
            self._take_inside(run, self._open)

    def _take_beyond(self, run: _Run) -> None:
        if self._open is None or run.excess > self._excess:
            begin_s = run.begin_s if self._open is None else self._open.begin_s
            self._open, self._excess = LimitAlarm(begin_s, run.end_s, run.extreme), run.excess
        self._open = self._open._replace(end_s=run.end_s)
        self._inside_since_s = None

    def _take_inside(self, run: _Run, alarm: LimitAlarm) -> None:
        if run.side == 0:
            self._open, self._inside_since_s = alarm._replace(end_s=run.end_s), None
            return
        if self._inside_since_s is None:
            self._inside_since_s = run.begin_s
            self._open = alarm = alarm._replace(end_s=run.begin_s)
        if run.end_s - self._inside_since_s >= END_S:
            self._open = None
            self._ended += [alarm] if _is_long(alarm) else []


def limit_alarms(limits: Limits, times_s: np.ndarray,
                 values: np.ndarray) -> Tuple[LimitAlarm, ...]:
    """Return the alarms of a whole recording in order of time, without overlaps.

    Args:
        limits: the variable's limits.
        times_s: (n,) [s], ascending.
        values: (n,), finite.
    """
    watch = LimitWatch(limits)
    watch.add_all(times_s, values)
    last = () if watch.present is None else (watch.present,)
    return watch.take_ended() + last


def _is_long(alarm: LimitAlarm) -> bool:
    return alarm.end_s - alarm.begin_s >= BEGIN_S


def _runs(limits: Limits, times_s: np.ndarray, values: np.ndarray) -> List[_Run]:
    if not len(values):
        return []
    excess = limits.excess(values)
    side = np.where(excess > 0.0, 1, np.where(excess <= -limits.margin, -1, 0))
    begins = np.flatnonzero(np.diff(side, prepend=side[0] + 1))
    runs = []
    for begin, end in zip(begins.tolist(), [*begins[1:].tolist(), len(values)]):
        worst = begin + int(np.argmax(excess[begin:end]))
        runs.append(_Run(float(times_s[begin]), float(times_s[end - 1]), int(side[begin]),
                         float(values[worst]), float(excess[worst])))
    return runs
