#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The player beside nodes that publish the same topics: told at once, and paused in the cell."""
from __future__ import annotations

import subprocess
import sys
import unittest
from pathlib import Path
from typing import Any

import rospy
import rostest
from player_testing import Player, cell_rows, temporary_folder, write_bag
from std_srvs.srv import Trigger

from process_visualizer.health.other_publishers import LOOK_PERIOD_S

DRIVER = """
import sys, rospy
from std_msgs.msg import Float32MultiArray
rospy.init_node('driver')
publishers = [rospy.Publisher(topic, Float32MultiArray, queue_size=1) for topic in sys.argv[1:]]
print('publishes', flush=True)
rospy.spin()
"""
LOOKS = rospy.Duration(3 * LOOK_PERIOD_S)
MIXED = ['/tcf is published by /driver']


class Driver:
    """A node that publishes topics, while it is used in a ``with``."""

    def __init__(self, *topics: str) -> None:
        self.process = subprocess.Popen([sys.executable, '-c', DRIVER, *topics],
                                        stdout=subprocess.PIPE, text=True)
        assert self.process.stdout is not None
        self.process.stdout.readline()

    def __enter__(self) -> Driver:
        return self

    def __exit__(self, *_error: Any) -> None:
        if self.process.poll() is None:
            self.process.terminate()
        self.process.communicate(timeout=40)

    def kill(self) -> None:
        """End it without a farewell: the master goes on knowing it."""
        self.process.kill()
        self.process.wait()


class BagPlayerOthersTest(unittest.TestCase):
    """The topics /tcf (an array), /tf and others are played."""

    def setUp(self) -> None:
        folder = temporary_folder()
        self.addCleanup(folder.cleanup)
        self.bag = write_bag(Path(folder.name) / 'cell.bag', cell_rows())

    def cell_player(self, *arguments: str) -> Player:
        """The player as it is launched in a cell."""
        return Player(self.bag, '--keep-alive', '--loop', *arguments, '--others', 'pause',
                      '--topics', '/tcf', '/tf', '/other_tcf')

    def test_a_driver_that_runs_keeps_it_from_playing(self) -> None:
        with Driver('/tcf'), self.cell_player() as player:
            state = player.wait_for_state(lambda it: bool(it.others), 'the other one')
            self.assertEqual(state.others, MIXED)
            self.assertTrue(state.paused)
            self.assertEqual(state.position, 0.0)

    def test_a_driver_that_starts_is_told_and_pauses(self) -> None:
        with self.cell_player() as player:
            state = player.wait_for_state(lambda it: not it.paused and it.position > 0.1, 'plays')
            self.assertEqual(state.others, [])
            with Driver('/tcf'):
                state = player.wait_for_state(lambda it: bool(it.others) and it.paused, 'paused')
                self.assertEqual(state.others, MIXED)
                player.call('play', Trigger)  # the operator wants it all the same
                player.wait_for_state(lambda it: not it.paused, 'plays on')
                began = rospy.Time.now()
                state = player.wait_for_state(
                    lambda it: it.paused or it.stamp > began + LOOKS, 'time passes')
                self.assertFalse(state.paused, 'it was told already')
            player.wait_for_state(lambda it: not it.others, 'nobody else')
            player.process.terminate()
            self.assertIn('/tcf is published by /driver, in addition to the recording: stop it',
                          player.wait()[1])

    def test_who_was_killed_is_nobody(self) -> None:
        with self.cell_player() as player, Driver('/tcf') as driver:
            player.wait_for_state(lambda it: bool(it.others), 'the other one')
            driver.kill()
            player.wait_for_state(lambda it: not it.others, 'nobody else')

    def test_what_the_recording_has_not_must_not_come_from_elsewhere(self) -> None:
        with Driver('/other_tcf'), self.cell_player() as player:
            state = player.wait_for_state(lambda it: bool(it.others), 'the other one')
            self.assertEqual(state.others, ['/other_tcf is published by /driver'])

    def test_shared_topics_and_other_names_are_no_mixture(self) -> None:
        with Driver('/tf', '/tcf'), Player(self.bag, '--keep-alive', '--loop', '--others', 'pause',
                                           '--prefix', '/recorded') as player:
            state = player.wait_for_state(lambda it: not it.paused and it.position > 0.9, 'plays')
            self.assertEqual(state.others, [])

    def test_in_the_place_of_rosbag_play_it_warns_and_plays(self) -> None:
        with Driver('/tcf'), Player(self.bag) as player:
            code, output = player.wait()
        self.assertEqual(code, 0, output)
        self.assertIn('/tcf is published by /driver, in addition to the recording', output)
        self.assertNotIn('paused', output)


if __name__ == '__main__':
    rospy.init_node('bag_player_others_test')
    rostest.rosrun('process_visualizer', 'bag_player_others_test', BagPlayerOthersTest)
