"""The velocity of a tool over bag time, in real time and in playback."""
from __future__ import annotations

import math
from collections import deque
from itertools import islice
from typing import Deque, Iterable, NamedTuple, Optional, Sequence

from process_visualizer.motion.playback_clock import BagTime, PlaybackClock
from process_visualizer.motion.recorded_times import MOST_BUNCHED, Recorded, RecordedTimes, Told
from process_visualizer.motion.rotations import Quaternion, Triple
from process_visualizer.motion.sending_period import SendingPeriod
from process_visualizer.motion.velocity import ScaledClock, VelocityEstimator

HOLD_S = 0.05
STATE_DELAY_S = 0.035  # of the player's states behind what they belong to, at most
TOLD_WITHIN_S = 0.5  # of a pose, the player tells when it was recorded, or not at all
_LIVE = -1  # the segment without a player
_SHORTEST = 0.99  # of the measured period: small errors of it must not add up
_SET_BACK_S = 0.1  # a clock's step that is worth beginning anew for


class _Sample(NamedTuple):
    arrival_s: float
    wall_s: float
    position: Sequence[float]
    quaternion: Quaternion
    checksum: int
    live: Optional[BagTime]  # without a player

    def stamped(self) -> bool:
        """Tell whether the driver says when it measured."""
        return self.wall_s != self.arrival_s


class ToolVelocity:
    """Gives each pose of a tool its bag time and estimates the velocity from them.

    Poses without a stamp come late now and then, and then several at once. A driver sends no
    faster than its period, so each was measured at least a period before the one that follows it
    in the recording; where messages are lost, nothing follows closely, and the gap stays a gap.
    To see what follows, poses wait for HOLD_S.

    In playback the player tells when such poses were recorded, before it sends them: however late
    they come, this is the time that counts, and those that follow are known already. Where
    nothing was told, and for poses with a stamp, the bag time is that of the player's states. A
    pose and the state that belongs to it come by two connections, in any order; so these poses
    wait for STATE_DELAY_S more. The first one of a segment is what was restored after a jump; when
    it was measured is not known, and it is left out. Backwards, the player shows a pose when it
    passes the one that was recorded after it, and replaces it at the time at which it was recorded
    itself; where playback turns round before that, it is left out.

    When the clock of the arrivals is set back, all begins anew.
    """

    def __init__(self, clock: PlaybackClock, window_s: float) -> None:
        """Take the clock and the window of the estimate [s of bag time]."""
        self._clock = clock
        self._scaled = ScaledClock()
        self._estimator = VelocityEstimator(window_s, gap_s=max(1.0, 2.0 * window_s))
        self._period = SendingPeriod()
        self._recorded = RecordedTimes()
        self._told_s = -math.inf
        self._waiting: Deque[_Sample] = deque(maxlen=1000)
        self._taken: Deque[BagTime] = deque(maxlen=MOST_BUNCHED)
        self._segment = _LIVE
        self._newest_s = -math.inf

    def tell(self, now_s: float, coming: Iterable[Told]) -> None:
        """Take note of when poses that come next were recorded."""
        self._told_s = now_s
        self._recorded.tell(coming)

    def add(self, arrival_s: float, wall_s: float, position: Sequence[float],
            quaternion: Quaternion, rate: float = 1.0, checksum: int = 0) -> None:
        """Add a pose.

        Args:
            arrival_s: wall time at which it came.
            wall_s: its stamp, if it has one that can be used, else the same.
            position: (3,) [m] in the base frame.
            quaternion: (4,) x y z w in the base frame, of any length but zero.
            rate: seconds of recording per second, for playback without the player.
            checksum: CRC-32 of the message, by which the player tells when it was recorded.
        """
        if arrival_s < self._newest_s - _SET_BACK_S:
            self._begin_anew()
        self._newest_s = arrival_s
        live = None
        if not self._clock.follows_player(arrival_s):
            live = BagTime(_LIVE, self._scaled.advance(wall_s, rate), rate)
        self._waiting.append(_Sample(arrival_s, wall_s, position, quaternion, checksum, live))
        self.settle(arrival_s)

    def settle(self, now_s: float) -> None:
        """Take the poses whose time is known, and those that have waited for long enough."""
        while self._waiting and self._settle_first(self._waiting[0], now_s):
            self._waiting.popleft()

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

    def _settle_first(self, sample: _Sample, now_s: float) -> bool:
        """Take the pose that has waited for longest, if it need not wait any more."""
        recorded = None
        if sample.live is None and not sample.stamped():
            recorded = self._recorded.take(sample.checksum)
        if recorded is not None:
            self._take_recorded(sample, recorded)
            return True
        if sample.arrival_s > now_s - self._hold_s(sample):
            return False
        if len(self._waiting) < 2 and self._bag_time(sample).rate < 0.0:
            return False  # played backwards: it is dated by the next one to come
        self._take(sample, now_s)
        return True

    def _hold_s(self, sample: _Sample) -> float:
        """Return how long [s] a pose must wait for what belongs to it or comes after it."""
        if sample.live is not None:
            return 0.0 if sample.stamped() else HOLD_S
        is_told = sample.arrival_s - self._told_s < TOLD_WITHIN_S and not sample.stamped()
        return TOLD_WITHIN_S if is_told else HOLD_S + STATE_DELAY_S

    def _bag_time(self, sample: _Sample) -> BagTime:
        bag = sample.live or self._clock.bag_time(sample.wall_s)
        assert bag is not None, 'there are states once there is a player'
        return bag

    def _take_recorded(self, sample: _Sample, recorded: Recorded) -> None:
        """Take a pose of which the player has told when it was recorded."""
        bag = recorded.bag
        self._enter(bag.segment)
        self._note(bag)
        time_s = _measured_s(bag, recorded.following if bag.rate >= 0.0 else self._passed(),
                             self._period.period_s)
        self._estimate(sample, self._bag_time(sample), bag, time_s)

    def _take(self, sample: _Sample, now_s: float) -> None:
        """Take a pose whose time is that of its stamp, or of its arrival."""
        played = self._bag_time(sample)
        restored = self._enter(played.segment)
        recorded = played if played.rate >= 0.0 else self._bag_time(self._waiting[1])
        turned = recorded.segment != played.segment or recorded.rate * played.rate < 0.0
        if turned or (restored and played.segment != _LIVE):
            return
        self._note(recorded)
        time_s = recorded.time_s if sample.stamped() else self._dated(recorded, now_s)
        self._estimate(sample, played, recorded, time_s)

    def _enter(self, segment: int) -> bool:
        """Begin anew where a new segment begins; tell whether it does."""
        begins = segment != self._segment
        if begins:
            self._segment = segment
            self._estimator.reset()
            self._period.reset()
        return begins

    def _note(self, bag: BagTime) -> None:
        self._taken.append(bag)
        self._period.add(bag.time_s)

    def _estimate(self, sample: _Sample, played: BagTime, bag: BagTime, time_s: float) -> None:
        """Add a pose of a bag time [s] to the estimate, given what was played when it came."""
        moved_s = 0.0
        if played.segment == bag.segment and played.rate:
            moved_s = (time_s - played.time_s) / played.rate
        self._estimator.add(time_s, sample.position, sample.quaternion, sample.wall_s + moved_s)

    def _passed(self) -> Iterable[BagTime]:
        """Return the times of those that were taken before the last one, backwards."""
        return islice(reversed(self._taken), 1, None)

    def _dated(self, bag: BagTime, now_s: float) -> float:
        """Return the bag time [s] at which the first pose waiting was measured at the latest."""
        if bag.rate < 0.0:  # what follows in the recording has come before
            followers = self._passed()
        else:
            known_s = now_s if bag.segment == _LIVE else now_s - STATE_DELAY_S
            followers = (self._bag_time(sample)
                         for sample in islice(self._waiting, 1, MOST_BUNCHED + 1)
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
