#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Words in the scene about processes that draw and have ended, hang, or took their leave."""
from __future__ import annotations

import os
import signal
import subprocess
import unittest
from typing import Dict
from xmlrpc.client import ServerProxy

import rosgraph
import rospy
import rostest
from cloud_testing import wait_until
from sensor_msgs.msg import PointCloud2
from visualization_msgs.msg import Marker, MarkerArray


def process_of(node: str) -> int:
    """Return the process id of a node that has started."""
    master = rosgraph.Master('/scene_watch_test')
    wait_until(lambda: node in str(master.getSystemState()), f'{node} at the master')
    process: int = ServerProxy(master.lookupNode(node)).getPid('/scene_watch_test')[2]
    return process


class SceneWatchTest(unittest.TestCase):
    """Stops and kills the nodes of the launch file."""

    def setUp(self) -> None:
        self.markers: Dict[str, Marker] = {}
        self.watched = rospy.Subscriber('/scene_watch/marker_array', MarkerArray, self._take)
        wait_until(lambda: self.watched.get_num_connections() > 0, 'the node scene_watch')

    def tearDown(self) -> None:
        self.watched.unregister()

    def _take(self, array: MarkerArray) -> None:
        self.markers = {marker.ns: marker for marker in array.markers}
        assert array.markers  # a display without any warns

    def _says(self, device: str, words: str) -> bool:
        return device in self.markers and words in self.markers[device].text

    def test_robot_processor_that_hangs_and_goes_on(self) -> None:
        self._stop('robot_proc', 'no arrows and numbers')

    def test_state_publisher_that_hangs_and_goes_on(self) -> None:
        self._stop('robot_state_publisher', 'the robot does not move')

    def _stop(self, node: str, meaning: str) -> None:
        process, words = process_of(f'/r/{node}'), f'r: {node} does not answer, {meaning}'
        rospy.sleep(1.0)  # it has been asked: one that never answered may still start
        os.kill(process, signal.SIGSTOP)
        try:
            wait_until(lambda: self._says('r', words), words)
        finally:
            os.kill(process, signal.SIGCONT)
        marker = self.markers['r']
        self.assertEqual((marker.header.frame_id, marker.pose.position.z), ('r/link0', 0.7))
        self.assertGreater(marker.lifetime.to_sec(), 0.0)
        wait_until(lambda: not self._says('r', words) or self._is_silent(), 'no such words')

    def test_process_that_is_killed(self) -> None:
        process = process_of('/r/joint_proc')
        rospy.sleep(1.0)
        os.kill(process, signal.SIGKILL)
        words = 'r: joint_proc has ended, the robot does not move'
        wait_until(lambda: self._says('r', words), words)
        self.assertNotIn('variable_proc', self.markers['r'].text)

    def test_publisher_of_a_shown_topic_that_takes_its_leave(self) -> None:
        other = subprocess.Popen(['rostopic', 'pub', '-r', '10', '/r/marker',
                                  'visualization_msgs/Marker', '{}'],
                                 stdout=subprocess.DEVNULL)
        master = rosgraph.Master('/scene_watch_test')
        try:
            wait_until(lambda: '/r/marker' in dict(master.getSystemState()[0]), 'the helper')
            rospy.sleep(4.0)  # the watch looks at the master every two seconds
        finally:
            other.send_signal(signal.SIGINT)
            other.wait(20)
        wait_until(lambda: self._says('r', 'has ended, what it showed is out of date'), 'the end')

    def test_cloud_that_comes_no_more(self) -> None:
        clouds = rospy.Publisher('/c/cloud', PointCloud2, queue_size=1)
        wait_until(lambda: clouds.get_num_connections() > 0, 'the depth processor')
        clouds.publish(PointCloud2(height=1, width=0))
        wait_until(lambda: self._says('c', 's old'), 'the age of the cloud')
        self.assertRegex(self.markers['c'].text, r'^c: points \d+\.\d s old$')

    def _is_silent(self) -> bool:
        self.markers = {}
        rospy.sleep(1.0)
        return 'r' not in self.markers


if __name__ == '__main__':
    rospy.init_node('scene_watch_test')
    rostest.rosrun('process_visualizer', 'scene_watch_test', SceneWatchTest)
