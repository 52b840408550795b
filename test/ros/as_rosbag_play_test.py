#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Options of `rosbag play`, compared with `rosbag play` itself: the same messages arrive."""
from __future__ import annotations

import subprocess
import unittest
from pathlib import Path
from typing import Callable, List, Sequence, Tuple

import rospy
import rostest
from geometry_msgs.msg import PointStamped
from player_testing import PROGRAM, Listener, Row, stamp, temporary_folder, write_bag
from std_msgs.msg import Int32

PLAYERS: Tuple[Tuple[str, ...], ...] = (
    ('rosbag', 'play'), (PROGRAM, '--stamps', 'recorded'))
TIMES_MS = [*range(0, 1000, 50), 3500, *range(4000, 4500, 50)]


def numbers(listener: Listener, topic: str = '/number') -> List[int]:
    """The numbers received on a topic."""
    return [Int32().deserialize(data).data for data in listener.of(topic)]


class AsRosbagPlayTest(unittest.TestCase):
    """Each number is its message's time [ms]; a half second and two seconds have no messages."""

    @classmethod
    def setUpClass(cls) -> None:
        cls.folder = temporary_folder()
        rows = [Row('/number', time_ms, Int32(time_ms)) for time_ms in TIMES_MS]
        cls.bag = write_bag(Path(cls.folder.name) / 'numbers.bag',
                            [*rows, Row('/mark', 725, Int32(725))], latched=())

    @classmethod
    def tearDownClass(cls) -> None:
        cls.folder.cleanup()

    def each(self, check: Callable[['subprocess.Popen[bytes]', Listener], None],
             *options: str) -> None:
        """Run both players with some options once a subscriber is there, and check the messages."""
        for program in PLAYERS:
            with self.subTest(program=program), Listener('/number', '/mark') as listener:
                process = subprocess.Popen(
                    [*program, self.bag, '--quiet', '--wait-for-subscribers', *options],
                    stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
                try:
                    check(process, listener)
                finally:
                    process.terminate()
                    process.communicate(timeout=60)

    def check_all(self, expected: Sequence[int], *options: str) -> None:
        """Check that both players publish the same, and end."""
        def check(process: 'subprocess.Popen[bytes]', listener: Listener) -> None:
            listener.wait_for(lambda: numbers(listener)[-1:] == [expected[-1]], 'the last message')
            self.assertEqual(process.wait(120), 0)
            self.assertEqual(numbers(listener), list(expected))

        self.each(check, *options)

    def allow(self, done: rospy.Publisher, time_ms: int) -> None:
        """Publish the progress of the node that controls the rate."""
        message = PointStamped()
        message.header.stamp = stamp(time_ms)
        done.publish(message)

    def test_immediate_without_a_limit_of_the_queue(self) -> None:
        self.check_all(TIMES_MS, '-i', '--queue', '0')

    def test_a_rate_beyond_those_of_the_keys(self) -> None:
        self.check_all(TIMES_MS, '-r', '50')

    def test_empty_parts_are_skipped(self) -> None:
        self.check_all(TIMES_MS, '--skip-empty', '1')

    def test_a_duration_ends_once(self) -> None:
        self.check_all(range(0, 701, 50), '-u', '0.72')

    def test_it_waits_for_the_node_that_controls_the_rate(self) -> None:
        def check(process: 'subprocess.Popen[bytes]', listener: Listener) -> None:
            listener.wait_for(lambda: 250 in numbers(listener), 'what may come')
            done = rospy.Publisher('/done', PointStamped, queue_size=1, latch=True)
            try:
                self.allow(done, 600)
                listener.wait_for(lambda: 600 in numbers(listener), 'what may come then')
                self.allow(done, 10 * TIMES_MS[-1])
                self.assertEqual(process.wait(120), 0)
                listener.wait_for(lambda: numbers(listener) == TIMES_MS, 'all')
            finally:
                done.unregister()

        self.each(check, '--rate-control-topic', '/done', '--rate-control-max-delay', '0.3')


if __name__ == '__main__':
    rospy.init_node('as_rosbag_play_test')
    rostest.rosrun('process_visualizer', 'as_rosbag_play_test', AsRosbagPlayTest)
