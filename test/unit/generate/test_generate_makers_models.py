# SPDX-License-Identifier: BSD-3-Clause
"""Models in the style of robot makers are used as they are: arguments, YAML, prefix."""
from __future__ import annotations

import os
from pathlib import Path
from typing import Tuple

import pytest

from process_visualizer.cell.errors import Location
from process_visualizer.cell.model import BaseFrame, Cell, Device, DeviceType, Model, Pose
from process_visualizer.cell.xml_parser import XmlParser
from process_visualizer.robot.description import (
    ModelError,
    RobotDescription,
    describe_devices,
    load_robot_description,
)
from process_visualizer.robot.tool_frame import tool_frame

MAKERS = Path(__file__).parents[2] / 'data' / 'makers'
UR, PANDA = ('ur_style_description', 'urdf/arm.xacro'), ('panda_style_description',
                                                         'robots/arm.urdf.xacro')
HERE = Location('cell.xml', 3)


@pytest.fixture(autouse=True)
def packages(monkeypatch: pytest.MonkeyPatch) -> None:
    paths = [str(MAKERS), os.environ.get('ROS_PACKAGE_PATH', '')]
    monkeypatch.setenv('ROS_PACKAGE_PATH', os.pathsep.join(paths))


def loaded(model: Tuple[str, str], prefix: str = '', **arguments: str) -> RobotDescription:
    return load_robot_description(str(MAKERS.joinpath(*model)), tuple(arguments.items()), prefix)


def robot(name: str, model: Tuple[str, str], base: str, prefix: str = '',
          **arguments: str) -> Device:
    return Device(DeviceType.ROBOT, name, HERE, base=BaseFrame(base, Pose(), HERE),
                  model=Model(*model, HERE, tuple(arguments.items()), prefix))


def test_arguments_have_the_values_of_the_file() -> None:
    description = loaded(UR)
    assert description.root_link == 'base_link'
    assert list(description.joints) == ['shoulder_pan_joint', 'shoulder_lift_joint',
                                        'wrist_1_joint']
    assert '0.1625' in description.text and '1.5707' in description.text  # from YAML, in degrees


def test_arguments_are_passed() -> None:
    description = loaded(UR, tf_prefix='left_')
    assert description.root_link == 'left_base_link'
    assert 'left_shoulder_pan_joint' in description.joints


def test_argument_that_names_a_file_which_is_not_there() -> None:
    with pytest.raises(ModelError, match='arm.xacro.*No such file or directory.*nowhere.yaml'):
        loaded(UR, kinematics='nowhere.yaml')


def test_argument_that_the_file_does_not_take() -> None:
    with pytest.raises(ModelError, match='arm.xacro: it has no argument "tf_prefx"; did you mean '
                                         '"tf_prefix"'):
        loaded(UR, tf_prefx='left_')


def test_argument_that_the_file_only_asks_for(tmp_path: Path) -> None:
    path = tmp_path / 'arm.xacro'
    path.write_text('<robot xmlns:xacro="http://ros.org/wiki/xacro" name="$(arg robot_model)">'
                    '<link name="${xacro.arg(\'link\')}"/></robot>')
    with pytest.raises(ModelError, match='arm.xacro:1: xacro: the argument "robot_model" has no '
                                         'value; write <arg name="robot_model" value="…" /> in'):
        load_robot_description(str(path))
    description = load_robot_description(str(path), (('robot_model', 'ur5e'), ('link', 'base')))
    assert description.root_link == 'base'


def test_prefix_renames_links_and_no_joints() -> None:
    plain, renamed = loaded(UR), loaded(UR, prefix='left/')
    assert renamed.links == tuple(f'left/{link}' for link in plain.links)
    assert renamed.joints == plain.joints
    assert renamed.parents == {f'left/{child}': f'left/{parent}'
                               for child, parent in plain.parents.items()}


def test_gripper_with_mimic_joint_and_collision_links() -> None:
    description = loaded(PANDA, hand='true', arm_id='right')
    assert 'right_leftfinger_joint' in description.joints
    assert 'right_rightfinger_joint' not in description.joints
    assert 'right_hand_sc' in description.collision_only
    device = robot('arm', PANDA, 'right_link0')
    assert tool_frame(device, description).frame == 'right_hand'
    assert tool_frame(device, loaded(PANDA)).frame == 'panda_link8'


def test_two_robots_of_one_model() -> None:
    left, right = (robot(name, UR, f'{name}_base_link', prefix=f'{name}_')
                   for name in ('left', 'right'))
    descriptions, problems = describe_devices((left, right))
    assert not problems
    assert set(descriptions['left'].links).isdisjoint(descriptions['right'].links)
    assert tool_frame(left, descriptions['left']).frame == 'left_tool0'


def test_two_robots_of_one_model_without_a_prefix_are_told_of_it() -> None:
    _, problems = describe_devices((robot('left', UR, 'base_link'),
                                    robot('right', UR, 'base_link')))
    assert [str(problem) for problem in problems] == [
        'cell.xml:3: <model>: the link "base_link" is also in the model of "left"; link names '
        'must differ: write prefix="right/" in <model>, and the same before the frames in <base>, '
        '<tool>, <force>']


def test_arguments_and_prefix_in_a_configuration(tmp_path: Path) -> None:
    path = tmp_path / 'cell.xml'
    path.write_text('''<visualizer>
      <device type="robot" name="arm">
        <model pkg="panda_style_description" path="robots/arm.urdf.xacro" prefix="a_">
          <arg name="hand" value="true"/>
        </model>
        <base frame="a_panda_link0"/>
      </device>
    </visualizer>''')
    cell: Cell = XmlParser().parse(str(path))
    model = cell.devices[0].model
    assert model == Model('panda_style_description', 'robots/arm.urdf.xacro',
                          Location(str(path), 3), (('hand', 'true'),), 'a_')
    descriptions, problems = describe_devices(cell.devices)
    assert not problems and 'a_panda_hand' in descriptions['arm'].links
