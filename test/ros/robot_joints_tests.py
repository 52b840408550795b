# SPDX-License-Identifier: BSD-3-Clause
"""The joint states of a robot: the model moves, none is lost, bad ones are left out."""
from __future__ import annotations

import time
import unittest
from typing import Any, List, Tuple

import numpy as np
import rospy
import tf2_ros
from cloud_testing import Listener, log_listener, logged, wait_until
from robot_testing import (
    array,
    last_markers,
    publisher,
    tool_position,
)
from rosgraph_msgs.msg import Log
from sensor_msgs.msg import JointState
from std_msgs.msg import Float32MultiArray
from visualization_msgs.msg import Marker, MarkerArray


class RobotJointsTest(unittest.TestCase):
    """Plays the drivers of joints."""

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

    def test_every_joint_state_of_a_slow_driver_and_the_last_of_a_fast_one(self) -> None:
        joints = publisher('/s/joints', JointState)
        with Listener('/s/joint_states', JointState) as states:
            rate, start_s = rospy.Rate(500), time.monotonic()
            for step in range(1000):
                joints.publish(JointState(name=['b'], position=[step * 1e-3]))
                rate.sleep()
            wait_until(lambda: bool(states.messages)
                       and states.messages[-1].position[0] == 0.999, 'the last joint state')
            self.assertLess(len(states.messages), 44 * (time.monotonic() - start_s) + 2)
            time.sleep(0.1)  # a state so soon after the last would be held back and overtaken
            del states.messages[:]
            sent = [step / 64 for step in range(20)]
            for position in sent:  # at 20 Hz, and never faster to make up for being late
                joints.publish(JointState(name=['b'], position=[position]))
                time.sleep(0.05)
            wait_until(lambda: bool(states.messages)
                       and states.messages[-1].position[0] == sent[-1], 'the last joint state')
            self.assertEqual([state.position[0] for state in states.messages], sent)

    def test_a_topic_that_another_robot_shares_and_a_joint_that_nobody_tells_about(self) -> None:
        joints = publisher('/m/joints', JointState)

        def publish() -> None:
            joints.publish(JointState(name=['arm'], position=[0.5]))
            joints.publish(JointState(name=['others'], position=[0.5]))

        with log_listener() as log:
            wait_until(lambda: logged(log, Log.WARN, 'm: ', '/m/joints', 'where m/finger is'),
                       'a warning of the joint', publish)
            self.assertFalse(logged(log, Log.WARN, 'none of the names'))
            wait_until(lambda: logged(log, Log.WARN, 'none of the names others is a joint'),
                       'a warning when all are those of another robot', lambda: joints.publish(
                           JointState(name=['others'], position=[0.5])))

    def test_joint_states_that_stop_are_shown(self) -> None:
        joints = publisher('/p/joints', JointState)
        with Listener('/p/marker_array', MarkerArray) as arrays:
            joints.publish(JointState(name=['a'], position=[0.5]))
            wait_until(lambda: ('joints', 1) in last_markers(arrays)
                       and 'joints no data for' in last_markers(arrays)['joints', 1].text,
                       'a text that there are no joint states')
            wait_until(lambda: last_markers(arrays)['joints', 1].action == Marker.DELETE,
                       'the end of the text', lambda: joints.publish(
                           JointState(name=['a'], position=[0.5])))

    def test_joint_arrays_without_their_padding(self) -> None:
        joints = publisher('/r/q_act', Float32MultiArray)
        padded = array(9.0, 0.3, 0.15)
        padded.layout.data_offset = 1
        with Listener('/r/joint_states', JointState) as states:
            wait_until(lambda: any(it.position == (np.float32(0.3), np.float32(0.15))
                                   for it in list(states.messages)), 'joint states',
                       lambda: joints.publish(padded))

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
            wait_until(lambda: any(it.position == (np.float32(0.1), np.float32(0.2))
                                   for it in list(states.messages)), 'joint states',
                       lambda: joints.publish(array(0.1, 0.2)))
            for state in states.messages:  # one of the test before may still be on its way
                self.assertEqual(len(state.position), 2)
                self.assertTrue(np.isfinite(state.position).all())
