#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The frame publisher with a real master: /tf_static, and moving a frame while it runs."""
from __future__ import annotations

import subprocess
import unittest

import numpy as np
import rospy
import rostest
from cloud_testing import Listener, wait_until
from roslib.packages import find_node
from tf2_msgs.msg import TFMessage

from process_visualizer.srv import SetFrame, SetFrameResponse

NAN = float('nan')


def numbers(transform) -> list:
    """Return x y z and the quaternion of a transform."""
    shift, turn = transform.transform.translation, transform.transform.rotation
    return [shift.x, shift.y, shift.z, turn.x, turn.y, turn.z, turn.w]


def set_frame(parent: str, child: str, xyz: tuple, ypr: tuple) -> SetFrameResponse:
    """Call the service."""
    rospy.wait_for_service('/cell_frames/set_frame', 20.0)
    return rospy.ServiceProxy('/cell_frames/set_frame', SetFrame)(parent, child, xyz, ypr)


class FramePublisherTest(unittest.TestCase):
    """Listens to /tf_static as a late comer."""

    def test_all_frames_are_in_one_latched_message(self) -> None:
        with Listener('/tf_static', TFMessage) as listener:
            wait_until(lambda: bool(listener.messages), 'the frames')
            base, force = listener.messages[0].transforms
        self.assertEqual((base.header.frame_id, base.child_frame_id), ('world', 'r/link0'))
        self.assertEqual((force.header.frame_id, force.child_frame_id), ('r/tool', 'r/force'))
        np.testing.assert_allclose(numbers(base), [1, 2, 3, 0, 0, np.sqrt(0.5), np.sqrt(0.5)],
                                   atol=1e-12)

    def test_a_frame_is_moved(self) -> None:
        with Listener('/tf_static', TFMessage) as listener:
            answer = set_frame('', '/r/force', (0.1, 0.2, 0.3), (0.0, np.pi, 0.0))
            self.assertTrue(answer.success, answer.message)
            wait_until(lambda: any(np.allclose(numbers(message.transforms[1]),
                                               [0.1, 0.2, 0.3, 0, 1, 0, 0], atol=1e-9)
                                   for message in list(listener.messages)), 'the moved frame')
            self.assertEqual(len(listener.messages[-1].transforms), 2)

    def test_what_is_refused_says_why(self) -> None:
        zero = (0.0, 0.0, 0.0)
        for parent, child, xyz, problem in (
                ('', 'r/link1', zero, 'known are: r/force, r/link0'),
                ('r/link0', 'r/link0', zero, 'own ancestor'),
                ('', 'r/link0', (NAN, 0.0, 0.0), 'NaN')):
            answer = set_frame(parent, child, xyz, zero)
            self.assertFalse(answer.success)
            self.assertIn(problem, answer.message)

    def test_wrong_frames_end_the_node_with_a_message(self) -> None:
        command = [find_node('process_visualizer', 'cell_frames')[0], '__name:=wrong_frames']
        for frames, problem in (('[{parent: a, child: b, xyz: [1, 2]}]', 'xyz: a list of three'),
                                ('[{parent: a, child: a}]', 'own ancestor'), ('7', 'a list')):
            process = subprocess.run([*command, f'_frames:={frames}'], stdout=subprocess.PIPE,
                                     stderr=subprocess.STDOUT, timeout=60)
            output = process.stdout.decode()
            self.assertEqual(process.returncode, 1, output)
            self.assertIn('/wrong_frames/frames', output)
            self.assertIn(problem, output)
            self.assertNotIn('Traceback', output)


if __name__ == '__main__':
    rospy.init_node('frame_publisher_test')
    rostest.rosrun('process_visualizer', 'frame_publisher_test', FramePublisherTest)
