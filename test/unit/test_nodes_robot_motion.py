# SPDX-License-Identifier: BSD-3-Clause
"""The arrows of a robot: velocity and force, their positions, and the end of data."""
from __future__ import annotations

from typing import Any, Dict, List

import numpy as np
import pytest
import rospy
from geometry_msgs.msg import WrenchStamped
from robot_stage import MODELS, RobotStage, array, direction, moving_tool, transform
from sensor_msgs.msg import JointState
from simulated_node import any_message
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import Marker

from process_visualizer.msg import PlayerState
from process_visualizer.robot.kinematics import Kinematics, Placement

PARAMETERS = {'force_frame': 'r/force',
              'topics': {'joint_states': {'name': '/r/q_act'},
                         'tool_center_frame': {'name': '/r/tcf'},
                         'force_sensor': {'name': '/ft/ft'}}}
TICK_S = 0.1


@pytest.fixture
def robot() -> RobotStage:
    """The robot of robot.urdf, with the messages of the thesis."""
    return RobotStage(PARAMETERS, model='robot.urdf')


def joints(robot: RobotStage, *positions: float) -> None:
    """Send joint states as joint_proc does."""
    robot.send('/r/joint_states', JointState(name=['r/turn', 'r/slide'], position=positions))


def text_of(message: Any) -> List[str]:
    """Return the text of the velocity in an array of markers, if there is one."""
    return [it.text.strip() for it in message.markers if (it.ns, it.id) == ('velocity', 1)]


def test_velocity_of_a_moving_tool(robot: RobotStage) -> None:
    joints(robot, np.pi / 2, 0.0)  # the model's tool is turned, the reported one is not
    robot.run(2.0, moving_tool(robot, '/r/tcf', (0.0, 0.1, 0.0)))
    # Each pose waits for the following one.
    np.testing.assert_allclose(robot.velocities(200), [[0.0, 0.1, 0.0]] * 200, atol=1e-6)
    assert robot.twists[-1].header.frame_id == 'r/link0'
    arrow = robot.markers()['velocity', 0]
    assert (arrow.header.frame_id, arrow.frame_locked) == ('r/tool', True)
    # The tool's x axis points along the base's y axis.
    np.testing.assert_allclose(direction(arrow), [1.0, 0.0, 0.0], atol=1e-6)
    assert robot.text() == 'v 0.100 m/s'


def test_markers_come_as_fast_as_a_screen_can_show_them(robot: RobotStage) -> None:
    robot.run(0.5, moving_tool(robot, '/r/tcf', (0.0, 0.1, 0.0)))
    robot.forget()
    robot.run(4.0, moving_tool(robot, '/r/tcf', (0.0, 0.1, 0.0)))
    assert len(robot.arrays) == pytest.approx(4.0 * 30.0, abs=1)
    assert len(robot.twists) == 500


@pytest.mark.parametrize('model', ['', 'robot.urdf'])
def test_a_robot_without_markers_says_so(model: str) -> None:
    """RViz treats a topic without messages as a dead process; the view picture waits for it."""
    robot = RobotStage({'topics': {}}, model=model)
    robot.run(1.0)
    assert robot.arrays and not robot.markers()


def test_without_subscribers_nothing_is_published(robot: RobotStage) -> None:
    for publisher in robot.node.publishers.values():
        publisher.connections = 0
    robot.run(1.0, moving_tool(robot, '/r/tcf', (0.0, 0.1, 0.0)))
    assert not robot.arrays and not robot.twists


def test_angular_velocity(robot: RobotStage) -> None:
    robot.run(1.5, lambda time_s: robot.send(
        '/r/tcf', array(0.5, 0.0, 0.2, 0.0, 0.0, 0.8 * time_s)))
    assert [it.twist.angular.z for it in robot.twists[-80:]] == pytest.approx([0.8] * 80, abs=1e-4)
    age_s = robot.node.now_s - robot.twists[-1].header.stamp.to_sec()
    assert 0.1 <= age_s < 0.17  # the middle of the window of 0.2 s, after poses have waited


def test_tool_frame_from_tf() -> None:
    robot = RobotStage({'base_frame': 'f/base', 'tool_frame': 'f/tip', 'topics': {
        'tool_center_frame': {'name': '/tf', 'msg': 'tf2_msgs/TFMessage', 'frame': 'f/tip'}}}, 'f')
    robot.send('/tf_static', TFMessage([transform('f/flange', 'f/tip', 0.0, 0.0, 0.0, 0.25)]))

    def drive(time_s: float) -> None:
        robot.send('/tf', TFMessage([transform('f/base', 'f/flange', robot.node.now_s,
                                               0.1 * time_s, 0.0, 0.0)]))
        robot.send('/tf', TFMessage([transform('others', 'frame', robot.node.now_s)]))
    robot.run(1.0, drive, hz=60.0)
    assert robot.node.log == []
    np.testing.assert_allclose(robot.velocities(30), [[0.1, 0.0, 0.0]] * 30, atol=1e-6)
    assert robot.twists[-1].header.frame_id == 'f/base'
    assert robot.markers()['velocity', 0].header.frame_id == 'f/tip'


def test_transforms_after_a_clock_that_was_set_back() -> None:
    """The old ones would prevent the use of the new ones."""
    robot = RobotStage({'base_frame': 'f/base', 'tool_frame': 'f/tip', 'topics': {
        'tool_center_frame': {'name': '/tf', 'msg': 'tf2_msgs/TFMessage'}}}, 'f')

    def drive(time_s: float) -> None:
        robot.send('/tf', TFMessage([transform('f/base', 'f/tip', robot.node.ros_s(),
                                               0.1 * time_s, 0.0, 0.0)]))
    robot.run(1.0, drive)
    robot.node.ros_offset_s = -500.0
    robot.forget()
    robot.run(1.0, drive)
    np.testing.assert_allclose(robot.velocity(), [0.1, 0.0, 0.0], atol=1e-6)
    assert len(robot.twists) > 60


def test_a_standing_tool_has_no_arrow_and_a_stopped_driver_is_shown(robot: RobotStage) -> None:
    robot.run(1.0, moving_tool(robot, '/r/tcf', (0.0, 0.0, 0.0)))
    assert robot.markers()['velocity', 0].action == Marker.DELETE
    assert robot.text() == 'v 0.000 m/s'
    robot.run(2.1)
    assert robot.text().startswith('v no data for 2.')


def test_stopped_drivers_are_shown_within_a_second(robot: RobotStage) -> None:
    """The gray arrow, its number, and the joints; 0.7 s after the last data, not earlier."""
    joints(robot, 0.1, 0.2)
    robot.run(0.7, moving_tool(robot, '/r/tcf', (0.0, 0.1, 0.0)))
    joints(robot, 0.1, 0.2)
    stopped_s = robot.node.now_s
    grey_s: Dict[str, float] = {}
    for _ in range(100):
        robot.forget()
        robot.node.advance(0.01)
        for marker in (it for message in robot.arrays for it in message.markers):
            gray = marker.color.r == marker.color.g == marker.color.b
            told = marker.type == Marker.ARROW or 'no data for' in marker.text
            if gray and told and marker.action == Marker.ADD:
                grey_s.setdefault(f'{marker.ns} {marker.type}', robot.node.now_s - stopped_s)
    assert set(grey_s) == {f'velocity {Marker.ARROW}', f'velocity {Marker.TEXT_VIEW_FACING}',
                           f'joints {Marker.TEXT_VIEW_FACING}'}
    assert min(grey_s.values()) >= 0.7 - 0.01  # the last pose came a period earlier
    assert max(grey_s.values()) <= 0.7 + 2 * TICK_S  # a tick, and the period of the numbers


def test_what_is_left_from_the_live_robot_grows_old_in_paused_playback(robot: RobotStage) -> None:
    wrench = WrenchStamped()
    wrench.header.frame_id, wrench.wrench.force.z = 'r/link0', 9.0
    robot.send('/ft/ft', wrench)
    joints(robot, 0.1, 0.2)
    robot.run(0.5)
    paused = PlayerState(since=robot.node.now(), rate=1.0, paused=True)
    for _ in range(20):
        paused.stamp = robot.node.now()
        robot.send('/bag_player/state', paused)
        robot.run(0.1)
    assert robot.text('force').startswith('F no data for 2.')
    assert robot.text('joints').startswith('joints no data for 2.')


def test_before_its_first_wrench_a_recording_has_no_force(robot: RobotStage) -> None:
    """The force at the position before the jump remained."""
    wrench = WrenchStamped()
    wrench.header.frame_id, wrench.wrench.force.z = 'r/link0', 9.0
    texts = []
    for segment, not_begun in enumerate(([], ['/ft/ft'])):
        robot.send('/bag_player/state', PlayerState(
            stamp=robot.node.now(), since=robot.node.now(), rate=1.0, paused=True, segment=segment,
            not_begun=not_begun))
        if not not_begun:
            robot.send('/ft/ft', wrench)
        robot.run(0.2)
        texts.append(robot.text('force'))
    assert texts == ['F 9.0 N', '']


@pytest.mark.parametrize('model, said', [('', 'no model'), ('robot.urdf', 'no joints')])
def test_a_robot_without_joints_says_that_it_is_not_where_it_is_drawn(model: str, said: str
                                                                      ) -> None:
    robot = RobotStage(PARAMETERS, model=model)
    robot.run(1.9)
    assert ('joints', 1) not in robot.markers()
    robot.run(0.5)
    marker = robot.markers()['joints', 1]
    assert marker.text.strip() == f'{said}: its pose is unknown'
    assert marker.header.frame_id == 'r/link0'  # no other frame of it is known
    joints(robot, 0.1, 0.2)
    robot.run(0.2)
    assert robot.markers()['joints', 1].action == Marker.DELETE


def test_joint_states_that_come_again_end_the_text(robot: RobotStage) -> None:
    joints(robot, 0.1, 0.2)
    robot.run(1.0)
    assert robot.text('joints').startswith('joints no data for ')
    joints(robot, 0.1, 0.2)
    robot.run(0.2)
    assert robot.markers()['joints', 1].action == Marker.DELETE


def test_arrows_are_drawn_with_the_joint_states_that_move_the_drawn_robot(robot: RobotStage
                                                                          ) -> None:
    """Also if there are fewer of them than the screen could show."""
    drive = moving_tool(robot, '/r/tcf', (0.0, 0.1, 0.0))
    robot.run(0.5, drive)
    joints(robot, 0.1, 0.2)
    drawn = {'poses': 0, 'joints': 0}
    for step in range(400):
        robot.node.advance(0.008)
        robot.forget()
        drive(0.5 + 0.008 * step)
        drawn['poses'] += len(robot.arrays)
        robot.forget()
        if step % 8 == 7:
            joints(robot, 0.1, 0.2)
        drawn['joints'] += len(robot.arrays)
    assert drawn['poses'] == 0 and drawn['joints'] > 30


def test_the_last_poses_before_a_driver_stops_count(robot: RobotStage) -> None:
    """Poses wait for the following ones, but not forever."""
    robot.run(0.2, moving_tool(robot, '/r/tcf', (0.0, 0.1, 0.0)), hz=10.0)
    robot.node.advance(0.3)
    assert robot.text() == 'v 0.100 m/s'


def test_arrow_and_tool_are_at_one_place_at_every_moment(robot: RobotStage) -> None:
    model = Kinematics((MODELS / 'robot.urdf').read_text())
    distances_m = []
    for step in range(400):
        robot.forget()
        turn, slide = step * 0.01, 0.25 + step * 1e-4
        reach = 0.5 + slide
        robot.send('/r/tcf', array(reach * np.cos(turn), reach * np.sin(turn), 0.3, 0.0, 0.0, turn))
        joints(robot, turn, slide)
        robot.node.advance(0.008)
        for arrow in (it for message in robot.arrays for it in message.markers
                      if (it.ns, it.id, it.action) == ('velocity', 0, Marker.ADD)):
            foot = arrow.pose.position
            place = model.placement(arrow.header.frame_id, 'r/link0',
                                    {'r/turn': turn, 'r/slide': slide})
            drawn = place.then(Placement((foot.x, foot.y, foot.z))).position
            distances_m.append(np.linalg.norm(np.subtract(
                drawn, (reach * np.cos(turn), reach * np.sin(turn), 0.3))))
    assert len(distances_m) > 50
    assert max(distances_m) < 1e-9


def test_force(robot: RobotStage) -> None:
    robot.send('/ft/ft', array(0.0, 0.0, 45.0, 0.1, 0.2, 0.3))
    wrench, markers = robot.node.sent('tool_force')[-1], robot.markers()
    assert wrench.header.frame_id == 'r/force'
    assert wrench.header.stamp.to_sec() == pytest.approx(robot.node.now_s)
    assert (wrench.wrench.force.z, round(wrench.wrench.torque.y, 6)) == (45.0, 0.2)
    assert markers['force', 0].header.frame_id == 'r/force'
    assert markers['force', 0].scale.x == pytest.approx(0.6)  # the upper limit
    assert robot.text('force') == 'F 45.0 N'


def test_playback_rate_scales_the_time_while_it_changes(robot: RobotStage) -> None:
    """For another player than our own, one that sets the parameter."""
    drive = moving_tool(robot, '/r/tcf', (0.0, 0.1, 0.0))
    for rate in (2.0, -1.0, 0.5):
        robot.node.params['/process_visualizer/playback_rate'] = rate
        robot.run(1.5, drive)
        assert robot.velocity()[1] == pytest.approx(0.1 / rate, abs=1e-4)


JOINTS_ONLY = {'force_frame': 'r/force', 'topics': {'joint_states': {'name': '/r/q_act'},
                                                    'force_sensor': {'name': '/ft/ft'}}}


@pytest.mark.parametrize('hz', [125.0, 30.0])
def test_a_driver_without_poses_has_velocity_and_force_at_the_tool_of_the_model(hz: float) -> None:
    """The joints come one by one: 0.5 rad/s at 0.6 m, and the slide is at rest."""
    robot = RobotStage(JOINTS_ONLY, model='robot.urdf')

    def drive(time_s: float) -> None:
        for name, position in (('r/slide', 0.1), ('r/turn', 0.5 * time_s)):
            state = JointState(name=[name], position=[position])
            state.header.stamp = robot.node.now()
            robot.send('/r/joint_states', state)
        wrench = WrenchStamped()
        wrench.header.frame_id, wrench.wrench.force.z = 'r/link0', 9.0
        robot.send('/ft/ft', wrench)
    robot.run(2.0, drive, hz=hz)
    speeds = np.linalg.norm(robot.velocities(10), axis=1)
    np.testing.assert_allclose(speeds, 0.3, rtol=0.01)
    markers = robot.markers()
    assert (robot.speed(), robot.text('force')) == (0.3, 'F 9.0 N')
    for name in ('velocity', 'force'):
        assert (markers[name, 0].header.frame_id, markers[name, 0].frame_locked) == ('r/tool', True)
    assert robot.warnings() == []
    robot.node.advance(2.0)
    assert 'v no data for' in robot.text()


@pytest.mark.parametrize('topic, value', [('/r/tcf', 0.5), ('/ft/ft', 12.0)])
def test_two_publishers_that_contradict_each_other_are_named(robot: RobotStage, topic: str,
                                                             value: float) -> None:
    def drive(_time_s: float) -> None:
        for publisher, there in (('/driver', value), ('/simulator', 0.0)):
            message = any_message(array(there, 0.0, 0.3, 0.0, 0.0, 0.0))
            message._connection_header['callerid'] = publisher
            robot.send(topic, message)
    robot.run(1.0, drive)
    assert robot.warnings(topic, '2 nodes publish on this topic, /driver, /simulator')
    assert robot.reports('2 nodes publish')


def test_a_force_has_the_stamp_of_its_measurement(robot: RobotStage) -> None:
    for age_s, shown_age_s in ((0.15, 0.15), (0.0, 0.0), (5.0, 0.0), (-0.2, 0.0)):
        robot.forget()
        robot.node.advance(2.0)
        wrench = WrenchStamped()
        wrench.header.stamp = rospy.Time.from_sec(robot.node.now_s - age_s)
        robot.send('/ft/ft', wrench)
        (shown,) = robot.node.sent('tool_force')
        assert robot.node.now_s - shown.header.stamp.to_sec() == pytest.approx(shown_age_s)


def test_a_latency_that_is_known_is_taken_off_the_stamps() -> None:
    topics = {'tool_center_frame': {'name': '/r/tcf', 'latency': 0.3},
              'force_sensor': {'name': '/ft/ft', 'latency': 0.1}}
    late, plain = (RobotStage({'force_frame': 'r/force', 'topics': {
        name: {**it, **without} for name, it in topics.items()}}, model='robot.urdf')
        for without in ({}, {'latency': 0.0}))
    for robot in (late, plain):
        robot.run(2.0, moving_tool(robot, '/r/tcf', (0.0, 0.1, 0.0)))
        robot.send('/ft/ft', array(0.0, 0.0, 45.0))
    for topic, by_s in (('tool_velocity', 0.3), ('tool_force', 0.1)):
        stamps_s = [robot.node.sent(topic)[-1].header.stamp.to_sec() for robot in (plain, late)]
        assert stamps_s[0] - stamps_s[1] == pytest.approx(by_s, abs=1e-6)
    np.testing.assert_allclose(late.velocities(100), [[0.0, 0.1, 0.0]] * 100, atol=1e-6)
