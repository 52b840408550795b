#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The RViz display DisplayStatus reports the displays as RViz shows them."""
from __future__ import annotations

import unittest
from typing import Dict, Tuple

import rospy
import rostest
from cloud_testing import Listener, wait_until
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import Point, PointStamped
from sensor_msgs.msg import PointCloud2, PointField, RegionOfInterest
from std_msgs.msg import Bool, Header

RVIZ_STARTS_WITHIN_S = 90.0


def values(status: DiagnosticStatus) -> Dict[str, str]:
    """Return a status' values by key."""
    return {pair.key: pair.value for pair in status.values}


class DisplayStatusTest(unittest.TestCase):
    """Checks the report of an RViz with a good, a bad, and a disabled display."""

    first: DiagnosticArray
    last: DiagnosticArray
    displays: Dict[str, DiagnosticStatus]

    @classmethod
    def setUpClass(cls) -> None:
        cls.first = rospy.wait_for_message(
            '/rviz/display_status', DiagnosticArray, RVIZ_STARTS_WITHIN_S)
        with Listener('/rviz/display_status', DiagnosticArray) as reports:
            wait_until(lambda: len(reports.messages) > 3, 'more reports')
            cls.last = reports.messages[-1]
        cls.displays = {status.name: status for status in cls.last.status}

    def test_lists_every_display(self) -> None:
        self.assertEqual([status.name for status in self.last.status],
                         ['rviz', 'Status report', 'Floor', 'Floor/Good', 'Bad', 'Off',
                          'Calibration', 'Deaf', 'Cloud', 'Lost'])
        self.assertEqual(self.displays['Floor/Good'].hardware_id, 'rviz/Grid')

    def test_good_display(self) -> None:
        good = self.displays['Floor/Good']
        self.assertEqual((good.level, good.message), (DiagnosticStatus.OK, ''))
        self.assertEqual(values(good)['enabled'], 'true')

    def test_bad_display(self) -> None:
        bad = self.displays['Bad']
        self.assertEqual(bad.level, DiagnosticStatus.ERROR)
        self.assertIn('no_such_description', bad.message)
        self.assertTrue(values(bad)['URDF'].startswith('Error: '), bad)

    def test_disabled_display(self) -> None:
        off = self.displays['Off']
        self.assertEqual((off.level, off.message), (DiagnosticStatus.OK, ''))
        self.assertEqual(values(off)['enabled'], 'false')

    def test_interactive_markers_that_nobody_publishes_are_no_problem(self) -> None:
        markers = self.displays['Calibration']
        self.assertEqual((markers.level, markers.message), (DiagnosticStatus.OK, ''))

    def test_display_without_subscription(self) -> None:
        deaf = self.displays['Deaf']
        self.assertIn('No messages received: RViz has not subscribed to /nobody', deaf.message)
        self.assertGreaterEqual(deaf.level, DiagnosticStatus.WARN)

    def test_a_covered_window_draws_few_pictures(self) -> None:
        def picture(report: DiagnosticArray) -> Tuple[int, float]:
            return int(values(report.status[0])['frames']), report.header.stamp.to_sec()

        def draws_few() -> bool:
            if len(reports.messages) < 4:
                return False
            (first, begin_s), (last, end_s) = (picture(reports.messages[it]) for it in (-4, -1))
            return last - first <= (end_s - begin_s) / 0.25 + 1

        publisher = rospy.Publisher('/rviz/covered', Bool, queue_size=1, latch=True)
        publisher.publish(True)
        with Listener('/rviz/display_status', DiagnosticArray) as reports:
            wait_until(draws_few, 'few pictures')
            publisher.unregister()  # as if the launcher ended
            drawn, _ = picture(reports.messages[-1])
            wait_until(lambda: picture(reports.messages[-1])[0] > drawn + 20, 'all pictures again')

    def test_message_that_has_no_place_was_received_all_the_same(self) -> None:
        self.assertIn('No messages received on /lost', self.displays['Lost'].message)
        publisher = rospy.Publisher('/lost', PointStamped, queue_size=1)
        with Listener('/rviz/display_status', DiagnosticArray) as reports:
            def lost() -> DiagnosticStatus:
                return reports.messages[-1].status[-1]
            wait_until(lambda: bool(reports.messages) and 'nowhere' in lost().message,
                       "RViz's own error", lambda: publisher.publish(
                           PointStamped(Header(frame_id='nowhere'), Point())))
            self.assertNotIn('No messages', lost().message)

    def test_the_empty_cloud_that_clears_an_old_one_is_no_data(self) -> None:
        publisher = rospy.Publisher('/cloud', PointCloud2, queue_size=1)
        fields = [PointField(name, 4 * row, PointField.FLOAT32, 1)
                  for row, name in enumerate('xyz')]
        cloud = PointCloud2(Header(frame_id='base'), 1, 0, fields, False, 12, 0, b'', True)
        with Listener('/rviz/display_status', DiagnosticArray) as reports:
            def status() -> DiagnosticStatus:
                return reports.messages[-1].status[-2] if reports.messages else DiagnosticStatus()
            wait_until(lambda: 'No messages received on /cloud' in status().message, 'a warning')
            wait_until(lambda: publisher.get_num_connections() > 0, 'RViz listens')
            publisher.publish(cloud)
            wait_until(lambda: 'Points' in values(status()), 'RViz has it')
            self.assertIn('No messages received on /cloud', status().message)
            publisher.publish(cloud)  # an empty box
            wait_until(lambda: 'No messages' not in status().message, 'data')

    def test_rviz_itself(self) -> None:
        rviz = self.displays['rviz']
        self.assertEqual(rviz.level, DiagnosticStatus.OK, rviz.message)
        self.assertIn('Fixed Frame', values(rviz))
        self.assertGreater(int(values(rviz)['width']), 100)
        self.assertGreater(int(values(rviz)['height']), 100)
        self.assertGreater(int(values(rviz)['frames']),
                           int(values(self.first.status[0])['frames']))

    def test_rviz_has_the_size_that_it_is_told(self) -> None:
        publisher = rospy.Publisher('/rviz/place', RegionOfInterest, queue_size=1, latch=True)
        with Listener('/rviz/display_status', DiagnosticArray) as reports:
            def size() -> Tuple[int, int]:
                view = values(reports.messages[-1].status[0])
                return int(view['width']), int(view['height'])

            def place(width: int, height: int) -> None:
                publisher.publish(RegionOfInterest(20, 30, height, width, False))
            wait_until(lambda: bool(reports.messages), 'a report')
            before = size()
            place(900, 700)
            wait_until(lambda: size() != before, 'another size')
            wide, high = size()
            place(960, 780)
            wait_until(lambda: size() == (wide + 60, high + 80), 'the scene has grown likewise')


if __name__ == '__main__':
    rospy.init_node('display_status_test')
    rostest.rosrun('process_visualizer', 'display_status_test', DisplayStatusTest)
