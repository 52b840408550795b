"""The velocity of a tool over bag time, in real time and in playback."""
from __future__ import annotations

import math
from collections import deque
from itertools import islice
from typing import Deque, Iterable, NamedTuple, Optional, Sequence

from process_visualizer.motion.playback_clock import BagTime, PlaybackClock
from process_visualizer.motion.rotations import Quaternion, Triple
from process_visualizer.motion.sending_period import SendingPeriod
from process_visualizer.motion.velocity import ScaledClock, VelocityEstimator

HOLD_S = 0.05
STATE_DELAY_S = 0.035  # of the player's states behind what they belong to, at most
_LIVE = -1  # the segment without a player
_SHORTEST = 0.99  # of the measured period: small errors of it must not add up
_SET_BACK_S = 0.1  # a clock's step that is worth beginning anew for
_MOST_BUNCHED = 50  # messages: what was held up for longer is dated by the rest of them


class _Sample(NamedTuple):
    arrival_s: float
    wall_s: float
    position: Sequence[float]
    quaternion: Quaternion
    live: Optional[BagTime]  # without a player

    def stamped(self) -> bool:
        """Tell whether the driver says when it measured."""
        return self.wall_s != self.arrival_s

    def hold_s(self) -> float:
        """Return how long [s] it must wait for what comes after it."""
        if self.live is None:
            return HOLD_S + STATE_DELAY_S
        return 0.0 if self.stamped() else HOLD_S


class ToolVelocity:
    """Gives each pose of a tool its bag time and estimates the velocity from them.

    Poses without a stamp come late now and then, and then several at once. A driver sends no
    faster than its period, so each was measured at least a period before the one that follows it
    in the recording; where messages are lost, nothing follows closely, and the gap stays a gap.
    To see what follows, poses wait for HOLD_S.

    In playback a pose and the player's state that belongs to it come by two connections, in any
    order; so all poses wait for STATE_DELAY_S more. The first pose of a segment is what was
    restored after a jump; when it was measured is not known, and it is left out. Backwards, the
    player shows a pose when it passes the one that was recorded after it, and replaces it at the
    time at which it was recorded itself; where playback turns round before that, it is left out.

    When the clock of the arrivals is set back, all begins anew.
    """

    def __init__(self, clock: PlaybackClock, window_s: float) -> None:
        """Take the clock and the window of the estimate [s of bag time]."""
        self._clock = clock
        self._scaled = ScaledClock()
        self._estimator = VelocityEstimator(window_s, gap_s=max(1.0, 2.0 * window_s))
        self._period = SendingPeriod()
        self._waiting: Deque[_Sample] = deque(maxlen=1000)
        self._taken: Deque[BagTime] = deque(maxlen=_MOST_BUNCHED)
        self._segment = _LIVE
        self._newest_s = -math.inf

    def add(self, arrival_s: float, wall_s: float, position: Sequence[float],
            quaternion: Quaternion, rate: float = 1.0) -> None:
        """Add a pose.

        Args:
            arrival_s: wall time at which it came.
            wall_s: its stamp, if it has one that can be used, else the same.
            position: (3,) [m] in the base frame.
            quaternion: (4,) x y z w in the base frame, of any length but zero.
            rate: seconds of recording per second, for playback without the player.
        """
        if arrival_s < self._newest_s - _SET_BACK_S:
            self._begin_anew()
        self._newest_s = arrival_s
        live = None
        if not self._clock.follows_player(arrival_s):
            live = BagTime(_LIVE, self._scaled.advance(wall_s, rate), rate)
        self._waiting.append(_Sample(arrival_s, wall_s, position, quaternion, live))
        self.settle(arrival_s)

    def settle(self, now_s: float) -> None:
        """Take the poses that have waited for long enough."""
        waiting = self._waiting
        while waiting and waiting[0].arrival_s <= now_s - waiting[0].hold_s():
            if len(waiting) < 2 and self._bag_time(waiting[0]).rate < 0.0:
                return  # played backwards: it is dated by the next one to come
            self._take(waiting.popleft(), now_s)

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
        self._taken.clear()
        self._estimator.reset()
        self._period.reset()

    def _bag_time(self, sample: _Sample) -> BagTime:
        bag = sample.live or self._clock.bag_time(sample.wall_s)
        assert bag is not None, 'there are states once there is a player'
        return bag

    def _take(self, sample: _Sample, now_s: float) -> None:
        played = self._bag_time(sample)
        restored = played.segment != self._segment
        if restored:
            self._segment = played.segment
            self._estimator.reset()
            self._period.reset()
        recorded = played if played.rate >= 0.0 else self._bag_time(self._waiting[0])
        turned = recorded.segment != played.segment or recorded.rate * played.rate < 0.0
        if turned or (restored and played.segment != _LIVE):
            return
        self._taken.append(recorded)
        self._period.add(recorded.time_s)
        time_s = recorded.time_s if sample.stamped() else self._dated(recorded, now_s)
        moved_s = (time_s - played.time_s) / played.rate if played.rate else 0.0
        self._estimator.add(time_s, sample.position, sample.quaternion, sample.wall_s + moved_s)

    def _dated(self, bag: BagTime, now_s: float) -> float:
        """Return the bag time [s] at which a pose was measured at the latest."""
        if bag.rate < 0.0:  # what follows in the recording has come before
            followers: Iterable[BagTime] = islice(reversed(self._taken), 1, None)
        else:
            known_s = now_s if bag.segment == _LIVE else now_s - STATE_DELAY_S
            followers = (self._bag_time(sample) for sample in islice(self._waiting, _MOST_BUNCHED)
                         if sample.arrival_s <= known_s)
        return _measured_s(bag, followers, self._period.period_s)


def _measured_s(bag: BagTime, followers: Iterable[BagTime], period_s: float) -> float:
    """Return a bag time [s] that is before those of its followers by so many periods."""
    step_s = _SHORTEST * period_s
    latest_s, before_s = bag.time_s, 0.0
    for follower in followers:
        if follower.segment != bag.segment or follower.rate * bag.rate <= 0.0:
            break
        before_s += step_s
        latest_s = min(latest_s, follower.time_s - before_s)
    return latest_s
