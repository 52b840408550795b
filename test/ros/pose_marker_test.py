#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The markers with which a frame and a box are dragged, with the real server of markers."""
from __future__ import annotations

import math
import unittest
from typing import List, Tuple

import rospy
import rostest
from cloud_testing import Listener, wait_until
from geometry_msgs.msg import Point, Quaternion
from geometry_msgs.msg import Pose as PoseMessage
from visualization_msgs.msg import (
    InteractiveMarkerFeedback,
    InteractiveMarkerInit,
    InteractiveMarkerUpdate,
)

from process_visualizer.cell.errors import Location
from process_visualizer.cell.model import Pose, RegionOfInterest
from process_visualizer.gui.ros.rviz_markers import BoxMarker, PoseMarker

TOPIC = '/process_visualizer/calibration'
TURNED = math.sqrt(0.5)
BOX = RegionOfInterest('tool', (1.0, 2.0, 3.0), (0.2, 0.4, 0.6), Location('cell.xml', 1))


class PoseMarkerTest(unittest.TestCase):
    """Plays RViz: listens to the updates and sends feedback."""

    def test_it_is_shown_dragged_moved_and_hidden(self) -> None:
        dragged: List[Tuple[str, Pose]] = []
        marker = PoseMarker(lambda frame, pose: dragged.append((frame, pose)))
        feedback = rospy.Publisher(f'{TOPIC}/feedback', InteractiveMarkerFeedback, queue_size=10)
        marker.show('world', 'first', Pose())
        with Listener(f'{TOPIC}/update', InteractiveMarkerUpdate) as updates:
            wait_until(lambda: bool(updates.messages), 'a sign of life')
            marker.show('world', 'camera_link', Pose((1.0, 2.0, 3.0)))
            wait_until(lambda: any(it.name == 'camera_link' for update in updates.messages
                                   for it in update.markers), 'the marker')
            wait_until(lambda: any('first' in it.erases for it in updates.messages),
                       'the end of the first one')
            message = InteractiveMarkerFeedback(
                client_id='rviz', marker_name='camera_link',
                event_type=InteractiveMarkerFeedback.POSE_UPDATE, pose=PoseMessage(
                    Point(0.5, 0.0, -1.0), Quaternion(0.0, 0.0, TURNED, TURNED)))
            # The server ignores everything in the first second of a marker.
            wait_until(lambda: bool(dragged), 'dragging', lambda: feedback.publish(message))
            self.assertEqual(dragged[0][0], 'camera_link')
            self.assertEqual(dragged[0][1].xyz, (0.5, 0.0, -1.0))
            marker.move(Pose((0.0, 0.0, 7.0)))
            wait_until(lambda: any(pose.pose.position == Point(0.0, 0.0, 7.0)
                                   for it in updates.messages for pose in it.poses), 'its move')
            with Listener(f'{TOPIC}/update_full', InteractiveMarkerInit) as full:
                wait_until(lambda: bool(full.messages), 'what RViz gets that comes late')
                self.assertEqual([it.name for it in full.messages[-1].markers], ['camera_link'])
            self.assert_stands_beside_a_box(updates, feedback)
            marker.hide()
            wait_until(lambda: any('camera_link' in it.erases for it in updates.messages),
                       'its end')

    def assert_stands_beside_a_box(self, updates: Listener, feedback: rospy.Publisher) -> None:
        """Both use the topics of one display."""
        dragged: List[str] = []
        box = BoxMarker(lambda device, _region: dragged.append(device))
        box.show('kinect', BOX)
        message = InteractiveMarkerFeedback(
            client_id='rviz', marker_name='kinect middle',
            event_type=InteractiveMarkerFeedback.POSE_UPDATE)
        wait_until(lambda: bool(dragged), 'dragging of the box',
                   lambda: feedback.publish(message))
        self.assertEqual(set(dragged), {'kinect'})
        self.assertEqual({it.server_id for it in updates.messages},
                         {'/pose_marker_test', '/pose_marker_test/box'})


if __name__ == '__main__':
    rospy.init_node('pose_marker_test')
    rostest.rosrun('process_visualizer', 'pose_marker_test', PoseMarkerTest)
