#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Options of `rosbag play`, beside `rosbag play` itself: the same messages come, as fast."""
from __future__ import annotations

import subprocess
import unittest
from pathlib import Path
from typing import Callable, List, Tuple

import rospy
import rostest
from geometry_msgs.msg import PointStamped
from player_testing import PROGRAM, Listener, Row, stamp, temporary_folder, write_bag
from std_msgs.msg import Int32

PLAYERS: Tuple[Tuple[str, ...], ...] = (
    ('rosbag', 'play'), (PROGRAM, '--stamps', 'recorded'))
TIMES_MS = [*range(0, 1000, 50), 3500, *range(4000, 4500, 50)]


def numbers(listener: Listener, topic: str = '/number') -> List[int]:
    """The numbers that have come on a topic."""
    return [Int32().deserialize(data).data for data in listener.of(topic)]


class AsRosbagPlayTest(unittest.TestCase):
    """A number is the time [ms] of its message; half a second is empty, and two seconds are."""

    @classmethod
    def setUpClass(cls) -> None:
        cls.folder = temporary_folder()
        rows = [Row('/number', time_ms, Int32(time_ms)) for time_ms in TIMES_MS]
        rows.append(Row('/mark', 725, Int32(725)))
        cls.bag = write_bag(Path(cls.folder.name) / 'numbers.bag',
                            sorted(rows, key=lambda row: row.time_ms), latched=())

    @classmethod
    def tearDownClass(cls) -> None:
        cls.folder.cleanup()

    def each(self, check: Callable[[subprocess.Popen, Listener], None], *options: str) -> None:
        """Run both players with some options, and look at what comes."""
        for program in PLAYERS:
            with self.subTest(program=program), Listener('/number', '/mark') as listener:
                process = subprocess.Popen(
                    [*program, self.bag, '--quiet', '--delay', '2', *options],
                    stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
                try:
                    check(process, listener)
                finally:
                    process.terminate()
                    process.communicate(timeout=20)

    def played(self, *options: str, last_ms: int = TIMES_MS[-1]) -> List[Tuple[List[int], float]]:
        """What comes until a message, and how long that takes [s], for both players."""
        found = []

        def check(process: subprocess.Popen, listener: Listener) -> None:
            listener.wait_for(lambda: numbers(listener)[-1:] == [last_ms], 'the last message')
            self.assertEqual(process.wait(40), 0)
            times_s = [it.time_s for it in listener.received]
            found.append((numbers(listener), times_s[-1] - times_s[0]))

        self.each(check, *options)
        return found

    def check_same(self, found: List[Tuple[List[int], float]], expected: List[int],
                   about_s: float) -> None:
        """Both players brought the same, in about the same time."""
        for came, elapsed_s in found:
            self.assertEqual(came, expected)
            self.assertAlmostEqual(elapsed_s, about_s, delta=0.7)
        self.assertEqual(len(found), len(PLAYERS))

    def test_immediate(self) -> None:
        self.check_same(self.played('-i'), TIMES_MS, 0.0)

    def test_a_rate_beyond_those_of_the_keys(self) -> None:
        self.check_same(self.played('-r', '50'), TIMES_MS, 0.1)

    def test_empty_parts_are_skipped(self) -> None:
        self.check_same(self.played('--skip-empty', '1'), TIMES_MS, 1.95)

    def test_a_duration_ends_once(self) -> None:
        self.check_same(self.played('-u', '0.72', last_ms=700), list(range(0, 701, 50)), 0.7)

    def test_a_queue_without_limit(self) -> None:
        self.check_same(self.played('--queue', '0', '-i'), TIMES_MS, 0.0)

    def test_it_pauses_before_the_messages_of_some_topics(self) -> None:
        def check(process: subprocess.Popen, listener: Listener) -> None:
            listener.wait_for(lambda: numbers(listener)[-1:] == [700], 'what comes before')
            with self.assertRaises(AssertionError):
                listener.wait_for(lambda: bool(numbers(listener, '/mark')), 'the mark', 1.5)
            self.assertEqual(numbers(listener)[-1], 700)

        self.each(check, '--pause-topics', '/mark')

    def test_it_waits_for_the_node_that_controls_the_rate(self) -> None:
        def check(process: subprocess.Popen, listener: Listener) -> None:
            listener.wait_for(lambda: 250 in numbers(listener), 'what may come')
            with self.assertRaises(AssertionError):
                listener.wait_for(lambda: max(numbers(listener)) > 450, 'more than that', 1.5)
            message = PointStamped()
            message.header.stamp = stamp(10 * TIMES_MS[-1])
            done.publish(message)
            listener.wait_for(lambda: numbers(listener)[-1:] == [TIMES_MS[-1]], 'the rest')
            self.assertEqual(numbers(listener), TIMES_MS)
            self.assertEqual(process.wait(40), 0)

        done = rospy.Publisher('/done', PointStamped, queue_size=1)
        self.each(check, '--rate-control-topic', '/done', '--rate-control-max-delay', '0.3')


if __name__ == '__main__':
    rospy.init_node('as_rosbag_play_test')
    rostest.rosrun('process_visualizer', 'as_rosbag_play_test', AsRosbagPlayTest)
