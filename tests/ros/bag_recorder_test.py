#!/usr/bin/env python3
"""The recorder with a real master: what it promises, and what it does about faults."""
from __future__ import annotations

import itertools
import json
import os
import shutil
import signal
import subprocess
import tempfile
import threading
import unittest

import rosbag
import rospy
import rostest
from recorder_testing import TIMEOUT_S, RecorderUnderTest, contents, numbers
from std_msgs.msg import Header, String, UInt8MultiArray, UInt32

from process_visualizer.bags.bag_errors import BagUnindexed
from process_visualizer.bags.marks import read_marks
from process_visualizer.bags.recorder_topics import recorded_configuration
from process_visualizer.bags.recording import Recording
from process_visualizer.bags.reindex import reindex
from process_visualizer.bags.report import make_report
from process_visualizer.msg import RecorderState
from process_visualizer.nodes.bag_recorder import RecorderError, RecordingOptions

_names = itertools.count()


def new_topic() -> str:
    """A topic that no other test uses."""
    return f'/recorder_test/topic_{next(_names)}'


class Stream:
    """Publishes growing numbers at 200 Hz until it is closed."""

    def __init__(self, topic: str) -> None:
        self.publisher = rospy.Publisher(topic, UInt32, queue_size=10000)
        self._end = threading.Event()
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def __enter__(self) -> Stream:
        return self

    def __exit__(self, *_: object) -> None:
        self._end.set()
        self._thread.join()
        self.publisher.unregister()

    def _run(self) -> None:
        number = 0
        while not self._end.wait(0.005):
            self.publisher.publish(number)
            number += 1


class BagRecorderTest(unittest.TestCase):
    """Every test has a recorder of its own."""

    def test_everything_between_start_and_stop_is_in_the_bag(self):
        with RecorderUnderTest() as recorder:
            for _ in range(8):
                topics = [new_topic(), new_topic()]
                publishers = [rospy.Publisher(topic, UInt32, queue_size=1000) for topic in topics]
                path = recorder.start(*topics, name=topics[0].split('/')[-1])
                for number in range(300):
                    for publisher in publishers:
                        publisher.publish(number)
                recorder.client.stop()
                for topic in topics:
                    self.assertEqual(numbers(path, topic), list(range(300)))

    def test_a_bag_is_active_until_it_is_finished(self):
        topic = new_topic()
        with RecorderUnderTest() as recorder, Stream(topic):
            recorder.start(topic, name='a')
            self.assertEqual(recorder.files(), ['a.bag.active'])
            recorder.client.stop()
            self.assertEqual(recorder.files(), ['a.bag'])
            information = subprocess.run(['rosbag', 'info', f'{recorder.folder}/a.bag'],
                                         stdout=subprocess.PIPE, text=True, check=True).stdout
            self.assertIn(topic, information)

    def test_configuration_and_latched_topics_begin_every_part(self):
        latched, topic = new_topic(), new_topic()
        publisher = rospy.Publisher(latched, String, latch=True, queue_size=1)
        publisher.publish('always')
        stored = json.dumps({'file': '/c.xml', 'files': {'/c.xml': '<visualizer/>'},
                             'arguments': {}})
        with RecorderUnderTest() as recorder, Stream(topic):
            recorder.start(latched, topic, name='a', split_duration_s=1.0, configuration=stored)
            state = recorder.client.wait_for(lambda state: len(state.files) == 3, TIMEOUT_S)
            self.assertIsNotNone(state)
            recorder.client.stop()
            paths = [f'{recorder.folder}/a_{part}.bag' for part in range(3)]
            for path in paths:
                self.assertEqual(contents(path, latched)[0][0].data, 'always')
                with Recording([path]) as recording:
                    configuration = recorded_configuration(recording)
                    self.assertEqual(configuration.files, {'/c.xml': '<visualizer/>'})
            found = list(itertools.chain(*(numbers(path, topic) for path in paths)))
            self.assertEqual(found, list(range(found[0], found[0] + len(found))))

    def test_lz4(self):
        topic = new_topic()
        publisher = rospy.Publisher(topic, String, queue_size=100)
        with RecorderUnderTest() as recorder:
            path = recorder.start(topic, name='a', compression='lz4')
            for _ in range(100):
                publisher.publish('x' * 100_000)
            recorder.client.stop()
            self.assertLess(os.path.getsize(path), 1_000_000)
            self.assertEqual([m.data for m, _ in contents(path, topic)], ['x' * 100_000] * 100)
            with Recording([path]) as recording:
                self.assertEqual(bytes(recording.message(50)[-5:]), b'xxxxx')

    def test_live_figures(self):
        topic = new_topic()
        with RecorderUnderTest() as recorder, Stream(topic):
            recorder.start(topic, name='a')
            state = recorder.client.wait_for(
                lambda state: state.topics[0].rate > 150 and state.topics[0].messages > 300,
                TIMEOUT_S)
            self.assertIsNotNone(state)
            self.assertEqual(state.state, RecorderState.RECORDING)
            self.assertEqual(state.topics[0].publishers, 1)
            self.assertEqual(state.topics[0].type, 'std_msgs/UInt32')
            self.assertLess(state.topics[0].silence, 1.0)
            self.assertGreater(state.free_bytes, 0)
            self.assertGreater(state.time_left, 0)
            self.assertEqual((state.dropped, state.lost, state.problems), (0, 0, []))

    def test_lost_messages_are_counted_live_and_in_the_report(self):
        topic = new_topic()

        class Numbered(Header):
            """A header as a message; rospy numbers what has a header, this it leaves alone."""
            _has_header = False
            _full_text = 'Header header\n' + '=' * 80 + '\nMSG: std_msgs/Header\n' \
                + Header._full_text

        publisher = rospy.Publisher(topic, Numbered, queue_size=1000)
        with RecorderUnderTest() as recorder:
            path = recorder.start(topic, name='a')
            for number in [*range(50), *range(53, 100)]:
                publisher.publish(Numbered(seq=number))
            state = recorder.client.wait_for(lambda state: state.messages == 97, TIMEOUT_S)
            self.assertEqual((state.lost, state.gaps), (3, 1))
            recorder.client.stop()
            with Recording([path]) as recording:
                report = make_report(recording)
            self.assertEqual(report.topics[0].lost, 3)
            self.assertFalse(report.is_complete)

    def test_dropped_messages_are_counted_live_and_in_the_report(self):
        topic = new_topic()
        publisher = rospy.Publisher(topic, UInt8MultiArray, queue_size=10)
        with RecorderUnderTest(queue_megabytes=1) as recorder:
            path = recorder.start(topic, name='a')
            publisher.publish(data=b'1' * 10)
            for _ in range(3):
                publisher.publish(data=bytes(2_000_000))
            state = recorder.client.wait_for(lambda state: state.dropped == 3, TIMEOUT_S)
            self.assertEqual(state.topics[0].messages, 1)
            recorder.client.stop()
            with Recording([path]) as recording:
                report = make_report(recording)
            self.assertEqual(report.topics[0].dropped, 3)
            self.assertFalse(report.is_complete)
            self.assertTrue(report.has_account)

    def test_the_moment_before_and_going_on_into_the_same_file(self):
        topic, latched = new_topic(), new_topic()
        publisher = rospy.Publisher(latched, String, latch=True, queue_size=1)
        publisher.publish('old')
        with Stream(topic), RecorderUnderTest(
                recent_duration=2, topics=[topic, latched]) as recorder:
            self.assertIsNotNone(
                recorder.client.wait_for(lambda state: state.recent > 1.9, TIMEOUT_S))
            # the latched message is older than what is kept
            recorder.client.mark('before')
            saved = recorder.client.save_recent(
                RecordingOptions(folder=recorder.folder, name='saved'))
            self.assertEqual(contents(saved, latched)[0][0].data, 'old')
            self.assertEqual([m.data for m, _ in contents(saved, '/process_visualizer/marks')],
                             ['before'])
            self.assert_seconds(saved, topic, 1.5, 2.5)
            recorder.client.wait_for(lambda state: state.recent > 1.9, TIMEOUT_S)
            path = recorder.start(name='on', recent_s=1.0)
            recorder.client.wait_for(lambda state: state.duration > 1.0, TIMEOUT_S)
            recorder.client.stop()
            self.assert_seconds(path, topic, 2.0, 4.0)

    def assert_seconds(self, path, topic, least, most):
        """The topic's messages are all there, and span about so many seconds."""
        found = numbers(path, topic)
        self.assertEqual(found, list(range(found[0], found[0] + len(found))))
        times = [time for _, time in contents(path, topic)]
        self.assertGreater(times[-1] - times[0], least)
        self.assertLess(times[-1] - times[0], most)

    def test_marks(self):
        topic = new_topic()
        with RecorderUnderTest() as recorder, Stream(topic):
            with self.assertRaisesRegex(RecorderError, 'nothing is being recorded'):
                recorder.client.mark('too early')
            path = recorder.start(topic, name='a')
            before = rospy.get_time()
            recorder.client.mark('the seam tears ü')
            after = rospy.get_time()
            recorder.client.stop()
            with Recording([path]) as recording:
                mark, = read_marks(recording)
            self.assertEqual(mark.label, 'the seam tears ü')
            self.assertTrue(before <= mark.time_ns / 1e9 <= after)

    def test_bad_requests_change_nothing_and_say_why(self):
        topic = new_topic()
        with RecorderUnderTest() as recorder, Stream(topic):
            recorder.start(topic, name='taken')
            with self.assertRaisesRegex(RecorderError, 'taken.bag is being recorded'):
                recorder.start(topic, name='second')
            recorder.client.stop()
            for options, message in [
                    ({'name': 'taken'}, 'exists already'), ({'name': 'a/b'}, 'slash'),
                    ({'compression': 'zip'}, 'no compression "zip"'),
                    ({'name': 'x' * 300}, 'File name too long')]:
                with self.assertRaisesRegex(RecorderError, message):
                    recorder.start(topic, **options)
            with self.assertRaisesRegex(RecorderError, 'folder cannot be created'):
                recorder.client.start(RecordingOptions((topic,), '/proc/no/folder'))
            with self.assertRaisesRegex(RecorderError, '/proc/x.bag cannot be created'):
                recorder.client.start(RecordingOptions((topic,), '/proc', name='x'))
            with self.assertRaisesRegex(RecorderError, 'nothing is being recorded'):
                recorder.client.stop()
            with self.assertRaisesRegex(RecorderError, 'nothing is in memory'):
                recorder.client.save_recent(RecordingOptions())
            self.assertEqual(recorder.files(), ['taken.bag'])

    def test_without_a_topic_nothing_is_recorded(self):
        with RecorderUnderTest() as recorder, \
                self.assertRaisesRegex(RecorderError, 'no topic is chosen'):
            recorder.start()

    def test_a_publisher_that_hangs_is_named_and_one_that_is_dead_is_not_waited_for(self):
        topic = new_topic()
        driver = subprocess.Popen(
            ['rostopic', 'pub', '-r', '10', topic, 'std_msgs/UInt32', '1'],
            stdout=subprocess.DEVNULL)
        try:
            rospy.wait_for_message(topic, UInt32, TIMEOUT_S)
            driver.send_signal(signal.SIGSTOP)
            with RecorderUnderTest(connection_timeout=1) as recorder:
                with self.assertRaisesRegex(RecorderError, f'not recording.*{topic}'):
                    recorder.start(topic, name='a')
                self.assertEqual(recorder.files(), [])
                driver.kill()
                driver.wait()
                recorder.start(topic, name='a')
                recorder.client.stop()
        finally:
            driver.kill()
            driver.wait()

    def test_a_publisher_that_returns_and_a_topic_that_changes_its_type(self):
        topic = new_topic()
        with RecorderUnderTest() as recorder:
            with Stream(topic):
                path = recorder.start(topic, name='a')
                recorder.client.wait_for(lambda state: state.messages > 50, TIMEOUT_S)
            with Stream(topic):
                before = recorder.client.state.messages
                self.assertIsNotNone(recorder.client.wait_for(
                    lambda state: state.messages > before + 100, TIMEOUT_S))
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

    def test_signals_finish_the_bag(self):
        for number in (signal.SIGINT, signal.SIGTERM):
            topic = new_topic()
            with RecorderUnderTest() as recorder, Stream(topic):
                path = recorder.start(topic, name='a')
                recorder.client.wait_for(lambda state: state.messages > 100, TIMEOUT_S)
                self.assertEqual(recorder.end(number), 0)
                self.assertEqual(recorder.files(), ['a.bag'])
                self.assertGreater(len(numbers(path, topic)), 100)

    def test_what_a_killed_recorder_leaves_is_repaired_but_for_its_last_chunk(self):
        topic = new_topic()
        with RecorderUnderTest() as recorder, Stream(topic):
            path = recorder.start(topic, name='a')
            recorder.client.wait_for(lambda state: state.messages > 600, TIMEOUT_S)
            killed = rospy.get_time()
            recorder.end(signal.SIGKILL)
            self.assertEqual(recorder.files(), ['a.bag.active'])
            with self.assertRaises(BagUnindexed):
                Recording([f'{path}.active'])
            copy = reindex(f'{path}.active').path
            found = numbers(copy, topic)
            self.assertEqual(found, list(range(found[0], found[0] + len(found))))
            self.assertLess(killed - contents(copy, topic)[-1][1], 1.0)

    def test_a_full_disk_stops_the_recording_and_leaves_a_whole_bag(self):
        topic = new_topic()
        with self.small_disk(megabytes=20) as recorder:
            publisher = rospy.Publisher(topic, UInt8MultiArray, queue_size=100)
            path = recorder.start(topic, name='a')
            while recorder.client.wait_for(lambda state: state.problems, 0.02) is None:
                publisher.publish(data=bytes(500_000))
            state = recorder.client.wait_for(
                lambda state: state.state == RecorderState.IDLE, TIMEOUT_S)
            self.assertIn('make room', state.problems[-1])
            self.assertGreater(state.dropped, 0)
            self.assertEqual(recorder.files(), ['a.bag'])
            with rosbag.Bag(path) as bag:
                count = bag.get_message_count(topic)
            self.assertGreater(count, 20)
            self.assertEqual(count, state.messages)
            with Recording([path]) as recording:
                report = make_report(recording)
            self.assertGreater(report.topics[0].dropped, 0)

    def small_disk(self, megabytes: int) -> RecorderUnderTest:
        """A recorder on a small disk; without the right to mount one, with files limited so."""
        folder = tempfile.mkdtemp(prefix='recorder_test_disk_')
        mounted = subprocess.run(
            ['mount', '-t', 'tmpfs', '-o', f'size={megabytes}m', 'tmpfs', folder],
            stderr=subprocess.DEVNULL).returncode == 0
        self.addCleanup(shutil.rmtree, folder)
        if mounted:
            self.addCleanup(subprocess.run, ['umount', '--lazy', folder])
            return RecorderUnderTest(folder=folder)
        return RecorderUnderTest('prlimit', f'--fsize={megabytes << 20}', folder=folder)

    def test_too_little_room_is_refused_or_stops_the_recording(self):
        topic = new_topic()
        publisher = rospy.Publisher(topic, UInt8MultiArray, queue_size=100)
        with self.small_disk(megabytes=200) as recorder:
            rospy.set_param(f'{recorder.node}/minimum_free_megabytes', 2_000_000_000)
            with self.assertRaisesRegex(RecorderError, 'MB are free'):
                recorder.start(topic, name='a')
            self.assertEqual(recorder.files(), [])
            # Where no disk could be mounted, others use this one too: they only end it earlier.
            free = shutil.disk_usage(recorder.folder).free >> 20
            rospy.set_param(f'{recorder.node}/minimum_free_megabytes', free - 100)
            path = recorder.start(topic, name='a')
            while recorder.client.wait_for(
                    lambda state: state.state == RecorderState.IDLE, 0.02) is None:
                publisher.publish(data=bytes(1_000_000))
            state = recorder.client.state
            self.assertIn('the bag is complete until then', state.problems[-1])
            self.assertEqual(state.dropped, 0)
            with rosbag.Bag(path) as bag:
                self.assertEqual(bag.get_message_count(topic), state.messages)

    def test_a_folder_that_is_removed_costs_nothing(self):
        topic = new_topic()
        with RecorderUnderTest() as recorder, Stream(topic):
            path = recorder.start(topic, name='a')
            recorder.client.wait_for(lambda state: state.messages > 200, TIMEOUT_S)
            shutil.rmtree(recorder.folder)
            state = recorder.client.wait_for(
                lambda state: state.state == RecorderState.IDLE, TIMEOUT_S)
            self.assertIn('was removed', state.problems[-1])
            found = numbers(path, topic)
            self.assertGreater(len(found), 200)
            self.assertEqual(found, list(range(found[0], found[0] + len(found))))


if __name__ == '__main__':
    rospy.init_node('bag_recorder_test')
    rostest.rosrun('process_visualizer', 'bag_recorder_test', BagRecorderTest)
