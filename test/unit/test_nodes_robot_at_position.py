# SPDX-License-Identifier: BSD-3-Clause
"""A robot's display of a recording is that of the position, whatever the way there."""
from __future__ import annotations

import math
import random
from pathlib import Path
from typing import Callable, Dict, Iterator, List, Mapping, Optional, Tuple

import numpy as np
import pytest
from recorded_rows import BEGIN_S, Row, stamp, write_bag
from robot_stage import RobotStage, array, transform
from sensor_msgs.msg import JointState
from simulated_player import SimulatedPlayer
from std_msgs.msg import Header
from tf2_msgs.msg import TFMessage

from process_visualizer.player.bag_player import HEAD_START_NS
from process_visualizer.robot.measuring_time import measuring_times
from process_visualizer.robot.recorded_velocity import RecordedVelocity, speeds
from process_visualizer.srv import ReadTopicRequest

LENGTH_MS, GAP_MS = 12_000, (8_000, 10_500)
NEAR_M_PER_S = 2e-4  # error of a velocity due to float32 positions
PARAMETERS: Dict[str, Mapping[str, object]] = {
    'n': {'base_frame': 'n/base', 'topics': {'tool_center_frame': {'name': '/n/tcf'}}},
    # the tool's frame from tf, two frames away from the base
    't': {'base_frame': 't/base', 'tool_frame': 't/tool', 'topics': {'tool_center_frame': {
        'name': '/tf', 'msg': 'tf2_msgs/TFMessage', 'frame': 't/tip'}}},
    # a driver that sends its measurements with a delay of 0.1 s
    'l': {'base_frame': 'n/base', 'topics': {'tool_center_frame': {'name': '/n/tcf',
                                                                   'latency': 0.1}}},
    # joints and a model alone
    'j': {'base_frame': 'j/base', 'tool_frame': 'j/tip', 'topics': {'joint_states': {
        'name': '/j/q', 'msg': 'sensor_msgs/JointState'}}},
    # the same arrays in a maker's frame, which is turned by half a turn
    'm': {'base_frame': 'left_base_link', 'tool_frame': 'left_tool', 'link_prefix': 'left_',
          'topics': {'tool_center_frame': {'name': '/n/tcf', 'parent_frame': 'base'}}}}


def place(time_ms: float) -> Tuple[float, float, float]:
    """Return the tool position [m]: it swings, slower and faster."""
    time_s = time_ms / 1000.0
    return -0.6 + 0.02 * time_s, 0.15 * math.sin(2.0 * time_s), 0.2 + 0.05 * math.cos(time_s ** 1.5)


def rows() -> List[Row]:
    """Return poses at 125 Hz except in a gap, some of them late, and transforms at 50 Hz."""
    late = random.Random(3)
    found, free_ms = [], 0
    for time_ms in range(0, LENGTH_MS + 1, 8):
        if not GAP_MS[0] < time_ms < GAP_MS[1]:
            free_ms = max(free_ms, time_ms + (late.randrange(60) if late.random() < 0.03 else 0))
            found.append(Row('/n/tcf', free_ms, array(*place(time_ms), 0.0, 0.0, time_ms / 2000)))
    for time_ms in range(0, LENGTH_MS + 1, 20):
        x, y, _ = place(time_ms)
        found.append(Row('/tf', time_ms + 3, TFMessage([transform(
            't/base', 't/flange', BEGIN_S + time_ms / 1000.0, x, y, time_ms / 1000.0)])))
    return [*found, Row('/tf_static', 0, TFMessage([
        transform('t/flange', 't/tip', BEGIN_S, 0.25, 0.0, 0.0)]))]


class Truth:
    """The launcher's curves of the recording."""

    def __init__(self, recording: List[Row]) -> None:
        poses = sorted((row for row in recording if row.topic == '/n/tcf'),
                       key=lambda row: row.time_ms)
        times_s = measuring_times(np.array([row.time_ms / 1000.0 for row in poses]),
                                  np.full(len(poses), np.nan))
        positions = np.array([row.message.data[:3] for row in poses], np.float32).astype(float)
        self.recorded = RecordedVelocity(times_s, positions)
        self.curve = speeds(times_s, positions)

    def velocity(self, position_s: float) -> Optional[Tuple[float, float, float]]:
        """Return the velocity at a position [s]."""
        return self.recorded.velocity(position_s)


@pytest.fixture(scope='module')
def truth() -> Truth:
    return Truth(rows())


@pytest.fixture(scope='module')
def bag(tmp_path_factory: pytest.TempPathFactory) -> str:
    return write_bag(tmp_path_factory.mktemp('robot') / 'robot.bag', rows())


class Shown:
    """Robot next to a player that is paused at the beginning, and the expected values."""

    def __init__(self, robot: RobotStage, bag: str, truth: Truth) -> None:
        self.robot, self.truth = robot, truth
        self.player = SimulatedPlayer(robot.node, bag)

    def seek(self, position_s: float) -> None:
        """Go to a position and forget everything published before."""
        self.robot.forget()
        self.player.seek(position_s)

    def check(self, position_s: Optional[float] = None, truth: Optional[np.ndarray] = None,
              within_s: float = 0.2) -> None:
        """Assert that the velocity at the position is displayed and published, and remains."""
        self.robot.node.advance(within_s)
        position_s = self.player.position_s if position_s is None else position_s
        wanted = self.truth.velocity(position_s) if truth is None else truth
        self.assert_published(wanted)
        self.robot.forget()
        self.robot.node.advance(1.0)  # nothing else follows
        for velocity in self.robot.velocities():
            np.testing.assert_allclose(velocity, wanted, atol=NEAR_M_PER_S)
        assert self.robot.speed() == pytest.approx(np.linalg.norm(wanted), abs=0.0011)

    def assert_published(self, wanted: object) -> None:
        """Assert the last published values, and that RViz shows their number."""
        assert self.robot.velocity() is not None
        np.testing.assert_allclose(self.robot.velocity(), wanted, atol=NEAR_M_PER_S)
        assert self.robot.speed() == pytest.approx(np.linalg.norm(wanted), abs=0.0011)


@pytest.fixture
def stage(bag: str, truth: Truth) -> Iterator[Callable[..., Shown]]:
    """Return a function that sets up a robot next to a player."""
    opened: List[Shown] = []

    def make(name: str = 'n', model: str = '', played: str = bag) -> Shown:
        opened.append(Shown(RobotStage(PARAMETERS[name], name, model), played, truth))
        return opened[-1]
    yield make
    for shown in opened:
        shown.player.close()


@pytest.fixture
def shown(stage: Callable[..., Shown]) -> Shown:
    return stage()


def test_after_a_seek(shown: Shown) -> None:
    for position_s in (4.0, 7.9, 0.0, 11.95, 0.02, 4.0, 5.5, 12.0):
        shown.seek(position_s)
        shown.check(position_s)


def test_after_single_steps_in_both_directions(shown: Shown) -> None:
    shown.seek(3.0)
    for count in (1, 1, 1, -1, -1, 5, -40, 250, -1):
        shown.player.step(count, '/n/tcf')
        shown.check()
    for duration_s in (0.1, -0.3, 2.0):
        shown.player.step(0, duration_s=duration_s)
        shown.check()


@pytest.mark.parametrize('rate, begin_s', [(1.0, 1.0), (-1.0, 7.5), (4.0, 0.5), (0.25, 3.0)])
def test_when_it_is_paused_while_it_plays(shown: Shown, rate: float, begin_s: float) -> None:
    shown.seek(begin_s)
    shown.player.play(rate)
    shown.robot.node.advance(HEAD_START_NS * 1e-9 + 0.4321 / abs(rate))
    shown.player.pause()
    assert shown.player.position_s == pytest.approx(begin_s + math.copysign(0.4321, rate))
    shown.check()


def test_scrubbing_leaves_the_velocity_of_the_last_position(shown: Shown) -> None:
    for position_s in np.linspace(1.0, 6.0, 60):
        shown.player.seek(position_s)
        shown.robot.node.advance(0.01)
    shown.check(6.0)


@pytest.mark.parametrize('rate, begin_s', [(1.0, 1.0), (-1.0, 7.5), (4.0, 0.5), (8.0, 0.0)])
def test_while_it_plays_each_velocity_is_the_one_of_its_stamp(
        shown: Shown, rate: float, begin_s: float) -> None:
    shown.seek(begin_s)
    shown.player.play(rate)
    robot, player = shown.robot, shown.player
    robot.node.advance(0.3 / abs(rate))
    robot.forget()
    robot.node.advance(2.0 / abs(rate))
    now_s, position_s = robot.node.now_s, player.position_s
    errors = []
    for message in robot.twists:
        wanted = shown.truth.velocity(position_s - rate * (now_s - message.header.stamp.to_sec()))
        linear = message.twist.linear
        errors.append(np.abs(np.subtract([linear.x, linear.y, linear.z], wanted)).max())
    assert len(errors) > 200
    # For late poses it matters slightly which others are known.
    assert np.median(errors) < 1e-6 and max(errors) < 2 * NEAR_M_PER_S


def test_it_is_the_curve_of_the_launcher(shown: Shown) -> None:
    times_s, curve = shown.truth.curve
    for position_s in (0.5, 2.2, 6.6, 11.0):
        shown.seek(position_s)
        shown.robot.node.advance(0.2)
        assert np.linalg.norm(shown.robot.velocity()) == pytest.approx(
            np.interp(position_s, times_s, curve), abs=1e-3)


def test_where_poses_are_missing_no_velocity_is_shown(shown: Shown) -> None:
    shown.seek(4.0)
    shown.check(4.0)
    shown.seek(8.4)
    shown.robot.node.advance(0.5)
    assert shown.robot.speed() is None
    assert not shown.robot.twists
    shown.seek(9.5)
    shown.robot.node.advance(0.5)
    assert shown.robot.text() == 'v no data for 1.5 s'
    shown.seek(11.0)
    shown.check(11.0)


def test_a_subscriber_that_comes_later_gets_it(shown: Shown) -> None:
    shown.seek(5.0)
    shown.check(5.0)
    shown.robot.forget()
    shown.player.repeat()
    shown.robot.node.advance(0.2)
    shown.assert_published(shown.truth.velocity(5.0))


def test_another_recording_is_another_one(shown: Shown, tmp_path: Path) -> None:
    shown.seek(4.0)
    shown.check(4.0)
    shown.player.close()
    still = write_bag(tmp_path / 'still.bag', [
        Row('/n/tcf', time_ms, array(0.1, 0.2, 0.3, 0.0, 0.0, 0.0))
        for time_ms in range(0, 6000, 8)])
    shown.player = SimulatedPlayer(shown.robot.node, still)
    shown.seek(4.0)
    shown.check(4.0, np.zeros(3))


def test_a_robot_processor_that_is_restarted_while_paused(shown: Shown) -> None:
    shown.seek(6.0)
    shown.check(6.0)
    shown.robot = RobotStage(PARAMETERS['n'], 'n', node=shown.robot.node)
    shown.robot.forget()
    shown.player.repeat()
    shown.check(6.0)


def test_a_tool_on_tf(stage: Callable[..., Shown]) -> None:
    shown = stage('t')
    for position_s in (4.0, 11.0, 0.5):
        shown.seek(position_s)
        shown.robot.node.advance(0.2)
        before, after = (np.array(place(1000 * (position_s + by))) for by in (-0.05, 0.05))
        np.testing.assert_allclose(shown.robot.velocity()[:2], (after - before)[:2] / 0.1,
                                   atol=0.005)


SLIDE = '''<robot name="j"><link name="j/base"/><link name="j/tip"/>
<joint name="reach" type="prismatic"><parent link="j/base"/><child link="j/tip"/>
<axis xyz="1 0 0"/><limit lower="-1" upper="1" effort="1" velocity="9"/></joint></robot>'''


def test_a_tool_by_joints_alone_has_the_velocity_of_its_curve(
        stage: Callable[..., Shown], tmp_path: Path) -> None:
    times_s = np.arange(0.0, 12.0, 0.008)
    reach_m = 0.3 * np.sin(4.0 * times_s)
    played = write_bag(tmp_path / 'joints.bag', [
        Row('/j/q', round(1000 * time_s), JointState(
            Header(stamp=stamp(1000 * time_s)), ['reach'], [x_m], [], []))
        for time_s, x_m in zip(times_s.tolist(), reach_m.tolist())])
    shown = stage('j', SLIDE, played)
    curve = RecordedVelocity(times_s, np.outer(reach_m, (1.0, 0.0, 0.0)))
    for position_s in (4.0, 11.0, 0.5):
        shown.seek(position_s)
        shown.robot.node.advance(0.2)
        np.testing.assert_allclose(shown.robot.velocity(), curve.velocity(position_s),
                                   atol=NEAR_M_PER_S)


def test_a_driver_with_a_latency(stage: Callable[..., Shown]) -> None:
    shown = stage('l')
    for position_s in (4.0, 11.0, 0.5):
        shown.seek(position_s)
        shown.check(position_s, shown.truth.velocity(position_s + 0.1))


def test_poses_in_the_frame_of_the_maker(stage: Callable[..., Shown]) -> None:
    shown = stage('m', 'maker_robot.urdf')
    for position_s in (4.0, 11.0, 0.5):
        shown.seek(position_s)
        shown.check(position_s, np.multiply(shown.truth.velocity(position_s), (-1, -1, 1)))


def test_data_is_not_stale_while_playback_is_paused_but_once_the_player_is_gone(
        shown: Shown) -> None:
    shown.seek(2.0)
    shown.player.play()
    shown.robot.node.advance(2.0)
    shown.player.pause()
    shown.robot.node.advance(10.0)
    shown.check()
    shown.player.close()
    shown.robot.node.advance(2.0)
    assert shown.robot.text().startswith('v no data for ')


def test_what_comes_before_the_player_has_told_its_position_is_not_shown(shown: Shown) -> None:
    """Messages after a seek may arrive before the state that contains the position."""
    shown.seek(4.0)
    shown.check(4.0)
    shown.robot.forget()
    shown.robot.send('/n/tcf', array(*place(7000.0), 0.0, 0.0, 0.0))
    assert not shown.robot.twists
    assert not shown.robot.arrays


def test_while_the_recording_is_read_nothing_is_drawn_and_then_no_old_number(
        shown: Shown) -> None:
    shown.seek(4.0)
    shown.check(4.0)
    del shown.robot.node.offered['/bag_player/read']
    shown.seek(11.9)
    shown.robot.node.advance(0.04)
    assert not shown.robot.arrays  # only for a moment
    shown.robot.node.advance(0.3)
    assert not shown.robot.twists
    assert shown.robot.text() == ''


def test_a_static_transform_that_comes_later_gives_poses_their_meaning(
        stage: Callable[..., Shown], tmp_path: Path) -> None:
    shown = stage('t', played=write_bag(tmp_path / 'tf.bag', [
        row for row in rows() if row.topic == '/tf']))
    shown.seek(4.0)
    shown.robot.node.advance(0.5)
    assert not shown.robot.twists
    shown.robot.send('/tf_static', TFMessage([transform('t/flange', 't/tip', 0.0, 0.25, 0.0, 0.0)]))
    shown.robot.node.advance(3.0)  # the player repeats the scene
    before, after = (np.array(place(1000 * (4.0 + by))) for by in (-0.05, 0.05))
    np.testing.assert_allclose(shown.robot.velocity()[:2], (after - before)[:2] / 0.1, atol=0.005)


def test_what_does_not_fit_into_an_answer_is_asked_for_again(shown: Shown) -> None:
    offered = shown.robot.node.offered
    service = offered['/bag_player/read']
    offered['/bag_player/read'] = lambda request: service(ReadTopicRequest(
        request.topic, request.begin, min(request.end, request.begin + 0.03)))
    for position_s in (4.0, 7.0):
        shown.seek(position_s)
        shown.check(position_s)


def test_a_player_that_does_not_answer_is_named_now_and_then(shown: Shown) -> None:
    node = shown.robot.node
    service = node.offered.pop('/bag_player/read')
    shown.player.seek(4.0)
    node.advance(0.5)
    assert node.log == []  # it may just have ended
    node.advance(4.0)
    assert len(shown.robot.warnings('/n/tcf: its recorded velocities are not known')) == 1
    node.advance(8.0)
    assert len(shown.robot.warnings('/n/tcf: its recorded velocities are not known')) == 2
    node.offered['/bag_player/read'] = service
    shown.seek(5.0)
    node.advance(20.0)
    shown.check(5.0)
    del node.offered['/bag_player/read'], node.log[:]
    shown.player.seek(11.9)
    node.advance(0.5)
    assert node.log == []  # again, it may just have ended
