#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The client of a player that hangs, has ended, or was replaced."""
from __future__ import annotations

import signal
import unittest
from pathlib import Path

import rospy
import rostest
from player_testing import Player, cell_rows, temporary_folder, write_bag
from surroundings import suspended

from process_visualizer.clients.player_client import PlayerClient, PlayerUnreachable
from process_visualizer.msg import PlayerState

TIMEOUT_S = 60.0


class PlayerClientTest(unittest.TestCase):
    """Plays a bag of one second."""

    @classmethod
    def setUpClass(cls) -> None:
        cls.folder = temporary_folder()
        cls.bag = write_bag(Path(cls.folder.name) / 'cell.bag', cell_rows())

    @classmethod
    def tearDownClass(cls) -> None:
        cls.folder.cleanup()

    def client(self, **options: object) -> PlayerClient:
        """Return a client that is closed at the end."""
        client = PlayerClient(**options)
        self.addCleanup(client.close)
        return client

    def wait_for(self, client: PlayerClient, **expected: object) -> PlayerState:
        """Wait for a state with these values."""
        state = client.wait_for(lambda it: all(getattr(it, name) == value
                                               for name, value in expected.items()), TIMEOUT_S)
        self.assertIsNotNone(state, (expected, client.state))
        return state

    def test_a_player_that_is_not_there_is_told(self) -> None:
        client = self.client(node='/nobody')
        with self.assertRaisesRegex(PlayerUnreachable, 'nobody/play does not answer'):
            client.play()
        with self.assertRaisesRegex(PlayerUnreachable, 'is not running; start it'):
            client.wait_until_ready(0.1)

    def test_a_new_player_is_found_without_an_error(self) -> None:
        client = self.client()
        for ending in (signal.SIGKILL, signal.SIGINT, signal.SIGINT):
            with Player(self.bag, '--pause') as player:
                player.wait_for_state(lambda it: it.paused, 'the player runs')
                client.wait_until_ready(TIMEOUT_S)
                self.assertEqual(client.seek(0.5), 'at 0.500 s')
                player.process.send_signal(ending)
                player.wait()
        with self.assertRaises(PlayerUnreachable):
            client.seek(0.5)

    def test_a_player_that_hangs_is_given_up_and_works_again_later(self) -> None:
        client = self.client(timeout_s=4.0)
        with Player(self.bag, '--pause') as player:
            client.wait_until_ready(TIMEOUT_S)
            client.seek(0.5)
            with suspended(player.process.pid), \
                    self.assertRaisesRegex(PlayerUnreachable, 'timed out'):
                client.seek(0.6)
            self.wait_for(client, position=0.6)  # done too late; it must not follow the next one
            self.assertEqual(client.seek(0.7), 'at 0.700 s')


if __name__ == '__main__':
    rospy.init_node('player_client_test')
    rostest.rosrun('process_visualizer', 'player_client_test', PlayerClientTest)
