#!/usr/bin/env python3
"""The robot processor with a real master: right numbers, bad input, playback rate, wrong start."""
from __future__ import annotations

import subprocess
import time
import unittest
from typing import Any, Dict, List, Sequence, Tuple

import numpy as np
import rospy
import rostest
import tf2_ros
from cloud_testing import Listener, log_listener, logged, wait_until
from geometry_msgs.msg import PoseStamped, TwistStamped, WrenchStamped
from rosgraph_msgs.msg import Log
from sensor_msgs.msg import JointState
from std_msgs.msg import Float32MultiArray, String
from visualization_msgs.msg import Marker, MarkerArray

RATE_PARAMETER = '/process_visualizer/playback_rate'


def array(*values: float) -> Float32MultiArray:
    """Return the thesis' message for a quantity."""
    return Float32MultiArray(data=values)


def publisher(topic: str, message_class: type) -> rospy.Publisher:
    """Return a publisher that has its subscriber, the robot processor."""
    result = rospy.Publisher(topic, message_class, queue_size=10)
    wait_until(lambda: result.get_num_connections() > 0, f'a subscriber of {topic}')
    return result


def move(tool: rospy.Publisher, speed_m_per_s: float, duration_s: float) -> None:
    """Publish the pose of a tool that points down and moves along +y of the base, at 125 Hz."""
    rate, start_s = rospy.Rate(125), time.monotonic()
    while time.monotonic() < start_s + duration_s:
        y = speed_m_per_s * (time.monotonic() - start_s)
        tool.publish(array(-0.6, y, 0.2, np.pi, 0.0, 0.0))
        rate.sleep()


def median_velocity(listener: Listener) -> np.ndarray:
    """Return the middle of the last velocities that were published."""
    linear = [message.twist.linear for message in listener.messages[-80:]]
    return np.median([[part.x, part.y, part.z] for part in linear], axis=0)


def last_markers(listener: Listener) -> Dict[Tuple[str, int], Marker]:
    """Return what RViz would know of each marker."""
    return {(marker.ns, marker.id): marker
            for message in list(listener.messages) for marker in message.markers}


def tool_position(buffer: tf2_ros.Buffer) -> List[float]:
    """Return where the tool is in tf; far away before it is there."""
    if not buffer.can_transform('r/link0', 'r/tool', rospy.Time()):
        return [np.inf] * 3
    position = buffer.lookup_transform('r/link0', 'r/tool', rospy.Time()).transform.translation
    return [position.x, position.y, position.z]


class RobotProcessorTest(unittest.TestCase):
    """Plays the drivers of two robots."""

    def setUp(self) -> None:
        rospy.set_param(RATE_PARAMETER, 1.0)

    def test_joint_states_move_the_model(self) -> None:
        joints = publisher('/r/q_act', Float32MultiArray)
        buffer = tf2_ros.Buffer()
        tf2_ros.TransformListener(buffer)
        with Listener('/r/joint_states', JointState) as states:
            start = rospy.Time.now()
            wait_until(lambda: bool(states.messages)
                       and np.allclose(tool_position(buffer), [0.0, 0.75, 0.3], atol=1e-6),
                       'the tool in tf', lambda: joints.publish(array(np.pi / 2, 0.25)))
            state = states.messages[-1]
        self.assertEqual(state.name, ['r/turn', 'r/slide'])
        np.testing.assert_allclose(state.position, [np.pi / 2, 0.25], atol=1e-6)
        self.assertTrue(start <= state.header.stamp <= rospy.Time.now())

    def test_velocity_of_a_moving_tool(self) -> None:
        tool = publisher('/r/tcf', Float32MultiArray)
        with Listener('/r/tool_velocity', TwistStamped) as velocities, \
                Listener('/r/marker_array', MarkerArray) as arrays:
            move(tool, 0.1, 2.0)
            markers = last_markers(arrays)
            arrived = len(arrays.messages)
        np.testing.assert_allclose(median_velocity(velocities), [0.0, 0.1, 0.0], atol=0.005)
        self.assertEqual(velocities.messages[-1].header.frame_id, 'r/link0')
        self.assertLessEqual(arrived, 66)  # 30 Hz
        arrow = markers['velocity', 0]
        self.assertEqual((arrow.header.frame_id, arrow.frame_locked), ('r/tool', True))
        rotation = arrow.pose.orientation  # the tool's y axis is against the base's
        np.testing.assert_allclose([rotation.x, rotation.y, rotation.z, rotation.w],
                                   [0.0, 0.0, -np.sqrt(0.5), np.sqrt(0.5)], atol=0.02)
        self.assertRegex(markers['velocity', 1].text, r'^v 0\.1\d\d m/s|^v 0\.09\d m/s')

    def test_standing_tool_has_no_arrow_and_a_stopped_driver_is_shown(self) -> None:
        tool = publisher('/r/tcf', Float32MultiArray)
        with Listener('/r/marker_array', MarkerArray) as arrays:
            move(tool, 0.0, 1.0)
            markers = last_markers(arrays)
            self.assertEqual(markers['velocity', 0].action, Marker.DELETE)
            self.assertIn('v 0.000 m/s', markers['velocity', 1].text)
            wait_until(lambda: 'v no data for 2' in last_markers(arrays)['velocity', 1].text,
                       'a text that says since when there is no data')

    def test_force(self) -> None:
        force = publisher('/ft/ft', Float32MultiArray)
        with Listener('/r/tool_force', WrenchStamped) as wrenches, \
                Listener('/r/marker_array', MarkerArray) as arrays:
            wait_until(lambda: ('force', 1) in last_markers(arrays) and bool(wrenches.messages),
                       'a force', lambda: force.publish(array(0.0, 0.0, 45.0, 0.1, 0.2, 0.3)))
            markers = last_markers(arrays)
        wrench = wrenches.messages[-1]
        self.assertEqual(wrench.header.frame_id, 'r/force')
        self.assertEqual((wrench.wrench.force.z, round(wrench.wrench.torque.y, 6)), (45.0, 0.2))
        self.assertEqual(markers['force', 0].header.frame_id, 'r/force')
        self.assertAlmostEqual(markers['force', 0].scale.x, 0.6)  # the upper limit
        self.assertIn('F 45.0 N', markers['force', 1].text)

    def test_playback_rate_scales_the_time_while_it_changes(self) -> None:
        tool = publisher('/r/tcf', Float32MultiArray)
        with Listener('/r/tool_velocity', TwistStamped) as velocities:
            for rate in (2.0, -1.0, 0.5):
                rospy.set_param(RATE_PARAMETER, rate)
                move(tool, 0.1, 1.5)
                self.assertAlmostEqual(median_velocity(velocities)[1], 0.1 / rate, delta=0.02)

    def test_bad_input_is_named_and_left_out(self) -> None:
        joints = publisher('/r/q_act', Float32MultiArray)
        bad: List[Tuple[Any, str]] = [
            (array(0.1), '2 values are expected'), (array(float('nan'), 0.0), 'NaN'),
            (array(), '2 values are expected')]
        with log_listener() as log, Listener('/r/joint_states', JointState) as states:
            for message, problem in bad:
                wait_until(lambda p=problem: logged(log, Log.WARN, 'r: ', '/r/q_act', p),
                           f'a warning: {problem}', lambda m=message: joints.publish(m))
                log.messages.clear()
            self.assertEqual(states.messages, [])
            wait_until(lambda: bool(states.messages), 'joint states',
                       lambda: joints.publish(array(0.1, 0.2)))

    def test_standard_messages(self) -> None:
        joints = publisher('/s/joints', JointState)
        pose, wrench = publisher('/s/pose', PoseStamped), publisher('/s/wrench', WrenchStamped)
        sent_pose, sent_wrench = PoseStamped(), WrenchStamped()
        sent_pose.header.frame_id = 'base'
        sent_pose.pose.orientation.w = 1.0
        sent_wrench.wrench.force.x = 3.0

        def send() -> None:
            joints.publish(JointState(name=['b', 'other'], position=[0.5, 7.0]))
            pose.publish(sent_pose)
            wrench.publish(sent_wrench)

        with Listener('/s/joint_states', JointState) as states, \
                Listener('/s/marker_array', MarkerArray) as arrays, \
                Listener('/s/tool_force', WrenchStamped) as forces:
            wait_until(lambda: ('velocity', 1) in last_markers(arrays)
                       and ('force', 0) in last_markers(arrays) and bool(states.messages)
                       and bool(forces.messages), 'everything', send)
        self.assertEqual((states.messages[0].name, list(states.messages[0].position)),
                         (['s/b'], [0.5]))
        self.assertEqual(forces.messages[0].header.frame_id, 's/tool')

    def test_wrong_types_are_named(self) -> None:
        array_force = publisher('/w/wrench', Float32MultiArray)
        text = publisher('/w/pose', String)
        with log_listener() as log:
            wait_until(lambda: logged(log, Log.WARN, 'w: ', '/w/wrench', 'Float32MultiArray'),
                       'a warning about the type', lambda: array_force.publish(array(1, 2, 3)))
            wait_until(lambda: logged(log, Log.WARN, '/w/pose', 'std_msgs/String'),
                       'a warning about the type', lambda: text.publish(String('x')))

    def test_wrong_parameters_end_the_node_with_a_message(self) -> None:
        for argument, problem in (('_marker_rate:=-1', 'marker_rate: a number above 0'),
                                  ('_arrows/force/color:=red', 'color: three or four numbers'),
                                  ('robot_description:=/broken', 'the URDF is not XML')):
            rospy.set_param('/broken', '<robot>')
            status, output = run_node(['__ns:=/t', argument])
            self.assertEqual(status, 1, output)
            self.assertIn(problem, output)
            self.assertNotIn('Traceback', output)


def run_node(arguments: Sequence[str]) -> Tuple[int, str]:
    """Return status and output of a robot processor that ends at once."""
    process = subprocess.run(['rosrun', 'process_visualizer', 'robot_proc', *arguments],
                             stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=60)
    return process.returncode, process.stdout.decode()


if __name__ == '__main__':
    rospy.init_node('robot_processor_test')
    rostest.rosrun('process_visualizer', 'robot_processor_test', RobotProcessorTest)
