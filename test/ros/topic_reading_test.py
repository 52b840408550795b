#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The player reads the recording for others, and nobody sees anything of it."""
from __future__ import annotations

import math
import unittest
from pathlib import Path
from typing import Any, List

import rospy
import rostest
from player_testing import (
    BEGIN_S,
    Listener,
    Player,
    cell_rows,
    serialised,
    temporary_folder,
    write_bag,
)
from std_srvs.srv import Trigger

from process_visualizer.srv import ReadTopic


def messages(answer: Any) -> List[bytes]:
    """The messages of an answer."""
    ends = [sum(answer.sizes[:count]) for count in range(len(answer.sizes) + 1)]
    return [answer.data[begin:end] for begin, end in zip(ends, ends[1:])]


class TopicReadingTest(unittest.TestCase):
    """Plays a bag of one second, /tcf each 8 ms."""

    @classmethod
    def setUpClass(cls) -> None:
        cls.folder = temporary_folder()
        cls.rows = [row for row in cell_rows(1000) if row.topic == '/tcf']
        cls.bag = write_bag(Path(cls.folder.name) / 'cell.bag', cell_rows(1000))

    @classmethod
    def tearDownClass(cls) -> None:
        cls.folder.cleanup()

    def test_it_answers_what_was_recorded(self) -> None:
        with Player(self.bag, '--pause', '-k') as player:
            answer = player.call('read', ReadTopic, '/tcf', 0.2, 0.4)
        wanted = [row for row in self.rows if 200 <= row.time_ms <= 400]
        self.assertTrue(answer.success, answer.message)
        self.assertEqual(answer.type, 'std_msgs/Float32MultiArray')
        self.assertEqual(answer.recording_begin, rospy.Time(BEGIN_S))
        self.assertEqual(answer.end, 0.4)
        self.assertAlmostEqual(answer.period, 0.008, 6)
        self.assertEqual(list(answer.positions), [row.time_ms / 1000 for row in wanted])
        self.assertEqual(messages(answer), [serialised(row.message) for row in wanted])

    def test_the_name_is_the_one_that_it_is_published_by(self) -> None:
        with Player(self.bag, '--pause', '-k', '/tcf:=/played/tcf') as player:
            self.assertTrue(player.call('read', ReadTopic, '/played/tcf', 0.0, 0.1).success)
            answer = player.call('read', ReadTopic, '/tcf', 0.0, 0.1)
        self.assertEqual((answer.success, answer.message), (False, '/tcf is not played'))

    def test_what_cannot_be_read_is_refused(self) -> None:
        with Player(self.bag, '--pause', '-k') as player:
            for begin, end in ((0.4, 0.2), (math.nan, 1.0), (0.0, math.inf)):
                self.assertFalse(player.call('read', ReadTopic, '/tcf', begin, end).success)
            self.assertEqual(player.call('read', ReadTopic, '/tcf', 7.0, 8.0).sizes, ())

    def test_of_too_much_it_says_up_to_where_it_is(self) -> None:
        with Player(self.bag, '--pause', '-k') as player:
            answer = player.call('read', ReadTopic, '/image', 0.0, 1.0)
        self.assertEqual(len(answer.sizes), 11)  # of 90 kB each
        self.assertAlmostEqual(answer.end, 0.404, 6)

    def test_nobody_sees_anything_of_it(self) -> None:
        with Listener('/tcf') as listener, Player(self.bag, '-d', '1', '-k') as player:
            while len(listener.of('/tcf')) < 20:
                player.call('read', ReadTopic, '/image', 0.0, 1.0)
            player.call('pause', Trigger)
            state = player.wait_for_state(lambda it: it.paused, 'a pause')
            player.call('read', ReadTopic, '/tcf', 0.0, 1.0)
            after = player.wait_for_state(lambda it: it.stamp > state.stamp, 'a state')
            received = list(dict.fromkeys(listener.of('/tcf')))
        self.assertEqual((after.position, after.segment), (state.position, state.segment))
        wanted = [serialised(row.message) for row in self.rows]
        self.assertEqual(received, wanted[:len(received)])


if __name__ == '__main__':
    rospy.init_node('topic_reading_test')
    rostest.rosrun('process_visualizer', 'topic_reading_test', TopicReadingTest)
