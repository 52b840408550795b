#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""A robot with its real nodes: joints to tf, the arrow at the tool, the force, complaints.

The nodes' handling of input is tested on a simulated clock (test/unit/test_nodes_robot_*);
this is the test of their connections.
"""
from __future__ import annotations

import subprocess
import time
import unittest
from typing import Callable, Dict, List, Optional, Sequence, Tuple

import numpy as np
import rospy
import rostest
import tf2_ros
from cloud_testing import Listener, log_listener, logged, wait_until
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import TwistStamped, WrenchStamped
from rosgraph_msgs.msg import Log
from roslib.packages import find_node
from sensor_msgs.msg import JointState
from std_msgs.msg import Float32MultiArray, Header
from visualization_msgs.msg import Marker, MarkerArray

RATE_PARAMETER = '/process_visualizer/playback_rate'


def array(*values: float) -> Float32MultiArray:
    """Return the thesis' message for a quantity."""
    return Float32MultiArray(data=values)


def publisher(topic: str, message_class: type = Float32MultiArray) -> rospy.Publisher:
    """Return a publisher that has a subscriber, one of the nodes."""
    result = rospy.Publisher(topic, message_class, queue_size=10)
    wait_until(lambda: result.get_num_connections() > 0, f'a subscriber of {topic}')
    return result


def last_markers(listener: Listener) -> Dict[Tuple[str, int], Marker]:
    """Return each marker's state in RViz."""
    return {(marker.ns, marker.id): marker
            for message in list(listener.messages) for marker in message.markers}


class RobotProcessorTest(unittest.TestCase):
    """Plays the drivers of a robot."""

    @classmethod
    def setUpClass(cls) -> None:
        cls.log = log_listener()  # early, so that it misses nothing
        cls.joints, cls.tool, cls.force = map(publisher, ('/r/q_act', '/r/tcf', '/ft/ft'))
        cls.buffer = tf2_ros.Buffer()
        tf2_ros.TransformListener(cls.buffer)

    def move(self) -> None:
        """Send the tool at 0.1 m/s along +y of the base during each pause of `wait_until`."""
        for _ in range(6):
            self.joints.publish(array(np.pi / 2, 0.25))
            self.tool.publish(array(-0.6, 0.1 * time.monotonic() % 50.0, 0.2, np.pi, 0.0, 0.0))
            time.sleep(0.008)

    def tool_position(self) -> Optional[List[float]]:
        """Return the tool's position in tf; None if it is not there yet."""
        if not self.buffer.can_transform('r/link0', 'r/tool', rospy.Time()):
            return None
        found = self.buffer.lookup_transform('r/link0', 'r/tool', rospy.Time())
        place = found.transform.translation
        return [place.x, place.y, place.z]

    def wait_for_velocity(self, condition: Callable[[float], bool], what: str) -> None:
        """Move until the velocity along y fulfills a condition."""
        with Listener('/r/tool_velocity', TwistStamped) as velocities:
            wait_until(lambda: bool(velocities.messages)
                       and condition(velocities.messages[-1].twist.linear.y), what, self.move)

    def test_joints_move_the_model(self) -> None:
        begin = rospy.Time.now()
        with Listener('/r/joint_states', JointState) as states:
            wait_until(lambda: bool(states.messages) and self.tool_position() is not None
                       and np.allclose(self.tool_position(), [0.0, 0.75, 0.3], atol=1e-6),
                       'the tool in tf', lambda: self.joints.publish(array(np.pi / 2, 0.25)))
            state = states.messages[-1]
        self.assertEqual(state.name, ['r/turn', 'r/slide'])
        np.testing.assert_allclose(state.position, [np.pi / 2, 0.25], atol=1e-6)
        self.assertTrue(begin <= state.header.stamp <= rospy.Time.now())

    def test_the_velocity_of_a_moving_tool_is_an_arrow_at_it(self) -> None:
        with Listener('/r/marker_array', MarkerArray) as arrays:
            self.wait_for_velocity(lambda y: y > 0.02, 'a velocity')
            wait_until(lambda: last_markers(arrays).get(('velocity', 0), Marker(action=2)).action
                       == Marker.ADD and ('velocity', 1) in last_markers(arrays), 'an arrow',
                       self.move)
            arrow = last_markers(arrays)['velocity', 0]
        self.assertEqual((arrow.header.frame_id, arrow.frame_locked), ('r/tool', True))
        # The tool's x axis points along the base's y axis.
        self.assertGreater(arrow.pose.orientation.w, 0.99)

    def test_a_rate_on_the_parameter_server_is_followed(self) -> None:
        self.addCleanup(rospy.set_param, RATE_PARAMETER, 1.0)
        self.wait_for_velocity(lambda y: y > 0.02, 'a velocity')
        rospy.set_param(RATE_PARAMETER, -1.0)
        self.wait_for_velocity(lambda y: y < -0.02, 'the velocity of a recording backwards')

    def test_a_force(self) -> None:
        with Listener('/r/tool_force', WrenchStamped) as wrenches, \
                Listener('/r/marker_array', MarkerArray) as arrays:
            wait_until(lambda: ('force', 1) in last_markers(arrays) and bool(wrenches.messages),
                       'a force', lambda: self.force.publish(array(0.0, 0.0, 45.0, 0.1, 0.2, 0.3)))
            marker = last_markers(arrays)['force', 0]
        self.assertEqual(wrenches.messages[-1].header.frame_id, 'r/force')
        self.assertEqual(wrenches.messages[-1].wrench.force.z, 45.0)
        self.assertEqual(marker.header.frame_id, 'r/force')

    def test_a_driver_that_stops_is_shown(self) -> None:
        with Listener('/r/marker_array', MarkerArray) as arrays:
            self.wait_for_velocity(lambda y: y > 0.02, 'a velocity')
            for name in ('velocity', 'joints'):
                wait_until(lambda name=name: (name, 1) in last_markers(arrays)
                           and 'no data for' in last_markers(arrays)[name, 1].text, name)

    def test_complaints_are_logged_and_stand_on_diagnostics_while_they_hold(self) -> None:
        """The complaints are those of robot_proc and joint_proc."""
        problems = {'/r/robot_proc: /r/tcf': '3 values (x y z), 6 (with',
                    '/r/joint_proc: /r/q_act': '2 values are expected'}

        def send() -> None:
            self.tool.publish(array(1.0))
            self.joints.publish(array(1.0))

        with Listener('/diagnostics', DiagnosticArray) as reports:
            wait_until(lambda: all(told(reports, name, problem)
                                   and logged(self.log, Log.WARN, 'r: ', problem)
                                   for name, problem in problems.items()), 'complaints', send)
            wait_until(lambda: all(told(reports, name, 'all is well') for name in problems),
                       'the end of the complaints', self.move)

    def test_one_joint_without_a_number_is_named_and_the_others_move(self) -> None:
        with Listener('/r/joint_states', JointState) as states, \
                Listener('/diagnostics', DiagnosticArray) as reports:
            def send(slide: float) -> None:
                self.joints.publish(array(np.nan, slide))

            wait_until(lambda: bool(states.messages)
                       and dict(zip(states.messages[-1].name, states.messages[-1].position)).get(
                           'r/slide') == 0.125, 'the joint that has a number',
                       lambda: send(0.125))
            wait_until(lambda: told(reports, '/r/joint_proc: /r/q_act',
                                    'the position of r/turn is NaN, infinite or beyond 1e6'),
                       'the name of the other', lambda: send(0.125))
            self.assertFalse(any(np.isnan(state.position).any() for state in states.messages))
            wait_until(lambda: told(reports, '/r/joint_proc: /r/q_act', 'all is well'),
                       'the end of the complaint', self.move)

    def test_joints_of_other_robots_are_named_only_without_those_of_the_own(self) -> None:
        """Messages with velocities alone cause no complaint as long as positions arrive."""
        joints = publisher('/m/joints', JointState)

        def publish(*names: str) -> None:
            for name in names:
                joints.publish(JointState(name=[name], position=[0.5]))

        def publish_all() -> None:
            publish('arm', 'shared')
            joints.publish(JointState(name=['arm'], velocity=[0.1]))
            publish('arm')

        with Listener('/m/joint_states', JointState) as states:
            wait_until(lambda: bool(states.messages), 'a joint state', publish_all)
            wait_until(lambda: logged(self.log, Log.WARN, 'm: ', 'none of the names alone is'),
                       'a warning', lambda: publish('alone'))
            for problem in ('none of the names shared', 'positions'):
                self.assertFalse(logged(self.log, Log.WARN, 'm: ', problem), problem)

    def test_joints_of_a_robot_on_two_topics(self) -> None:
        arm, gripper = publisher('/m/joints', JointState), publisher('/m/gripper', JointState)

        def publish() -> None:
            arm.publish(JointState(name=['arm'], position=[0.5]))
            gripper.publish(JointState(name=['finger'], position=[0.02]))

        with Listener('/m/joint_states', JointState) as states:
            wait_until(lambda: {'m/arm': 0.5, 'm/finger': 0.02}.items() <= {
                name: position for state in states.messages
                for name, position in zip(state.name, state.position)}.items(), 'both', publish)

    def test_the_latency_of_a_driver_is_taken_off_the_stamps(self) -> None:
        arm = publisher('/m/joints', JointState)
        latency, stamps = rospy.Duration(0.2), []

        def publish() -> None:
            stamps.append(rospy.Time.now() - rospy.Duration(0.05))
            arm.publish(JointState(Header(stamp=stamps[-1]), ['arm'], [0.7], [], []))

        with Listener('/m/joint_states', JointState) as states:
            wait_until(lambda: any(state.header.stamp + latency in stamps
                                   for state in states.messages), 'its stamp', publish)

    def test_wrong_parameters_end_the_node_with_a_message(self) -> None:
        rospy.set_param('/broken', '<robot>')
        rospy.set_param('/one', '<robot name="t"><joint name="a" type="revolute"/></robot>')
        for node, arguments, problem in (
                ('robot_proc', ['_marker_rate:=-1'], 'marker_rate: a number above 0'),
                ('joint_proc', [], 'topic: the topic of the joints is expected'),
                ('joint_proc', ['_topic:=q'], 'joint_names: the names of'),
                ('joint_proc', ['_topic:=q', '_joint_rate:=fast'], 'joint_rate: a number'),
                ('joint_proc', ['_topic:=q', '_joint_rate:=9', '_joint_offsets/b:=1',
                                'robot_description:=/one'],
                 'an offset of b'),
                ('joint_proc', ['_topic:=q', '_joint_rate:=9', 'robot_description:=/broken'],
                 'the URDF is not XML'),
                ('joint_proc', ['_topic:=q', '_joint_rate:=9', '_latencies:=[0.1, 0.2]'],
                 'latencies: a number of')):
            status, output = run_node(node, ['__ns:=/t', *arguments])
            self.assertEqual(status, 1, output)
            self.assertIn(problem, output)
            self.assertNotIn('Traceback', output)


def told(reports: Listener, name: str, text: str) -> bool:
    """Return whether this is the last report of a name; a problem of several messages."""
    found = [status for report in list(reports.messages) for status in report.status
             if status.name == name][-1:]
    return any(text in status.message and (status.level == DiagnosticStatus.OK or int(
        {it.key: it.value for it in status.values}['messages']) > 2) for status in found)


def run_node(node: str, arguments: Sequence[str]) -> Tuple[int, str]:
    """Return status and output of a processor that ends at once."""
    process = subprocess.run([find_node('process_visualizer', node)[0], *arguments],
                             stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=60)
    return process.returncode, process.stdout.decode()


if __name__ == '__main__':
    rospy.init_node('robot_processor_test')
    rostest.rosrun('process_visualizer', 'robot_processor_test', RobotProcessorTest)
