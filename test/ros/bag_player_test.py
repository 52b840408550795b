#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""One path through the real player: its program, master, client and subscribers."""
from __future__ import annotations

import struct
import unittest
from pathlib import Path
from typing import List

import rospy
import rostest
from player_testing import Listener, Player, cell_rows, serialized, temporary_folder, write_bag
from std_msgs.msg import Float32MultiArray, String

from process_visualizer.clients.player_client import PlayerClient, PlayerError, PlayerUnreachable
from process_visualizer.player.bag_player import HEAD_START_NS
from process_visualizer.ros_names import PLAYBACK_RATE
from process_visualizer.srv import ReadTopic

TIMEOUT_S = 60.0


def numbers(listener: Listener) -> List[float]:
    """Return the numbers in the messages on /tcf."""
    return [round(Float32MultiArray().deserialize(data).data[0], 4) for data in listener.of('/tcf')]


def numbers_since(listener: Listener, number: float) -> List[float]:
    """Return the numbers after the last arrival of one of them; none before it has arrived."""
    backwards = numbers(listener)[::-1]
    return backwards[:backwards.index(number)][::-1] if number in backwards else []


class BagPlayerTest(unittest.TestCase):
    """Plays a bag of one second, in which a number is the time."""

    def setUp(self) -> None:
        folder = temporary_folder()
        self.addCleanup(folder.cleanup)
        self.bag = write_bag(Path(folder.name) / 'cell.bag', cell_rows(), compression='lz4')

    def test_every_message_comes_once_and_in_order(self) -> None:
        with Listener('/tcf', '/image', '/text') as listener, \
                Player(self.bag, '--wait-for-subscribers', '--topics', '/tcf', '/image', '/text',
                       '-q') as player:
            self.assertEqual(player.wait(), (0, ''))
            rows = [row for row in cell_rows() if row.topic in ('/tcf', '/image', '/text')]
            listener.wait_for(lambda: len(listener.received) >= len(rows), 'all messages')
            latched = {it.topic for it in listener.received if it.header['latching'] == '1'}
        for topic, stamped in (('/tcf', False), ('/text', False), ('/image', True)):
            recorded = [serialized(row.message) for row in rows if row.topic == topic]
            self.assertEqual([data[12 * stamped:] for data in listener.of(topic)],
                             [data[12 * stamped:] for data in recorded], topic)
        self.assertEqual(latched, {'/text'})

    def test_it_does_what_its_client_asks_for(self) -> None:
        client = PlayerClient()
        self.addCleanup(client.close)
        with Listener('/tcf') as listener, Player(self.bag, '--pause', '-k') as player:
            client.wait_until_ready(TIMEOUT_S)
            self.check_refusals(client)
            listener.wait_for(lambda: bool(numbers(listener)), 'the beginning')
            self.assertEqual(client.seek(0.5), 'at 0.500 s')
            for step, answer, shown_s in (((1, '/tcf'), 'at 0.504 s', 0.504),
                                          ((-2, '/tcf'), 'at 0.488 s', 0.488),
                                          ((0, '', -0.1), 'at 0.388 s', 0.384)):
                self.assertEqual(client.step(*step), answer)
                listener.wait_for(lambda it=shown_s: numbers(listener)[-1] == it, answer)
            self.check_playing(client, listener)
            self.check_loop(client, listener)
            client.stop()
            self.assertIsNotNone(client.wait_for(
                lambda it: it.paused and it.position == 0.0, TIMEOUT_S))
            self.check_late_subscriber()
            answer = player.call('read', ReadTopic, '/tcf', 0.2, 0.4)
            self.assertEqual((answer.success, len(answer.sizes)), (True, 26))
            player.process.terminate()
            self.assertEqual(player.wait()[0], 0)

    def check_refusals(self, client: PlayerClient) -> None:
        """A command that cannot be executed raises an error, and the player stays reachable."""
        for command, reason in ((lambda: client.set_rate(0.0), 'must not be 0'),
                                (lambda: client.step(1, '/none'), 'not in the recording'),
                                (lambda: client.set_loop(True, 0.5, 0.4), 'at least')):
            with self.assertRaisesRegex(PlayerError, reason) as caught:
                command()
            self.assertNotIsInstance(caught.exception, PlayerUnreachable)

    def check_playing(self, client: PlayerClient, listener: Listener) -> None:
        """Both directions play in order, without a gap."""
        for rate, begin_s in ((1.0, 0.2), (-2.0, 0.8)):
            client.seek(begin_s)
            self.assertEqual(client.set_rate(rate), f'rate {rate:g}')
            asked_s = rospy.get_time()
            self.assertIn('playing', client.play())
            listener.wait_for(lambda at=begin_s: len(numbers_since(listener, at)) > 40, 'messages')
            self.assertIn('paused', client.toggle_paused())
            self.assertEqual(rospy.get_param(PLAYBACK_RATE), rate)
            came = list(dict.fromkeys(numbers_since(listener, begin_s)))  # the last one is repeated
            step_s = 0.008 if rate > 0.0 else -0.008
            self.assertEqual(came, [round(begin_s + step_s * number, 4)
                                    for number in range(1, len(came) + 1)])
            came_s = {number: it.time_s for number, it in zip(numbers(listener), listener.received)}
            starts_s = asked_s + HEAD_START_NS * 1e-9
            # None before its time; backwards each arrives when the one after it is left.
            for count, number in enumerate(came, int(rate > 0.0)):
                due_s = starts_s + 0.008 * count / abs(rate)
                self.assertGreaterEqual(came_s[number], due_s - 0.001)
            listener.clear()

    def check_loop(self, client: PlayerClient, listener: Listener) -> None:
        """It loops between two positions; no other messages arrive."""
        client.set_rate(1.0)
        self.assertIn('loop from 0.200 to 0.400', client.set_loop(True, 0.2, 0.4))
        client.seek(0.2)
        segment = client.wait_for(lambda it: it.position == 0.2, TIMEOUT_S).segment
        listener.wait_for(lambda: numbers(listener)[-1:] == [0.2], 'the begin of the loop')
        listener.clear()
        client.play()
        self.assertIsNotNone(client.wait_for(lambda it: it.segment >= segment + 2, TIMEOUT_S))
        self.assertEqual(client.set_loop(False), 'no loop')
        client.pause()
        first_round = numbers(listener)[:numbers(listener).index(0.4)]
        self.assertTrue(set(first_round) <= {round(0.008 * it, 4) for it in range(25, 50)})
        self.assertEqual(first_round, sorted(first_round))

    def check_late_subscriber(self) -> None:
        """Latched messages have a stamp of the present, and so does the scene."""
        begin_s = rospy.get_time()
        with Listener('/text', '/image') as late:
            late.wait_for(lambda: bool(late.of('/text') and late.of('/image')), 'the scene')
            self.assertEqual(String().deserialize(late.of('/text')[-1]).data, 'the cell')
            seconds, nanoseconds = struct.unpack_from('<II', late.of('/image')[-1], 4)
            self.assertTrue(begin_s <= seconds + 1e-9 * nanoseconds <= rospy.get_time())


if __name__ == '__main__':
    rospy.init_node('bag_player_test')
    rostest.rosrun('process_visualizer', 'bag_player_test', BagPlayerTest)
