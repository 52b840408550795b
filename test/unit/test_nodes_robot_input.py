# SPDX-License-Identifier: BSD-3-Clause
"""Input of a robot: standard messages; unusable ones are reported and left out."""
from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticStatus
from geometry_msgs.msg import PoseStamped, WrenchStamped
from robot_stage import RobotStage, array, moving_tool
from rospy import AnyMsg, Time
from simulated_node import any_message
from std_msgs.msg import Float32MultiArray, String

ARRAY, TEXT = Float32MultiArray._type, String._type
POSE, WRENCH = PoseStamped._type, WrenchStamped._type
TOPICS = {'tool_center_frame': {'name': '/s/tool'}, 'force_sensor': {'name': '/s/force'}}


@pytest.fixture
def robot() -> RobotStage:
    """A robot that accepts any type of message."""
    return RobotStage({'base_frame': 'base', 'topics': TOPICS}, 's')


def pose(frame: str = 'base', stamp_s: float = 0.0, w: float = 1.0, x: float = 0.5) -> PoseStamped:
    message = PoseStamped()
    message.header.frame_id, message.header.stamp = frame, Time.from_sec(stamp_s)
    message.pose.position.x, message.pose.orientation.w = x, w
    return message


def wrench(x: float) -> WrenchStamped:
    message = WrenchStamped()
    message.wrench.force.x = x
    return message


def cut(message: Any) -> AnyMsg:
    """Return a truncated message."""
    found = any_message(message)
    found._buff = found._buff[:-3]
    return found


def test_standard_messages(robot: RobotStage) -> None:
    def drive(time_s: float) -> None:
        robot.send('/s/tool', pose(stamp_s=robot.node.now_s, x=0.1 * time_s))
        robot.send('/s/force', wrench(3.0))
    robot.run(1.0, drive)
    np.testing.assert_allclose(robot.velocity(), [0.1, 0.0, 0.0], atol=1e-6)
    assert robot.node.sent('tool_force')[-1].header.frame_id == 's/tool'
    assert (robot.text(), robot.text('force')) == ('v 0.100 m/s', 'F 3.0 N')


BAD = [
    ('/s/tool', array(1, 2, 3, 4), '3 values (x y z), 6 (with a rotation vector) or 7'),
    ('/s/tool', array(0, 0, np.nan, 0, 0, 0), 'it holds NaN or infinity'),
    ('/s/tool', pose(frame='elsewhere'), 'its frame is elsewhere, which neither the model nor a '
     'static transform connects with the base frame base'),
    ('/s/tool', pose(w=np.nan), 'it holds NaN or infinity'),
    ('/s/tool', String('there'), f'it carries {TEXT}, and {ARRAY} or {POSE} is expected'),
    ('/s/tool', cut(pose()), f'its bytes are not those of {POSE}'),
    ('/s/force', array(1, 2), '3 values (a force) or 6'),
    ('/s/force', array(np.inf, 0, 0), 'it holds NaN or infinity'),
    ('/s/force', wrench(np.nan), 'it holds NaN or infinity'),
    ('/s/force', String('strong'), f'it carries {TEXT}, and {ARRAY} or {WRENCH} is expected'),
]


@pytest.mark.parametrize('topic, message, problem', BAD)
def test_bad_input_is_named_and_the_last_good_state_stays(
        robot: RobotStage, topic: str, message: Any, problem: str) -> None:
    drive = moving_tool(robot, '/s/tool', (0.0, 0.1, 0.0))
    robot.run(0.5, drive, lambda _: robot.send('/s/force', array(0, 0, 20)))
    shown = robot.velocity(), robot.markers()['force', 0]
    robot.forget()
    robot.run(0.2, lambda _: robot.send(topic, message), hz=20.0)
    assert robot.warnings(f's: a message on {topic} is left out: {problem}')
    if topic == '/s/tool':
        assert all(np.allclose(it, shown[0], atol=1e-6) for it in robot.velocities())
    else:
        assert robot.markers()['force', 0] == shown[1]
        assert not robot.node.sent('tool_force')
    robot.run(1.0, lambda _: robot.send(topic, message), hz=20.0)
    assert robot.text('velocity' if topic == '/s/tool' else 'force').find('no data for') == 2
    robot.run(0.5, drive, lambda _: robot.send('/s/force', array(0, 0, 20)))
    assert (robot.text(), robot.text('force')) == ('v 0.100 m/s', 'F 20.0 N')


def test_a_type_that_the_configuration_does_not_name() -> None:
    robot = RobotStage({'base_frame': 'base', 'topics': {
        'force_sensor': {'name': 'wrench', 'msg': WRENCH}}}, 's')
    robot.send('/s/wrench', array(1, 2, 3))
    assert robot.warnings('s: a message on /s/wrench', f'it carries {ARRAY}, and {WRENCH} is')
    assert not robot.node.sent('tool_force')


def test_stamps_that_stand_still_are_named(robot: RobotStage) -> None:
    stamp_s = robot.node.now_s
    robot.run(0.1, lambda _: robot.send('/s/tool', pose(stamp_s=stamp_s)))
    assert robot.warnings('s: a message on /s/tool is shown, but its stamp is not later than')


def test_ros_time_that_stands_still_or_goes_back_is_named(robot: RobotStage) -> None:
    """Its messages are shown anyway."""
    drive = moving_tool(robot, '/s/tool', (0.0, 0.1, 0.0))
    node, begin_s = robot.node, robot.node.now_s

    def stand_still(_time_s: float) -> None:
        node.ros_offset_s = begin_s - node.now_s
    robot.run(1.5, stand_still, drive)
    assert robot.warnings('s: a message on /s/tool is shown, but ROS time is not advancing')
    robot.run(6.0, drive)
    assert robot.text() == 'v 0.100 m/s'
    node.ros_offset_s -= 100.0
    robot.run(1.0, drive)
    assert robot.warnings('s: a message on /s/tool is shown, but ROS time has gone back')
    assert robot.text() == 'v 0.100 m/s'


def test_a_complaint_stands_on_diagnostics_while_it_holds(robot: RobotStage) -> None:
    name = '/s/robot_proc: /s/tool'
    robot.run(2.0, lambda _: robot.send('/s/tool', pose(w=np.nan)))
    bad = robot.reports(name, 'NaN or infinity')
    assert {status.level for status in bad} == {DiagnosticStatus.WARN}
    assert 4 <= len(bad) <= 5  # at once, and twice per second
    assert {it.key: it.value for it in bad[-1].values} == {'messages': '250', 'for_s': '2.0'}
    robot.run(4.0, lambda _: robot.send('/s/tool', pose()))
    assert robot.reports(name)[-1].level == DiagnosticStatus.OK
    robot.forget()
    robot.run(1.0, lambda _: robot.send('/s/tool', pose()))
    assert robot.reports(name) == []


def test_a_complaint_is_logged_when_it_begins_and_now_and_then_while_it_holds(
        robot: RobotStage) -> None:
    robot.run(11.0, lambda _: robot.send('/s/tool', pose(w=np.nan)))
    assert len(robot.warnings('NaN or infinity')) == 3


def test_a_description_that_is_no_urdf_is_named() -> None:
    robot = RobotStage({'topics': TOPICS}, 's', model='<robot')
    robot.node.advance(0.1)
    assert robot.warnings('s: parameter /s/robot_description: a URDF is expected')
    robot.run(0.5, moving_tool(robot, '/s/tool', (0.0, 0.1, 0.0)))
    np.testing.assert_allclose(robot.velocity(), [0.0, 0.1, 0.0], atol=1e-6)


def test_a_frame_that_tf_does_not_know_is_named() -> None:
    robot = RobotStage({'force_frame': 'loose/force', 'topics': {
        'tool_center_frame': {'name': '/loose/tcf'}, 'force_sensor': {'name': '/loose/ft'}}},
        'loose')

    def drive(time_s: float) -> None:
        robot.send('/loose/tcf', array(0.5, 0, 0.2, 0, 0, 0))
        robot.send('/loose/ft', array(0, 0, 20))
    robot.run(4.0, drive)
    assert robot.node.log == []  # other nodes may start later
    assert not robot.node.listens('/tf')  # expensive with many robots
    robot.run(1.5, drive)
    assert robot.node.listens('/tf')
    robot.run(2.5, drive)
    assert not robot.node.listens('/tf')
    assert robot.warnings('loose: the data of /loose/ft is not drawn, as tf does not connect the '
                          'frame loose/force with loose/link0')
    assert not robot.warnings('/loose/tcf')  # it is drawn at the reported position
