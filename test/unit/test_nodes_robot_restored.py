# SPDX-License-Identifier: BSD-3-Clause
"""The robot's pose at the time of the clouds that are shown at a position of a recording."""
from __future__ import annotations

import itertools
import math
import random
from pathlib import Path
from typing import Any, Dict, Iterator, List, Optional, Tuple

import pytest
import simulated_player
from recorded_rows import Row, stamp, write_bag
from robot_stage import RobotStage
from sensor_msgs.msg import JointState, PointCloud2
from simulated_node import SimulatedNode
from std_msgs.msg import Header

from process_visualizer.player.bag_player import REPEAT_S
from process_visualizer.ros_names import RESTORED_TF_TOPIC

LENGTH_MS = 6000
FAR, NEAR, ANOTHER_CLOCK = '/far/points', '/near/points', '/foreign/points'
CLOUDS = {FAR: (100, 200, 61), NEAR: (101, 143, 5), ANOTHER_CLOCK: (77, 500, 5_000)}
"""By topic: the first, the period, and the age of a cloud, by its stamp, when recorded [ms]."""
MODEL = '<robot name="r"><link name="base_link"/><link name="arm"/><link name="finger"/>' + ''.join(
    f'<joint name="{child}_joint" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
    '<axis xyz="0 0 1"/><limit lower="-9" upper="9" effort="1" velocity="9"/></joint>'
    for parent, child, kind in (('base_link', 'arm', 'continuous'),
                                ('arm', 'finger', 'prismatic'))) + '</robot>'
PARAMETERS = {'base_frame': 'base_link', 'tool_frame': 'finger', 'topics': {
    'joint_states': {'name': '/arm/joints'}, 'more_joint_states': ['/gripper/joints']}}
OPENED_MS = 2000
"""Time of the gripper's opening; it reported once, before the first cloud, that it is shut."""


def turn(time_s: float) -> float:
    """Return the arm's angle [rad], which passes several full turns."""
    return 2.0 * time_s + 0.5 * math.sin(3.0 * time_s)


def opening(time_s: float) -> float:
    """Return the gripper's opening [m]."""
    return 0.05 if time_s * 1000.0 >= OPENED_MS else 0.0


def joints(time_ms: int, name: str, position: float) -> JointState:
    """Return a driver's message."""
    return JointState(Header(stamp=stamp(time_ms)), [name], [position], [], [])


def rows() -> List[Row]:
    """Return an arm at 50 Hz, late and within one turn, and a gripper that only sends changes."""
    found = [Row('/gripper/joints', 0, joints(0, 'finger_joint', 0.0)),
             Row('/gripper/joints', OPENED_MS, joints(OPENED_MS, 'finger_joint', 0.05))]
    for time_ms in range(0, LENGTH_MS + 1, 20):
        told = math.remainder(turn(time_ms / 1000.0), 2.0 * math.pi)
        found.append(Row('/arm/joints', time_ms + 30, joints(time_ms, 'arm_joint', told)))
    for topic, (first_ms, period_ms, age_ms) in CLOUDS.items():
        for time_ms in range(first_ms, LENGTH_MS, period_ms):
            cloud = PointCloud2(header=Header(stamp=stamp(time_ms - age_ms), frame_id='camera'))
            found.append(Row(topic, time_ms, cloud))
    return found


@pytest.fixture(scope='module')
def bag(tmp_path_factory: pytest.TempPathFactory) -> str:
    return write_bag(tmp_path_factory.mktemp('restored') / 'robot.bag', rows())


class Cell:
    """Robot next to a player, with a comparison of its clouds and its poses."""

    def __init__(self, bag: str, params: Optional[Dict[str, Any]] = None) -> None:
        self.robot = RobotStage(PARAMETERS, 'r', MODEL, SimulatedNode('/r/robot_proc', params))
        self.player = simulated_player.SimulatedPlayer(self.robot.node, bag)

    def places(self) -> Dict[int, Tuple[float, float]]:
        """Return the arm's angle and the gripper's opening, by the stamps [ns] of their poses."""
        found: Dict[int, Dict[str, float]] = {}
        for message in self.robot.node.sent(RESTORED_TF_TOPIC):
            for it in message.transforms:
                turned = it.transform.rotation
                found.setdefault(it.header.stamp.to_nsec(), {})[it.child_frame_id] = \
                    2.0 * math.atan2(turned.z, turned.w) if it.child_frame_id == 'arm' \
                    else it.transform.translation.z
        return {stamp_ns: (it['arm'], it['finger']) for stamp_ns, it in found.items()}

    def come(self, wait_s: float = 0.05) -> None:
        """Let everything arrive."""
        self.robot.node.advance(wait_s)

    def clouds(self) -> Dict[str, int]:
        """Return the stamps [ns] of the last cloud of each topic."""
        return {topic: PointCloud2().deserialize(self.player.of(topic)[-1]).header.stamp.to_nsec()
                for topic in CLOUDS if self.player.of(topic)}

    def check(self) -> None:
        """Assert the robot's pose at the time of each displayed cloud."""
        places, position_ms = self.places(), self.player.position_s * 1000.0
        for topic, stamp_ns in self.clouds().items():
            first_ms, period_ms, age_ms = CLOUDS[topic]
            number = max(math.floor((position_ms - first_ms) / period_ms + 1e-6), 0)
            came_ms = first_ms + number * period_ms
            taken_s = (came_ms - (age_ms if topic != ANOTHER_CLOCK else 0)) / 1000.0
            angle, opened = places[stamp_ns]
            assert abs(math.remainder(angle - turn(taken_s), 2.0 * math.pi)) < 0.002
            assert opened == pytest.approx(opening(taken_s), abs=0.001)


@pytest.fixture(autouse=True)
def time_that_passes_while_messages_are_stamped(monkeypatch: pytest.MonkeyPatch) -> None:
    ticks, wall_ns = itertools.count(), simulated_player._Turns.wall_ns
    monkeypatch.setattr(simulated_player._Turns, 'wall_ns',
                        lambda turns: wall_ns(turns) + 1000 * next(ticks))


@pytest.fixture
def cell(bag: str) -> Iterator[Cell]:
    opened = Cell(bag)
    yield opened
    opened.player.close()


def test_after_seeks_while_paused(cell: Cell) -> None:
    chosen = random.Random(5)
    for _ in range(60):
        position_s = round(chosen.uniform(0.2, LENGTH_MS / 1000.0), 3)
        cell.player.seek(position_s)
        cell.come()
        cell.check()


def test_after_steps_in_both_directions(cell: Cell) -> None:
    cell.player.seek(3.0)
    for count in (1, 1, 1, -1, -1, 3):
        cell.player.step(count, FAR)
        cell.come()
        cell.check()
    for duration_s in (0.1, -0.3, 0.5):
        cell.player.step(0, duration_s=duration_s)
        cell.come()
        cell.check()


@pytest.mark.parametrize('rate', [1.0, -1.0, 2.0])
def test_when_it_is_paused_while_it_plays(cell: Cell, rate: float) -> None:
    cell.player.seek(4.0)
    cell.player.play(rate)
    cell.robot.node.advance(0.777)
    cell.player.pause()
    cell.robot.node.advance(0.3)
    cell.check()


def test_when_the_scene_is_repeated(cell: Cell) -> None:
    cell.player.seek(3.3)
    for _ in range(3):
        cell.robot.forget()
        cell.player.received.clear()
        cell.robot.node.advance(REPEAT_S + 0.6)
        cell.check()


def test_the_robot_itself_stands_at_the_position(cell: Cell) -> None:
    cell.player.seek(3.3)
    cell.player.received.clear()
    cell.robot.node.advance(0.2)
    told = [JointState().deserialize(it) for it in cell.player.of('/arm/joints')]
    assert {round(math.remainder(it.position[0] - turn(3.26), 2.0 * math.pi), 9)
            for it in told} == {0.0}


def test_latencies_that_are_known_count(bag: str) -> None:
    shown = Cell(bag, {'/r/joint_proc/latencies': [0.1, 0.0]})
    shown.robot.forget()
    shown.player.seek(3.3)
    shown.come()
    angle, _ = shown.places()[shown.clouds()[FAR]]
    assert abs(math.remainder(angle - turn(3.339), 2.0 * math.pi)) < 0.002
    shown.player.close()


def test_without_subscribers_nothing_is_read(cell: Cell) -> None:
    cell.robot.node.publishers[RESTORED_TF_TOPIC].connections = 0
    cell.robot.forget()
    cell.player.seek(3.3)
    cell.come()
    assert cell.places() == {}


def test_a_stamp_says_when_it_was_measured(cell: Cell) -> None:
    cell.player.seek(3.3)
    cell.come()
    told = {it.stamp.to_nsec(): (it.recorded - stamp(0)).to_sec()
            for it in cell.player.state.restored}
    clouds = cell.clouds()
    assert [round(told[clouds[topic]], 3) for topic in CLOUDS] == [3.239, 3.242, 3.077]


def test_a_joint_that_was_not_recorded_is_where_it_is_now(tmp_path: Path) -> None:
    cell = Cell(write_bag(tmp_path / 'arm.bag', [
        it for it in rows() if it.topic != '/gripper/joints']))
    cell.robot.send('/r/joint_states', JointState(name=['finger_joint'], position=[0.02]))
    cell.robot.forget()
    cell.player.seek(3.3)
    cell.come()
    assert {opened for _, opened in cell.places().values()} == {0.02}
    cell.player.close()
