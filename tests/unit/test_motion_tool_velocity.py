"""The velocity in playback: the same at every rate, backwards, across changes, in single steps."""
import zlib

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from process_visualizer.motion.playback_clock import BagTime, PlaybackClock, PlaybackState
from process_visualizer.motion.recorded_times import Told
from process_visualizer.motion.tool_velocity import (
    HOLD_S,
    STATE_DELAY_S,
    TOLD_WITHIN_S,
    ToolVelocity,
)

VELOCITY = np.array([0.05, -0.12, 0.02])
TURNING = np.array([0.3, -0.5, 0.8])  # rad/s in the base frame
PERIOD_S = 0.008
START_S = 1000.0


def pose(bag_s):
    """Return position and quaternion at a bag time."""
    rotation = Rotation.from_rotvec(TURNING * bag_s) * Rotation.from_rotvec((3.1, 0.1, 0.2))
    return tuple(VELOCITY * bag_s + [0.5, 0.1, 0.2]), tuple(rotation.as_quat())


class Player:
    """Plays poses every 8 ms of a recording; states may come later than what they belong to."""

    rate = 0.0  # as it was last said; 0 while paused

    def __init__(self, state_delay_s=0.0):
        self.clock = PlaybackClock()
        self.velocity = ToolVelocity(self.clock, 0.1)
        self.wall_s, self.bag_s, self.segment = START_S, 10.0, 0
        self._state_delay_s = state_delay_s
        self._states = []
        self.found = []

    def say(self, rate, paused=False):
        self.rate = 0.0 if paused else rate
        self._states.append(PlaybackState(self.wall_s, self.bag_s, rate, paused, self.segment))

    def play(self, rate, duration_s):
        """Play for a time of the recording."""
        count = int(round(duration_s / PERIOD_S))
        self.wall_s += 1e-6  # the command comes after what was played before
        for step in range(count):
            if step % 10 == 0:
                self.say(rate)
            self.wall_s += PERIOD_S / abs(rate)
            self.bag_s += np.copysign(PERIOD_S, rate)
            # Backwards, what was before is shown.
            self.send(age_s=PERIOD_S if rate < 0.0 else 0.0)

    def step(self, count):
        """Step from pose to pose, three a second."""
        for _ in range(abs(count)):
            self.wall_s += 0.3
            self.bag_s += np.copysign(PERIOD_S, count)
            self.say(1.0, paused=True)
            self.send(0.002)

    def seek(self, bag_s, paused=False):
        self.wall_s += 0.001
        self.bag_s, self.segment = bag_s, self.segment + 1
        self.say(1.0, paused)
        self.send(age_s=0.005)

    def send(self, late_s=0.0, age_s=0.0):
        arrival_s = self.wall_s + late_s
        while self._states and self._states[0].stamp_s + self._state_delay_s <= arrival_s:
            self.clock.add(self._states.pop(0))
        self.velocity.add(arrival_s, arrival_s, *pose(self.bag_s - age_s))
        if self.velocity.velocity() is not None:
            self.found.append((*self.velocity.velocity(), *self.velocity.angular_velocity()))

    def assert_right(self, at_least):
        assert len(self.found) >= at_least
        assert np.allclose(self.found, np.concatenate([VELOCITY, TURNING]), atol=2e-4)


@pytest.mark.parametrize('delay_s', [0.0, 0.03])
@pytest.mark.parametrize('rate', [0.25, 1.0, 4.0, 16.0, -0.5, -1.0, -4.0])
def test_every_rate(rate, delay_s):
    player = Player(delay_s)
    player.play(rate, 4.0)
    player.assert_right(200)


@pytest.mark.parametrize('delay_s', [0.0, 0.03])
def test_live_changes_of_the_rate(delay_s):
    player = Player(delay_s)
    for rate in (1.0, 4.0, 0.5, -1.0, -8.0, 2.0):
        player.play(rate, 1.0)
    player.assert_right(500)


@pytest.mark.parametrize('delay_s', [0.0, 0.001])
@pytest.mark.parametrize('count', [40, -40])
def test_single_steps(count, delay_s):
    player = Player(delay_s)
    player.play(1.0, 0.5)
    player.step(count)
    player.assert_right(60)


@pytest.mark.parametrize('delay_s', [0.0, 0.03])
def test_never_across_a_jump(delay_s):
    player = Player(delay_s)
    for target_s in (100.0, 20.0, 20.5, 60.0):
        player.play(1.0, 0.5)
        player.seek(target_s)
    player.play(1.0, 0.5)
    player.assert_right(150)


def test_after_a_jump_the_velocity_is_not_known():
    player = Player()
    player.play(1.0, 0.5)
    player.seek(100.0, paused=True)
    assert player.velocity.velocity() is not None  # it may belong to what was before
    player.velocity.settle(player.wall_s + HOLD_S + STATE_DELAY_S + 0.001)
    assert player.velocity.velocity() is None


def test_pause_and_resume():
    player = Player()
    player.play(1.0, 0.5)
    player.say(1.0, paused=True)
    for _ in range(30):
        player.wall_s += 0.1
        player.say(1.0, paused=True)
    player.play(1.0, 0.5)
    player.assert_right(80)


def test_without_a_player_the_rate_scales_the_time():
    velocity = ToolVelocity(PlaybackClock(), 0.1)
    for step in range(60):
        wall_s = START_S + step * PERIOD_S / 2
        velocity.add(wall_s, wall_s, *pose(step * PERIOD_S), 2.0)
    assert np.allclose(velocity.velocity(), VELOCITY)
    assert np.allclose(velocity.angular_velocity(), TURNING, atol=1e-4)
    newest_s = wall_s - HOLD_S
    assert velocity.wall_s() == pytest.approx(newest_s - 6.5 * PERIOD_S / 2, abs=PERIOD_S)


def test_poses_with_stamps_do_not_wait():
    velocity = ToolVelocity(PlaybackClock(), 0.1)
    for step in range(30):
        wall_s = START_S + step * PERIOD_S
        velocity.add(wall_s + 0.03 * (step % 3), wall_s - 1e-4, *pose(step * PERIOD_S))
    assert np.allclose(velocity.velocity(), VELOCITY)
    assert velocity.wall_s() == pytest.approx(wall_s - 6.5 * PERIOD_S, abs=PERIOD_S)


@pytest.mark.parametrize('back_s', [0.05, 2.0, 900.0])
def test_a_clock_that_was_set_back(back_s):
    velocity, found = ToolVelocity(PlaybackClock(), 0.1), []
    for step in range(100):
        wall_s = START_S + step * PERIOD_S - (back_s if step >= 50 else 0.0)
        velocity.add(wall_s, wall_s, *pose(step * PERIOD_S))
        if velocity.velocity() is not None:
            found.append(velocity.velocity())
    assert len(found) > 50
    assert np.allclose(found[-20:], VELOCITY)
    if back_s > 1.0:
        assert np.allclose(found, VELOCITY)


class TellingPlayer(Player):
    """Tells when poses were recorded, a hundred of them before the first is sent.

    All is late by up to 0.3 s, and comes in bunches.
    """

    ahead = 100

    def __init__(self):
        super().__init__()
        self._random = np.random.default_rng(5)
        self._to_send, self._newest_s = [], 0.0

    def send(self, late_s=0.0, age_s=0.0):
        bag_s = self.bag_s - age_s
        checksum = zlib.crc32(repr(round(bag_s, 4)).encode())
        told = Told(checksum, BagTime(self.segment, bag_s, self.rate))
        self.velocity.tell(self.wall_s, [told])
        self._to_send.append((self.wall_s, bag_s, checksum))
        if len(self._to_send) > self.ahead:
            self._send_first()

    def finish(self):
        while self._to_send:
            self._send_first()

    def _send_first(self):
        sent_s, bag_s, checksum = self._to_send.pop(0)
        while self._states and self._states[0].stamp_s <= sent_s:
            self.clock.add(self._states.pop(0))
        late_s = self._random.uniform(0.0, 0.3) if self._random.random() < 0.1 else 0.0
        self._newest_s = max(self._newest_s, sent_s + late_s)
        self.velocity.add(self._newest_s, self._newest_s, *pose(bag_s), checksum=checksum)
        if self.velocity.velocity() is not None:
            self.found.append((*self.velocity.velocity(), *self.velocity.angular_velocity()))


@pytest.mark.parametrize('rate', [0.25, 1.0, 4.0, 16.0, -0.5, -1.0, -4.0])
def test_what_is_told_counts_however_late_a_pose_comes(rate):
    player = TellingPlayer()
    player.play(rate, 4.0)
    player.finish()
    player.assert_right(450)


def test_what_is_told_across_commands():
    player = TellingPlayer()
    for rate in (1.0, 4.0, -2.0, 0.5):
        player.play(rate, 1.0)
        player.seek(player.bag_s + 7.0)
        player.step(30)
        player.step(-30)
    player.finish()
    player.assert_right(500)


def test_poses_wait_for_what_is_told_late_and_are_not_lost_without_it():
    player = TellingPlayer()
    player.ahead = 0
    player.play(1.0, 1.0)
    count = len(player.found)
    arrival_s = player.wall_s + 0.01
    player.velocity.add(arrival_s, arrival_s, (9.0, 9.0, 9.0), (0.0, 0.0, 0.0, 1.0), checksum=1)
    player.velocity.settle(arrival_s + TOLD_WITHIN_S - 0.01)
    assert np.allclose(player.velocity.velocity(), VELOCITY, atol=2e-4)  # it still waits
    player.velocity.tell(arrival_s, [Told(1, BagTime(0, player.bag_s + 500.0))])
    player.velocity.settle(arrival_s)
    assert player.velocity.velocity() is None  # it is far from the others
    player.velocity.add(arrival_s, arrival_s, *pose(player.bag_s), checksum=2)
    player.velocity.settle(arrival_s + TOLD_WITHIN_S + 0.001)
    assert count > 50 and not player.velocity._waiting


def test_poses_that_the_recorder_got_in_a_bunch():
    clock = PlaybackClock()
    clock.add(PlaybackState(START_S, 0.0, 1.0, False, 0))
    velocity, found = ToolVelocity(clock, 0.1), []
    velocity.tell(START_S, [Told(number, BagTime(0, recorded_s(number), 1.0))
                            for number in range(1, 600)])
    for number in range(1, 600):
        velocity.add(START_S, START_S, *pose(number * PERIOD_S), checksum=number)
        if velocity.velocity() is not None:
            found.append((*velocity.velocity(), *velocity.angular_velocity()))
    assert len(found) > 550
    assert np.allclose(found[300:], np.concatenate([VELOCITY, TURNING]), rtol=0.02)


def recorded_s(number):
    """Of each fifty poses the first four came with the fifth."""
    place = number % 50
    return (number + max(4 - place, 0)) * PERIOD_S
