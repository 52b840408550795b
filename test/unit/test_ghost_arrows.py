# SPDX-License-Identifier: BSD-3-Clause
"""The reference arrows have the position and length of the run's own arrows."""
from __future__ import annotations

import math
from pathlib import Path
from typing import Dict, List, Sequence

import numpy as np
import pytest

from process_visualizer.cell.model import Cell
from process_visualizer.cell.xml_parser import XmlParser
from process_visualizer.nodes.ghost.ghost_robot import BESIDE_M, GhostRobot
from process_visualizer.nodes.ghost.ghost_robot import GhostArrow as DrawnArrow
from process_visualizer.robot.arrows import FORCE_ARROW, VELOCITY_ARROW
from process_visualizer.robot.description import describe_device
from process_visualizer.robot.joints import joint_track
from process_visualizer.robot.kinematics import Kinematics
from process_visualizer.robot.rotations import (
    matrix_from_quaternion,
    quaternion_from_ypr,
    rotated,
)
from process_visualizer.runs.alignment.alignment import Alignment, AlignmentMethod
from process_visualizer.runs.alignment.time_map import time_map
from process_visualizer.runs.comparison.comparison import Comparison
from process_visualizer.runs.comparison.ghost import ReferenceArrow, ghost_arrows
from process_visualizer.runs.deviation.band import Band
from process_visualizer.runs.run import Channel, ChannelKind, Run, ToolForce, ToolMotion

ROBOT = 'ur_rt_upper'
TIMES_S = np.arange(0.0, 10.0, 0.01)
VELOCITY = np.array([0.03, -0.04, 0.0])  # m/s, in the global frame


def comparison(speed: float = 2.0, begin_s: float = 100.0) -> Comparison:
    """A run that takes twice as long, and begins 100 s after its recording."""
    run = Run('slow', 10.0 * speed, (), begin_s=begin_s)
    maps = time_map(np.array([0.0, 10.0]), np.array([0.0, 10.0 * speed]))
    return Comparison(run, Alignment(maps, AlignmentMethod.MOTION, ()), {}, Band({}, 1), (), ())


def reference(frame: str = '', force: Sequence[float] = (0.0, 3.0, 4.0)) -> Run:
    feed = Channel('machine', 'feed', '', ChannelKind.VARIABLE, TIMES_S, 1.0 + 0.1 * TIMES_S)
    return Run('good', 10.0, (feed,),
               (ToolMotion(ROBOT, TIMES_S, TIMES_S[:, np.newaxis] * VELOCITY),),
               forces=(ToolForce(ROBOT, frame, TIMES_S, np.tile(force, (len(TIMES_S), 1))),))


def simulated() -> Cell:
    return XmlParser().parse(str(Path(__file__).parents[2] / 'sewing_cell' / 'devices'
                                 / 'simulated.xml'))


def found_arrows(cell: Cell, run: Run) -> Dict[str, ReferenceArrow]:
    return {it.name: it for it in ghost_arrows(cell, run, [comparison()])}


def drawn(
    cell: Cell, arrow: ReferenceArrow, joints: List[float]
) -> 'tuple[np.ndarray, np.ndarray]':
    """Foot and vector in the robot's root, for an arm at rest."""
    description = describe_device(cell.device(ROBOT))
    assert description is not None
    track = joint_track(tuple(description.joints), np.array([0.0, 200.0]), np.array(2 * joints))
    robot = GhostRobot(ROBOT, description.text, '', track, None)
    marker = DrawnArrow(arrow.name, arrow.frame, arrow.foot_frame, arrow.foot, joint_track(
        ('x', 'y', 'z'), arrow.times_s, arrow.vectors)).marker([robot], 110.0)
    assert marker is not None and marker.header.frame_id == robot.root
    place, turn = marker.pose.position, marker.pose.orientation
    return (np.array([place.x, place.y, place.z]), marker.scale.x * np.array(
        rotated((turn.x, turn.y, turn.z, turn.w), (1.0, 0.0, 0.0))))


JOINTS = [0.4, -1.2, 1.1, -0.7, 0.9, 0.2]


def test_the_velocity_is_drawn_at_the_tool() -> None:
    cell = simulated()
    arrow = found_arrows(cell, reference())[f'{ROBOT}/velocity']
    foot, vector = drawn(cell, arrow, JOINTS)
    base = cell.device(ROBOT).base
    assert base is not None
    assert arrow.frame == base.frame
    turn = matrix_from_quaternion(quaternion_from_ypr(base.pose.ypr))
    np.testing.assert_allclose(turn @ vector, VELOCITY * VELOCITY_ARROW.scale_m, atol=1e-6)
    description = describe_device(cell.device(ROBOT))
    assert description is not None
    arm = Kinematics(description.text)
    tool = arm.placement(f'{ROBOT}/tool', arrow.frame, dict(zip(description.joints, JOINTS)))
    assert tool is not None
    assert math.dist(tool.position, foot) == pytest.approx(BESIDE_M)
    assert np.dot(foot - tool.position, vector) == pytest.approx(0.0, abs=1e-9)


def test_a_force_is_drawn_in_the_frame_of_its_sensor() -> None:
    cell = simulated()
    arrow = found_arrows(cell, reference())[f'{ROBOT}/force']
    _, vector = drawn(cell, arrow, JOINTS)
    description = describe_device(cell.device(ROBOT))
    assert description is not None
    arm = Kinematics(description.text)
    tool = arm.placement(f'{ROBOT}/tool', arm.links[0], dict(zip(description.joints, JOINTS)))
    assert tool is not None
    wanted = matrix_from_quaternion(tool.quaternion) @ (3.0, 0.0, 4.0)  # yaw of -90 degrees
    np.testing.assert_allclose(vector, wanted * FORCE_ARROW.scale_m, atol=1e-5)


def test_a_force_along_the_axes_of_the_base_is_drawn_there_and_at_the_tool() -> None:
    cell = simulated()
    foot, vector = drawn(cell, found_arrows(cell, reference('link0'))[f'{ROBOT}/force'], JOINTS)
    np.testing.assert_allclose(vector, np.array([0.0, 3.0, 4.0]) * FORCE_ARROW.scale_m, atol=1e-6)
    other, _ = drawn(cell, found_arrows(cell, reference())[f'{ROBOT}/velocity'], JOINTS)
    assert math.dist(foot, other) <= 2.0 * BESIDE_M


def test_what_is_too_small_to_be_drawn_has_no_arrow() -> None:
    run = reference(force=(0.0, 0.0, 0.9 * FORCE_ARROW.threshold))
    arrow = found_arrows(simulated(), run)[f'{ROBOT}/force']
    assert np.isnan(arrow.vectors).all()
    gone = found_arrows(simulated(), reference(force=(math.nan, 0.0, 1.0)))[f'{ROBOT}/force']
    assert np.isnan(gone.vectors).all()


def test_a_variable_is_drawn_in_its_frame_in_step_with_the_run(tmp_path: Path) -> None:
    config = tmp_path / 'cell.xml'
    config.write_text('''<visualizer><device type="other" name="machine">
      <topic name="feed"/><topic name="heat"/>
      <variable topic="feed" frame="table" axis="0 -2 0" scale="3" offset="1" label="feed"/>
      <variable topic="heat" frame="table" axis="y" label="heat"/></device></visualizer>''',
                      encoding='utf-8')
    arrow = found_arrows(XmlParser().parse(str(config)), reference())['machine/feed']
    assert (arrow.frame, arrow.foot_frame) == ('table', 'table')
    track = joint_track(('x', 'y', 'z'), arrow.times_s, arrow.vectors)
    at = track.at(110.0)  # 5 s of the reference
    assert at is not None and at['y'] == pytest.approx(-3.0 * 0.5) and at['x'] == 0.0
    assert track.at(99.0) is None and track.at(119.99) is None
    assert abs(arrow.foot[0]) > 0.01  # next to the other variable's arrow
    marker = DrawnArrow(arrow.name, arrow.frame, arrow.foot_frame, arrow.foot, track).marker([],
                                                                                             110.0)
    assert marker is not None and marker.header.frame_id == 'table'


def test_without_a_run_there_are_no_arrows() -> None:
    assert ghost_arrows(simulated(), reference(), []) == ()
