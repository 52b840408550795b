#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Short versions of two benchmarks: random commands, and the order within every topic."""
from __future__ import annotations

import sys
import unittest
from pathlib import Path

import numpy as np
import rospy
import rostest
from player_testing import Listener, Player, temporary_folder
from std_msgs.msg import String

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / 'bench'))

from message_index import indexes  # noqa: E402
from random_commands import commanded  # noqa: E402
from scene_bag import scene_bag  # noqa: E402
from topic_order import mixed_bag  # noqa: E402

COMMANDS, MESSAGES = 80, 3000


class RandomCommandsTest(unittest.TestCase):
    """A player with messages of all sizes, and a subscriber of everything."""

    def setUp(self) -> None:
        folder = temporary_folder()
        self.addCleanup(folder.cleanup)
        self.folder = folder.name

    def test_after_random_commands_the_scene_is_that_of_the_position(self) -> None:
        with commanded(scene_bag(self.folder, 3.0), seed=12) as session:
            result = session.run(COMMANDS)
        self.assertEqual(result.wrong, [])
        self.assertGreater(result.compared, COMMANDS // 4)

    def test_messages_of_each_topic_keep_their_order_whatever_their_sizes(self) -> None:
        bag = mixed_bag(self.folder, MESSAGES)
        names = [topic.name for topic in bag.topics]
        for rate in ('1', '-1', '8', '-8'):
            options = [f'--rate={rate}', '--wait-for-subscribers', '--queue', '10000']
            with Listener(*names) as listener, Player(str(bag.path), *options) as player:
                self.assertEqual(player.wait()[0], 0)
                for number, name in enumerate(names):
                    self.check_order(listener, name, len(bag.times_ns(number)), float(rate))

    def check_order(self, listener: Listener, topic: str, count: int, rate: float) -> None:
        """Every message arrives, none after one that is later in the direction of play."""
        listener.wait_for(lambda: len({it.data for it in listener.received if it.topic == topic})
                          == count, f'{topic}: {count} messages')
        fronts = b''.join(data[:64].ljust(64, b'.') for data in listener.of(topic))
        came = indexes(String._type, np.frombuffer(fronts, np.uint8).reshape(-1, 64))
        steps = np.diff(came if rate > 0 else -came)
        self.assertEqual(np.flatnonzero(steps < 0).tolist(), [], f'{topic} at {rate:g}x')


if __name__ == '__main__':
    rospy.init_node('random_commands_test')
    rostest.rosrun('process_visualizer', 'random_commands_test', RandomCommandsTest)
