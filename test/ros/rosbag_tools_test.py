#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""rosbag's own tools on the recorder's bags and on those of `cell reindex`: nothing is lost."""
from __future__ import annotations

import os
import shutil
import signal
import subprocess
import tempfile
import threading
import unittest
from typing import Dict, Iterator, List, NamedTuple, Tuple

import rosbag
import rospy
import rostest
from recorder_testing import (
    TIMEOUT_S,
    RecorderUnderTest,
    Stream,
    contents,
    new_topic,
    numbers,
    wait_for_count,
)
from roslib.packages import find_node
from std_msgs.msg import String, UInt8MultiArray, UInt32

from process_visualizer.bagio.recording import Recording
from process_visualizer.bagio.reindex import reindex

NUMBERS, IMAGES, LATCHED = new_topic(), new_topic(), new_topic()
LARGE = 12


class Row(NamedTuple):
    """A message of a bag: topic, type, time [ns], serialized bytes."""

    topic: str
    type: str
    time_ns: int
    data: bytes


def rows(path: str) -> List[Row]:
    """Return the messages that rosbag reads, sorted: the order of equal times is undefined."""
    with rosbag.Bag(path) as bag:
        return sorted(Row(topic, message[0], time.to_nsec(), bytes(message[1]))
                      for topic, message, time in bag.read_messages(raw=True))


def own_rows(path: str) -> List[Row]:
    """Return the messages that this project's reader finds in it."""
    with Recording([path]) as recording:
        index = recording.index
        connections = [index.connections[number] for number in index.connection.tolist()]
        return sorted(Row(connection.topic, connection.type, int(time_ns),
                          bytes(recording.message(position)))
                      for position, (connection, time_ns)
                      in enumerate(zip(connections, index.time_ns.tolist())))


def minute_later_s(before: List[Row]) -> int:
    """Return a time [s] about a minute after the last message."""
    return max(row.time_ns for row in before) // 10 ** 9 + 60


def run(*command: str) -> str:
    """Run a tool that must succeed; return its output."""
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                          stdin=subprocess.DEVNULL)
    assert done.returncode == 0, f'{command}: {done.stdout}'
    return done.stdout


def record(recorder: RecorderUnderTest, name: str, compression: str, is_killed: bool) -> str:
    """Record a few chunks of several topics, one of which is latched; return the file."""
    large = rospy.Publisher(IMAGES, UInt8MultiArray, queue_size=100)
    latched = rospy.Publisher(LATCHED, String, latch=True, queue_size=1)
    latched.publish('always')
    with Stream(NUMBERS):
        path = recorder.start(NUMBERS, IMAGES, LATCHED, name=name, compression=compression)
        for _ in range(LARGE):
            large.publish(data=os.urandom(300_000))
        assert wait_for_count(recorder, IMAGES, LARGE) and wait_for_count(recorder, NUMBERS, 100)
        if is_killed:
            recorder.end(signal.SIGKILL)
            return f'{path}.active'
        recorder.client.stop()
    return path


class RosbagToolsTest(unittest.TestCase):
    """Every tool gets a copy of every kind of bag."""

    @classmethod
    def setUpClass(cls) -> None:
        """Record the bags; two readers agree on their messages before any tool runs."""
        cls.folder = tempfile.mkdtemp(prefix='rosbag_tools_test_')
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        cls.bags: Dict[str, str] = {}
        with RecorderUnderTest() as recorder:
            for compression in ('none', 'lz4'):
                path = record(recorder, compression, compression, is_killed=False)
                cls.bags[f'recorded_{compression}'] = shutil.copy(path, cls.folder)
            cls.active = shutil.copy(record(recorder, 'left', 'none', is_killed=True), cls.folder)
        for compression in ('none', 'lz4'):
            path = cls.bags[f'recorded_{compression}']
            cls.bags[f'reindexed_{compression}'] = reindex(path).path
        cls.bags['reindexed_active'] = reindex(cls.active).path
        cls.before = {kind: own_rows(path) for kind, path in cls.bags.items()}

    def each_bag(self) -> Iterator[Tuple[str, List[Row]]]:
        """Yield for each kind a copy of its bag in a folder of its own, and its messages."""
        for kind, path in self.bags.items():
            with tempfile.TemporaryDirectory(dir=self.folder) as folder:
                yield shutil.copy(path, f'{folder}/{kind}.bag'), self.before[kind]

    def assert_same(self, path: str, before: List[Row]) -> None:
        """Check that the bag is complete for both readers, and has the same messages."""
        self.assertEqual(len(rows(path)), len(before), path)
        self.assertTrue(rows(path) == before, f'{path}: other messages than before')
        self.assertTrue(own_rows(path) == before, f'{path}: other messages than before')

    def test_the_bags_hold_what_was_published(self):
        for path, before in self.each_bag():
            self.assert_same(path, before)
            found = numbers(path, NUMBERS)
            self.assertEqual(found, list(range(found[0], found[0] + len(found))))
            self.assertEqual([message.data for message, _ in contents(path, LATCHED)], ['always'])
        self.assertEqual(len(contents(self.bags['recorded_none'], IMAGES)), LARGE)

    def test_reindex(self):
        for path, before in self.each_bag():
            run('rosbag', 'reindex', path)
            self.assert_same(path, before)
            self.assert_same(path.replace('.bag', '.orig.bag'), before)

    def test_reindex_of_what_a_killed_recorder_left(self):
        path = shutil.copy(self.active, f'{self.folder}/killed.bag')
        run('rosbag', 'reindex', path)
        self.assert_same(path, self.before['reindexed_active'])

    def test_append_from_python(self):
        for path, before in self.each_bag():
            later_s = minute_later_s(before)
            with rosbag.Bag(path, 'a') as bag:
                bag.write(NUMBERS, UInt32(7), rospy.Time(later_s))
                bag.write('/new', String('text'), rospy.Time(later_s + 1))
            self.assert_appended(path, before, 2)

    def test_append_from_cpp(self):
        program, = find_node('process_visualizer', 'append_to_bag')
        for path, before in self.each_bag():
            later_s = minute_later_s(before)
            run(program, path, NUMBERS, str(later_s), '7')
            run(program, path, '/new', str(later_s + 1), '8')
            self.assert_appended(path, before, 2)

    def assert_appended(self, path: str, before: List[Row], count: int) -> None:
        """Check that this many messages were added, later than all others."""
        new = [row for row in rows(path) if row.time_ns >= minute_later_s(before) * 10 ** 9]
        self.assertEqual(len(new), count)
        self.assert_same(path, sorted([*before, *new]))

    def test_fastrebag(self):
        program, = find_node('rosbag', 'fastrebag.py')
        for path, before in self.each_bag():
            run('python3', program, path, f'{path}.copy.bag')
            self.assert_same(f'{path}.copy.bag', before)

    def test_filter(self):
        for path, before in self.each_bag():
            run('rosbag', 'filter', path, f'{path}.all.bag', 'True')
            self.assert_same(f'{path}.all.bag', before)
            run('rosbag', 'filter', path, f'{path}.some.bag', f'topic == "{NUMBERS}"')
            self.assert_same(f'{path}.some.bag', [row for row in before if row.topic == NUMBERS])

    def test_compress_and_decompress(self):
        for path, before in self.each_bag():
            for tool in (['compress', '--lz4'], ['decompress'], ['compress', '--bz2']):
                run('rosbag', *tool, '--force', path)
                self.assert_same(path, before)

    def test_check(self):
        for path, before in self.each_bag():
            self.assertIn('does not need any migrations', run('rosbag', 'check', path))
            self.assert_same(path, before)

    def test_info(self):
        for path, before in self.each_bag():
            information = run('rosbag', 'info', '--yaml', path)
            self.assertIn(f'messages: {len(before)}\n', information)
            self.assertIn('indexed: True\n', information)

    def test_play(self):
        received: List[int] = []
        came = threading.Condition()

        def receive(message: UInt32) -> None:
            with came:
                received.append(message.data)
                came.notify()

        subscriber = rospy.Subscriber(NUMBERS, UInt32, receive)
        self.addCleanup(subscriber.unregister)
        for path, _ in self.each_bag():
            received.clear()
            run('rosbag', 'play', '--quiet', '--wait-for-subscribers', path, '--topics', NUMBERS)
            last = numbers(path, NUMBERS)[-1:]
            with came:
                while received[-1:] != last and came.wait(TIMEOUT_S):
                    pass
            self.assertEqual(received, numbers(path, NUMBERS))


if __name__ == '__main__':
    rospy.init_node('rosbag_tools_test')
    rostest.rosrun('process_visualizer', 'rosbag_tools_test', RosbagToolsTest)
