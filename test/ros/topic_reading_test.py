#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The player reads the recording for others while it plays, and nobody sees anything of it."""
from __future__ import annotations

import unittest
from pathlib import Path

import rospy
import rostest
from player_testing import (
    Listener,
    Player,
    cell_rows,
    serialised,
    temporary_folder,
    write_bag,
)
from std_srvs.srv import Trigger

from process_visualizer.srv import ReadTopic


class TopicReadingTest(unittest.TestCase):
    """Plays a bag of one second, /tcf each 8 ms, under another name."""

    def test_nobody_sees_anything_of_it(self) -> None:
        with temporary_folder() as folder:
            rows = cell_rows(1000)
            bag = write_bag(Path(folder) / 'cell.bag', rows)
            wanted = [serialised(row.message) for row in rows if row.topic == '/tcf']
            with Listener('/played/tcf') as listener, \
                    Player(bag, '-d', '1', '-k', '/tcf:=/played/tcf') as player:
                while len(listener.of('/played/tcf')) < 20:
                    player.call('read', ReadTopic, '/image', 0.0, 1.0)
                player.call('pause', Trigger)
                state = player.wait_for_state(lambda it: it.paused, 'a pause')
                answer = player.call('read', ReadTopic, '/played/tcf', 0.0, 1.0)
                after = player.wait_for_state(lambda it: it.stamp > state.stamp, 'a state')
                received = list(dict.fromkeys(listener.of('/played/tcf')))
        self.assertEqual(answer.data, b''.join(wanted))
        self.assertEqual((after.position, after.segment), (state.position, state.segment))
        self.assertEqual(received, wanted[:len(received)])


if __name__ == '__main__':
    rospy.init_node('topic_reading_test')
    rostest.rosrun('process_visualizer', 'topic_reading_test', TopicReadingTest)
