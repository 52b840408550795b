# SPDX-License-Identifier: BSD-3-Clause
"""The draft for any observed cell can be read, and contains what was observed."""
from __future__ import annotations

import dataclasses
import tempfile
from pathlib import Path
from typing import List, Tuple

import pytest
from hypothesis import given
from seen_cells import (
    CLOUD,
    FLOATS,
    IMAGE,
    INFO,
    JOINTS,
    POSE,
    WRENCH,
    cells,
    model,
    number,
    transform,
    written,
)

from process_visualizer.cell.model import Device, TopicFunction
from process_visualizer.discovery.make_draft import make_draft
from process_visualizer.discovery.robot_topics import FoundModel
from process_visualizer.discovery.seen import Seen, SeenDescription, SeenNumber, SeenTopic
from process_visualizer.discovery.topic_groups import device_topics
from process_visualizer.robot.description import describe_devices

UR_JOINTS, PANDA_JOINTS = ['pan', 'lift', 'elbow'], ['panda_joint1', 'panda_joint2']


@given(cells)
def test_whatever_is_seen_can_be_read(cell: Tuple[Seen, List[FoundModel]]) -> None:
    if not make_draft(*cell).draft.devices:
        return
    with tempfile.TemporaryDirectory() as folder:
        _, read = written(*cell, Path(folder))
        assert describe_devices(read.devices)[1] == []


def functions(device: Device) -> List[str]:
    return [device.topic_for(it).name if device.topic_for(it) else ''  # type: ignore[union-attr]
            for it in (TopicFunction.JOINT_STATES, TopicFunction.TOOL_CENTER_FRAME,
                       TopicFunction.FORCE_SENSOR)]


def test_two_robots_of_other_makers(tmp_path: Path) -> None:
    models = [model('/ur5e', 'ur5e_robot', ['base_link', 'tool0'], UR_JOINTS),
              model('', 'panda', ['panda_link0', 'panda_hand'], PANDA_JOINTS)]
    topics = [SeenTopic('/joint_states', JOINTS, joints=(*UR_JOINTS, *PANDA_JOINTS)),
              SeenTopic('/ur5e/joint_states', JOINTS, joints=tuple(UR_JOINTS)),
              SeenTopic('/ur5e/tcp_pose', POSE, frames=('base_link',)),
              SeenTopic('/ur5e/target_pose', POSE, frames=('base_link',)),
              SeenTopic('/ur5e/wrench', WRENCH, frames=('tool0',)),
              SeenTopic('/franka_state_controller/ee_pose', POSE, frames=('panda_link0',)),
              SeenTopic('/franka_state_controller/F_ext', WRENCH, frames=('panda_K',))]
    _, cell = written(Seen('x', tuple(topics), (transform('world', 'panda_link0', 1.0, 0.0, 0.0),)),
                      models, tmp_path)
    ur, panda = cell.devices[:2]
    assert (ur.name, functions(ur)) == (
        'ur5e_robot', ['/ur5e/joint_states', '/ur5e/tcp_pose', '/ur5e/wrench'])
    assert (panda.name, functions(panda)) == (
        'panda', ['/joint_states', '/franka_state_controller/ee_pose',
                  '/franka_state_controller/F_ext'])
    assert panda.base is not None and panda.base.pose.xyz == (1.0, 0.0, 0.0)
    assert panda.force is not None
    assert (panda.force.frame, panda.force.parent_frame) == ('panda_K', 'panda_hand')
    assert '/ur5e/target_pose' in [topic.name for topic in ur.topics]


def test_two_robots_of_one_model_get_a_prefix(tmp_path: Path) -> None:
    models = [model(f'/{side}', 'panda', ['link0', 'hand'], PANDA_JOINTS)
              for side in ('left', 'right')]
    topics = [SeenTopic(f'/{side}/joint_states', JOINTS, joints=tuple(PANDA_JOINTS))
              for side in ('right', 'left')]
    _, cell = written(Seen('x', tuple(topics)), models, tmp_path)
    assert [(it.name, functions(it)[0]) for it in cell.devices] == [
        ('left_robot', '/left/joint_states'), ('right_robot', '/right/joint_states')]
    assert [it.base.frame for it in cell.devices if it.base] == ['link0', 'right/link0']
    assert describe_devices(cell.devices)[1] == []


def test_arrays_by_their_names(tmp_path: Path) -> None:
    topics = [SeenTopic(f'/ur_{side}/{name}', FLOATS, length=6)
              for side in ('upper', 'lower') for name in ('q_act', 'qd_act', 'tcf')]
    topics += [SeenTopic(f'/ft_{side}/ft', FLOATS, length=6) for side in ('lower', 'upper')]
    text, cell = written(Seen('x', tuple(topics)), [], tmp_path)
    assert {it.name: functions(it) for it in cell.devices} == {
        'ur_upper': ['/ur_upper/q_act', '/ur_upper/tcf', '/ft_upper/ft'],
        'ur_lower': ['/ur_lower/q_act', '/ur_lower/tcf', '/ft_lower/ft']}
    assert '<!-- <model pkg="my_robot_description"' in text


def test_a_robot_without_joint_states_is_a_model(tmp_path: Path) -> None:
    text, cell = written(Seen('x'), [model('/arm', 'a', ['b', 't'], ['j'])], tmp_path)
    assert [(it.type.value, it.name) for it in cell.devices] == [('other', 'arm')]
    assert 'No node was seen that publishes joints of arm.' in text


def camera(*names: str) -> List[SeenTopic]:
    kinds = {'camera_info': INFO, 'points': CLOUD}
    return [SeenTopic(f'/cam/{name}', kinds.get(name.rpartition('/')[2], IMAGE),
                      frames=('optical',)) for name in names]


CAMERA = ('depth_registered/image_raw', 'depth_registered/camera_info', 'rgb/image_color',
          'rgb/camera_info')
CAMERA_FRAMES = (transform('world', 'cam_link', 0.0, 0.0, 2.0),
                 transform('cam_link', 'optical', 0.0, 0.1, 0.0))


def test_depth_sensor_with_its_cloud(tmp_path: Path) -> None:
    topics = camera(*CAMERA, 'depth_registered/points')
    _, cell = written(Seen('x', tuple(topics), CAMERA_FRAMES), [], tmp_path)
    [sensor] = cell.devices
    assert sensor.base is not None
    assert (sensor.base.frame, sensor.base.pose.xyz) == ('cam_link', (0.0, 0.0, 2.0))
    cloud = sensor.topic_for(TopicFunction.POINTCLOUD)
    assert cloud is not None and (cloud.name, cloud.record) == (
        '/cam/depth_registered/points', False)
    frame, nodelet = sensor.nodes
    assert frame.attributes['args'] == '0 0.1 0 0 0 0 1 cam_link optical'
    assert nodelet.attributes['args'] == 'standalone depth_image_proc/point_cloud_xyzrgb'
    assert {it.mode.value for it in sensor.nodes if it.mode} == {'playback'}


def test_cloud_is_computed_where_only_images_are_seen(tmp_path: Path) -> None:
    _, cell = written(Seen('x', tuple(camera(*CAMERA[:2]))), [], tmp_path)
    [sensor] = cell.devices
    cloud = sensor.topic_for(TopicFunction.POINTCLOUD)
    assert cloud is not None and (cloud.name, cloud.record) == ('/cam/cloud', False)
    [nodelet] = sensor.nodes
    assert nodelet.mode is None
    assert [it.attributes for it in nodelet.children][-1] == {'from': 'points', 'to': '/cam/cloud'}


def test_camera_on_a_robot_has_no_base_frame(tmp_path: Path) -> None:
    arm = model('/arm', 'arm', ['base', 'hand'], ['j'])
    seen = Seen('x', tuple(camera('depth_registered/points')), (
        transform('hand', 'cam_link'), *CAMERA_FRAMES[1:]))
    text, cell = written(seen, [arm], tmp_path)
    sensor = cell.device('cam')
    assert sensor.base is None and 'cam is fixed to hand.' in text
    assert [it.attributes['args'].split()[-2:] for it in sensor.nodes] == [
        ['cam_link', 'optical'], ['hand', 'cam_link']]


def test_what_is_drawn_in_frames_of_its_own_has_these(tmp_path: Path) -> None:
    """In playback nobody else publishes the frames of a machine's markers; one of them moved."""
    topic = SeenTopic('/press/markers', 'visualization_msgs/MarkerArray',
                      frames=('press/base', 'press/needle', 'press/ram', 'world'))
    moved = transform('press/base', 'press/ram', 0.0, 0.0, 0.5)._replace(changes=True)
    frames = (transform('world', 'press/base', 1.0, 2.0, 0.0),
              transform('press/base', 'press/needle', 0.0, 0.0, 0.3), moved)
    text, cell = written(Seen('x', (topic,), frames), [], tmp_path)
    [press] = cell.devices
    assert press.base is not None
    assert (press.base.frame, press.base.pose.xyz) == ('press/base', (1.0, 2.0, 0.0))
    assert [it.attributes['args'] for it in press.nodes] == [
        '0 0 0.3 0 0 0 1 press/base press/needle']
    assert '<!-- moved while it was observed' in text


def test_variables(tmp_path: Path) -> None:
    topics = (
        SeenTopic('/oven/temperature', 'sensor_msgs/Temperature', frames=('oven_frame',),
                  numbers=(number('temperature', 180.0, 190.0), number('variance', 0.0, 1.0))),
        SeenTopic('/feed', 'std_msgs/Float64', numbers=(number('data', -0.5, 0.2),)),
        SeenTopic('/fixed', 'std_msgs/Float64', numbers=(number('data', 3.0, 3.0),)),
        SeenTopic('/count', 'std_msgs/UInt32', numbers=(SeenNumber('data', 0, 9, True, True),)),
        SeenTopic('/odd', 'my/Odd', numbers=tuple(number(f'a{i}') for i in range(9))))
    text, cell = written(Seen('x', topics, (transform('world', 'oven_frame', 1.0, 2.0, 0.0),)), [],
                         tmp_path)
    oven, sensors = cell.devices
    assert oven.base is not None
    assert (oven.base.frame, oven.base.pose.xyz) == ('oven_frame', (1.0, 2.0, 0.0))
    [temperature] = oven.variables
    assert (temperature.unit, temperature.frame, temperature.field) == (
        '°C', 'oven_frame', 'temperature')
    assert temperature.offset == 180.0 and temperature.scale * 10.0 == pytest.approx(0.3)
    assert [it.topic for it in sensors.variables] == ['/feed', *6 * ['/odd']]
    assert '<!-- <variable topic="fixed"' in text
    assert [it.name for it in sensors.topics][:2] == ['/fixed', '/count']
    assert '/odd has 3 more numbers.' in text


@pytest.mark.parametrize('is_moment, scale, offset', [(False, 0.1, 192.0), (True, 0.008, 190.0)])
def test_a_number_that_was_seen_for_a_moment_may_go_far(tmp_path: Path, is_moment: bool,
                                                        scale: float, offset: float) -> None:
    topic = SeenTopic('/oven/temperature', 'sensor_msgs/Temperature', frames=('oven',),
                      numbers=(number('temperature', 192.0, 195.0),))
    _, cell = written(Seen('x', (topic,), is_moment=is_moment), [], tmp_path)
    [it] = cell.devices[0].variables
    assert (it.scale, it.offset, it.maximum_m) == (scale, offset, 0.6)


def test_names_do_not_collide_with_what_the_program_publishes(tmp_path: Path) -> None:
    """The robot's driver is in the namespace of robot_proc of a device "arm"."""
    topics = (SeenTopic('/arm/joint_states', JOINTS, ('/driver',), joints=('j',)),
              SeenTopic('/camera/points', CLOUD, frames=('c',)))
    _, cell = written(Seen('x', topics), [], tmp_path)
    assert [it.name for it in cell.devices] == ['arm_robot', 'camera_sensor']


def test_no_device_takes_the_place_of_a_drivers_description(tmp_path: Path) -> None:
    """Its model would be written to the same parameter."""
    arm = model('/arm', 'a', ['b', 't'], ['j'])
    seen = Seen('x', descriptions=(SeenDescription('/arm', arm.description.text),))
    assert [it.name for it in written(seen, [arm], tmp_path)[1].devices] == ['arm_device']


def test_own_outputs_are_left_out(tmp_path: Path) -> None:
    own = [('/a/joint_states', JOINTS, '/a/joint_proc'),
           ('/a/marker_array', 'm/A', '/a/robot_proc'),
           ('/c/roi_filter/outline', 'visualization_msgs/Marker', '/camera/manager'),
           ('/c/roi_points', CLOUD, '/camera/manager'),
           ('/c/objects_markers', 'visualization_msgs/MarkerArray', '/camera/manager'),
           ('/c/unknown_points', CLOUD, '/camera/manager'),
           ('/c/points', CLOUD, ''), ('/c/points_age', 'std_msgs/Float32', '/c/depth_proc'),
           ('/rosout', 'rosgraph_msgs/Log', '/x'),
           ('/clicked_point', 'geometry_msgs/PointStamped', '/rviz_1234'),
           ('/tf', 'tf2_msgs/TFMessage', '/x'), ('/move/goal', 'm/MoveActionGoal', '/x'),
           ('/process_visualizer/configuration', 'std_msgs/String', '/bag_recorder')]
    topics = [SeenTopic(name, kind, (node,), ('optical',), ('j',)) for name, kind, node in own]
    recorded = [dataclasses.replace(it, publishers=()) for it in topics[:2]]
    marks = SeenTopic('/a/tool_velocity', 'geometry_msgs/TwistStamped')
    whole = camera('depth_registered/points')
    [device] = make_draft(Seen('x', (*topics, *whole)), []).draft.devices
    assert [(it.attributes['ns'], it.attributes['name']) for it in device.elements
            if it.tag == 'topic'] == [('cam/depth_registered', 'points')]
    assert make_draft(Seen('x', (*recorded, marks)), []).draft.devices == []


@pytest.mark.parametrize('slash', ['/', ''])
def test_a_cropped_cloud_beside_its_camera_is_left_out(slash: str) -> None:
    """Also if a recorder wrote names without the leading slash, or the frames are unknown."""
    topics = [SeenTopic(f'{slash}cam/{name}', kind) for name, kind in (
        ('depth/points', CLOUD), ('roi_points', CLOUD),
        ('roi_filter/outline', 'visualization_msgs/Marker'))]
    assert [it.name for it in device_topics(topics)] == [f'{slash}cam/depth/points']


@pytest.mark.parametrize('others', [
    [], [SeenTopic('/eye/image_raw', IMAGE)], [SeenTopic('/eye/depth/image_raw/compressed',
                                                         'sensor_msgs/CompressedImage')],
    [SeenTopic('/eye/depth/image_raw', IMAGE)],  # no cloud without its camera info
    [SeenTopic('/front/points', CLOUD, frames=('front_optical',))]])
def test_a_cropped_cloud_stands_for_its_sensor(tmp_path: Path, others: List[SeenTopic]) -> None:
    """The whole cloud is often too large to be recorded."""
    topics = [SeenTopic('/eye/roi_filter/outline', 'visualization_msgs/Marker'),
              SeenTopic('/eye/roi_points', CLOUD, frames=('eye_optical',)),
              SeenTopic('/eye/points', CLOUD, frames=('eye_optical',))]
    _, cell = written(Seen('x', (*topics, *others)), [], tmp_path)
    clouds = [it.topic_for(TopicFunction.POINTCLOUD) for it in cell.devices]
    assert '/eye/roi_points' in [it.name for it in clouds if it is not None]
    assert len(cell.devices) == (2 if others and others[0].name == '/front/points' else 1)


def test_the_global_frame(tmp_path: Path) -> None:
    """It is the root of the robots; a model that has a link "world" keeps it."""
    arm = model('/arm', 'arm', ['base', 'hand'], ['j'])
    with_world = model('/arm', 'arm', ['world', 'base'], ['j'])
    carried = (transform('table', 'base', 0.5, 0.0, 0.0), transform('odd', 'other'))
    assert written(Seen('x', (), carried), [arm], tmp_path)[1].frame == 'table'
    assert written(Seen('x'), [arm], tmp_path)[1].frame == 'world'
    assert written(Seen('x', (), (transform('world', 'base'),)), [with_world],
                   tmp_path)[1].frame == 'cell'
