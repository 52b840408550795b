#!/usr/bin/env python3
"""The player tells of messages without a stamp when they were recorded, before it sends them."""
from __future__ import annotations

import threading
import time
import unittest
import zlib
from pathlib import Path
from typing import Dict, List

import rospy
import rostest
from player_testing import Listener, Player, cell_rows, serialised, temporary_folder, write_bag
from std_srvs.srv import Trigger

from process_visualizer.motion.recorded_times import Told
from process_visualizer.nodes.recorded_times import RecordedTimesFollower
from process_visualizer.srv import Seek, SetRate, Step


class Follower:
    """What is told of a topic, and when it came."""

    def __init__(self, topic: str) -> None:
        self.told: List[Told] = []
        self.first_s: Dict[int, float] = {}
        self.changed = threading.Condition()
        RecordedTimesFollower(topic, self._receive)

    def _receive(self, coming: List[Told]) -> None:
        now_s = time.time()
        with self.changed:
            self.told += coming
            for told in coming:
                self.first_s.setdefault(told.checksum, now_s)
            self.changed.notify_all()


class RecordedTimesTest(unittest.TestCase):
    """Plays a bag of one second, in which no two messages of /tcf are equal."""

    @classmethod
    def setUpClass(cls) -> None:
        cls.folder = temporary_folder()
        rows = cell_rows()
        cls.bag = write_bag(Path(cls.folder.name) / 'cell.bag', rows)
        cls.recorded_s = {zlib.crc32(serialised(row.message)): row.time_ms / 1000.0
                          for row in rows if row.topic == '/tcf'}

    @classmethod
    def tearDownClass(cls) -> None:
        cls.folder.cleanup()

    def check(self, follower: Follower, listener: Listener) -> None:
        """What was told is true, and all that came was told."""
        sent = {zlib.crc32(data) for data in listener.of('/tcf')}
        with follower.changed:
            complete = follower.changed.wait_for(lambda: sent <= follower.first_s.keys(), 20.0)
            self.assertTrue(complete, len(sent - follower.first_s.keys()))
            for told in follower.told:
                self.assertAlmostEqual(told.bag.time_s, self.recorded_s[told.checksum], 6)

    def test_while_it_plays_what_comes_is_told_before(self) -> None:
        follower = Follower('/tcf')
        with Listener('/tcf') as listener, Player(self.bag, '-d', '2', '-r', '0.5', '-k') as player:
            listener.wait_for(lambda: len(listener.received) >= 126, '/tcf')
            player.wait_for_state(lambda it: it.position == 1.0, 'the end')
            self.check(follower, listener)
        self.assertEqual({told.bag.rate for told in follower.told[:100]}, {0.5})
        late = [it for it in listener.received[10:]
                if follower.first_s[zlib.crc32(it.data)] >= it.time_s]
        self.assertLess(len(late), 12)  # a busy machine may hold up what tells

    def test_after_commands_of_all_kinds(self) -> None:
        follower = Follower('/tcf')
        with Listener('/tcf') as listener, Player(self.bag, '--pause', '-k') as player:
            paused = player.wait_for_state(lambda it: it.paused, 'the player runs')
            listener.wait_for(lambda: len(listener.received) >= 1, 'the scene')
            for rate, position_s in ((0.5, 0.1), (-0.5, 0.9), (4.0, 0.2)):
                player.call('set_rate', SetRate, rate)
                player.call('seek', Seek, position_s)
                player.call('play', Trigger)
                player.wait_for_state(lambda it, at=position_s: abs(it.position - at) > 0.2, 'on')
                player.call('pause', Trigger)
            player.call('step', Step, 5, '/tcf', 0.0)
            player.call('step', Step, -5, '/tcf', 0.0)
            player.wait_for_state(lambda it: it.paused, 'the last step')
            self.check(follower, listener)
        self.assertEqual({told.bag.rate for told in follower.told}, {0.0, 0.5, -0.5, 4.0})
        self.assertGreater(follower.told[-1].bag.segment, paused.segment)


if __name__ == '__main__':
    rospy.init_node('recorded_times_test')
    rostest.rosrun('process_visualizer', 'recorded_times_test', RecordedTimesTest)
