#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The player as a process under faults: of the master and subscribers, signals, and bad files."""
from __future__ import annotations

import os
import signal
import socket
import socketserver
import subprocess
import sys
import threading
import unittest
from pathlib import Path
from typing import Any, Sequence, Tuple
from xmlrpc.client import ServerProxy
from xmlrpc.server import SimpleXMLRPCServer

import rospy
import rostest
from eager_subscriber import EagerSubscriber
from player_testing import (
    PROGRAM,
    Listener,
    Player,
    Row,
    cell_rows,
    temporary_folder,
    write_bag,
)
from sensor_msgs.msg import Image
from std_srvs.srv import Trigger

from process_visualizer.player.player_program import NOT_ALL


def played(*arguments: str, **environment: str) -> Tuple[int, str]:
    """Run the player to its end; return exit code and output."""
    return run([PROGRAM, *arguments], **environment)


def run(command: Sequence[str], **environment: str) -> Tuple[int, str]:
    """Run a program to its end; return exit code and output."""
    process = subprocess.run(
        command, timeout=120,
        stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
        env={**os.environ, **environment})
    return process.returncode, process.stdout


class SlowMaster:
    """Forwards a node's calls to the master; the first call of one method waits to be released."""

    def __init__(self, method: str) -> None:
        self._method = method
        self.is_asked, self.release = threading.Event(), threading.Event()
        self._server = SlowMaster._Server(('localhost', 0), logRequests=False, allow_none=True)
        self._server.register_instance(self)
        self._thread = threading.Thread(target=self._server.serve_forever)
        self._thread.start()
        self.uri = f'http://localhost:{self._server.server_address[1]}'

    class _Server(socketserver.ThreadingMixIn, SimpleXMLRPCServer):
        daemon_threads = True

    def _dispatch(self, method: str, arguments: Sequence[Any]) -> Any:
        if method == self._method and not self.is_asked.is_set():
            self.is_asked.set()
            self.release.wait(60.0)
        return getattr(ServerProxy(os.environ['ROS_MASTER_URI']), method)(*arguments)

    def __enter__(self) -> SlowMaster:
        return self

    def __exit__(self, *_: object) -> None:
        self._server.shutdown()
        self._thread.join()
        self._server.server_close()


FAULTY_PLAYER = """
import sys
from process_visualizer.bagio.recording import Recording
from process_visualizer.player.player_program import main

class FaultyRecording(Recording):
    def message(self, position):
        if position >= int(sys.argv[-1]):
            raise RuntimeError('a fault')
        return super().message(position)

sys.exit(main(sys.argv[:-1], FaultyRecording))
"""


SLOW_SUBSCRIBER = """
import sys, threading, rospy

def take_no_more(message):
    print('came', flush=True)
    threading.Event().wait()

rospy.init_node('slow')
rospy.Subscriber(sys.argv[1], rospy.AnyMsg, take_no_more)
rospy.spin()
"""


class BagPlayerFaultsTest(unittest.TestCase):
    """Every fault has a message that says what and where, no traceback, no hang."""

    def setUp(self) -> None:
        self.folder = temporary_folder()
        self.addCleanup(self.folder.cleanup)
        self.rows = cell_rows()

    def bag(self, compression: str = 'none') -> str:
        """Write a bag of one second."""
        return write_bag(Path(self.folder.name) / 'cell.bag', self.rows, compression=compression)

    def test_no_master(self) -> None:
        with socket.socket() as probe:
            probe.bind(('localhost', 0))
            uri = f'http://localhost:{probe.getsockname()[1]}'
        code, output = played(self.bag(), ROS_MASTER_URI=uri)
        self.assertRegex(output, r'^bag_player: [^\n]*is roscore running\?\n$')
        self.assertEqual(code, 1)

    def test_at_the_end_it_sums_up_what_was_not_played(self) -> None:
        bag = Path(self.bag('bz2'))
        content = bytearray(bag.read_bytes())
        at = content.index(b'BZh', content.index(b'BZh', len(content) // 3) + 1)
        content[at:at + 40] = bytes(40)
        bag.write_bytes(content)
        code, output = played(str(bag))
        self.assertEqual(code, NOT_ALL)
        _, told, summary = output.partition('bag_player: not everything was played')
        self.assertTrue(told, output)
        self.assertRegex(summary, r'/tcf: \d+ of 126 messages could not be played')
        self.assertIn('a chunk cannot be read: decompression (bz2) fails', summary)
        self.assertEqual(played(str(bag), '--topics', '/marker'), (0, ''))

    def test_a_slow_subscriber_loses_messages_that_are_counted_and_nobody_else_does(self) -> None:
        rows = [Row('/big', 100 * number, Image(data=bytes([number]) * 2_000_000))
                for number in range(31)]  # more than sockets hold
        bag = write_bag(Path(self.folder.name) / 'big.bag', rows)
        with Listener('/big') as listener, \
                Player(bag, '--pause', '-k', '--queue', '3') as player:
            slow = subprocess.Popen([sys.executable, '-c', SLOW_SUBSCRIBER, '/big'],
                                    stdout=subprocess.PIPE)
            self.addCleanup(slow.communicate)
            self.addCleanup(slow.kill)
            slow.stdout.readline()
            player.call('play', Trigger)
            state = player.wait_for_state(lambda it: it.position >= it.duration, 'the end')
            listener.wait_for(lambda: len(set(listener.of('/big'))) == 31, 'all of it')
            self.assertGreater(state.dropped, 0)
            self.assertEqual(state.achieved_rate, 0.0)

    def test_a_fault_of_the_program_ends_it_with_a_sentence(self) -> None:
        code, output = run([sys.executable, '-c', FAULTY_PLAYER, self.bag(), '-q', '60'])
        self.assertEqual(code, 1, output)
        self.assertRegex(output, r"^bag_player: playback has failed at 0.* s: "
                                 r"RuntimeError\('a fault'\) in .*, line \d+; start it again")
        self.assertNotIn('Traceback', output)

    def test_a_signal_while_the_master_is_asked_ends_it(self) -> None:
        for number in (signal.SIGINT, signal.SIGTERM):
            with self.subTest(number), SlowMaster('registerService') as master:
                player = subprocess.Popen([PROGRAM, self.bag(), '--pause', '-k'],
                                          stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                                          stderr=subprocess.STDOUT, text=True,
                                          env={**os.environ, 'ROS_MASTER_URI': master.uri})
                self.assertTrue(master.is_asked.wait(60.0))
                player.send_signal(number)
                master.release.set()
                try:
                    output, _ = player.communicate(timeout=60.0)
                finally:
                    player.kill()
                self.assertEqual((player.returncode, 'Traceback' in output), (0, False), output)

    def test_who_connects_again_at_its_end_is_no_fault(self) -> None:
        with Player(self.bag(), '--pause', '-q') as player:
            player.wait_for_state(lambda it: it.paused, 'it is there')
            with EagerSubscriber('/bag_player', '/tcf') as subscriber:
                player.call('play', Trigger)
                self.assertEqual(player.wait(), (0, ''))
            self.assertGreaterEqual(subscriber.connections, 1)

    def test_signals_end_it(self) -> None:
        for number in (signal.SIGINT, signal.SIGTERM):
            with Player(self.bag(), '-r', '0.1') as player:
                player.wait_for_state(lambda it: not it.paused, 'playing')
                player.process.send_signal(number)
                _, output = player.wait()
                self.assertNotIn('Traceback', output)


if __name__ == '__main__':
    rospy.init_node('bag_player_faults_test')
    rostest.rosrun('process_visualizer', 'bag_player_faults_test', BagPlayerFaultsTest)
