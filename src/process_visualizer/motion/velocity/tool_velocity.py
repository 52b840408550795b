# SPDX-License-Identifier: BSD-3-Clause
"""The velocity of a tool from poses as they arrive."""
from __future__ import annotations

import math
from collections import deque
from itertools import islice
from typing import Deque, Iterable, NamedTuple, Optional, Sequence

from process_visualizer.motion.rotations import Quaternion, Triple
from process_visualizer.motion.velocity.sending_period import SendingPeriod
from process_visualizer.motion.velocity.velocity_estimator import (
    GAP_S,
    ScaledClock,
    VelocityEstimator,
)

HOLD_S = 0.05
_MOST_BUNCHED = 50  # messages: what was held up for longer is dated by the rest of them
_SHORTEST = 0.99  # of the measured period: small errors of it must not add up
_SET_BACK_S = 0.1  # a clock's step that is worth beginning anew for


class _Sample(NamedTuple):
    arrival_s: float
    wall_s: float
    position: Sequence[float]
    quaternion: Quaternion
    time_s: float  # of the recording, if it is one that is played
    rate: float

    def stamped(self) -> bool:
        """Return whether the driver says when it measured."""
        return self.wall_s != self.arrival_s


class ToolVelocity:
    """Gives each pose of a tool its time and estimates the velocity from them.

    Poses without a stamp come late now and then, and then several at once. A driver sends no
    faster than its period, so each was measured at least a period before the one that follows it;
    where messages are lost, nothing follows closely, and the gap stays a gap. To see what follows,
    poses wait for HOLD_S.

    When the clock of the arrivals is set back, all begins anew.
    """

    def __init__(self, window_s: float) -> None:
        """Take the window of the estimate [s]."""
        self._scaled = ScaledClock()
        self._estimator = VelocityEstimator(window_s, gap_s=max(GAP_S, 2.0 * window_s))
        self._period = SendingPeriod()
        self._waiting: Deque[_Sample] = deque(maxlen=1000)
        self._newest_s = -math.inf

    def add(self, arrival_s: float, wall_s: float, position: Sequence[float],
            quaternion: Quaternion, rate: float = 1.0) -> None:
        """Add a pose.

        Args:
            arrival_s: wall time at which it came.
            wall_s: its stamp, if it has one that can be used, else the same.
            position: (3,) [m] in the base frame.
            quaternion: (4,) x y z w in the base frame, of any length but zero.
            rate: seconds of recording per second, for another player than the own one.
        """
        if arrival_s < self._newest_s - _SET_BACK_S:
            self._begin_anew()
        self._newest_s = arrival_s
        self._waiting.append(_Sample(arrival_s, wall_s, position, quaternion,
                                     self._scaled.advance(wall_s, rate), rate))
        self.settle(arrival_s)

    def settle(self, now_s: float) -> None:
        """Take the poses that have waited for long enough."""
        while self._waiting and self._is_settled(self._waiting[0], now_s):
            self._take(self._waiting.popleft())

    def velocity(self) -> Optional[Triple]:
        """Return the velocity (3,) [m/s] in the base frame; None while it is not known."""
        return self._estimator.velocity()

    def angular_velocity(self) -> Optional[Triple]:
        """Return the angular velocity (3,) [rad/s] in the base frame; None while not known."""
        return self._estimator.angular_velocity()

    def wall_s(self) -> float:
        """Return the wall time [s] at which the tool had that velocity: the window's middle."""
        return self._estimator.wall_s()

    def _begin_anew(self) -> None:
        self._scaled = ScaledClock()
        self._waiting.clear()
        self._estimator.reset()
        self._period.reset()

    def _is_settled(self, sample: _Sample, now_s: float) -> bool:
        return sample.stamped() or sample.arrival_s <= now_s - HOLD_S

    def _take(self, sample: _Sample) -> None:
        """Add a pose to the estimate, at the time of its stamp, or when it was measured."""
        self._period.add(sample.time_s)
        time_s = sample.time_s
        if not sample.stamped():
            time_s = _measured_s(sample, islice(self._waiting, _MOST_BUNCHED),
                                 self._period.period_s)
        moved_s = (time_s - sample.time_s) / sample.rate if sample.rate else 0.0
        self._estimator.add(time_s, sample.position, sample.quaternion, sample.wall_s + moved_s)


def _measured_s(sample: _Sample, followers: Iterable[_Sample], period_s: float) -> float:
    """Return the time [s] of a pose that is before those of its followers by so many periods."""
    step_s = _SHORTEST * period_s
    latest_s, before_s = sample.time_s, 0.0
    for follower in followers:
        if sample.rate <= 0.0 or follower.rate <= 0.0:
            break
        before_s += step_s
        latest_s = min(latest_s, follower.time_s - before_s)
    return latest_s
