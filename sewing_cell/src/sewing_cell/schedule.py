# SPDX-License-Identifier: BSD-3-Clause
"""The schedule of one sewing cycle."""
from __future__ import annotations

from dataclasses import dataclass
from typing import Callable, NamedTuple

import numpy as np

REFERENCE_PERIOD_S = 20.0
MIN_PERIOD_S = 12.0
MAX_PERIOD_S = 120.0


@dataclass(frozen=True)
class Phase:
    """A part of the cycle, in s from the cycle's start."""

    begin: float
    end: float


@dataclass(frozen=True)
class Schedule:
    """The phases of a cycle of ``period_s`` seconds; all of them scale with the period.

    Raises ValueError for a period outside 12 to 120 s.
    """

    period_s: float = REFERENCE_PERIOD_S

    def __post_init__(self) -> None:
        if not MIN_PERIOD_S <= self.period_s <= MAX_PERIOD_S:
            raise ValueError(
                f"period is {self.period_s} s; give one from {MIN_PERIOD_S:.0f} "
                f"to {MAX_PERIOD_S:.0f} s"
            )

    def _phase(self, begin: float, end: float) -> Phase:
        scale = self.period_s / REFERENCE_PERIOD_S
        return Phase(begin * scale, end * scale)

    @property
    def grip(self) -> Phase:
        """The grippers close on the covers waiting at the fetch position."""
        return self._phase(0.0, 1.2)

    @property
    def bring(self) -> Phase:
        """The covers' front edges go to the needle."""
        return self._phase(1.2, 4.2)

    @property
    def sew(self) -> Phase:
        """The machine feeds, the robots steer."""
        return self._phase(4.2, 13.4)

    @property
    def release(self) -> Phase:
        """The grippers open and leave the covers."""
        return self._phase(13.4, 14.8)

    @property
    def go_back(self) -> Phase:
        """The robots return to the fetch position, and wait there for the rest of the period."""
        return self._phase(14.4, 18.8)

    @property
    def take_away(self) -> Phase:
        """The sewn covers leave the cell."""
        return self._phase(13.6, 17.6)

    @property
    def stage(self) -> Phase:
        """The next covers come onto the supply table."""
        return self._phase(6.0, 10.0)

    @property
    def present(self) -> Phase:
        """The next covers move from the supply table to the fetch position."""
        return self._phase(14.6, 19.0)


class ProfileValue(NamedTuple):
    """A value over time and its rate of change per second."""

    value: np.ndarray
    rate: np.ndarray


def smooth_step(progress: np.ndarray) -> ProfileValue:
    """Quintic step (minimum jerk, Flash and Hogan 1985); ``rate`` is per unit of progress."""
    u = _clamped(progress)
    return ProfileValue(u * u * u * (10 + u * (6 * u - 15)), 30 * (u * (1 - u)) ** 2)


def steady_feed(progress: np.ndarray, ramp: float = 0.13) -> ProfileValue:
    """Constant speed except for smooth ramps of length ``ramp`` at both ends (progress 0 to 1)."""
    u = _clamped(progress)
    speed = 1.0 / (1.0 - ramp)
    near = np.minimum(u, 1.0 - u) / ramp
    inside = np.minimum(near, 1.0)
    ramped = speed * ramp * (inside**3 - inside**4 / 2 + np.maximum(near - 1.0, 0.0))
    rate = speed * inside**2 * (3 - 2 * inside)
    return ProfileValue(np.where(u < 0.5, ramped, 1.0 - ramped), rate)


def _clamped(progress: np.ndarray) -> np.ndarray:
    """``progress`` within 0 to 1 (np.clip is several times slower for single numbers)."""
    return np.minimum(np.maximum(progress, 0.0), 1.0)


Profile = Callable[[np.ndarray], ProfileValue]


def between(
    time: np.ndarray, begin: float, end: float, profile: Profile = smooth_step
) -> ProfileValue:
    """``profile`` stretched over ``begin`` to ``end`` [s]; its rate is per second."""
    course = profile((time - begin) / (end - begin))
    return ProfileValue(course.value, course.rate / (end - begin))


def window(time: np.ndarray, begin: float, end: float, edge: float) -> ProfileValue:
    """1 between ``begin`` and ``end`` [s], with smooth edges of ``edge`` seconds inside them."""
    rise = between(time, begin, begin + edge)
    fall = between(time, end - edge, end)
    return ProfileValue(rise.value - fall.value, rise.rate - fall.rate)


def product(left: ProfileValue, right: ProfileValue) -> ProfileValue:
    """The product of two values over time."""
    return ProfileValue(left.value * right.value, left.rate * right.value + left.value * right.rate)
