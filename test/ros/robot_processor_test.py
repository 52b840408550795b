#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The robot processor with a real master: all its tests beside one launch of its nodes."""
from __future__ import annotations

import rospy
import rostest
from robot_frames_tests import RobotFramesTest
from robot_input_tests import RobotInputTest
from robot_joints_tests import RobotJointsTest
from robot_motion_tests import RobotMotionTest
from robot_playback_tests import RobotPlaybackTest

TESTS = (RobotFramesTest, RobotInputTest, RobotJointsTest, RobotMotionTest, RobotPlaybackTest)

if __name__ == '__main__':
    rospy.init_node('robot_processor_test')
    rostest.rosrun('process_visualizer', 'robot_processor_test', 'robot_processor_test')
