#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The recorder with a real master: what it does about faults and bad input."""
from __future__ import annotations

import shutil
import signal
import subprocess
import tempfile
import unittest

import rosbag
import rospy
import rostest
from recorder_testing import (
    TIMEOUT_S,
    RecorderUnderTest,
    Stream,
    contents,
    message_count,
    new_topic,
    numbers,
    rostopic_pub,
    wait_for_count,
)
from std_msgs.msg import String, UInt8MultiArray, UInt32
from surroundings import suspended

from process_visualizer.bags.bag_errors import BagUnindexed
from process_visualizer.bags.recording import Recording
from process_visualizer.bags.reindex import reindex
from process_visualizer.clients.recording_options import RecorderError, RecordingOptions
from process_visualizer.msg import RecorderState
from process_visualizer.report.report import make_report


class BagRecorderFaultsTest(unittest.TestCase):
    """Every test has a recorder of its own."""

    def test_a_driver_that_dies_is_told_at_once(self):
        topic = new_topic()
        with RecorderUnderTest() as recorder:
            driver = rostopic_pub(topic)
            try:
                path = recorder.start(topic, name='a')
                recorder.client.wait_for(lambda state: state.messages > 20, TIMEOUT_S)
            finally:
                driver.kill()
                driver.wait()
            state = recorder.client.wait_for(lambda state: state.problems, TIMEOUT_S)
            self.assertIn(f'{topic}: silent', state.problems[-1])
            self.assertLess(state.topics[0].silence, 3.0)
            driver = rostopic_pub(topic)
            try:
                self.assertIsNotNone(recorder.client.wait_for(
                    lambda now: now.messages > state.messages + 20, TIMEOUT_S))
            finally:
                driver.kill()
                driver.wait()
            recorder.client.stop()
            self.assertEqual(state.problem_count, 1)
            self.assertGreater(len(contents(path, topic)), 40)

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
        driver = rostopic_pub(topic)
        try:
            rospy.wait_for_message(topic, UInt32, TIMEOUT_S)
            with suspended(driver.pid), RecorderUnderTest(connection_timeout=1) as recorder:
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
            self.assertGreater(state.topics[0].messages, 20)
            self.assertEqual(message_count(path, topic), state.topics[0].messages)
            self.assertEqual(message_count(path), state.messages)
            with Recording([path]) as recording:
                report = make_report(recording)
            self.assertGreater(report.topics[0].dropped, 0)

    def test_nothing_is_counted_below_zero_when_nothing_can_be_written(self):
        topic = new_topic()
        publisher = rospy.Publisher(topic, UInt8MultiArray, latch=True, queue_size=1)
        publisher.publish(data=bytes(100_000))
        with RecorderUnderTest('prlimit', '--fsize=20000', topics=[topic]) as recorder:
            self.assertTrue(wait_for_count(recorder, topic, 1))
            path = recorder.start(topic, name='a')
            state = recorder.client.wait_for(
                lambda state: state.problems and state.state == RecorderState.IDLE, TIMEOUT_S)
            self.assertIn('make room', state.problems[-1])
            self.assertEqual((state.topics[0].messages, state.topics[0].dropped), (0, 1))
            self.assertEqual(state.messages, message_count(path))

    def test_a_recorded_log_does_not_feed_itself(self):
        topics = ['/rosout', '/rosout_agg']
        with RecorderUnderTest() as recorder:
            path = recorder.start(*topics, name='a')
            for number in range(20):
                rospy.logwarn(f'log {number}')
                self.assertTrue(wait_for_count(recorder, '/rosout', number + 1))
            # a second of silence is told of what comes regularly
            state = recorder.client.wait_for(lambda state: state.problems, 6.0)
            self.assertIsNone(state)
            recorder.client.stop()
            self.assertGreaterEqual(message_count(path, '/rosout'), 20)

    def small_disk(self, megabytes: int, file_megabytes: int = 0) -> RecorderUnderTest:
        """A recorder on a small disk; without the right to mount one, with files limited so.

        The limit of files is ``file_megabytes`` if given.
        """
        folder = tempfile.mkdtemp(prefix='recorder_test_disk_')
        mounted = subprocess.run(
            ['mount', '-t', 'tmpfs', '-o', f'size={megabytes}m', 'tmpfs', folder],
            stderr=subprocess.DEVNULL).returncode == 0
        self.addCleanup(shutil.rmtree, folder)
        if mounted:
            self.addCleanup(subprocess.run, ['umount', '--lazy', folder])
            return RecorderUnderTest(folder=folder)
        return RecorderUnderTest('prlimit', f'--fsize={(file_megabytes or megabytes) << 20}',
                                 folder=folder)

    def test_too_little_room_is_refused_or_stops_the_recording(self):
        topic = new_topic()
        publisher = rospy.Publisher(topic, UInt8MultiArray, queue_size=100)
        with self.small_disk(megabytes=200, file_megabytes=4000) as recorder:
            rospy.set_param(f'{recorder.node}/minimum_free_megabytes', 2_000_000_000)
            with self.assertRaisesRegex(RecorderError, 'MB are free'):
                recorder.start(topic, name='a')
            self.assertEqual(recorder.files(), [])
            # Where no disk could be mounted, others write and delete files on this one meanwhile.
            free = shutil.disk_usage(recorder.folder).free >> 20
            rospy.set_param(f'{recorder.node}/minimum_free_megabytes', free - 100)
            path = recorder.start(topic, name='a')
            while recorder.client.wait_for(
                    lambda state: state.state == RecorderState.IDLE, 0.02) is None:
                publisher.publish(data=bytes(1_000_000))
            state = recorder.client.state
            self.assertIn('the bag is complete until then', state.problems[-1])
            self.assertEqual(state.dropped, 0)
            self.assertEqual(message_count(path), state.messages)

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
    rospy.init_node('bag_recorder_faults_test')
    rostest.rosrun('process_visualizer', 'bag_recorder_faults_test', BagRecorderFaultsTest)
