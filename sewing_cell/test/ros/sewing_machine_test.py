#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The sewing machine's node with a real master: its model, three arrows, live setpoints."""
from __future__ import annotations

import time
import unittest
from typing import Callable, Dict, List, Tuple

import rospy
import rostest
from std_msgs.msg import Float32, UInt16
from visualization_msgs.msg import Marker, MarkerArray

TIMEOUT_S = 20.0


class Markers:
    """What RViz would know of the markers of a topic."""

    def __init__(self, topic: str) -> None:
        self.known: Dict[Tuple[str, int], Marker] = {}
        self.count = 0
        rospy.Subscriber(topic, MarkerArray, self._receive)

    def _receive(self, message: MarkerArray) -> None:
        self.count += 1
        self.known.update({(marker.ns, marker.id): marker for marker in message.markers})

    def text(self, namespace: str) -> str:
        """Return the text beside an arrow, '' where there is none."""
        marker = self.known.get((namespace, 1))
        return marker.text.strip() if marker else ''


def wait_until(condition: Callable[[], bool], what: str, meanwhile: Callable[[], None]) -> None:
    """Call meanwhile at 50 Hz until the condition holds."""
    rate, end_s = rospy.Rate(50), time.monotonic() + TIMEOUT_S
    while not condition():
        assert time.monotonic() < end_s, f'not within {TIMEOUT_S} s: {what}'
        meanwhile()
        rate.sleep()


class SewingMachineTest(unittest.TestCase):
    """Plays the drivers of the sewing machine."""

    def setUp(self) -> None:
        self.markers = Markers('/sewing_machine/marker_array')
        self.publishers: List[rospy.Publisher] = [
            rospy.Publisher('/edge_finder_upper', UInt16, queue_size=1),
            rospy.Publisher('/edge_finder_lower', UInt16, queue_size=1),
            rospy.Publisher('/feed_rate_est', Float32, queue_size=1)]

    def send(self) -> None:
        """Publish one value of each sensor."""
        for publisher, value in zip(self.publishers, (310, 225, 0.0625)):
            publisher.publish(value)

    def test_model_arrows_and_numbers(self) -> None:
        texts = {'feed_rate': 'feed 0.063 m/s', 'edge_upper': 'upper edge 310, 10 above 300',
                 'edge_lower': 'lower edge 225, 30 below 255'}
        wait_until(lambda: all(self.markers.text(name).startswith(text[:9])
                               for name, text in texts.items()), 'all texts', self.send)
        for name, text in texts.items():
            self.assertIn(self.markers.text(name), (text, text.replace('0.063', '0.062')))
        mesh = self.markers.known['machine', 0]
        self.assertEqual((mesh.type, mesh.header.frame_id),
                         (Marker.MESH_RESOURCE, 'sewing_machine/base'))
        self.assertEqual(mesh.mesh_resource, 'package://sewing_cell/meshes/sewing_machine.dae')
        for name in texts:
            arrow = self.markers.known[name, 0]
            self.assertEqual((arrow.type, arrow.action, arrow.header.frame_id),
                             (Marker.ARROW, Marker.ADD, 'sewing_machine/needle'))

    def test_setpoints_are_read_live(self) -> None:
        wait_until(lambda: '30 below 255' in self.markers.text('edge_lower'),
                   'the default setpoint', self.send)
        rospy.set_param('/sewing_machine/setpoint_lower', 225.0)
        wait_until(lambda: 'at 225' in self.markers.text('edge_lower'), 'the new setpoint',
                   self.send)
        self.assertEqual(self.markers.known['edge_lower', 0].action, Marker.DELETE)
        rospy.delete_param('/sewing_machine/setpoint_lower')
        wait_until(lambda: '30 below 255' in self.markers.text('edge_lower'), 'the default again',
                   self.send)

    def test_a_sensor_that_stopped_is_shown(self) -> None:
        wait_until(lambda: 'm/s' in self.markers.text('feed_rate'), 'a feed rate', self.send)
        wait_until(lambda: self.markers.text('feed_rate').startswith('feed no data for'),
                   'a text that says since when there is no data', lambda: None)

    def test_no_mesh_where_none_is_wanted(self) -> None:
        plain = Markers('/plain/marker_array')
        wait_until(lambda: plain.text('feed_rate') != '', 'a feed rate', self.send)
        self.assertNotIn(('machine', 0), plain.known)


if __name__ == '__main__':
    rospy.init_node('sewing_machine_test')
    rostest.rosrun('sewing_cell', 'sewing_machine_test', SewingMachineTest)
