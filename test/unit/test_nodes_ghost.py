# SPDX-License-Identifier: BSD-3-Clause
"""The markers of a ghost, and the tracks that it follows."""
from __future__ import annotations

import math
from pathlib import Path
from typing import Any, List

import numpy as np
import pytest
from visualization_msgs.msg import Marker

from process_visualizer.cell.xml_parser import XmlParser
from process_visualizer.nodes.ghost.ghost_robot import EXAGGERATION, GhostRobot
from process_visualizer.robot.description import describe_device
from process_visualizer.robot.joints import joint_track
from process_visualizer.robot.kinematics import Kinematics
from process_visualizer.robot.visuals import ShapeKind, link_visuals
from process_visualizer.runs.alignment.alignment import Alignment, AlignmentMethod
from process_visualizer.runs.alignment.time_map import time_map
from process_visualizer.runs.comparison.comparison import Comparison
from process_visualizer.runs.comparison.ghost import ghost_tracks
from process_visualizer.runs.deviation.band import Band
from process_visualizer.runs.run import Channel, ChannelKind, Run

SIMULATED = Path(__file__).parents[2] / 'sewing_cell' / 'devices' / 'simulated.xml'
ARM = '''<robot name="arm">
  <link name="foot"><visual><geometry><box size="0.2 0.3 0.4"/></geometry></visual></link>
  <link name="upper"><visual><origin xyz="0 0 0.5" rpy="0 0 1.5707963"/>
    <geometry><cylinder radius="0.05" length="1.0"/></geometry></visual>
    <visual><geometry><mesh filename="package://a/b.dae" scale="2 2 2"/></geometry></visual></link>
  <link name="tool"><visual><geometry><sphere radius="0.1"/></geometry></visual>
    <visual><geometry><cone/></geometry></visual></link>
  <joint name="turn" type="revolute"><parent link="foot"/><child link="upper"/>
    <axis xyz="1 0 0"/></joint>
  <joint name="hand" type="fixed"><parent link="upper"/><child link="tool"/>
    <origin xyz="0 0 1"/></joint>
</robot>'''
TIMES_S = np.array([0.0, 10.0])


def ghost(there: List[float], here: List[float], tool: str = 'tool') -> GhostRobot:
    return GhostRobot('arm', ARM, tool, joint_track(('turn',), TIMES_S, np.array(there)),
                      joint_track(('turn',), TIMES_S, np.array(here)) if here else None)


def test_shapes_are_those_of_the_model() -> None:
    found = link_visuals(ARM)
    assert [(it.link, it.kind, it.size, it.mesh) for it in found] == [
        ('foot', ShapeKind.BOX, (0.2, 0.3, 0.4), ''),
        ('upper', ShapeKind.CYLINDER, (0.1, 0.1, 1.0), ''),
        ('upper', ShapeKind.MESH, (2.0, 2.0, 2.0), 'package://a/b.dae'),
        ('tool', ShapeKind.SPHERE, (0.2, 0.2, 0.2), '')]
    assert found[1].place.position == (0.0, 0.0, 0.5)
    for text in ('<robot', '<robot><link name="a"><visual><geometry><box size="x"/></geometry>'
                 '</visual></link></robot>'):
        with pytest.raises(ValueError):
            link_visuals(text)


def test_links_are_where_the_joints_put_them() -> None:
    markers = ghost([0.0, math.pi], []).markers(5.0)  # turned by a quarter: it points along -y
    assert [it.type for it in markers] == [Marker.CUBE, Marker.CYLINDER, Marker.MESH_RESOURCE,
                                           Marker.SPHERE]
    assert {it.header.frame_id for it in markers} == {'foot'}
    assert len({(it.ns, it.id) for it in markers}) == 4
    tool = markers[3].pose.position
    assert (tool.x, tool.y, tool.z) == pytest.approx((0.0, -1.0, 0.0), abs=1e-9)
    assert all(0.1 < it.color.a < 0.6 and it.lifetime.to_sec() > 0.3 for it in markers)


def test_the_deviation_points_from_the_ghost_to_the_robot() -> None:
    robot = ghost([0.0, 0.0], [0.01, 0.01])
    found = robot.deviation(5.0)
    assert found is not None
    assert found.vector == pytest.approx((0.0, -math.sin(0.01), math.cos(0.01) - 1.0))
    *_, arrow, text = robot.markers(5.0)
    assert arrow.type == Marker.ARROW
    assert arrow.scale.x == pytest.approx(EXAGGERATION * found.length_m)
    assert text.text == 'Δ 10.0 mm'
    *_, last = ghost([0.0, 0.0], [1e-5, 1e-5]).markers(5.0)  # too little for an arrow
    assert (last.type, last.text) == (Marker.TEXT_VIEW_FACING, 'Δ 0.0 mm')
    assert len(ghost([0.0, 0.0], [1e-5, 1e-5]).markers(5.0)) == 5
    assert len(ghost([0.0, 0.0], [0.01, 0.01], tool='').markers(5.0)) == 4


def test_outside_of_the_runs_nothing_is_drawn() -> None:
    assert ghost([0.0, 0.0], []).markers(11.0) == []
    assert ghost([math.nan, 0.0], []).markers(5.0) == []


def channel(joint: str, times_s: np.ndarray, values: np.ndarray) -> Channel:
    return Channel('ur_rt_upper', f'joint {joint}', 'rad', ChannelKind.JOINT, times_s, values)


def test_a_track_has_the_reference_at_the_times_of_the_run(monkeypatch: Any) -> None:
    cell = XmlParser().parse(str(SIMULATED))
    description = describe_device(cell.device('ur_rt_upper'))
    joints = list(description.joints)
    times_s = np.arange(0.0, 10.0, 0.008)
    names = [joint.rpartition('/')[2] for joint in joints]
    reference = Run('good', 10.0, tuple(
        channel(name, times_s, 0.1 * number + 0.05 * times_s) for number, name in enumerate(names)))
    slow = Run('slow', 20.0, tuple(
        channel(name, 2.0 * times_s, 0.2 + 0.1 * number + 0.05 * times_s)
        for number, name in enumerate(names)), begin_s=100.0)
    maps = time_map(np.array([0.0, 10.0]), np.array([0.0, 20.0]))
    comparison = Comparison(
        slow, Alignment(maps, AlignmentMethod.MOTION, ()), {}, Band({}, 1), (), ()
    )
    track, = ghost_tracks(cell, reference, [comparison])
    assert (track.device, track.tool) == ('ur_rt_upper', 'ur_rt_upper/tool')
    assert track.there.joints == tuple(joints)
    found = track.there.at(110.0)
    assert found is not None
    assert found[joints[2]] == pytest.approx(0.2 + 0.05 * 5.0, abs=1e-6)
    own = joint_track(track.there.joints, track.there.times_s, track.here).at(110.0)
    assert own is not None and own[joints[2]] == pytest.approx(found[joints[2]] + 0.2, abs=1e-6)
    assert track.there.at(99.0) is None and track.there.at(121.0) is None
    assert None not in (track.there.at(100.0), track.there.at(120.0))  # a player may pause there
    arm = Kinematics(description.text)
    assert arm.placement(track.tool, arm.links[0], found) is not None


def test_runs_without_joints_have_no_ghost() -> None:
    cell = XmlParser().parse(str(SIMULATED))
    assert ghost_tracks(cell, Run('good', 10.0, ()), []) == ()
