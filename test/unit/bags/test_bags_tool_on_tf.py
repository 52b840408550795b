# SPDX-License-Identifier: BSD-3-Clause
"""A tool's speed from tf: model and joints supply the frames that the recording lacks."""
from __future__ import annotations

import math
from pathlib import Path
from typing import Any, Callable, List, Sequence

import numpy as np
import pytest
import rosbag
from genpy import Time
from geometry_msgs.msg import TransformStamped
from sensor_msgs.msg import JointState
from std_msgs.msg import Float32MultiArray, Header
from tf2_msgs.msg import TFMessage

from process_visualizer.cell.model import Device
from process_visualizer.cell.xml_parser import XmlParser
from process_visualizer.curves import curves as curves_module
from process_visualizer.curves.curves import Curve, read_curves
from process_visualizer.curves.position_values import PositionValues

BEGIN_S = 1_600_000_000
NEAR = 0.01  # relative error of the slope over 0.2 s on a circle
SECONDS, TURN_RAD_PER_S = 4.0, 2.0
MODEL = """<robot name="r">
  <link name="root"/><link name="base"/><link name="arm"/><link name="flange"/><link name="tool"/>
  <joint name="f" type="fixed"><parent link="root"/><child link="base"/>
    <origin xyz="0 0 0.5" rpy="0 0 3.14159265"/></joint>
  <joint name="j" type="KIND"><parent link="root"/><child link="arm"/><axis xyz="0 0 1"/>
    <limit lower="-9" upper="9" effort="1" velocity="9"/></joint>
  <joint name="g" type="fixed"><parent link="arm"/><child link="flange"/>
    <origin xyz="0.3 0 0" rpy="0 1 0"/></joint>
  <joint name="h" type="fixed"><parent link="flange"/><child link="tool"/></joint>
</robot>"""
CELL = """<visualizer><device type="robot" name="r">
  <model path="robot.urdf"/><base frame="root"/>
  <topic name="joints" type="joint_states"/>
  <topic name="tf" type="tool_center_frame" msg="tf2_msgs/TFMessage" frame="FRAME"/>
</device></visualizer>"""


class Row:
    """A message that was recorded."""

    def __init__(self, topic: str, time_s: float, message: Any, late_s: float = 0.003) -> None:
        self.topic, self.message, self.time_s = topic, message, time_s + late_s
        for part in getattr(message, 'transforms', [message]):
            if hasattr(part, 'header'):
                part.header.stamp = stamp(time_s)


def stamp(time_s: float) -> Time:
    return Time(*divmod(BEGIN_S * 10 ** 9 + round(time_s * 1e9), 10 ** 9))


def sent(parent: str, child: str, x: float = 0.0, y: float = 0.0, turn: float = 0.0) -> Any:
    transform = TransformStamped(header=Header(frame_id=parent), child_frame_id=child)
    transform.transform.translation.x, transform.transform.translation.y = x, y
    transform.transform.rotation.z, transform.transform.rotation.w = (math.sin(turn / 2),
                                                                      math.cos(turn / 2))
    return transform


def times(rate_hz: float) -> List[float]:
    return [number / rate_hz for number in range(int(SECONDS * rate_hz))]


@pytest.fixture
def cell(tmp_path: Path) -> Callable[..., Sequence[Device]]:
    """Parses the cell, in which the tool is a frame."""
    def parse(frame: str, kind: str = 'revolute') -> Sequence[Device]:
        (tmp_path / 'robot.urdf').write_text(MODEL.replace('KIND', kind))
        path = tmp_path / 'cell.xml'
        path.write_text(CELL.replace('FRAME', frame))
        return XmlParser().parse(str(path)).devices
    return parse


def curves(path: Path, devices: Sequence[Device], rows: Sequence[Row]) -> Sequence[Curve]:
    with rosbag.Bag(str(path), 'w', chunk_threshold=20_000) as bag:
        for row in sorted(rows, key=lambda it: it.time_s):
            bag.write(row.topic, row.message, stamp(row.time_s))
    return read_curves([str(path)], devices, columns=40)


def assert_speed(path: Path, devices: Sequence[Device], rows: Sequence[Row],
                 speed: float) -> None:
    """Assert that the curve, and the value at each position, have this speed [m/s]."""
    (curve,) = curves(path, devices, rows)
    assert curve.high[3:-3] == pytest.approx(speed, rel=NEAR)
    assert curve.low[3:-3] == pytest.approx(speed, rel=NEAR)
    values = PositionValues([str(path)], devices)
    for position_s in (0.5, 1.234, 3.0):
        assert list(values.at(position_s).values()) == [pytest.approx(speed, rel=NEAR)]
    values.close()


def test_a_fixed_link_of_the_model_lies_between(tmp_path: Path, cell: Any) -> None:
    """As with ur_robot_driver: base next to base_link, and only the tool's pose relative to it."""
    rows = [Row('/tf', time_s, TFMessage([sent('base', 'controller', 0.2 * time_s)]))
            for time_s in times(125)]
    assert_speed(tmp_path / 'a.bag', cell('controller'), rows, 0.2)


@pytest.mark.parametrize('rate_hz', [125.0, 41.0])
def test_joints_move_the_links_between(tmp_path: Path, cell: Any, rate_hz: float) -> None:
    """As with franka_control: fixed frames after the last link; the joints are sent separately.

    The tool is 0.3 m plus another 0.1 m ahead of the axis.
    """
    rows = [Row('/tf', time_s, TFMessage([sent('flange', 'hand'), sent('hand', 'tip', 0.0, 0.4)]))
            for time_s in times(30)]
    rows += [Row('/joints', time_s, JointState(name=['other', 'j'],
                                               position=[5.0, TURN_RAD_PER_S * time_s]))
             for time_s in times(rate_hz)]
    assert_speed(tmp_path / 'a.bag', cell('tip'), rows, TURN_RAD_PER_S * 0.5)


def test_joints_of_an_array_that_go_round(tmp_path: Path, cell: Any) -> None:
    rows = [Row('/tf', time_s, TFMessage([sent('flange', 'tip')])) for time_s in times(30)]
    rows += [Row('/joints', time_s, Float32MultiArray(data=[
        (TURN_RAD_PER_S * time_s + math.pi) % (2 * math.pi) - math.pi])) for time_s in times(125)]
    assert_speed(tmp_path / 'a.bag', cell('tip', 'continuous'), rows, TURN_RAD_PER_S * 0.3)


def test_several_recorded_frames(tmp_path: Path, cell: Any) -> None:
    """The recording has all links, from two nodes with different rates and one static transform."""
    rows = [Row('/tf_static', 0.0, TFMessage([sent('turner', 'end', 0.5)]))]
    rows += [Row('/tf', time_s, TFMessage([sent('root', 'arm', 0.0, 0.0, 1.0 * time_s)]))
             for time_s in times(50)]
    rows += [Row('/tf', time_s, TFMessage([sent('arm', 'turner', 0.0, 0.0, 1.5 * time_s)]))
             for time_s in times(125)]
    assert_speed(tmp_path / 'a.bag', cell('end'), rows, 2.5 * 0.5)


def joints_only(tmp_path: Path, tool: str) -> Sequence[Device]:
    """A cell whose driver sends no tool pose."""
    (tmp_path / 'robot.urdf').write_text(MODEL.replace('KIND', 'revolute'))
    path = tmp_path / 'joints_only.xml'
    path.write_text(f"""<visualizer><device type="robot" name="r">
        <model path="robot.urdf"/><base frame="root"/>{tool}
        <topic name="joints" type="joint_states"/></device></visualizer>""")
    return XmlParser().parse(str(path)).devices


@pytest.mark.parametrize('tool', ['', '<tool frame="flange" xyz="0 0.4 0"/>'])
def test_a_driver_sends_joints_only(tmp_path: Path, tool: str) -> None:
    """As most drivers do: model and joints give the tool pose, also if joints come separately."""
    rows = [Row('/joints', time_s, JointState(name=[name], position=[position]))
            for time_s in times(100)
            for name, position in (('other', 5.0), ('j', TURN_RAD_PER_S * time_s))]
    assert_speed(tmp_path / 'a.bag', joints_only(tmp_path, tool), rows,
                 TURN_RAD_PER_S * (0.5 if tool else 0.3))


def test_arrays_of_joints_are_not_taken_for_poses(tmp_path: Path) -> None:
    devices = joints_only(tmp_path, '<tool frame="nowhere"/>')
    rows = [Row('/joints', time_s, Float32MultiArray(data=[time_s] * 6)) for time_s in times(50)]
    assert curves(tmp_path / 'a.bag', devices, rows) == ()


@pytest.mark.parametrize('returns', [False, True])
def test_there_is_no_speed_where_joints_are_missing(tmp_path: Path, cell: Any,
                                                    returns: bool) -> None:
    """This holds even if they were known before."""
    rows = [Row('/tf', time_s, TFMessage([sent('flange', 'tip')])) for time_s in times(30)]
    joints = [Row('/joints', time_s, JointState(name=['j'], position=[
        2.0 * (abs(time_s - 1.75) if returns else time_s)]))
        for time_s in times(50) if not 1.0 < time_s < 2.5]
    (curve,) = curves(tmp_path / 'a.bag', cell('tip'), rows + joints)
    assert np.isfinite(curve.high[4:9]).all() and np.isfinite(curve.high[27:37]).all()
    assert not np.isfinite(curve.high[11:24]).any()
    assert curves(tmp_path / 'b.bag', cell('tip'), rows) == ()


TWO_JOINTS = """<robot name="r">
  <link name="root"/><link name="arm"/><link name="end"/><link name="tool"/>
  <joint name="j" type="continuous"><parent link="root"/><child link="arm"/><axis xyz="0 0 1"/>
  </joint>
  <joint name="r/slide" type="prismatic"><parent link="arm"/><child link="end"/><axis xyz="1 0 0"/>
    <limit lower="-9" upper="9" effort="1" velocity="9"/></joint>
  <joint name="twin" type="prismatic"><parent link="end"/><child link="tool"/><axis xyz="1 0 0"/>
    <limit lower="-9" upper="9" effort="1" velocity="9"/>
    <mimic joint="r/slide" multiplier="2" offset="0.1"/></joint>
</robot>"""


def test_of_groups_that_take_turns_none_is_left_out(tmp_path: Path,
                                                    monkeypatch: pytest.MonkeyPatch) -> None:
    """Of very many messages only some are read, such as two of three."""
    devices = joints_only(tmp_path, '')
    rows = [Row('/joints', time_s + 0.001 * number, JointState(name=[name], position=[position]))
            for time_s in times(100)
            for number, (name, position) in enumerate((
                ('one', 0.0), ('other', 0.0), ('j', TURN_RAD_PER_S * (time_s + 0.002))))]
    for share in (2 / 3, 1 / 2, 1 / 3):
        monkeypatch.setattr(curves_module, 'MAX_MESSAGES', int(share * len(rows)))
        (curve,) = curves(tmp_path / 'a.bag', devices, rows)
        assert curve.high[3:-3] == pytest.approx(TURN_RAD_PER_S * 0.3, rel=NEAR)


@pytest.mark.parametrize('sent_s', [[0.0], [0.0, 0.02, 2.5], [0.0, 1.2, 2.4, 3.6]])
def test_a_joint_that_is_sent_only_when_it_moves_is_where_it_was(
        tmp_path: Path, sent_s: List[float]) -> None:
    """The slide and its mimic joint rest after the turning joint; NaN has no meaning."""
    (tmp_path / 'robot.urdf').write_text(TWO_JOINTS)
    (tmp_path / 'cell.xml').write_text(CELL.replace('FRAME', 'tool'))
    rows = [Row('/joints', time_s, JointState(name=['j'], position=[TURN_RAD_PER_S * time_s]))
            for time_s in times(125)]
    rows += [Row('/joints', time_s, JointState(name=['slide'], position=[value]))
             for time_s, value in [*((it, 0.1) for it in sent_s), (2.0, math.nan)]]
    assert_speed(tmp_path / 'a.bag', XmlParser().parse(str(tmp_path / 'cell.xml')).devices, rows,
                 TURN_RAD_PER_S * (0.1 + 0.1 + 2 * 0.1))


@pytest.mark.parametrize('offset', [
    '<param name="joint_proc/joint_offsets/slide" value="0.2"/>',
    '<rosparam ns="joint_proc">joint_offsets: {slide: 0.2, j: deg(90)}</rosparam>',
    '<rosparam param="joint_proc/joint_offsets/slide">0.2</rosparam>',
    '<rosparam file="FOLDER/offsets.yaml"/>'])
@pytest.mark.parametrize('is_array', [True, False])
def test_offsets_that_joint_proc_adds(tmp_path: Path, offset: str, is_array: bool) -> None:
    """The slide reports 0.1 m at 0.3 m, and its mimic joint at 0.1 m and twice the scale."""
    (tmp_path / 'robot.urdf').write_text(TWO_JOINTS)
    (tmp_path / 'offsets.yaml').write_text('/r: {joint_proc/joint_offsets: {slide: 0.2}}')
    with_offset = CELL.replace('FRAME', 'tool').replace(
        '</device>', offset.replace('FOLDER', str(tmp_path)) + '</device>')
    (tmp_path / 'cell.xml').write_text(with_offset)
    devices = XmlParser().parse(str(tmp_path / 'cell.xml')).devices
    rows = []
    for time_s in times(125):
        values = [TURN_RAD_PER_S * time_s, 0.1]
        rows.append(Row('/joints', time_s, Float32MultiArray(data=values) if is_array
                        else JointState(name=['j', 'slide'], position=values)))
    assert_speed(tmp_path / 'a.bag', devices, rows, TURN_RAD_PER_S * (0.3 + 0.1 + 2 * 0.3))


@pytest.mark.parametrize('broken', ['<rosparam file="/nowhere/offsets.yaml"/>',
                                    '<param name="joint_proc/joint_offsets/slide" value="far"/>',
                                    '<param name="joint_proc/joint_offsets" value="0.2"/>'])
def test_offsets_that_roslaunch_or_joint_proc_refuses(tmp_path: Path, cell: Any,
                                                      broken: str) -> None:
    cell('tool')
    path = tmp_path / 'cell.xml'
    path.write_text(path.read_text().replace('</device>', broken + '</device>'))
    rows = [Row('/joints', time_s, JointState(name=['j'], position=[TURN_RAD_PER_S * time_s]))
            for time_s in times(125)]
    assert_speed(tmp_path / 'a.bag', XmlParser().parse(str(path)).devices, rows,
                 TURN_RAD_PER_S * 0.3)


@pytest.mark.parametrize('topic', ['/joints', '/tf'])
def test_a_link_of_the_model_is_moved_by_the_joints_alone(tmp_path: Path, cell: Any,
                                                          topic: str) -> None:
    """This holds with and without tf in the recording."""
    rows = [Row('/joints', time_s, JointState(name=['j'], position=[TURN_RAD_PER_S * time_s]))
            for time_s in times(125)]
    if topic == '/tf':
        rows += [Row('/tf', time_s, TFMessage([sent('floor', 'cart')])) for time_s in times(30)]
    assert_speed(tmp_path / 'a.bag', cell('tool'), rows, TURN_RAD_PER_S * 0.3)


def test_what_nothing_leads_to_has_none(tmp_path: Path, cell: Any) -> None:
    rows = [Row('/tf', time_s, TFMessage([sent('ring', 'other'), sent('other', 'ring'),
                                          sent('ring', 'elsewhere', time_s)]))
            for time_s in times(30)]
    assert curves(tmp_path / 'a.bag', cell('elsewhere'), rows) == ()
    assert curves(tmp_path / 'b.bag', cell('base'), rows) == ()
