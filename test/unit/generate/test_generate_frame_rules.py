# SPDX-License-Identifier: BSD-3-Clause
"""Frames that elements of a configuration name, but that do not exist."""
from __future__ import annotations

from typing import Callable, List, Tuple

import pytest

from process_visualizer.cell.model import Cell
from process_visualizer.generate.frame_rules import frame_warnings, static_frames
from process_visualizer.robot.description import RobotDescription, describe_devices

Parse = Callable[[str], Cell]
SENSOR = '<topic name="points" type="pointcloud"/><base frame="camera" xyz="0 0 2"/>'


def warned(cell: Cell, *published: str) -> List[Tuple[str, str]]:
    descriptions, _ = describe_devices(cell.devices)
    return [(it.element, it.message) for it in frame_warnings(cell, descriptions, published)]


@pytest.mark.parametrize(('element', 'text'), [
    ('roi', f'<device type="depth_sensor" name="a">{SENSOR}'
            '<roi frame="{}" xyz="0 0 0" size="1 1 1"/></device>'),
    ('objects', f'<device type="depth_sensor" name="a">{SENSOR}'
                '<objects frame="{}" xyz="0 0 0" size="1 1 1"/></device>'),
    ('expected', f'<device type="depth_sensor" name="a">{SENSOR}'
                 '<objects><expected frame="{}" xyz="0 0 0" size="1 1 1"/></objects>'
                 '</device>'),
    ('variable', '<device type="other" name="a"><variable topic="/v" frame="{}" label="v" '
                 'axis="0 0 1"/></device>'),
    ('force', '<device type="robot" name="a"><topic name="f" type="force_sensor"/>'
              '<tool frame="table"/>'
              '<force frame="sensor" parentframe="{}" xyz="0 0 0" rpy="0 0 0"/></device>'),
    ('property', '<device type="other" name="a"><rviz type="Grid">'
                 '<property name="Reference Frame" value="{}"/></rviz></device>'),
    ('property', '<device type="other" name="a"><rviz type="Group"><rviz type="Grid">'
                 '<property name="Reference Frame" value="/{}"/></rviz></rviz></device>')])
def test_an_element_names_a_frame_that_nothing_has(parse: Parse, element: str, text: str) -> None:
    table = '<device type="other" name="t"><base frame="table"/></device>'
    found = warned(parse(text.format('tabel') + table))
    assert found == [(element, 'no model, <base>, <tool> or <force> has the frame "tabel"; did you '
                               'mean "table"?')]
    assert warned(parse(text.format('table') + table)) == []
    assert warned(parse(text.format('tabel') + table), 'tabel') == []


def test_the_fixed_frame_and_no_frame_are_known(parse: Parse) -> None:
    display = '<rviz type="Grid"><property name="Reference Frame" value="{}"/></rviz>'
    for value in ('&lt;Fixed Frame&gt;', ''):
        assert warned(parse('<device type="other" name="a">'
                            f'{display.format(value)}</device>')) == []


def test_a_joint_is_no_frame(parse: Parse) -> None:
    cell = parse('<device type="other" name="a"><variable topic="/v" frame="elbow" label="v" '
                 'axis="0 0 1"/></device>')
    text = '''<robot name="r"><link name="upper"/><link name="fore"/><joint name="elbow"
        type="fixed"><parent link="upper"/><child link="fore"/></joint></robot>'''
    arm = RobotDescription(text, ('upper', 'fore'), {}, {'fore': 'upper'})
    found, = frame_warnings(cell, {'arm': arm}, ())
    assert found.message == '"elbow" is a joint, not a frame; did you mean its link "fore"?'


@pytest.mark.parametrize(('package', 'kind', 'arguments', 'frames'), [
    ('tf', 'static_transform_publisher', '0 0 1 0 0 0 world camera 100', {'world', 'camera'}),
    ('tf2_ros', 'static_transform_publisher', '0 0 1 0 0 0 1 /world /camera',
     {'world', 'camera'}),
    ('tf2_ros', 'static_transform_publisher', '0 0 1', set()),
    ('other', 'static_transform_publisher', '0 0 1 0 0 0 world camera', set())])
def test_frames_of_static_transform_publishers(package: str, kind: str, arguments: str,
                                               frames: 'set[str]') -> None:
    assert static_frames([(package, kind, arguments)]) == frames
