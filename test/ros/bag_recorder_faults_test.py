#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The recorder as a process: bad requests, odd and dead publishers, signals, and simulated time.

Full disks, the remains after a kill, and silence are in test/cpp/test_recorder*.cpp.
"""
from __future__ import annotations

import os
import signal
import threading
import unittest
from pathlib import Path
from typing import Callable, List

import rosbag
import rosgraph
import rospy
import rostest
from odd_publisher import OddPublisher, header_of
from recorder_testing import (
    TIMEOUT_S,
    RecorderUnderTest,
    SimulatedTime,
    Stream,
    contents,
    message_count,
    new_topic,
    numbers,
    rostopic_pub,
    wait_for_count,
)
from rosbags.rosbag1 import Reader
from std_msgs.msg import String, UInt32
from surroundings import suspended

from process_visualizer.bagio.recording import Recording
from process_visualizer.clients.bag_recorder import (
    RecorderError,
    RecorderMemory,
    RecorderUnreachable,
    RecordingOptions,
)
from process_visualizer.clients.service_connection import ServiceUnreachable
from process_visualizer.curves.live_curves import RecentPart

PATIENCE_S = 8.0
"""Twice the time after which the recorder assumes that a publisher's type has changed."""


class Copier:
    """Makes copies one after the other; use it in a ``with``."""

    def __init__(self, copy: Callable[[], str]) -> None:
        self.paths: List[str] = []
        self._copy = copy
        self._more = threading.Condition()
        self._ends = False
        self._thread = threading.Thread(target=self._run)

    def __enter__(self) -> Copier:
        self._thread.start()
        return self

    def __exit__(self, *_exception: object) -> None:
        self._ends = True
        self._thread.join()

    def wait_for_another(self) -> None:
        """Wait for one more copy."""
        with self._more:
            wanted = len(self.paths) + 1
            assert self._more.wait_for(lambda: len(self.paths) >= wanted, TIMEOUT_S), 'no copy'

    def _run(self) -> None:
        while not self._ends:
            path = self._copy()
            with self._more:
                self.paths.append(path)
                self._more.notify_all()


class BagRecorderFaultsTest(unittest.TestCase):
    """Every test has a recorder of its own."""

    # Invalid requests change nothing.

    def test_bad_requests_say_why(self) -> None:
        topic = new_topic()
        with RecorderUnderTest() as recorder, Stream(topic):
            recorder.start(topic, name='taken')
            with self.assertRaisesRegex(RecorderError, 'taken.bag is being recorded'):
                recorder.start(topic, name='second')
            recorder.client.stop()
            for options, message in [
                    ({'name': 'taken'}, 'exists already'), ({'name': 'a/b'}, 'slash'),
                    ({'compression': 'zip'}, 'no compression "zip"'),
                    ({'name': 'x' * 300}, 'at most 255 are allowed')]:
                with self.assertRaisesRegex(RecorderError, message):
                    recorder.start(topic, **options)
            for options, message in [
                    ({'split_duration_s': 1e-9}, 'write 0'),
                    ({'split_bytes': 1}, 'at least 1048576'),
                    ({'split_duration_s': float('nan')}, 'split_duration is nan'),
                    ({'recent_s': -1e308}, 'recent is -')]:
                with self.assertRaisesRegex(RecorderError, message):
                    recorder.start(topic, name='odd', **options)
            taken = os.path.join(recorder.folder, 'taken.bag')
            for folder, message in [(f'{taken}/folder', 'folder cannot be created'),
                                    ('/proc', 'not one of those allowed')]:
                with self.assertRaisesRegex(RecorderError, message):
                    recorder.client.start(RecordingOptions((topic,), folder, name='x'))
            with self.assertRaisesRegex(RecorderError, 'nothing is being recorded'):
                recorder.client.stop()
            with self.assertRaisesRegex(RecorderError, 'nothing from .* is in memory'):
                recorder.client.save_recent(RecordingOptions())
            self.assertEqual(recorder.files(), ['taken.bag'])

    def test_without_a_topic_or_room_nothing_is_recorded(self) -> None:
        topic = new_topic()
        with RecorderUnderTest(recent_duration=30, topics=[topic]) as recorder:
            with Stream(topic):
                self.assertTrue(wait_for_count(recorder, topic, 1))
            rospy.set_param(f'{recorder.node}/minimum_free_megabytes', 2_000_000_000)
            for command in (recorder.client.start, recorder.client.save_recent,
                            lambda options: recorder.client.copy_recent(options.folder)):
                with self.assertRaisesRegex(RecorderError, 'MiB are free; make room'):
                    command(RecordingOptions((topic,), recorder.folder))
            self.assertEqual(recorder.files(), [])
        with RecorderUnderTest() as recorder, \
                self.assertRaisesRegex(RecorderError, 'no topic is chosen'):
            recorder.start()

    def test_a_recorder_is_commanded_though_the_master_has_forgotten_it(self) -> None:
        """A restarted master has forgotten it."""
        topic = new_topic()
        with RecorderUnderTest() as recorder, Stream(topic):
            path = recorder.start(topic, name='going_on')
            assert recorder.client.wait_for(lambda state: bool(state.files), TIMEOUT_S)
            master = rosgraph.Master(recorder.node)
            for service in ('stop', 'mark'):
                name = f'{recorder.node}/{service}'
                master.unregisterService(name, master.lookupService(name))
            recorder.client.mark('here')
            self.assertEqual(recorder.client.stop(), [path])
            recorder.end(signal.SIGKILL)
            with self.assertRaisesRegex(RecorderUnreachable, 'stop does not answer'):
                recorder.client.stop()

    def test_signals_finish_the_bag(self) -> None:
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            topic = new_topic()
            with RecorderUnderTest() as recorder, Stream(topic):
                path = recorder.start(topic, name='a')
                self.assertTrue(wait_for_count(recorder, topic, 100))
                self.assertEqual(recorder.end(number), 0)
                self.assertEqual(recorder.files(), ['a.bag'])
                self.assertGreaterEqual(len(numbers(path, topic)), 100)

    def test_a_file_that_may_not_grow_does_not_end_the_recorder(self) -> None:
        """It causes a signal (SIGXFSZ)."""
        topic = new_topic()
        with RecorderUnderTest('prlimit', '--fsize=20000') as recorder, Stream(topic):
            path = recorder.start(topic, name='a')
            state = recorder.client.wait_for(lambda state: state.problems, TIMEOUT_S)
            self.assertIn('make room', state.problems[-1])
            with self.assertRaisesRegex(RecorderError, 'nothing is being recorded'):
                recorder.client.stop()
            self.assertEqual(message_count(path), recorder.client.state.messages)

    def test_what_is_under_way_when_it_is_stopped_is_in_the_bag(self) -> None:
        topics = [new_topic(), new_topic()]
        publishers = [rospy.Publisher(topic, UInt32, queue_size=300) for topic in topics]
        with RecorderUnderTest() as recorder:
            for name in 'abcdefgh':
                path = recorder.start(*topics, name=name)
                for number in range(300):
                    for publisher in publishers:
                        publisher.publish(number)
                recorder.client.stop()
                for topic in topics:
                    self.assertEqual(numbers(path, topic), list(range(300)))

    # The memory is copied and read during other operations.

    def test_commands_and_copies_do_not_disturb_each_other(self) -> None:
        """All bags are in one folder and named by the second: they also compete for names."""
        topic = new_topic()
        with Stream(topic), RecorderUnderTest(recent_duration=600, topics=[topic]) as recorder:
            self.assertTrue(wait_for_count(recorder, topic, 50))
            copier = Copier(lambda: recorder.client.copy_recent(recorder.folder))
            recorded: List[int] = []
            files: List[str] = []
            with copier:
                for _ in range(8):
                    path = recorder.start(recent_s=600.0)
                    recorder.client.mark('here')
                    copier.wait_for_another()
                    files += recorder.client.stop()
                    self.assertEqual(files[-1], path)
                    recorded += numbers(path, topic)
            copies = copier.paths
            self.assertEqual(recorded, list(range(recorded[0], recorded[0] + len(recorded))))
            self.assertEqual(len(set(copies + files)), len(copies) + len(files))
            self.assertEqual({os.path.basename(it) for it in copies + files},
                             set(recorder.files()))
            for path in (copies[0], copies[-1]):
                found = numbers(path, topic)
                self.assertEqual(found, list(range(recorded[0], recorded[0] + len(found))))
            self.assertEqual(recorder.client.state.problems, [])

    def test_each_message_is_read_once_also_while_it_is_recorded(self) -> None:
        topic, latched = new_topic(), new_topic()
        publisher = rospy.Publisher(latched, String, latch=True, queue_size=1)
        publisher.publish('old')
        with RecorderUnderTest(recent_duration=5, topics=[topic, latched]) as recorder:
            with Stream(topic):
                for it in (topic, latched):
                    self.assertTrue(wait_for_count(recorder, it, 1))
                memory = RecorderMemory(recorder.node)
                part, _ = memory.read((topic, latched))
                self.assertIn(b'old', [part.message(row)[4:] for row in range(len(part.numbers))
                                       if part.connections[part.numbers[row]].topic == latched])
                found = numbers_in(part, topic)
                path = recorder.start(name='a')
                wanted = found[-1] + 300
                while found[-1] < wanted:
                    part, more = memory.read((topic, latched))
                    self.assertFalse(more or part.is_anew)
                    found += numbers_in(part, topic)
                recorder.client.stop()
                self.assertEqual(found, list(range(found[0], found[0] + len(found))))
                self.assertGreater(len(set(found) & set(numbers(path, topic))), 200)
                self.assertEqual(recorder.end(signal.SIGINT), 0)
                with self.assertRaises(ServiceUnreachable):
                    memory.read((topic,))
            with RecorderUnderTest(node=recorder.node, recent_duration=5, topics=[topic]), \
                    Stream(topic):
                part, _ = memory.read((topic,))  # of another recorder with this name
                self.assertTrue(part.is_anew)

    # Publishers are invalid, hang, die, or follow each other.

    def test_one_that_hangs_is_named_and_a_dead_one_is_not_waited_for(self) -> None:
        topic = new_topic()
        driver = rostopic_pub(topic)
        try:
            rospy.wait_for_message(topic, UInt32, TIMEOUT_S)
            with suspended(driver.pid), RecorderUnderTest(connection_timeout=1) as recorder:
                with self.assertRaisesRegex(RecorderError, f'Not recording: .*{topic}'):
                    recorder.start(topic, name='a')
                self.assertEqual(recorder.files(), [])
                driver.kill()
                driver.wait()
                recorder.start(topic, name='a')
                recorder.client.stop()
        finally:
            driver.kill()
            driver.wait()

    def test_one_that_returns_and_a_topic_that_changes_its_type(self) -> None:
        topic = new_topic()
        with RecorderUnderTest() as recorder:
            with Stream(topic):
                path = recorder.start(topic, name='a')
                self.assertTrue(wait_for_count(recorder, topic, 50))
            with Stream(topic):
                before = recorder.client.state.messages
                self.assertTrue(wait_for_count(recorder, topic, before + 100))
            publisher = rospy.Publisher(topic, String, latch=True, queue_size=10)
            publisher.publish('another type')
            state = recorder.client.wait_for(
                lambda state: state.topics[0].type == 'std_msgs/String', TIMEOUT_S)
            self.assertIsNotNone(state)
            self.assertIn(topic, state.problems[-1])
            recorder.client.stop()
            with rosbag.Bag(path) as bag:
                types = {type(message)._type for _, message, _ in bag.read_messages([topic])}
            self.assertEqual(types, {'std_msgs/UInt32', 'std_msgs/String'})

    def test_a_dead_one_that_stays_registered_is_not_subscribed_anew(self) -> None:
        topic, never = new_topic(), new_topic()
        dead = OddPublisher(never)  # before it was ever connected
        dead.die()
        self.addCleanup(dead.unregister)
        driver = rostopic_pub(topic)
        try:
            with RecorderUnderTest(topics=[topic, never]) as recorder:
                self.assertTrue(wait_for_count(recorder, topic, 1))
                driver.send_signal(signal.SIGKILL)
                driver.wait()
                begin_s = recorder.client.state.stamp.to_sec()
                state = recorder.client.wait_for(
                    lambda state: state.stamp.to_sec() > begin_s + PATIENCE_S, TIMEOUT_S)
                self.assertEqual([it for it in state.problems if 'anew' in it], [])
        finally:
            driver.kill()
            driver.wait()

    def test_odd_answers_about_connections(self) -> None:
        odd = [[0, 'error', 0], [1, '', 0], [1, '', 'text'], [1, '', ['text']], [1, '', [[]]],
               [1, '', [[1, 2, 3, 4, 5]]], [1, '', [[1, '/someone', [], {}, 1.0]]], [1], 'text',
               ['1', '', {}], {}]
        with RecorderUnderTest() as recorder:
            for answer in odd:
                topic = new_topic()
                with OddPublisher(topic, bus_info=answer) as publisher:
                    path = recorder.start(topic, name=topic.split('/')[-1])
                    publisher.publish(7)
                    self.assertTrue(wait_for_count(recorder, topic, 1), answer)
                    recorder.client.stop()
                    self.assertEqual(numbers(path, topic), [7])

    def test_odd_headers(self) -> None:
        """All messages of such publishers, and all others, can be read by every reader."""
        undefined, odd = header_of(UInt32, '/undefined'), header_of(UInt32, '/odd')
        del undefined['message_definition']
        odd['callerid'] = b'/odd\xff\xc3('
        odd['message_definition'] += b'\n# 20 \xb0C'
        odd['note'] = b'\xed\xa0\x80 \xf5'
        least = {'type': UInt32._type.encode(), 'md5sum': UInt32._md5sum.encode()}
        for header in (undefined, odd, least):
            topic, other = new_topic(), new_topic()
            with RecorderUnderTest() as recorder, OddPublisher(topic, header) as publisher, \
                    Stream(other):
                path = recorder.start(topic, other, name='a')
                publisher.publish(7)
                self.assertTrue(wait_for_count(recorder, topic, 1))
                self.assertTrue(wait_for_count(recorder, other, 1))
                recorder.client.stop()
                self.check_readable(path, topic, other)

    def check_readable(self, path: str, topic: str, other: str) -> None:
        with rosbag.Bag(path) as bag:
            # as bytes: rosbag keeps one class for each type, for all bags that it reads
            read = [(name, data[1]) for name, data, _ in bag.read_messages(raw=True)]
        self.assertIn((topic, b'\7\0\0\0'), read)
        self.assertIn(other, [name for name, _ in read])
        with Reader(Path(path)) as reader:
            self.assertEqual([bytes(data) for connection, _, data in reader.messages()
                              if connection.topic == topic], [b'\7\0\0\0'])
        with Recording([path]) as recording:
            self.assertEqual(len(recording.index.connections_of(topic)), 1)

    def test_a_missing_definition_is_that_of_others(self) -> None:
        topic, other = new_topic(), new_topic()
        header = header_of(UInt32, '/undefined')
        del header['message_definition']
        with RecorderUnderTest(topics=[topic, other]) as recorder, Stream(other):
            self.assertTrue(wait_for_count(recorder, other, 1))
            with OddPublisher(topic, header) as publisher:
                path = recorder.start(topic, other, name='a')
                publisher.publish(7)
                self.assertTrue(wait_for_count(recorder, topic, 1))
                recorder.client.stop()
            with Recording([path]) as recording:
                definitions = {it.topic: it.message_definition
                               for it in recording.index.connections}
            self.assertEqual(definitions[topic], UInt32._full_text)

    def test_in_memory_the_installed_definition_stands_in_for_a_missing_one(self) -> None:
        """Its publisher is like rosjava's; no other publisher has sent the definition."""
        topic = new_topic()
        header = header_of(String, '/undefined', latching=True)
        del header['message_definition']
        with RecorderUnderTest(recent_duration=60, topics=[topic]) as recorder, \
                OddPublisher(topic, header) as publisher:
            publisher.publish(0)  # an empty text
            self.assertTrue(wait_for_count(recorder, topic, 1))
            part, _ = RecorderMemory(recorder.node).read((topic,))
            connection, = part.connections
            self.assertEqual((connection.type, connection.md5sum, connection.message_definition),
                             (String._type, String._md5sum, String._full_text))

    # The time is simulated; this process was started before that, and keeps the machine's time.

    def simulate_time(self) -> None:
        rospy.set_param('/use_sim_time', True)
        self.addCleanup(rospy.delete_param, '/use_sim_time')

    def test_nothing_is_recorded_before_the_first_time(self) -> None:
        self.simulate_time()
        topic, latched = new_topic(), new_topic()
        publisher = rospy.Publisher(latched, String, latch=True, queue_size=1)
        publisher.publish('before the first time')
        with RecorderUnderTest(topics=[topic, latched], connection_timeout=1,
                               recent_duration=600) as recorder, Stream(topic):
            self.assertTrue(wait_for_count(recorder, topic, 20))
            for command in (recorder.client.start, recorder.client.save_recent):
                with self.assertRaisesRegex(RecorderError, 'nothing publishes /clock'):
                    command(RecordingOptions((topic, latched), recorder.folder, name='a'))
            with self.assertRaisesRegex(RecorderError, 'nothing publishes /clock'):
                recorder.client.mark('now')
            self.assertEqual(recorder.files(), [])
            with SimulatedTime() as time:
                path = recorder.start(topic, latched, name='a', recent_s=600.0)
                self.assertTrue(wait_for_count(recorder, topic, 100))
                recorder.client.stop()
            with Recording([path]) as recording:
                self.assertGreaterEqual(recording.begin_ns, time.begin_ns)
                self.assertLessEqual(recording.end_ns, time.end_ns)
            found = numbers(path, topic)
            self.assertEqual(found, list(range(found[0], found[0] + len(found))))
            self.assertEqual(contents(path, latched)[0][0].data, 'before the first time')

    def test_start_waits_for_the_first_time(self) -> None:
        self.simulate_time()
        topic = new_topic()
        with RecorderUnderTest(topics=[topic]) as recorder, Stream(topic):
            paths: List[str] = []
            starter = threading.Thread(target=lambda: paths.append(recorder.start(topic)))
            starter.start()
            self.assertIsNotNone(recorder.client.wait_for(
                lambda state: any('/clock' in it for it in state.problems), TIMEOUT_S))
            self.assertEqual(recorder.files(), [])
            with SimulatedTime() as time:
                starter.join(TIMEOUT_S)
                self.assertTrue(wait_for_count(recorder, topic, 100))
                recorder.client.stop()
            with Recording(paths) as recording:
                self.assertGreaterEqual(recording.begin_ns, time.begin_ns)


def numbers_in(part: RecentPart, topic: str) -> List[int]:
    """Return the numbers of a topic of type std_msgs/UInt32."""
    return [int.from_bytes(part.message(row), 'little') for row in range(len(part.numbers))
            if part.connections[part.numbers[row]].topic == topic]


if __name__ == '__main__':
    rospy.init_node('bag_recorder_faults_test')
    rostest.rosrun('process_visualizer', 'bag_recorder_faults_test', BagRecorderFaultsTest)
