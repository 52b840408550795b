#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The player with what can go wrong: files, names, subscribers, the master."""
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
from typing import Any, BinaryIO, Sequence, Tuple
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
    serialised,
    temporary_folder,
    write_bag,
)
from sensor_msgs.msg import Image
from std_msgs.msg import Float32MultiArray, String
from std_srvs.srv import Trigger

from process_visualizer.srv import Seek
from process_visualizer.terminal.player_program import NOT_ALL


def played(*arguments: str, **environment: str) -> Tuple[int, str]:
    """Run the player to its end; return exit code and output."""
    return run([PROGRAM, *arguments], **environment)


def run(command: Sequence[str], **environment: str) -> Tuple[int, str]:
    """Run a program to its end; return exit code and output."""
    process = subprocess.run(
        command, timeout=60,
        stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
        env={**os.environ, **environment})
    return process.returncode, process.stdout


class SlowMaster:
    """Passes on what a node asks the master; the first call of one method waits to be released."""

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
            self.release.wait(20.0)
        return getattr(ServerProxy(os.environ['ROS_MASTER_URI']), method)(*arguments)

    def __enter__(self) -> SlowMaster:
        return self

    def __exit__(self, *_: object) -> None:
        self._server.shutdown()
        self._thread.join()
        self._server.server_close()


class BadImage(Image):
    """An image whose bytes end within its header."""

    def serialize(self, buff: BinaryIO) -> None:
        buff.write(bytes(14))


FAULTY_PLAYER = """
import sys
from process_visualizer.bags.recording import Recording
from process_visualizer.terminal.player_program import main

class FaultyRecording(Recording):
    def message(self, position):
        if position >= int(sys.argv[-1]):
            raise RuntimeError('a fault')
        return super().message(position)

sys.exit(main(sys.argv[:-1], FaultyRecording))
"""


SLOW_SUBSCRIBER = """
import sys, threading, rospy
rospy.init_node('slow')
rospy.Subscriber(sys.argv[1], rospy.AnyMsg, lambda message: threading.Event().wait())
rospy.spin()
"""


class BagPlayerFaultsTest(unittest.TestCase):
    """Whatever happens: a message that says what and where, no traceback, no hang."""

    def setUp(self) -> None:
        self.folder = temporary_folder()
        self.addCleanup(self.folder.cleanup)
        self.rows = cell_rows()

    def path(self, name: str, content: bytes = b'') -> str:
        """A file in the test's folder."""
        path = Path(self.folder.name) / name
        path.write_bytes(content)
        return str(path)

    def bag(self, compression: str = 'none') -> str:
        """A bag of one second."""
        return write_bag(Path(self.folder.name) / 'cell.bag', self.rows, compression=compression)

    def check_refused(self, expected: str, *arguments: str, code: int = 1,
                      **environment: str) -> None:
        """The player ends with a code, and one line that holds the expected text."""
        result, output = played(*arguments, **environment)
        self.assertIn(expected, output)
        self.assertNotIn('Traceback', output)
        self.assertEqual(result, code, output)

    def test_files_that_are_no_bags(self) -> None:
        self.check_refused('cannot be opened: No such file', '/nowhere/x.bag')
        self.check_refused('is empty', self.path('empty.bag'))
        self.check_refused('is not a bag', self.path('text.bag', b'no bag at all'))
        self.check_refused('version 1.2', self.path('old.bag', b'#ROSBAG V1.2\n' + bytes(100)))
        self.check_refused('is not a file', self.folder.name)

    def test_wrong_options(self) -> None:
        bag = self.bag()
        self.check_refused('no bag is given', code=2)
        self.check_refused('must not be 0', bag, '-r', '0', code=2)
        self.check_refused('did you mean "/image"', bag, '--topics', '/imaeg')
        self.check_refused('no chosen topic can be played', bag, '--exclude', '/*')
        self.check_refused('is not a valid topic name', bag, '--prefix', 'a b', code=2)

    def test_no_master(self) -> None:
        with socket.socket() as probe:
            probe.bind(('localhost', 0))
            uri = f'http://localhost:{probe.getsockname()[1]}'
        self.check_refused('is roscore running?', self.bag(), ROS_MASTER_URI=uri)

    def test_a_bag_without_an_index_is_played_from_a_copy_if_wanted(self) -> None:
        bag = Path(self.bag())
        whole = bag.read_bytes()
        bag.write_bytes(whole[:int(len(whole) * 0.7)])
        self.check_refused('bag_player --reindex', str(bag))
        size = bag.stat().st_size
        with Listener('/tcf') as listener:
            code, output = played('--reindex', str(bag), '-d', '2')
            self.assertEqual(code, 0, output)
            self.assertIn('cell.reindexed.bag', output)
            listener.wait_for(lambda: len(listener.of('/tcf')) > 60, '/tcf')
        self.assertEqual(bag.stat().st_size, size)
        recorded = [serialised(row.message) for row in self.rows if row.topic == '/tcf']
        self.assertEqual(listener.of('/tcf'), recorded[:len(listener.of('/tcf'))])

    def test_a_damaged_chunk_is_a_gap_that_is_reported(self) -> None:
        bag = Path(self.bag('bz2'))
        content = bytearray(bag.read_bytes())
        at = content.index(b'BZh', content.index(b'BZh', len(content) // 3) + 1)
        content[at:at + 40] = bytes(40)
        bag.write_bytes(content)
        with Listener('/tcf') as listener, Player(str(bag), '-d', '2', '-k') as player:
            state = player.wait_for_state(lambda it: it.position >= it.duration, 'the end')
            self.assertEqual(len(state.gaps), 1)
            self.assertIn('a chunk cannot be read: decompression (bz2) fails', state.gaps[0])
            count = len(listener.of('/tcf'))
        self.assertTrue(60 < count < 126, count)

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

    def test_a_start_behind_the_end_plays_nothing(self) -> None:
        self.check_refused('no messages to play from 100 s on: the recording is 1.000 s long',
                           self.bag(), '-s', '100')
        self.check_refused('no messages to play', self.bag(), '-s', '1.001', '-r', '-1')

    def test_a_start_at_the_end_plays_the_last_message(self) -> None:
        with Listener('/tcf') as listener:
            code, output = played(self.bag(), '-s', '1', '-d', '2', '--topics', '/tcf')
            listener.wait_for(lambda: bool(listener.of('/tcf')), 'the last message')
        last = serialised([row for row in self.rows if row.topic == '/tcf'][-1].message)
        before = serialised([row for row in self.rows if row.topic == '/tcf'][-2].message)
        self.assertEqual((code, output), (0, ''))
        self.assertEqual(listener.of('/tcf'), [before, last])  # the scene, and what is left

    def test_a_name_that_is_not_utf_8(self) -> None:
        bag = os.path.join(os.fsencode(self.folder.name), b'sch\xf6n.bag')
        os.rename(self.bag(), bag)
        with Player(os.fsdecode(bag), '-k') as player:
            state = player.wait_for_state(lambda it: it.position >= 1.0, 'the end')
            self.assertTrue(state.files[0].endswith('sch\ufffdn.bag'))

    def test_a_message_that_does_not_fit_its_definition_is_left_out(self) -> None:
        rows = sorted([*self.rows, Row('/image', 500, BadImage())], key=lambda it: it.time_ms)
        bag = write_bag(Path(self.folder.name) / 'bad.bag', rows)
        with Listener('/image') as listener, Player(bag, '-d', '2', '-k') as player:
            state = player.wait_for_state(lambda it: it.position >= it.duration, 'the end')
            self.assertIn('/image: the message at 0.500 s does not fit its definition',
                          state.gaps[0])
            listener.wait_for(lambda: len(listener.of('/image')) == 25, 'all others')

    def test_a_bag_that_disappears_is_played_to_its_end(self) -> None:
        bag = self.bag()
        with Listener('/tcf') as listener, Player(bag, '--pause') as player:
            listener.wait_for(lambda: bool(listener.of('/tcf')), 'the beginning')
            os.remove(bag)
            player.call('play', Trigger)
            self.assertEqual(player.wait()[0], 0)
            listener.wait_for(lambda: len(set(listener.of('/tcf'))) == 126, 'the rest')

    def test_a_bag_that_is_cut_off_meanwhile_has_a_gap(self) -> None:
        bag = self.bag()
        with Player(bag, '--pause') as player:
            player.wait_for_state(lambda it: it.paused, 'pause')
            os.truncate(bag, os.path.getsize(bag) // 2)
            player.call('seek', Seek, 0.95)
            state = player.wait_for_state(lambda it: bool(it.gaps), 'a gap')
            self.assertIn('has become shorter', state.gaps[0])
            self.assertTrue(player.call('seek', Seek, 0.1).success)

    def test_a_slow_subscriber_loses_messages_that_are_counted_and_nobody_else_does(self) -> None:
        rows = [Row('/big', 10 * number, Image(data=bytes([number]) * 400_000))
                for number in range(101)]
        bag = write_bag(Path(self.folder.name) / 'big.bag', rows)
        slow = subprocess.Popen([sys.executable, '-c', SLOW_SUBSCRIBER, '/big'])
        self.addCleanup(slow.wait)
        self.addCleanup(slow.kill)
        with Listener('/big') as listener, Player(bag, '-d', '3', '-k', '--queue', '3',
                                                    '-r', '0.5') as player:
            state = player.wait_for_state(lambda it: it.position >= it.duration, 'the end')
            listener.wait_for(lambda: len(listener.of('/big')) == 101, 'all of it')
            self.assertGreater(state.dropped, 0)
            self.assertEqual(state.achieved_rate, 0.0)

    def test_two_types_on_one_topic(self) -> None:
        texts = [Row('/x', 0, String('a')), Row('/x', 20, String('b'))]
        bags = [write_bag(Path(self.folder.name) / f'{name}.bag', rows) for name, rows in
                (('texts', texts), ('numbers', [Row('/x', 10, Float32MultiArray())]))]
        with Listener('/x') as listener:
            code, output = played(*bags, '-d', '2')
            listener.wait_for(lambda: len(listener.of('/x')) == 2, 'the texts')
        self.assertEqual(code, NOT_ALL)
        self.assertIn('/x: left out where it is std_msgs/Float32MultiArray', output)

    def test_a_fault_of_the_program_ends_it_with_a_sentence(self) -> None:
        for fault_at in ('0', '60'):  # where the scene is read, and while playing
            code, output = run([sys.executable, '-c', FAULTY_PLAYER, self.bag(), '-q', fault_at])
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
                self.assertTrue(master.is_asked.wait(20.0))
                player.send_signal(number)
                master.release.set()
                try:
                    output, _ = player.communicate(timeout=20.0)
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
