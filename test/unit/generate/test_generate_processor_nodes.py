# SPDX-License-Identifier: BSD-3-Clause
"""The nodes that the program starts for a device, with their parameters."""
from __future__ import annotations

from typing import Any, Callable, Dict, List, Optional

import pytest

from process_visualizer.cell.model import Cell, Device
from process_visualizer.generate.drivers import Manager
from process_visualizer.generate.processor_nodes import (
    ProcessorNode,
    fixed_frames,
    fusion_node,
    processor_nodes,
    robot_parameters,
)
from process_visualizer.parameters.cell_parameters import written_frames
from process_visualizer.robot.description import RobotDescription

Parse = Callable[[str], Cell]
ARM = RobotDescription('<robot/>', ('base', 'a', 'tool'),
                       {'j1': 'revolute', 'j2': 'prismatic'}, {'a': 'base', 'tool': 'a'})
STONE = RobotDescription('<robot/>', ('base',), {}, {})


def written(robot: Device, description: Optional[RobotDescription]) -> Dict[str, Any]:
    """The parameters of a robot processor in the launch file."""
    return robot_parameters(robot, description).to_parameters()


def device(parse: Parse, kind: str, elements: str) -> Device:
    return parse(f'<device type="{kind}" name="d">{elements}</device>').devices[0]


def nodes_of(parse: Parse, kind: str, elements: str,
             description: Optional[RobotDescription] = None) -> List[ProcessorNode]:
    cell = parse(f'<device type="{kind}" name="d">{elements}</device>')
    return processor_nodes(cell.devices[0], description)


@pytest.mark.parametrize('kind, elements, description, names', [
    ('robot', '', None, ['robot_proc']),
    ('robot', '', ARM, ['robot_state_publisher', 'robot_proc']),
    ('robot', '', STONE, ['robot_proc']),
    ('robot', '<topic name="q" type="joint_states"/>', ARM,
     ['robot_state_publisher', 'joint_proc', 'robot_proc']),
    ('robot', '<topic name="q" type="joint_states"/>', STONE, ['robot_proc']),
    ('other', '', None, []),
    ('other', '', ARM, ['robot_state_publisher']),
    ('other', '', STONE, []),
    ('other', '<variable topic="t" frame="f"/>', None, ['variable_proc']),
    ('depth_sensor', '', None, []),
    ('depth_sensor', '<topic name="c" type="pointcloud"/>', None, ['depth_proc']),
    ('depth_sensor', '<topic name="c" type="pointcloud"/><roi size="1 1 1"/>'
                     '<variable topic="t" frame="f"/>', ARM,
     ['robot_state_publisher', 'roi_filter', 'depth_proc', 'variable_proc'])])
def test_which_nodes(kind: str, elements: str, description: Optional[RobotDescription],
                     names: List[str], parse: Parse) -> None:
    assert [node.name for node in nodes_of(parse, kind, elements, description)] == names


@pytest.mark.parametrize(('kind', 'frequency_hz'), [('robot', 1e6), ('other', 100.0)])
def test_each_state_of_joint_proc_becomes_frames(kind: str, frequency_hz: float,
                                                 parse: Parse) -> None:
    """Otherwise the last of two states within 10 ms is lost, and a paused robot is not at its pose.

    A state that is not newer does not count: after a jump it would be an old pose.
    """
    publisher = nodes_of(parse, kind, '', ARM)[0]
    assert publisher.name == 'robot_state_publisher'
    assert publisher.parameters == {'publish_frequency': frequency_hz}


def test_cloud_that_is_not_cropped(parse: Parse) -> None:
    (node,) = nodes_of(parse, 'depth_sensor', '<topic ns="k" name="c" type="pointcloud"/>')
    assert node == ProcessorNode('process_visualizer', 'depth_proc', 'depth_proc',
                                 {'topic': '/k/c'})
    (node,) = processor_nodes(device(parse, 'depth_sensor',
                                     '<topic ns="k" name="c" type="pointcloud"/>'), None,
                              frame='hall')
    assert node.parameters == {'topic': '/k/c', 'frame': 'hall'}


def test_cropped_cloud(parse: Parse) -> None:
    roi, depth = nodes_of(parse, 'depth_sensor', '<topic ns="k" name="c" type="pointcloud"/>'
                          '<roi frame="/table" xyz="0 1 2" size="3 4 5"/>')
    assert (roi.package, roi.type, roi.args) == (
        'nodelet', 'nodelet', 'standalone process_visualizer/RoiFilter')
    assert roi.remaps == {'~input': '/k/c', '~output': '/d/roi_points'}
    assert roi.parameters == {'frame': 'table', 'center': [0, 1, 2], 'size': [3, 4, 5]}
    assert depth.parameters == {'topic': '/d/roi_points'}


IMAGES = ('<topic ns="k" name="d" type="depth_image"/><topic ns="k" name="c" type="color_image"/>'
          '<topic ns="k" name="i" type="camera_info"/>')


@pytest.mark.parametrize('cloud', ['', '<topic name="p" type="pointcloud"/>'])
def test_cloud_cropped_from_images(cloud: str, parse: Parse) -> None:
    roi, depth = nodes_of(parse, 'depth_sensor', IMAGES + cloud + '<roi size="3 4 5"/>')
    assert (roi.name, roi.args) == ('roi_filter', 'standalone process_visualizer/RegisteredCrop')
    assert roi.remaps == {'~depth': '/k/d', '~color': '/k/c', '~camera_info': '/k/i',
                          '~output': '/d/roi_points'}
    assert roi.parameters == {'frame': 'world', 'center': [0, 0, 0], 'size': [3, 4, 5]}
    assert depth.parameters == {'topic': '/d/roi_points'}


def test_crop_in_a_manager(parse: Parse) -> None:
    roi = processor_nodes(device(parse, 'depth_sensor', IMAGES + '<roi size="3 4 5"/>'), None,
                          Manager('/camera/m'))[0]
    assert (roi.args, roi.respawn) == (
        'load process_visualizer/RegisteredCrop /camera/m --no-bond', False)


def test_crop_in_the_manager_of_another_device_is_loaded_again_when_that_restarts(
        parse: Parse) -> None:
    roi = processor_nodes(device(parse, 'depth_sensor', IMAGES + '<roi size="3 4 5"/>'), None,
                          Manager('/camera/m', is_shared=True))[0]
    assert (roi.args, roi.respawn) == ('load process_visualizer/RegisteredCrop /camera/m', True)


SENSORS = ('<device type="depth_sensor" name="a"><topic name="a" type="pointcloud"/></device>'
           '<device type="depth_sensor" name="b"><topic name="b" type="pointcloud"/>'
           '<roi size="1 1 1"/></device>')


def test_fusion(parse: Parse) -> None:
    cell = parse(SENSORS + '<device type="depth_sensor" name="c"><fusion sensors="a b"/></device>')
    joined = cell.devices[2]
    assert joined.fusion is not None
    node = fusion_node(joined, joined.fusion, cell.devices[:2], 'world', None)
    assert (node.name, node.args, node.respawn) == (
        'fusion', 'standalone process_visualizer/CloudFusion', False)
    assert node.parameters == {'topics': ['/a', '/b/roi_points'], 'frame': 'world',
                               'voxel': 0.005, 'timeout': 1.0}
    assert node.remaps == {'~output': '/c/fused_points'}
    (depth,) = processor_nodes(joined, None)
    assert (depth.name, depth.parameters) == ('depth_proc', {'topic': '/c/fused_points'})


def test_fusion_in_a_manager(parse: Parse) -> None:
    cell = parse(SENSORS + '<device type="depth_sensor" name="c"><fusion sensors="a"/></device>')
    joined = cell.devices[2]
    assert joined.fusion is not None
    node = fusion_node(joined, joined.fusion, cell.devices[:1], 'world', Manager('/m', True))
    assert (node.args, node.respawn) == ('load process_visualizer/CloudFusion /m', True)

def test_region_in_the_global_frame(parse: Parse) -> None:
    roi = nodes_of(parse, 'depth_sensor',
                   '<topic name="c" type="pointcloud"/><roi size="3 4 5"/>')[0]
    assert (roi.parameters['frame'], roi.parameters['center']) == ('world', [0, 0, 0])


def test_variables(parse: Parse) -> None:
    (node,) = nodes_of(parse, 'other', '''
        <variable topic="a/t" field="v[2]" frame="f" axis="-z" color="#ff0000" unit="N" scale="0.5"
                  offset="255" label="Force"/>
        <variable topic="/u" frame="f"/>''')
    first, second = node.parameters['variables']
    assert first == {'topic': '/a/t', 'field': 'v[2]', 'frame': 'f', 'axis': [0, 0, -1],
                     'color': [1, 0, 0], 'unit': 'N', 'scale': 0.5, 'offset': 255,
                     'label': 'Force'}
    assert (second['topic'], second['field'], second['label'], second['scale']) == (
        '/u', 'data', 'u', 1)


def test_colors_and_live_offset_of_a_variable(parse: Parse) -> None:
    (node,) = nodes_of(parse, 'other', '<variable topic="t" frame="f" low="1" color_begin="2" '
                       'color_end="3" end_color="0 1 0" offset_param="setpoint" max="0.6"/>')
    (variable,) = node.parameters['variables']
    assert variable['limits'] == {'low': 1, 'color': [0.9, 0.1, 0.1]}
    assert variable['color_scale'] == {'begin': 2, 'end': 3, 'color': [0, 1, 0]}
    assert (variable['offset_param'], variable['max']) == ('setpoint', 0.6)


def test_tool_frame_in_tf(parse: Parse) -> None:
    found = written(device(parse, 'robot', '<topic name="tf" type="tool_center_frame" '
                                    'msg="tf2_msgs/TFMessage" frame="tool0"/>'), None)
    assert found['topics'] == {'tool_center_frame': {
        'name': '/tf', 'msg': 'tf2_msgs/TFMessage', 'frame': 'tool0'}}


def test_frames_of_the_maker(parse: Parse) -> None:
    """The driver's frame names, and the frames of its arrays."""
    robot = device(parse, 'robot', '<model pkg="p" path="a.urdf" prefix="left_"/>'
                   '<topic name="t" type="tool_center_frame" parentframe="/left_base"/>')
    parameters = written(robot, None)
    assert parameters['link_prefix'] == 'left_'
    assert parameters['topics'] == {'tool_center_frame': {
        'name': '/t', 'parent_frame': 'left_base'}}
    assert 'link_prefix' not in written(device(parse, 'robot', ''), None)


def test_robot_with_everything(parse: Parse) -> None:
    found = written(device(parse, 'robot', '''
        <base frame="/base"/>
        <force parentframe="tool" frame="force" xyz="0 0 0" rpy="0 0 0"/>
        <topic name="q" type="joint_states" msg="sensor_msgs/JointState"/>
        <topic name="t" type="tool_center_frame"/>
        <topic name="f" type="force_sensor" msg="geometry_msgs/WrenchStamped"/>
        <topic name="other"/>
        <arrow quantity="velocity" scale="2" min="0.01" max="0.4" color="red"/>
        <arrow quantity="force" max="0.3"/>'''), ARM)
    assert found == {
        'base_frame': 'base', 'tool_frame': 'tool', 'force_frame': 'force',
        'topics': {'joint_states': {'name': '/q', 'msg': 'sensor_msgs/JointState'},
                   'tool_center_frame': {'name': '/t'},
                   'force_sensor': {'name': '/f', 'msg': 'geometry_msgs/WrenchStamped'}},
        'arrows': {'velocity': {'scale': 2, 'min': 0.01, 'max': 0.4, 'color': [0.9, 0.1, 0.1]},
                   'force': {'max': 0.3}}}


def test_robot_with_nothing(parse: Parse) -> None:
    assert written(device(parse, 'robot', ''), None) == {
        'base_frame': 'd/link0', 'tool_frame': 'd/tool', 'topics': {}}


def test_robot_without_model_takes_the_parent_of_the_force_frame_as_tool(parse: Parse) -> None:
    found = written(device(parse, 'robot', '<force parentframe="flange" frame="f" '
                                                    'xyz="0 0 0" rpy="0 0 0"/>'), None)
    assert found == {'base_frame': 'd/link0', 'tool_frame': 'flange', 'force_frame': 'f',
                     'topics': {}}


def test_configured_tool(parse: Parse) -> None:
    found = written(device(parse, 'robot', '<tool frame="a"/>'), ARM)
    assert found == {'base_frame': 'd/link0', 'tool_frame': 'a', 'arrow_foot': 'tool_frame',
                     'topics': {}}
    found = written(device(parse, 'robot', '<tool frame="a" xyz="0 0 0.1"/>'), ARM)
    assert found['tool_frame'] == 'd/tool_center_frame'


def test_a_tool_that_is_posed_has_a_frame_of_its_own(parse: Parse) -> None:
    cell = parse('<device type="robot" name="a"><tool frame="flange" xyz="0 0 0.1" '
                 'rpy="1.5 0 0"/></device>'
                 '<device type="robot" name="b"><tool frame="tip"/></device>')
    assert written_frames(fixed_frames(cell, cell.devices)) == [
        {'parent': 'flange', 'child': 'a/tool_center_frame', 'xyz': [0, 0, 0.1],
         'ypr': [1.5, 0, 0]}]


def test_frames(parse: Parse) -> None:
    cell = parse('<device type="robot" name="a"><base frame="a" xyz="1 2 3" rpy="0.1 0.2 0.3"/>'
                 '<force parentframe="t" frame="f" xyz="0 0 1" ypr="1 0 0"/></device>'
                 '<device type="other" name="b"/>')
    assert written_frames(fixed_frames(cell, cell.devices)) == [
        {'parent': 'world', 'child': 'a', 'xyz': [1, 2, 3], 'ypr': [0.1, 0.2, 0.3]},
        {'parent': 't', 'child': 'f', 'xyz': [0, 0, 1], 'ypr': [1, 0, 0]}]
    assert fixed_frames(cell, cell.devices[1:]) == []


def test_joints_of_a_robot(parse: Parse) -> None:
    nodes = nodes_of(parse, 'robot', '<topic name="q" type="joint_states" '
                     'msg="sensor_msgs/JointState"/>', ARM)
    found = next(node.parameters for node in nodes if node.name == 'joint_proc')
    assert found == {'topic': '/q', 'joint_names': ['j1', 'j2'], 'msg': 'sensor_msgs/JointState'}


def test_joints_of_an_arm_and_of_its_gripper(parse: Parse) -> None:
    nodes = nodes_of(parse, 'robot', '<topic name="q" type="joint_states"/>'
                     '<topic ns="hand" name="q" type="joint_states"/>', ARM)
    found = next(node.parameters for node in nodes if node.name == 'joint_proc')
    assert found == {'topics': ['/q', '/hand/q'], 'joint_names': ['j1', 'j2']}


def test_latencies_of_a_robot(parse: Parse) -> None:
    elements = ('<topic name="q" type="joint_states" latency="0.1"/>'
                '<topic ns="hand" name="q" type="joint_states"/>'
                '<topic name="f" type="force_sensor" latency="0.02"/>'
                '<topic name="p" type="tool_center_frame" latency="0.03"/>')
    found = next(node.parameters for node in nodes_of(parse, 'robot', elements, ARM)
                 if node.name == 'joint_proc')
    assert found['latencies'] == [0.1, 0.0]
    topics = written(device(parse, 'robot', elements), ARM)['topics']
    assert topics['force_sensor'] == {'name': '/f', 'latency': 0.02}
    assert topics['tool_center_frame'] == {'name': '/p', 'latency': 0.03}


def test_joints_of_a_robot_whose_model_has_a_prefix(parse: Parse) -> None:
    nodes = nodes_of(parse, 'robot', '<model pkg="p" path="a.urdf" prefix="left_"/>'
                     '<topic name="q" type="joint_states"/>', ARM)
    found = next(node.parameters for node in nodes if node.name == 'joint_proc')
    assert found['prefix'] == 'left_'
