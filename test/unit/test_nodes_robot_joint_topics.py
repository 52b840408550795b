# SPDX-License-Identifier: BSD-3-Clause
"""A robot whose joints come in parts: on several topics in any order, or on one, one by one."""
from __future__ import annotations

import math
from pathlib import Path
from typing import Callable, Iterator, List, Sequence

import numpy as np
import pytest
from recorded_rows import Row, stamp, write_bag
from robot_stage import RobotStage
from sensor_msgs.msg import JointState
from simulated_player import SimulatedPlayer
from std_msgs.msg import Header

from process_visualizer.cell.xml_parser import XmlParser
from process_visualizer.generate.processor_nodes import robot_parameters
from process_visualizer.parameters.reading import Parameters
from process_visualizer.parameters.robot_parameters import RobotParameters

LENGTH_MS = 6000
NEAR_M_PER_S = 0.004
ARM, LIFT, GRIPPER = '/arm/joints', '/lift/joints', '/gripper/joints'
ALL = '/driver/joints'
JOINTS = {LIFT: ('base_link', 'lift', 'prismatic'), ARM: ('lift', 'arm', 'continuous'),
          GRIPPER: ('tool', 'finger', 'prismatic')}
MODEL = '<robot name="r"><link name="base_link"/><link name="tool"/>' + ''.join(
    f'<link name="{child}"/><joint name="{child}_joint" type="{kind}"><parent link="{parent}"/>'
    f'<child link="{child}"/><axis xyz="0 0 1"/>'
    '<limit lower="-9" upper="9" effort="1" velocity="9"/></joint>'
    for parent, child, kind in JOINTS.values()) + (
    '<joint name="flange" type="fixed"><parent link="arm"/><child link="tool"/>'
    '<origin xyz="0.6 0 0"/></joint></robot>')


def parameters(topics: Sequence[str]) -> dict:  # type: ignore[type-arg]
    return {'base_frame': 'base_link', 'tool_frame': 'tool', 'topics': {
        'joint_states': {'name': topics[0]}, 'more_joint_states': list(topics[1:])}}


def turn(time_s: float) -> float:
    return math.sin(1.5 * time_s)


def height(time_s: float) -> float:
    return 0.2 * math.sin(time_s)


def velocity(time_s: float) -> np.ndarray:
    """Return the tool's velocity [m/s] over a window of 0.2 s."""
    times_s = time_s + np.linspace(-0.1, 0.1, 21)
    places = np.array([(0.6 * math.cos(turn(it)), 0.6 * math.sin(turn(it)), height(it))
                       for it in times_s])
    return np.polyfit(times_s, places, 1)[0]


def rows() -> List[Row]:
    """Return an arm and a lift at 100 Hz, with a gripper at 50 Hz in between.

    Each message is on its own topic, and on the common one.
    """
    found = []
    for topic, step_ms, late_ms, value in ((ARM, 10, 0, turn), (LIFT, 10, 0, height),
                                           (GRIPPER, 20, 5, lambda time_s: 0.01 * time_s)):
        for time_ms in range(late_ms, LENGTH_MS, step_ms):
            found += [Row(name, time_ms, JointState(
                header=Header(stamp=stamp(time_ms)), name=[f'{JOINTS[topic][1]}_joint'],
                position=[value(time_ms / 1000.0)])) for name in (topic, ALL)]
    return found


@pytest.fixture(scope='module')
def bag(tmp_path_factory: pytest.TempPathFactory) -> str:
    return write_bag(tmp_path_factory.mktemp('robot') / 'parts.bag', rows())


class Stand:
    """Robot next to a player."""

    def __init__(self, bag: str, topics: Sequence[str]) -> None:
        self.robot = RobotStage(parameters(topics), model=MODEL)
        for topic in topics:  # in place of joint_proc
            self.robot.node.subscribe(topic, JointState, lambda message: self.robot.send(
                '/r/joint_states', message))
        self.player = SimulatedPlayer(self.robot.node, bag)

    def check(self, command: Callable[[], object]) -> None:
        self.robot.forget()
        command()
        self.robot.node.advance(0.3)
        np.testing.assert_allclose(self.robot.velocity(), velocity(self.player.position_s),
                                   atol=NEAR_M_PER_S)


ORDERS = [(ARM, LIFT, GRIPPER), (GRIPPER, ARM, LIFT), (LIFT, GRIPPER, ARM), (ALL,)]


@pytest.fixture(params=ORDERS, ids=['arm first', 'gripper first', 'lift first', 'one topic'])
def stand(request: pytest.FixtureRequest, bag: str) -> Iterator[Stand]:
    found = Stand(bag, request.param)
    yield found
    found.player.close()


def test_sought_stepped_and_backwards(stand: Stand) -> None:
    for position_s in (1.0, 4.0, 0.5, 2.25):
        stand.check(lambda at_s=position_s: stand.player.seek(at_s))  # type: ignore[misc]
    for direction in (1, -1, -1):
        stand.check(lambda by=direction: stand.player.step(by))  # type: ignore[misc]


@pytest.mark.parametrize('topics', [(ALL,), (ARM, LIFT)], ids=['one topic', 'two topics'])
def test_a_joint_that_is_sent_only_when_it_moves_is_where_it_was(
        tmp_path: Path, topics: Sequence[str]) -> None:
    """Nothing was sent for it for seconds, while the arm moves all the time."""
    seldom = [Row(name, row.time_ms, row.message) for row in rows() for name in (ALL, row.topic)
              if row.topic == ARM or (row.topic == LIFT and row.time_ms in (0, 30))]
    stand = Stand(write_bag(tmp_path / 'seldom.bag', seldom), topics)
    for position_s in (4.0, 1.0, 2.25):
        stand.robot.forget()
        stand.player.seek(position_s)
        stand.robot.node.advance(0.3)
        np.testing.assert_allclose(stand.robot.velocity()[:2], velocity(position_s)[:2],
                                   atol=NEAR_M_PER_S)
    stand.player.play()
    stand.robot.node.advance(1.0)
    stand.robot.forget()
    stand.robot.node.advance(1.0)
    assert len(stand.robot.twists) > 20 and stand.robot.reports('recorded velocity') == []
    stand.player.close()


@pytest.mark.parametrize('rate', [1.0, -1.0])
def test_played(stand: Stand, rate: float) -> None:
    stand.player.seek(3.0)
    stand.player.set_rate(rate)
    stand.player.play()
    stand.robot.node.advance(1.0)
    begin_s = stand.player.position_s
    stand.robot.forget()
    stand.robot.node.advance(1.0)
    speeds = np.linalg.norm(stand.robot.velocities(), axis=1)
    assert len(speeds) > 20
    times_s = np.linspace(begin_s, stand.player.position_s, len(speeds))
    np.testing.assert_allclose(speeds, [np.linalg.norm(velocity(it)) for it in times_s], atol=0.05)


def test_all_topics_of_the_configuration_reach_the_processor(tmp_path: Path) -> None:
    (tmp_path / 'cell.xml').write_text('<visualizer><device type="robot" name="r">' + ''.join(
        f'<topic ns="{ns}" name="joints" type="joint_states" msg="sensor_msgs/JointState"/>'
        for ns in ('gripper', 'arm')) + '</device></visualizer>')
    device = XmlParser().parse(str(tmp_path / 'cell.xml')).device('r')
    written = robot_parameters(device, None)
    read = RobotParameters.read(Parameters(written.to_parameters(), 'robot_proc'), 'r')
    assert (read.joint_states.name, read.more_joint_states) == (GRIPPER, (ARM,))
