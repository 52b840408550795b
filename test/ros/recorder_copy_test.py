#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Copies of what the recorder has in memory, whatever else it does meanwhile."""
from __future__ import annotations

import itertools
import os
import shutil
import tempfile
import threading
import time
import unittest
from typing import Callable, List

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
    topics_of,
    wait_for_count,
)
from std_msgs.msg import String, UInt8MultiArray

from process_visualizer.bags.recorder_topics import ACCOUNT, CONFIGURATION, MARKS
from process_visualizer.bags.recording import Recording
from process_visualizer.clients.recording_options import RecorderError, RecordingOptions
from process_visualizer.msg import RecorderState
from process_visualizer.report.report import Completeness, make_report


class RecorderCopyTest(unittest.TestCase):
    """Every test has a recorder of its own."""

    def wait_for_seconds(self, recorder: RecorderUnderTest, seconds: float) -> None:
        """Wait until what no recording has is so long."""
        self.assertIsNotNone(
            recorder.client.wait_for(lambda state: state.recent > seconds, TIMEOUT_S))

    def assert_no_gap(self, found: List[int]) -> None:
        """The numbers follow on each other."""
        self.assertTrue(found)
        self.assertEqual(found, list(range(found[0], found[0] + len(found))))

    def test_copies_have_all_and_the_recording_loses_nothing(self):
        topic, latched = new_topic(), new_topic()
        publisher = rospy.Publisher(latched, String, latch=True, queue_size=1)
        publisher.publish('old')
        with Stream(topic), RecorderUnderTest(recent_duration=60, topics=[topic, latched],
                                              configuration='{}') as recorder:
            self.wait_for_seconds(recorder, 1.0)
            path = recorder.start(name='a')
            recorder.client.mark('here')
            self.assertTrue(wait_for_count(recorder, topic, 100))
            publisher.publish('new')
            self.assertTrue(wait_for_count(recorder, latched, 2))  # one, and what was latched
            first = recorder.client.copy_recent(recorder.folder, 'first')
            self.assertEqual(recorder.client.state.state, RecorderState.RECORDING)
            second = recorder.client.copy_recent(recorder.folder, 'second')
            recorder.client.stop()
            recorded = numbers(path, topic)
            copied, again = numbers(first, topic), numbers(second, topic)
            for found in (recorded, copied, again):
                self.assert_no_gap(found)
            self.assertLess(copied[0], recorded[0] - 100)  # with what was before the recording
            self.assertGreater(copied[-1], recorded[0] + 90)
            self.assertEqual(again[:len(copied)], copied)
            for copy in (first, second):
                self.assertEqual([it.data for it, _ in contents(copy, latched)], ['old', 'new'])
                self.assertEqual([it.data for it, _ in contents(copy, MARKS)], ['here'])
                self.assert_is_a_recording(copy)
            self.wait_for_seconds(recorder, 0.5)
            recorder.client.copy_recent(recorder.folder, 'third')
            saved = numbers(recorder.client.save_recent(
                RecordingOptions(folder=recorder.folder, name='saved')), topic)
            self.assert_no_gap(recorded + saved)  # not one twice, and not one missing

    def assert_is_a_recording(self, path: str) -> None:
        """It begins with the configuration and ends with an account that says it is whole."""
        with rosbag.Bag(path) as bag:
            topics = [topic for topic, *_ in bag.read_messages()]
        self.assertIn(CONFIGURATION, topics[:3])
        self.assertEqual((topics[-1], topics.count(ACCOUNT)), (ACCOUNT, 1))
        with Recording([path]) as recording:
            self.assertIs(make_report(recording).completeness, Completeness.COMPLETE)

    def test_a_copy_begins_with_what_was_latched_then(self):
        topic, latched = new_topic(), new_topic()
        publisher = rospy.Publisher(latched, String, latch=True, queue_size=1)
        publisher.publish('old')
        with Stream(topic), RecorderUnderTest(
                recent_duration=2, topics=[topic, latched]) as recorder:
            recorder.start(name='a')
            self.assertTrue(wait_for_count(recorder, topic, 500))  # more than the memory has
            publisher.publish('new')
            self.assertTrue(wait_for_count(recorder, latched, 2))
            copy = recorder.client.copy_recent(recorder.folder, 'copy')
            self.assertEqual([it.data for it, _ in contents(copy, latched)], ['old', 'new'])
            short = recorder.client.copy_recent(recorder.folder, 'short', recent_s=0.01)
            self.assertEqual(contents(short, latched)[-1][0].data, 'new')
            self.assertLess(message_count(short, topic), 50)

    def test_a_memory_without_messages_has_what_is_latched_or_nothing(self):
        latched, other = new_topic(), new_topic()
        publisher = rospy.Publisher(latched, String, latch=True, queue_size=1)
        publisher.publish('old')
        with RecorderUnderTest(recent_duration=30, topics=[latched, other]) as recorder:
            self.assertTrue(wait_for_count(recorder, latched, 1))
            rospy.sleep(0.1)
            copy = recorder.client.copy_recent(recorder.folder, recent_s=0.05)
            self.assertEqual(topics_of(copy), {latched, ACCOUNT})
        with RecorderUnderTest(recent_duration=30, topics=[other]) as recorder:
            with self.assertRaisesRegex(RecorderError, 'nothing is latched'):
                recorder.client.copy_recent(recorder.folder)
            self.assertEqual(recorder.files(), [])

    def test_where_there_is_no_room_is_no_file(self):
        large = new_topic()
        publisher = rospy.Publisher(large, UInt8MultiArray, queue_size=100)
        with RecorderUnderTest(recent_duration=60, topics=[large]) as recorder:
            while publisher.get_num_connections() == 0:
                rospy.sleep(0.01)
            for _ in range(20):
                publisher.publish(data=bytes(1_000_000))
            self.assertTrue(wait_for_count(recorder, large, 20))
            os.makedirs(recorder.folder)
            for minimum in (2_000_000_000, (shutil.disk_usage(recorder.folder).free >> 20) - 5):
                rospy.set_param(f'{recorder.node}/minimum_free_megabytes', minimum)
                with self.assertRaisesRegex(RecorderError, 'MB are free; make room'):
                    recorder.client.copy_recent(recorder.folder)
            self.assertEqual(recorder.files(), [])
            rospy.set_param(f'{recorder.node}/minimum_free_megabytes', 0)
            path = recorder.client.copy_recent(recorder.folder)
            with self.assertRaisesRegex(RecorderError, 'exists already'):
                recorder.client.copy_recent(recorder.folder, os.path.basename(path))

    def test_a_full_disk_has_no_half_copies(self):
        large = new_topic()
        publisher = rospy.Publisher(large, UInt8MultiArray, queue_size=100)
        with RecorderUnderTest('prlimit', f'--fsize={10 << 20}', recent_duration=60,
                               topics=[large]) as recorder:
            while publisher.get_num_connections() == 0:
                rospy.sleep(0.01)
            for _ in range(20):
                publisher.publish(data=bytes(1_000_000))
            self.assertTrue(wait_for_count(recorder, large, 20))
            with self.assertRaisesRegex(RecorderError, 'make room'):
                recorder.client.copy_recent(recorder.folder)
            self.assertEqual(recorder.files(), [])

    def test_commands_and_copies_do_not_disturb_each_other(self):
        """All bags are in one folder and named by the second: for the names, too, they compete."""
        topic = new_topic()
        copies: List[str] = []
        with Stream(topic), RecorderUnderTest(recent_duration=60, topics=[topic]) as recorder:
            self.wait_for_seconds(recorder, 1.0)
            has_ended = threading.Event()
            threads = [threading.Thread(target=self.repeat, args=(has_ended, command))
                       for command in (
                           lambda: copies.append(recorder.client.copy_recent(recorder.folder)),
                           lambda: copies.append(recorder.client.copy_recent(recorder.folder)),
                           lambda: recorder.client.mark('here'))]
            for thread in threads:
                thread.start()
            recorded: List[int] = []
            files: List[str] = []
            for _ in range(12):
                path = recorder.start(recent_s=60.0)
                rospy.sleep(0.3)
                files += recorder.client.stop()
                self.assertEqual(files[-1], path)
                recorded += numbers(path, topic)
            has_ended.set()
            for thread in threads:
                thread.join()
            self.assert_no_gap(recorded)
            self.assertGreater(len(copies), 20)
            self.assertEqual(len(set(copies + files)), len(copies) + len(files))
            self.assertEqual({os.path.basename(it) for it in copies + files},
                             set(recorder.files()))
            for path in itertools.chain(copies[:5], copies[-5:]):
                found = numbers(path, topic)
                self.assert_no_gap(found)
                self.assertLess(found[0], recorded[0] + 5)
            self.assertEqual(len(recorder.client.state.problems), 0)

    @staticmethod
    def repeat(has_ended: threading.Event, command: Callable[[], object]) -> None:
        """Do something again and again."""
        while not has_ended.is_set():
            command()

    def test_half_a_minute_of_a_cell_is_copied_quickly(self):
        """So much that nobody waits for it: 75 000 messages of 20 topics."""
        topics = [new_topic() for _ in range(20)]
        publishers = [rospy.Publisher(it, UInt8MultiArray, queue_size=10_000) for it in topics]
        folder = tempfile.mkdtemp(prefix='recorder_test_', dir='/dev/shm')
        self.addCleanup(shutil.rmtree, folder)
        with RecorderUnderTest(recent_duration=120, topics=topics) as recorder:
            while any(it.get_num_connections() == 0 for it in publishers):
                rospy.sleep(0.01)
            for _ in range(3750):
                for publisher in publishers:
                    publisher.publish(data=bytes(292))
            for topic in topics:
                self.assertTrue(wait_for_count(recorder, topic, 3750))
            durations_s = []
            for _ in range(3):
                begin_s = time.monotonic()
                path = recorder.client.copy_recent(folder)
                durations_s.append(time.monotonic() - begin_s)
                self.assertEqual(message_count(path), 75_001)
            print('copied in', ', '.join(f'{it:.3f} s' for it in durations_s))
            self.assertLess(min(durations_s), 1.0)


if __name__ == '__main__':
    rospy.init_node('recorder_copy_test')
    rostest.rosrun('process_visualizer', 'recorder_copy_test', RecorderCopyTest)
