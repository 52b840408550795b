# SPDX-License-Identifier: BSD-3-Clause
"""The thesis' two listings, in every detail."""
from pathlib import Path

import pytest

from process_visualizer.cell.errors import Location
from process_visualizer.cell.model import (
    BaseFrame,
    Cell,
    Device,
    DeviceType,
    Display,
    ForceFrame,
    LaunchFile,
    Mode,
    Model,
    Node,
    Pose,
    Topic,
    TopicFunction,
    Vector3,
)
from process_visualizer.cell.xml_parser import XmlParser

REPOSITORY = Path(__file__).resolve().parents[3]
LISTING_5_1 = REPOSITORY / 'test' / 'data' / 'listing_5_1.xml'
LISTING_6_1 = REPOSITORY / 'devices.xml'


def at(line: int) -> Location:
    return Location(str(LISTING_6_1), line)


def arm(name: str, force_namespace: str, ypr: Vector3, line: int) -> Device:
    """One of the two robots; ``line`` is that of its <device>."""
    return Device(
        DeviceType.ROBOT, name, at(line),
        base=BaseFrame(f'{name}/link0', Pose((0, 0, 0), ypr), at(line + 2)),
        model=Model('sewing_cell', f'urdf/{name}.urdf.xacro', at(line + 1)),
        force=ForceFrame(f'{name}/tool', f'{name}/force', Pose((0, 0, 0), (-1.570796, 0, 0)),
                         at(line + 6)),
        topics=(
            Topic(f'/{name}/q_act', TopicFunction.JOINT_STATES, None, True, at(line + 3)),
            Topic(f'/{name}/tcf', TopicFunction.TOOL_CENTER_FRAME, None, True, at(line + 4)),
            Topic(f'/{force_namespace}/ft', TopicFunction.FORCE_SENSOR, None, True,
                  at(line + 5))))


def kinect() -> Device:
    recorded = ('depth_registered/camera_info', 'depth_registered/image_raw',
                'driver/parameter_descriptions', 'driver/parameter_updates', 'rgb/camera_info',
                'rgb/image_color')
    topics = [Topic(f'/camera/{name}', None, None, True, at(21 + index))
              for index, name in enumerate(recorded)]
    return Device(
        DeviceType.DEPTH_SENSOR, 'kinect', at(19),
        base=BaseFrame('camera_link', Pose((-0.53, 0.09, 1.9), (0, 1.55, 0)), at(20)),
        topics=(*topics,
                Topic('/camera/depth_registered/points', None, None, False, at(27)),
                Topic('/kinect/roi_points', TopicFunction.POINTCLOUD, None, False, at(28))),
        launch_files=(
            LaunchFile('sewing_cell', 'openni_live.launch', Mode.REALTIME, (), at(29)),
            LaunchFile('sewing_cell', 'openni_play.launch', Mode.PLAYBACK, (), at(30))),
        nodes=(Node('sewing_cell', 'kinect_roi', 'kinect_roi', 'kinect', None,
                    {'output': 'screen'}, (), at(31)),))


def sewing_machine() -> Device:
    transform = ('-0.08 -0.08 0 1.570796 0 0 /sewing_machine/base /sewing_machine/needle 100')
    return Device(
        DeviceType.OTHER, 'sewing_machine', at(33),
        base=BaseFrame('sewing_machine/base', Pose((-0.667, -0.499, 0.05), (0, 0, 0)), at(34)),
        nodes=(
            Node('sewing_cell', 'sewing_machine.py', 'sewing_machine', 'sewing_machine', None,
                 {'output': 'screen'}, (), at(35)),
            Node('tf', 'static_transform_publisher', 'needle_frame_transformer',
                 'sewing_machine', None, {'args': transform, 'output': 'screen'}, (), at(36))),
        displays=(Display('MarkerArray', None, None, (), (), at(38)),),
        topics=tuple(Topic(f'/{name}', None, None, True, at(39 + index)) for index, name in
                     enumerate(('edge_finder_upper', 'edge_finder_lower', 'feed_rate_est'))))


def test_listing_6_1() -> None:
    golden = Cell(str(LISTING_6_1), 'world', (
        arm('ur_rt_upper', 'ft_upper', (0, 0, 0), 3),
        arm('ur_rt_lower', 'ft_lower', (0, 3.141592653589793, 0), 11),
        kinect(), sewing_machine()), files=(str(LISTING_6_1),))
    cell = XmlParser().parse(str(LISTING_6_1))
    for device, expected in zip(cell.devices, golden.devices):
        assert device == expected
    assert cell == golden


def test_listing_5_1() -> None:
    cell = XmlParser().parse(str(LISTING_5_1))
    camera, robot = cell.devices
    assert (camera.type, robot.type) == (DeviceType.DEPTH_SENSOR, DeviceType.ROBOT)
    assert camera.base is not None and camera.base.pose == Pose((-1, 0, 1.5), (0, 0.1, 0))
    assert [topic.record for topic in camera.topics] == [True] * 6 + [False]
    assert [file.mode for file in camera.launch_files] == [Mode.REALTIME, Mode.PLAYBACK]
    points = camera.topic_for(TopicFunction.POINTCLOUD)
    assert points is not None and points.name == '/camera/depth_registered/points'
    assert robot.base is not None and robot.base.frame == 'R2D2/base_link'
    assert robot.base.pose == Pose((2, 0, 0.5), (1.570796, 0, 0))
    assert robot.model is not None and robot.model.path == 'urdf/R2D2.xacro'
    assert robot.nodes[0].namespace == 'R2D2'
    assert robot.topic_for(TopicFunction.JOINT_STATES) is None


def test_devices_are_found_by_name() -> None:
    cell = XmlParser().parse(str(LISTING_5_1))
    assert cell.device('R2D2').type is DeviceType.ROBOT
    with pytest.raises(KeyError):
        cell.device('C3PO')
