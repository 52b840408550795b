#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The marker by which a frame is dragged: what RViz gets, and what it says in return."""
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

from process_visualizer.cell.model import Pose
from process_visualizer.gui.ros.pose_marker import PoseMarker

TOPIC = '/process_visualizer/calibration'
TURNED = math.sqrt(0.5)


class PoseMarkerTest(unittest.TestCase):
    """Plays RViz: listens to the updates and sends feedback."""

    dragged: List[Tuple[str, Pose]]

    @classmethod
    def setUpClass(cls) -> None:
        cls.dragged = []
        cls.marker = PoseMarker(lambda frame, pose: cls.dragged.append((frame, pose)))
        cls.feedback = rospy.Publisher(f'{TOPIC}/feedback', InteractiveMarkerFeedback,
                                       queue_size=10)
        cls.marker.show('world', 'first', Pose())
        cls.marker.hide()

    def tearDown(self) -> None:
        self.marker.hide()
        del self.dragged[:]

    def show(self, updates: Listener, frame: str = 'camera_link') -> None:
        """Show the marker and wait until RViz knows."""
        wait_until(lambda: bool(updates.messages), 'a connection')  # something comes twice a second
        self.marker.show('world', frame, Pose((1.0, 2.0, 3.0), (math.pi / 2, 0.0, 0.0)))
        wait_until(lambda: any(it.name == frame for update in updates.messages
                               for it in update.markers), 'the marker')
        wait_until(lambda: self.feedback.get_num_connections() > 0, 'a listener for feedback')

    def say(self, event: int, frame: str = 'camera_link', height_m: float = -1.0) -> None:
        """Send what RViz would while the mouse does something."""
        message = InteractiveMarkerFeedback(client_id='rviz', marker_name=frame, event_type=event)
        message.header.frame_id = 'world'
        message.pose = PoseMessage(Point(0.5, 0.0, height_m),
                                   Quaternion(0.0, 0.0, TURNED, TURNED))
        self.feedback.publish(message)

    def drag(self, frame: str = 'camera_link') -> None:
        """Drag until it is noticed: the server takes nothing in the first second of a marker."""
        wait_until(lambda: bool(self.dragged), f'{frame} is dragged',
                   lambda: self.say(InteractiveMarkerFeedback.POSE_UPDATE, frame))

    def test_a_marker_has_six_degrees_of_freedom(self) -> None:
        with Listener(f'{TOPIC}/update', InteractiveMarkerUpdate) as updates:
            self.show(updates)
            (marker,) = next(it for it in updates.messages if it.markers).markers
        self.assertEqual((marker.header.frame_id, marker.description), ('world', 'camera_link'))
        self.assertEqual(marker.pose.position, Point(1.0, 2.0, 3.0))
        self.assertAlmostEqual(marker.pose.orientation.z, TURNED)
        controls = {(control.interaction_mode, tuple(round(part, 3) for part in (
            control.orientation.x, control.orientation.y, control.orientation.z)))
            for control in marker.controls}
        self.assertEqual(len(controls), 6)

    def test_who_comes_late_gets_the_marker(self) -> None:
        with Listener(f'{TOPIC}/update', InteractiveMarkerUpdate) as updates:
            self.show(updates)
        with Listener(f'{TOPIC}/update_full', InteractiveMarkerInit) as full:
            wait_until(lambda: bool(full.messages), 'the latched state')
            self.assertEqual([it.name for it in full.messages[-1].markers], ['camera_link'])

    def test_dragging_tells_the_pose(self) -> None:
        with Listener(f'{TOPIC}/update', InteractiveMarkerUpdate) as updates:
            self.show(updates)
            self.drag()
        frame, pose = self.dragged[0]
        self.assertEqual((frame, pose.xyz), ('camera_link', (0.5, 0.0, -1.0)))
        for found, expected in zip(pose.ypr, (math.pi / 2, 0.0, 0.0)):
            self.assertAlmostEqual(found, expected)

    def test_only_dragging_does(self) -> None:
        with Listener(f'{TOPIC}/update', InteractiveMarkerUpdate) as updates:
            self.show(updates)
            self.drag()
            for event in (InteractiveMarkerFeedback.MOUSE_DOWN,
                          InteractiveMarkerFeedback.MOUSE_UP,
                          InteractiveMarkerFeedback.BUTTON_CLICK):
                self.say(event, height_m=5.0)
            self.say(InteractiveMarkerFeedback.POSE_UPDATE, height_m=6.0)
            wait_until(lambda: self.dragged[-1][1].xyz[2] == 6.0, 'the last pose')
        self.assertNotIn(5.0, [pose.xyz[2] for _, pose in self.dragged])

    def test_it_follows_what_is_set_and_says_nothing_then(self) -> None:
        with Listener(f'{TOPIC}/update', InteractiveMarkerUpdate) as updates:
            self.show(updates)
            self.marker.move(Pose((0.0, 0.0, 7.0), (0.0, 0.0, math.pi)))
            wait_until(lambda: any(it.poses for it in updates.messages), 'the new pose')
            pose = next(it.poses for it in updates.messages if it.poses)[-1].pose
        self.assertEqual(pose.position, Point(0.0, 0.0, 7.0))
        self.assertAlmostEqual(abs(pose.orientation.x), 1.0)
        self.assertEqual(self.dragged, [])

    def test_another_frame_takes_its_place(self) -> None:
        with Listener(f'{TOPIC}/update', InteractiveMarkerUpdate) as updates:
            self.show(updates)
            self.show(updates, 'base')
            wait_until(lambda: any('camera_link' in it.erases for it in updates.messages),
                       'the first one is removed')
            self.say(InteractiveMarkerFeedback.POSE_UPDATE)
            self.drag('base')
        self.assertEqual({frame for frame, _ in self.dragged}, {'base'})

    def test_a_marker_that_is_hidden_is_gone(self) -> None:
        with Listener(f'{TOPIC}/update', InteractiveMarkerUpdate) as updates:
            self.show(updates)
            self.marker.hide()
            wait_until(lambda: any('camera_link' in it.erases for it in updates.messages),
                       'it is removed')
        self.assertEqual(self.marker.frame, '')
        self.marker.move(Pose())


if __name__ == '__main__':
    rospy.init_node('pose_marker_test')
    rostest.rosrun('process_visualizer', 'pose_marker_test', PoseMarkerTest)
