#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The nodelet RoiFilter: parameters that change while it runs, and errors that do not stop it."""
from __future__ import annotations

import unittest
from typing import List

import rospy
import rostest
import tf2_ros
from cloud_testing import (
    Listener,
    indices,
    log_listener,
    logged,
    make_cloud,
    send_fast_hand,
    wait_until,
)
from rosgraph_msgs.msg import Log
from sensor_msgs.msg import PointCloud2
from visualization_msgs.msg import Marker

# In the frame of the box these lie at x = 0, 0.9, 1.5, and 4.
POINTS = ((-5, 0, 0), (-4.1, 0, 0), (-3.5, 0, 0), (-1, 0, 0))


class RoiFilterTest(unittest.TestCase):
    """Publishes clouds on /cloud and checks the output."""

    publisher: rospy.Publisher

    @classmethod
    def setUpClass(cls) -> None:
        cls.publisher = rospy.Publisher('/cloud', PointCloud2, queue_size=1)

    def setUp(self) -> None:
        for name, value in (('frame', '/box'), ('center', [0, 0, 0]), ('size', [2, 2, 2])):
            rospy.set_param(f'/roi_filter/{name}', value)

    def publish(self, frame_id: str = 'camera') -> None:
        self.publisher.publish(make_cloud(POINTS, frame_id))

    def wait_for(self, output: Listener, expected: List[int], frame_id: str = 'camera'
                 ) -> PointCloud2:
        """Publish until a cloud with the expected points arrives; return it."""
        wait_until(lambda: bool(output.messages) and indices(output.messages[-1]) == expected,
                   f'a cloud with the points {expected}', lambda: self.publish(frame_id))
        return output.messages[-1]

    def test_crops_in_the_frame_of_the_box(self) -> None:
        with Listener('/roi_filter/output', PointCloud2) as output:
            cloud = self.wait_for(output, [0, 1])
        self.assertEqual(cloud.header.frame_id, 'camera')
        self.assertEqual(cloud.header.stamp, rospy.Time(1))
        with Listener('/roi_filter/output', PointCloud2) as output:
            self.wait_for(output, [0, 1], frame_id='/camera')

    def test_subscribes_only_while_needed(self) -> None:
        wait_until(lambda: self.publisher.get_num_connections() == 0, 'not subscribed at first')
        with Listener('/roi_filter/output', PointCloud2):
            wait_until(lambda: self.publisher.get_num_connections() == 1, 'subscribed')
        wait_until(lambda: self.publisher.get_num_connections() == 0, 'not subscribed any more')

    def test_follows_its_parameters(self) -> None:
        with Listener('/roi_filter/output', PointCloud2) as output:
            self.wait_for(output, [0, 1])
            rospy.set_param('/roi_filter/size', [4, 0.5, 0.5])
            self.wait_for(output, [0, 1, 2])
            rospy.set_param('/roi_filter/center', [4.0, 0.0, 0.0])
            self.wait_for(output, [3])
            rospy.set_param('/roi_filter', {'frame': '', 'center': [-5, 0, 0], 'size': [1, 1, 1]})
            self.wait_for(output, [0])

    def test_shows_its_box(self) -> None:
        with Listener('/roi_filter/outline', Marker) as outline:
            wait_until(lambda: any(marker.points[0].x == -1 and marker.header.frame_id == 'box'
                                   for marker in outline.messages), 'the box, without any cloud')
            rospy.set_param('/roi_filter/size', [4, 2, 2])
            wait_until(lambda: outline.messages[-1].points[0].x == -2, 'the larger box')

    def test_shows_a_box_of_the_clouds_own_frame(self) -> None:
        rospy.set_param('/roi_filter/frame', '')
        with Listener('/roi_filter/output', PointCloud2), \
                Listener('/roi_filter/outline', Marker) as outline:
            wait_until(lambda: any(marker.header.frame_id == 'camera'
                                   for marker in outline.messages), 'the box', self.publish)

    def test_keeps_the_last_good_parameters(self) -> None:
        with Listener('/roi_filter/output', PointCloud2) as output, log_listener() as log:
            self.wait_for(output, [0, 1])
            rospy.set_param('/roi_filter/size', [4, 4])
            wait_until(lambda: logged(log, Log.ERROR, '/roi_filter/size', 'three numbers'),
                       'an error about size', self.publish)
            del output.messages[:]
            self.wait_for(output, [0, 1])
            rospy.set_param('/roi_filter/size', [4, 4, 4])
            self.wait_for(output, [0, 1, 2])

    def test_is_where_a_moving_box_was_then(self) -> None:
        broadcaster = tf2_ros.TransformBroadcaster()
        rospy.set_param('/roi_filter/frame', 'hand')

        def publish_beside_a_fast_hand() -> None:
            """Publish with the hand at its last point at the cloud's time, else far away."""
            cloud = make_cloud(POINTS, 'camera')
            cloud.header.stamp = rospy.Time.now()
            send_fast_hand(broadcaster, cloud.header.stamp, -1.0)
            self.publisher.publish(cloud)

        with Listener('/roi_filter/output', PointCloud2) as output:
            wait_until(lambda: [indices(it) for it in output.messages].count([3]) >= 8,
                       'clouds with the last point', publish_beside_a_fast_hand)
        found = [indices(cloud) for cloud in output.messages]
        for points in found[found.index([3]):]:
            self.assertIn(points, ([3], []))  # nothing: taken more than a second later

    def test_survives_a_missing_transform(self) -> None:
        with Listener('/roi_filter/output', PointCloud2) as output, log_listener() as log:
            wait_until(lambda: logged(log, Log.WARN, '/cloud', 'nowhere'),
                       'a warning about the frame', lambda: self.publish('nowhere'))
            self.wait_for(output, [0, 1])

    def test_survives_a_cloud_that_is_none(self) -> None:
        broken = make_cloud(POINTS, 'camera')
        broken.data = broken.data[:-1]
        with Listener('/roi_filter/output', PointCloud2) as output, log_listener() as log:
            wait_until(lambda: logged(log, Log.ERROR, '/cloud', 'cut off'),
                       'an error about the data', lambda: self.publisher.publish(broken))
            self.wait_for(output, [0, 1])


if __name__ == '__main__':
    rospy.init_node('roi_filter_test')
    rostest.rosrun('process_visualizer', 'roi_filter_test', RoiFilterTest)
