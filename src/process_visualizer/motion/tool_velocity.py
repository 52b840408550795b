"""The velocity of a tool over bag time, in real time and in playback."""
from __future__ import annotations

from collections import deque
from typing import Deque, NamedTuple, Optional, Sequence

from process_visualizer.motion.playback_clock import PlaybackClock
from process_visualizer.motion.rotations import Quaternion, Triple
from process_visualizer.motion.sending_period import SendingPeriod
from process_visualizer.motion.velocity import ScaledClock, VelocityEstimator

HOLD_S = 0.05


class _Sample(NamedTuple):
    arrival_s: float
    wall_s: float
    position: Sequence[float]
    quaternion: Quaternion


class ToolVelocity:
    """Gives each pose of a tool its bag time and estimates the velocity from them.

    In playback a pose and the player's state that belongs to it come by two connections, in any
    order. So poses wait for HOLD_S before their times are taken: a state is known by then, and no
    velocity is computed across a jump or with the rate of before. The first pose of a segment is
    what was restored after a jump; when it was measured is not known, and it is left out.

    Without a player there is no wait, and the rate that is given scales the time.
    """

    def __init__(self, clock: PlaybackClock, window_s: float) -> None:
        """Take the clock and the window of the estimate [s of bag time]."""
        self._clock = clock
        self._scaled = ScaledClock()
        self._estimator = VelocityEstimator(window_s, gap_s=max(1.0, 2.0 * window_s))
        self._period = SendingPeriod()
        self._waiting: Deque[_Sample] = deque(maxlen=1000)
        self._segment: Optional[int] = None

    def add(self, arrival_s: float, wall_s: float, position: Sequence[float],
            quaternion: Quaternion, rate: float = 1.0) -> None:
        """Add a pose.

        Args:
            arrival_s: wall time at which it came.
            wall_s: wall time at which it was measured (or played), if that is known better.
            position: (3,) [m] in the base frame.
            quaternion: (4,) x y z w in the base frame, of any length but zero.
            rate: seconds of recording per second, for playback without the player.
        """
        if not self._clock.follows_player(arrival_s):
            self._waiting.clear()
            self._enter(None)
            self._estimate(self._scaled.advance(wall_s, rate),
                           _Sample(arrival_s, wall_s, position, quaternion))
            return
        self._waiting.append(_Sample(arrival_s, wall_s, position, quaternion))
        self.settle(arrival_s)

    def settle(self, now_s: float) -> None:
        """Take the poses that have waited for long enough."""
        while self._waiting and self._waiting[0].arrival_s <= now_s - HOLD_S:
            sample = self._waiting.popleft()
            bag = self._clock.bag_time(sample.wall_s)
            assert bag is not None, 'poses wait only if there is a player'
            if self._enter(bag.segment):
                self._estimate(bag.time_s, sample)

    def velocity(self) -> Optional[Triple]:
        """Return the velocity (3,) [m/s] in the base frame; None while it is not known."""
        return self._estimator.velocity()

    def angular_velocity(self) -> Optional[Triple]:
        """Return the angular velocity (3,) [rad/s] in the base frame; None while not known."""
        return self._estimator.angular_velocity()

    def wall_s(self) -> float:
        """Return the wall time [s] at which the tool had that velocity: the window's middle."""
        return self._estimator.wall_s()

    def _estimate(self, time_s: float, sample: _Sample) -> None:
        """Take a pose at a time that is exact if it has a stamp, and else that of its arrival."""
        stamped = sample.wall_s != sample.arrival_s
        self._estimator.period_s = 0.0 if stamped else self._period.add(time_s)
        self._estimator.add(time_s, sample.position, sample.quaternion, sample.wall_s)

    def _enter(self, segment: Optional[int]) -> bool:
        """Forget what was before if this is another segment; tell whether it is not."""
        if segment == self._segment:
            return True
        self._segment = segment
        self._estimator.reset()
        self._period.reset()
        return False
