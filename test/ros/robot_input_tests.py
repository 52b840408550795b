# SPDX-License-Identifier: BSD-3-Clause
"""What a robot takes: standard messages; wrong types, stamps and parameters are named."""
from __future__ import annotations

import subprocess
import unittest
from typing import Sequence, Tuple

import rospy
from cloud_testing import Listener, log_listener, logged, wait_until
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import PoseStamped, WrenchStamped
from robot_testing import (
    array,
    last_markers,
    publisher,
)
from rosgraph_msgs.msg import Log
from roslib.packages import find_node
from sensor_msgs.msg import JointState
from std_msgs.msg import Float32MultiArray, String
from visualization_msgs.msg import MarkerArray


class RobotInputTest(unittest.TestCase):
    """Plays drivers with other messages than those of the thesis."""

    def test_standard_messages(self) -> None:
        joints = publisher('/s/joints', JointState)
        pose, wrench = publisher('/s/pose', PoseStamped), publisher('/s/wrench', WrenchStamped)
        sent_pose, sent_wrench = PoseStamped(), WrenchStamped()
        sent_pose.header.frame_id = 'base'
        sent_pose.pose.orientation.w = 1.0
        sent_wrench.wrench.force.x = 3.0

        def send() -> None:
            joints.publish(JointState(name=['b', 'other', 'a'], position=[0.5, 7.0, 1.0]))
            pose.publish(sent_pose)
            wrench.publish(sent_wrench)

        with Listener('/s/joint_states', JointState) as states, \
                Listener('/s/marker_array', MarkerArray) as arrays, \
                Listener('/s/tool_force', WrenchStamped) as forces:
            wait_until(lambda: ('velocity', 1) in last_markers(arrays)
                       and ('force', 0) in last_markers(arrays) and bool(states.messages)
                       and bool(forces.messages), 'everything', send)
        self.assertEqual((states.messages[0].name, list(states.messages[0].position)),
                         (['s/b', 's/a'], [0.5, 1.25]))  # with the offset of a
        self.assertEqual(forces.messages[0].header.frame_id, 's/tool')

    def test_wrong_types_are_named(self) -> None:
        array_force = publisher('/w/wrench', Float32MultiArray)
        text = publisher('/w/pose', String)
        array_joints = publisher('/w/joints', Float32MultiArray)
        with log_listener() as log:
            wait_until(lambda: logged(log, Log.WARN, 'w: ', '/w/joints', 'Float32MultiArray'),
                       'a warning about the type', lambda: array_joints.publish(array(1)))
            wait_until(lambda: logged(log, Log.WARN, 'w: ', '/w/wrench', 'Float32MultiArray'),
                       'a warning about the type', lambda: array_force.publish(array(1, 2, 3)))
            wait_until(lambda: logged(log, Log.WARN, '/w/pose', 'std_msgs/String'),
                       'a warning about the type', lambda: text.publish(String('x')))

    def test_stamps_that_stand_still_are_named(self) -> None:
        pose, sent = publisher('/s/pose', PoseStamped), PoseStamped()
        sent.header.frame_id, sent.pose.orientation.w = 'base', 1.0
        sent.header.stamp = rospy.Time.now()
        with log_listener() as log:
            for _ in range(3):
                pose.publish(sent)
            wait_until(lambda: logged(log, Log.WARN, 's: ', '/s/pose', 'stamp'),
                       'a warning about the stamps', lambda: pose.publish(sent))

    def test_complaints_stand_on_diagnostics_while_they_hold(self) -> None:
        """Of robot_proc and joint_proc: counted, and told when they do not hold any more."""
        pose, joints = publisher('/s/pose', PoseStamped), publisher('/s/joints', JointState)
        sent = PoseStamped()
        sent.header.frame_id = 'base'
        with Listener('/diagnostics', DiagnosticArray) as reports:
            for is_good in (False, True):
                sent.pose.orientation.w = float(is_good)

                def send(names: Sequence[str] = ('a', 'b') if is_good else ('a',)) -> None:
                    sent.header.stamp = rospy.Time.now()
                    pose.publish(sent)
                    joints.publish(JointState(name=names, position=[0.1, 0.2]))

                for name, problem in (('/s/robot_proc: /s/pose', 'quaternion is zero'),
                                      ('/s/joint_proc: /s/joints', 'is left out')):
                    wait_until(lambda name=name, problem=problem, is_good=is_good: told(
                        reports, name, 'all is well' if is_good else problem), name, send)

    def test_wrong_parameters_end_the_node_with_a_message(self) -> None:
        rospy.set_param('/broken', '<robot>')
        rospy.set_param('/one', '<robot name="t"><joint name="a" type="revolute"/></robot>')
        for node, arguments, problem in (
                ('robot_proc', ['_marker_rate:=-1'], 'marker_rate: a number above 0'),
                ('robot_proc', ['_arrows/force/color:=red'], 'color: three or four numbers'),
                ('joint_proc', [], 'topic: the topic of the joints is expected'),
                ('joint_proc', ['_topic:=q'], 'joint_names: the names of'),
                ('joint_proc', ['_topic:=q', '_joint_rate:=fast'], 'joint_rate: a number'),
                ('joint_proc', ['_topic:=q', '_joint_rate:=9', '_joint_offsets/b:=1',
                                'robot_description:=/one'],
                 'an offset of b'),
                ('joint_proc', ['_topic:=q', '_joint_rate:=9', 'robot_description:=/broken'],
                 'the URDF is not XML')):
            status, output = run_node(node, ['__ns:=/t', *arguments])
            self.assertEqual(status, 1, output)
            self.assertIn(problem, output)
            self.assertNotIn('Traceback', output)


def told(reports: Listener, name: str, text: str) -> bool:
    """Return whether this is what was said last of something; a problem of several messages."""
    found = [status for report in list(reports.messages) for status in report.status
             if status.name == name][-1:]
    return any(text in status.message and (status.level == DiagnosticStatus.OK or int(
        {it.key: it.value for it in status.values}['messages']) > 2) for status in found)


def run_node(node: str, arguments: Sequence[str]) -> Tuple[int, str]:
    """Return status and output of a processor that ends at once."""
    process = subprocess.run([find_node('process_visualizer', node)[0], *arguments],
                             stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=60)
    return process.returncode, process.stdout.decode()
