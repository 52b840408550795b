#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The box that is dragged in RViz: what RViz gets, and what it says in return."""
from __future__ import annotations

import unittest
from dataclasses import replace
from typing import Dict, List, Tuple

import rospy
import rostest
from cloud_testing import Listener, wait_until
from geometry_msgs.msg import Point
from visualization_msgs.msg import (
    InteractiveMarker,
    InteractiveMarkerFeedback,
    InteractiveMarkerUpdate,
)

from process_visualizer.cell.errors import Location
from process_visualizer.cell.model import Pose, RegionOfInterest
from process_visualizer.gui.ros.box_marker import BoxMarker
from process_visualizer.gui.ros.pose_marker import PoseMarker

TOPIC = '/process_visualizer/calibration'
BOX = RegionOfInterest('tool', (1.0, 2.0, 3.0), (0.2, 0.4, 0.6), Location('cell.xml', 1))


class BoxMarkerTest(unittest.TestCase):
    """Plays RViz: listens to the updates and sends feedback."""

    dragged: List[Tuple[str, RegionOfInterest]]

    @classmethod
    def setUpClass(cls) -> None:
        cls.dragged = []
        cls.box = BoxMarker(lambda device, region: cls.dragged.append((device, region)))
        cls.feedback = rospy.Publisher(f'{TOPIC}/feedback', InteractiveMarkerFeedback,
                                       queue_size=10)
        cls.poses = PoseMarker(lambda frame, _pose: cls.dragged.append((frame, BOX)))

    def show(self, updates: Listener) -> Dict[str, InteractiveMarker]:
        """Show the box and return its handles as RViz gets them."""
        self.box.show('kinect', BOX)
        wait_until(lambda: bool(updates.messages), 'a connection')
        self.box.show('kinect', BOX)
        wait_until(lambda: len(_handles(updates)) == 7, 'seven handles')
        wait_until(lambda: self.feedback.get_num_connections() > 0, 'a listener for feedback')
        return _handles(updates)

    def drag(self, handle: str, x_m: float) -> None:
        message = InteractiveMarkerFeedback(
            client_id='rviz', marker_name=f'kinect {handle}',
            event_type=InteractiveMarkerFeedback.POSE_UPDATE)
        message.header.frame_id = 'tool'
        message.pose.position = Point(x_m, 2.0, 3.0)
        message.pose.orientation.w = 1.0
        self.feedback.publish(message)

    def test_a_face_is_dragged_and_the_other_handles_follow(self) -> None:
        with Listener(f'{TOPIC}/update', InteractiveMarkerUpdate) as updates:
            handles = self.show(updates)
            self.assertEqual({it.header.frame_id for it in handles.values()}, {'tool'})
            self.assertEqual(handles['kinect +x'].pose.position, Point(1.1, 2.0, 3.0))
            self.assertEqual(len(handles['kinect middle'].controls), 3)
            self.assertEqual(len(handles['kinect +x'].controls), 1)
            del self.dragged[:]
            # The server takes nothing in the first second of a marker.
            wait_until(lambda: bool(self.dragged), 'the face', lambda: self.drag('+x', 1.3))
            device, region = self.dragged[0]
            self.assertEqual(device, 'kinect')
            self.assertEqual(region.frame, 'tool')
            for found, expected in zip((*region.center, *region.size),
                                       (1.1, 2.0, 3.0, 0.4, 0.4, 0.6)):
                self.assertAlmostEqual(found, expected)
            wait_until(lambda: any(pose.name == 'kinect middle'
                                   and abs(pose.pose.position.x - 1.1) < 1e-6
                                   for update in list(updates.messages)
                                   for pose in update.poses), 'the middle follows')

    def test_follows_the_numbers_and_is_hidden(self) -> None:
        with Listener(f'{TOPIC}/update', InteractiveMarkerUpdate) as updates:
            self.show(updates)
            self.box.move('another', BOX)
            self.box.move('kinect', replace(BOX, center=(5.0, 2.0, 3.0)))
            wait_until(lambda: any(pose.name == 'kinect -x' and pose.pose.position.x == 4.9
                                   for update in list(updates.messages)
                                   for pose in update.poses), 'the numbers')
            self.box.hide()
            wait_until(lambda: {name for update in list(updates.messages)
                                for name in update.erases} >= set(_handles(updates)), 'hidden')

    def test_stands_beside_the_marker_of_a_frame(self) -> None:
        """Both use the topics of one display."""
        with Listener(f'{TOPIC}/update', InteractiveMarkerUpdate) as updates:
            self.poses.show('world', 'camera_link', Pose())
            self.show(updates)
            del self.dragged[:]
            wait_until(lambda: bool(self.dragged), 'the middle', lambda: self.drag('middle', 0.5))
            servers = {update.server_id for update in list(updates.messages)}
        self.assertEqual({device for device, _ in self.dragged}, {'kinect'})
        self.assertEqual(servers, {'/box_marker_test', '/box_marker_test/box'})


def _handles(updates: Listener) -> Dict[str, InteractiveMarker]:
    return {marker.name: marker for update in list(updates.messages) for marker in update.markers}


if __name__ == '__main__':
    rospy.init_node('box_marker_test')
    rostest.rosrun('process_visualizer', 'box_marker_test', BoxMarkerTest)
