# SPDX-License-Identifier: BSD-3-Clause
"""Poses and forces in frames of the maker, which the model connects with the robot's base."""
from __future__ import annotations

import math
import time
import unittest
from typing import Sequence

import numpy as np
import rospy
from cloud_testing import Listener, log_listener, logged, wait_until
from geometry_msgs.msg import PoseStamped, TransformStamped, TwistStamped, WrenchStamped
from robot_testing import last_markers, median_velocity, publisher
from rosgraph_msgs.msg import Log
from sensor_msgs.msg import JointState
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import MarkerArray

from process_visualizer.motion.rotations import rotated

SPEED_M_PER_S = 0.2


class RobotFramesTest(unittest.TestCase):
    """Plays a driver that knows of no prefix; its axis moves along +y of the base."""

    @classmethod
    def setUpClass(cls) -> None:
        cls.joints = publisher('/m/joint_states', JointState)
        cls.poses = publisher('/m/pose', PoseStamped)
        cls.forces = publisher('/m/wrench', WrenchStamped)

    def drive(self, frames: Sequence[str], duration_s: float = 1.0, moves: bool = True) -> None:
        """The tool moves along -y of the maker's base, or stands on the cart."""
        rate, begin_s = rospy.Rate(125), time.monotonic()
        for count in range(round(125 * duration_s)):
            y, now = SPEED_M_PER_S * (time.monotonic() - begin_s), rospy.Time.now()
            state = JointState(name=['axis'], position=[y])
            pose, wrench = PoseStamped(), WrenchStamped()
            state.header.stamp = pose.header.stamp = now
            pose.header.frame_id = wrench.header.frame_id = frames[count % len(frames)]
            pose.pose.position.x, pose.pose.position.y = (-1.0, -y) if moves else (1.0, 0.0)
            pose.pose.orientation.w = 1.0
            wrench.wrench.force.x = 20.0
            self.joints.publish(state)
            self.poses.publish(pose)
            self.forces.publish(wrench)
            rate.sleep()

    def test_poses_and_forces_in_the_base_of_the_maker(self) -> None:
        """By its names with and without prefix, tf prefix and slash; as arrows at the tool."""
        with Listener('/m/tool_velocity', TwistStamped) as velocities, \
                Listener('/m/marker_array', MarkerArray) as arrays, \
                Listener('/m/tool_force', WrenchStamped) as forces:
            self.drive(('base', '/base', 'left_base', 'left/base', '/m/base'))
            np.testing.assert_allclose(median_velocity(velocities), [0.0, SPEED_M_PER_S, 0.0],
                                       atol=0.02)
            wait_until(lambda: {('velocity', 0), ('force', 0)} <= set(last_markers(arrays)),
                       'both arrows', lambda: self.drive(['base'], 0.2))
            markers = last_markers(arrays)
        for name, direction in (('velocity', (1.0, 0.0, 0.0)), ('force', (0.0, 1.0, 0.0))):
            marker = markers[name, 0]
            turn = marker.pose.orientation
            self.assertEqual(marker.header.frame_id, 'left_tool')
            np.testing.assert_allclose(rotated((turn.x, turn.y, turn.z, turn.w), (1.0, 0.0, 0.0)),
                                       direction, atol=0.05)
        self.assertEqual({force.header.frame_id for force in forces.messages}, {'left_base'})

    def test_a_joint_between_the_frame_and_the_base(self) -> None:
        with Listener('/m/tool_velocity', TwistStamped) as velocities:
            wait_until(lambda: len(velocities.messages) > 60, 'velocities',
                       lambda: self.drive(['cart'], moves=False))
            np.testing.assert_allclose(median_velocity(velocities), [0.0, SPEED_M_PER_S, 0.0],
                                       atol=0.03)

    def test_a_frame_that_a_static_transform_connects(self) -> None:
        static = rospy.Publisher('/tf_static', TFMessage, queue_size=1, latch=True)
        transform = TransformStamped()
        transform.header.frame_id, transform.child_frame_id = 'm/floor', 'left_base_link'
        transform.transform.rotation.z = transform.transform.rotation.w = math.sqrt(0.5)
        static.publish(TFMessage([transform]))
        with Listener('/m/tool_velocity', TwistStamped) as velocities:
            wait_until(lambda: len(velocities.messages) > 60, 'velocities',
                       lambda: self.drive(['m/floor']))
            np.testing.assert_allclose(median_velocity(velocities), [-SPEED_M_PER_S, 0.0, 0.0],
                                       atol=0.02)
        # It goes on publishing: rospy before 1.16 would find a later one of this process only
        # after a pause that doubles each time.

    def test_a_frame_that_nothing_connects_is_named(self) -> None:
        with log_listener() as log:
            wait_until(lambda: logged(log, Log.WARN, 'm: ', '/m/pose', 'its frame is right_base',
                                      'connects with the base frame left_base_link'),
                       'a warning about the frame', lambda: self.drive(['right_base'], 0.1))
