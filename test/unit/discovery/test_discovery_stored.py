# SPDX-License-Identifier: BSD-3-Clause
"""A new configuration starts from the one in the bag."""
from __future__ import annotations

import re
import shutil
from pathlib import Path
from typing import Any, Dict

import pytest
import rosbag
from genpy import Time
from geometry_msgs.msg import Quaternion, Transform, TransformStamped, Vector3
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64, Header, String
from tf2_msgs.msg import TFMessage

from process_visualizer.bagio.recorder_topics import CALIBRATION, CONFIGURATION
from process_visualizer.cell.model import Cell
from process_visualizer.cell.stored_configuration import configuration_text
from process_visualizer.cell.xml_parser import XmlParser
from process_visualizer.commands.command_line import main
from process_visualizer.robot.description import describe_device

URDF = '''<robot name="r"><link name="base" /><link name="tool" />
<joint name="j" type="continuous"><parent link="base" /><child link="tool" /></joint></robot>'''
CELL = '''<?xml version="1.0"?>
<!-- mine -->
<visualizer>
  <arg name="speed" />
  <arg name="side" default="left" />
  <device type="robot" name="arm">
    <model path="models/arm.urdf" /><base frame="base" xyz="1 0 0" rpy="0 3.141592653589793 0" />
    <topic ns="driver" name="joint_states" type="joint_states" />
  </device>
  <include file="parts/oven.xml" />
</visualizer>
'''
OVEN = '''<visualizer><device type="other" name="oven"><base frame="oven" />
<variable topic="oven/temperature" frame="oven" scale="0.01" label="hot" /></device></visualizer>'''


@pytest.fixture
def bag(tmp_path: Path) -> str:
    """A bag as our recorder writes it, with one more topic."""
    return write_bag(tmp_path, CELL, {'speed': 'a"<b', 'side': 'right'})


def write_bag(tmp_path: Path, text: str, arguments: Dict[str, str], x: float = 1.0) -> str:
    files = {'cell.xml': text, 'models/arm.urdf': URDF, 'parts/oven.xml': OVEN}
    for name, content in files.items():
        path = tmp_path / 'was' / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(content)
    cell = XmlParser(arguments).parse(str(tmp_path / 'was' / 'cell.xml'))
    frames = TFMessage([TransformStamped(Header(frame_id='world'), 'base', Transform(
        Vector3(x, 0, 0), Quaternion(0, 1, 0, 0)))])
    with rosbag.Bag(str(tmp_path / 'a.bag'), 'w') as file:
        for topic, message in ((CONFIGURATION, String(configuration_text(cell))),
                               (CALIBRATION, frames), ('/oven/temperature', Float64(5.0)),
                               ('/driver/joint_states', JointState(name=['j'], position=[0.0])),
                               ('/odd', Float64(1.0))):
            file.write(topic, message, Time(1000))
    return str(tmp_path / 'a.bag')


@pytest.mark.parametrize('place', ['../models/arm.urdf', '$(dirname)/../models/arm.urdf',
                                   '{folder}/models/arm.urdf'])
def test_a_model_outside_of_the_folder_comes_beside_the_configuration(tmp_path: Path,
                                                                      place: str) -> None:
    """On another computer it is not at its old path."""
    named = place.format(folder=tmp_path)
    (tmp_path / 'models').mkdir()
    (tmp_path / 'models' / 'arm.urdf').write_text(URDF)
    bag = write_bag(tmp_path, CELL.replace('models/arm.urdf', named), {'speed': '1'})
    shutil.rmtree(tmp_path / 'models')
    shutil.rmtree(tmp_path / 'was')
    model = new_cell(bag, tmp_path / 'new').devices[0].model
    assert model is not None and model.path == str(tmp_path / 'new' / 'arm.urdf')
    (tmp_path / 'again').mkdir()
    assert main(['configuration', bag, '--output', str(tmp_path / 'again')]) == 0
    assert main(['check', str(tmp_path / 'again' / 'cell.xml'), 'speed:=1']) == 0


def new_cell(bag: str, folder: Path) -> Cell:
    folder.mkdir(exist_ok=True)
    path = str(folder / 'cell.xml')
    assert main(['new', bag, '-o', path]) == 0
    assert main(['check', path]) == 0
    return XmlParser().parse(path)


def test_a_bag_of_our_recorder(tmp_path: Path, bag: str, capsys: Any) -> None:
    cell = new_cell(bag, tmp_path / 'new')
    assert '1 robot, 1 other device' in capsys.readouterr().out
    assert [it.name for it in cell.devices] == ['arm', 'oven']
    assert cell.devices[0].model is not None
    assert cell.devices[0].model.path == str(tmp_path / 'new' / 'models' / 'arm.urdf')
    assert [(it.label, it.scale) for it in cell.devices[1].variables] == [('hot', 0.01)]
    text = (tmp_path / 'new' / 'cell.xml').read_text()
    begin, end = text.index('<!--\n  Made'), text.index('<visualizer>')
    comment = ' '.join(text[begin:end].split())
    assert 'from a.bag: the configuration cell.xml as it was, run with ' in comment
    assert 'It does not name these topics, which are there too: /odd.' in comment
    assert text[:begin] + text[end:] == CELL.replace(
        'name="speed"', 'name="speed" default="a&quot;&lt;b"').replace('"left"', '"right"')


XACRO = '''<robot name="r" xmlns:xacro="http://ros.org/wiki/xacro"><xacro:arg name="n" default=""/>
<xacro:if value="${not xacro.abs_filename('a').startswith('/tmp/process_visualizer-')}">
<later /></xacro:if><x y="$${1 + 1} $$(env HOME) $(arg n)" /><link name="base" /><link name="tool">
<visual><geometry><mesh filename="http://127.0.0.1:9/a.dae" /></geometry></visual></link>
<joint name="j" type="continuous"><parent link="base" /><child link="tool" /></joint></robot>'''


def test_a_model_is_what_was_read_of_it_with_limits(tmp_path: Path) -> None:
    """The new configuration belongs to the user; nothing in its model is evaluated again."""
    (tmp_path / 'was' / 'models').mkdir(parents=True)
    (tmp_path / 'was' / 'models' / 'arm.xacro').write_text(XACRO)
    given = '<model path="models/arm.xacro"><arg name="n" value="v" /></model>'
    bag = write_bag(tmp_path, CELL.replace('<model path="models/arm.urdf" />', given),
                    {'speed': '1'})
    device = new_cell(bag, tmp_path / 'new').devices[0]
    description = describe_device(device)
    assert description is not None and device.model is not None
    assert device.model.path == str(tmp_path / 'new' / 'models' / 'arm.xacro')
    assert 'y="${1 + 1} $(env HOME) v"' in description.text
    assert 'later' not in description.text and '127.0.0.1' not in description.text
    assert 'http://127.0.0.1:9/a.dae' in (tmp_path / 'new' / 'cell.xml').read_text()


TWO = '''<visualizer><arg name="speed" />
<device type="robot" name="arm"><model path="arm.xacro" /><base frame="base" />
<topic ns="driver" name="joint_states" type="joint_states" /></device>
<device type="robot" name="other"><model path="arm.xacro"><arg name="n" value="{value}" /></model>
<base frame="right_base" /><topic ns="second" name="joint_states" type="joint_states" /></device>
</visualizer>'''


def write_two(tmp_path: Path, value: str) -> str:
    (tmp_path / 'was').mkdir()
    (tmp_path / 'was' / 'arm.xacro').write_text(re.sub(
        '(name|link)="(base|tool|j)"', r'\1="$(arg n)\2"', XACRO))
    return write_bag(tmp_path, TWO.format(value=value), {'speed': '1'})


def test_two_devices_with_one_model_have_their_own_arguments(tmp_path: Path) -> None:
    devices = new_cell(write_two(tmp_path, 'right_'), tmp_path / 'new').devices
    found = [describe_device(it) for it in devices]
    assert [it and it.links for it in found] == [('base', 'tool'), ('right_base', 'right_tool')]


def test_an_argument_is_no_expression_of_a_model(tmp_path: Path) -> None:
    bag = write_two(tmp_path, "' + str(1) + '")
    assert main(['new', bag, '-o', str(tmp_path / 'cell.xml')]) == 0
    assert not list(tmp_path.glob('*.xacro'))  # it is made from the topics


def test_frames_that_were_calibrated(tmp_path: Path) -> None:
    cell = new_cell(write_bag(tmp_path, CELL, {'speed': '1'}, 1.25), tmp_path / 'new')
    base = cell.devices[0].base
    assert base is not None and base.pose.xyz == (1.25, 0.0, 0.0)
    text = (tmp_path / 'new' / 'cell.xml').read_text()
    assert 'The base frame of arm is where it was calibrated to be.' in text


def test_a_configuration_that_cannot_be_used_here(tmp_path: Path) -> None:
    """Then the devices in the bag are written, with the reason."""
    bag = write_bag(tmp_path, CELL.replace('path="models/', 'pkg="gone_package" path="'),
                    {'speed': '1'})
    cell = new_cell(bag, tmp_path / 'new')
    assert [it.name for it in cell.devices] == ['driver_robot', 'sensors', 'oven']
    text = ' '.join((tmp_path / 'new' / 'cell.xml').read_text().split())
    assert 'The configuration in the recording is not used:' in text and 'gone_package' in text
