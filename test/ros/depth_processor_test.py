#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The depth processor moves clouds to the present, leaves them else as they are, and lives on."""
from __future__ import annotations

import unittest

import rospy
import rostest
from cloud_testing import Listener, log_listener, logged, make_cloud, wait_until
from rosgraph_msgs.msg import Log
from sensor_msgs.msg import Image, PointCloud2


class DepthProcessorTest(unittest.TestCase):
    """Publishes recorded clouds, with stamps in the past."""

    def assert_passes(self, publisher: rospy.Publisher, output: Listener) -> None:
        """Publish until a cloud comes out, and compare the two."""
        cloud = make_cloud([(1, 2, 3), (4, 5, 6)], '/camera', stamp_s=5)
        start = rospy.Time.now()
        wait_until(lambda: bool(output.messages), 'a cloud', lambda: publisher.publish(cloud))
        result = output.messages[0]
        self.assertLessEqual(start, result.header.stamp)
        self.assertLessEqual(result.header.stamp, rospy.Time.now())
        self.assertEqual(result.header.frame_id, 'camera')
        result.header = cloud.header
        self.assertEqual(result, cloud)

    def test_moves_clouds_to_the_present(self) -> None:
        publisher = rospy.Publisher('/kinect/roi_points', PointCloud2, queue_size=1)
        with Listener('/kinect/points', PointCloud2) as output:
            self.assert_passes(publisher, output)

    def test_keeps_stamps_of_today(self) -> None:
        publisher = rospy.Publisher('/kinect/roi_points', PointCloud2, queue_size=1)
        sent = set()

        def publish() -> None:
            cloud = make_cloud([(1, 2, 3)], 'camera')
            cloud.header.stamp = rospy.Time.now()
            sent.add(cloud.header.stamp)
            publisher.publish(cloud)

        with Listener('/kinect/points', PointCloud2) as output:
            wait_until(lambda: len(output.messages) >= 3, 'clouds', publish)
        self.assertLessEqual({it.header.stamp for it in output.messages}, sent)

    def test_input_can_be_remapped(self) -> None:
        publisher = rospy.Publisher('/some/cloud', PointCloud2, queue_size=1)
        with Listener('/remapped/points', PointCloud2) as output:
            self.assert_passes(publisher, output)

    def test_reports_a_wrong_type_and_lives(self) -> None:
        wrong = rospy.Publisher('/mixed/cloud', Image, queue_size=1)
        with log_listener() as log, Listener('/mixed/points', PointCloud2) as output:
            wait_until(lambda: logged(log, Log.ERROR, '/mixed/cloud', 'sensor_msgs/Image'),
                       'an error about the type', lambda: wrong.publish(Image()))
            self.assertEqual(output.messages, [])
            wrong.unregister()
            right = rospy.Publisher('/mixed/cloud', PointCloud2, queue_size=1)
            self.assert_passes(right, output)


if __name__ == '__main__':
    rospy.init_node('depth_processor_test')
    rostest.rosrun('process_visualizer', 'depth_processor_test', DepthProcessorTest)
