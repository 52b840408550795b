#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The recorder with a real master: what it promises."""
from __future__ import annotations

import itertools
import json
import os
import signal
import subprocess
import threading
import unittest

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
from std_msgs.msg import Header, String, UInt8MultiArray, UInt32
from tf2_msgs.msg import TFMessage

from process_visualizer.bags.catalogue import read_catalogue
from process_visualizer.bags.marks import read_marks
from process_visualizer.bags.recorder_topics import ACCOUNT, MARKS, recorded_configuration
from process_visualizer.bags.recording import Recording
from process_visualizer.clients.recording_options import RecorderError, RecordingOptions
from process_visualizer.msg import RecorderState
from process_visualizer.report.report import Completeness, make_report


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

    def test_all_of_a_topic_is_there_each_time_it_is_recorded(self):
        topic = new_topic()
        publisher = rospy.Publisher(topic, UInt32, queue_size=1000)
        with RecorderUnderTest() as recorder:
            for name in 'abcdefgh':  # rospy keeps the connections of before until it sends again
                path = recorder.start(topic, name=name)
                for number in range(50):
                    publisher.publish(number)
                recorder.client.stop()
                self.assertEqual(numbers(path, topic), list(range(50)))

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
            publisher.unregister()
            played = threading.Semaphore(0)
            subscriber = rospy.Subscriber(topic, String, lambda _: played.release())
            subprocess.run(['rosbag', 'play', '--quiet', '--delay', '2', path], check=True,
                           stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
            self.assertTrue(all(played.acquire(timeout=TIMEOUT_S) for _ in range(100)))
            subscriber.unregister()

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

    def test_a_latched_topic_is_told_as_one(self):
        latched, topic = new_topic(), new_topic()
        publisher = rospy.Publisher(latched, String, latch=True, queue_size=1)
        publisher.publish('always')
        with RecorderUnderTest(topics=[latched, topic]) as recorder, Stream(topic):
            state = recorder.client.wait_for(
                lambda state: len(state.topics) == 2
                and all(it.silence >= 0.0 for it in state.topics), TIMEOUT_S)
            self.assertIsNotNone(state)
            self.assertEqual({it.name: it.latching for it in state.topics},
                             {latched: True, topic: False})

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
            self.assertIs(report.completeness, Completeness.INCOMPLETE)

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
            self.assertIs(report.completeness, Completeness.INCOMPLETE)
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

    def test_nothing_is_lost_where_the_past_goes_on_into_the_recording(self):
        many, topic = new_topic(), new_topic()
        publisher = rospy.Publisher(many, UInt32, queue_size=100_000)
        with Stream(topic), RecorderUnderTest(
                recent_duration=60, topics=[many, topic]) as recorder:
            self.assertTrue(wait_for_count(recorder, topic, 1))
            for number in range(60_000):  # to copy these takes longer than a period of the stream
                publisher.publish(number)
            self.assertTrue(wait_for_count(recorder, many, 60_000))
            path = recorder.start(name='on', recent_s=60.0)
            recorder.client.wait_for(lambda state: state.duration > 0.2, TIMEOUT_S)
            recorder.client.stop()
            found = numbers(path, topic)
            self.assertEqual(found, list(range(found[0], found[0] + len(found))))
            self.assertEqual(len(numbers(path, many)), 60_000)

    def test_what_is_saved_is_as_long_as_was_asked_for(self):
        topic = new_topic()
        with Stream(topic), RecorderUnderTest(recent_duration=30, topics=[topic]) as recorder:
            self.assertIsNotNone(
                recorder.client.wait_for(lambda state: state.recent > 2.0, TIMEOUT_S))
            path = recorder.client.save_recent(
                RecordingOptions(folder=recorder.folder, recent_s=1.5))
            with Recording([path]) as recording:
                duration_s = (recording.end_ns - recording.begin_ns) / 1e9
            self.assertLess(duration_s, 1.5 + 1e-6)
            self.assertGreater(duration_s, 1.0)

    def test_a_recording_with_the_past_holds_only_what_was_chosen(self):
        watched, chosen = new_topic(), new_topic()
        with Stream(watched), Stream(chosen), RecorderUnderTest(
                recent_duration=30, topics=[watched]) as recorder:
            self.assertTrue(wait_for_count(recorder, watched, 50))
            recorder.client.mark('before')
            path = recorder.start(chosen, name='a', recent_s=20.0)
            self.assertTrue(wait_for_count(recorder, chosen, 10))
            recorder.client.stop()
            self.assertEqual(topics_of(path), {chosen, MARKS, ACCOUNT})

    def test_what_is_saved_holds_only_what_was_chosen(self):
        watched, chosen, other = new_topic(), new_topic(), new_topic()
        with Stream(watched), Stream(chosen), RecorderUnderTest(
                recent_duration=30, topics=[watched, chosen]) as recorder:
            self.assertTrue(wait_for_count(recorder, watched, 10))
            self.assertTrue(wait_for_count(recorder, chosen, 10))
            with self.assertRaisesRegex(RecorderError, 'nothing is in memory of that'):
                recorder.client.save_recent(RecordingOptions((other,), recorder.folder))
            path = recorder.client.save_recent(RecordingOptions((chosen,), recorder.folder))
            self.assertEqual(topics_of(path), {chosen, ACCOUNT})

    def test_a_count_is_what_the_bags_hold(self):
        topic, latched = new_topic(), new_topic()
        publisher = rospy.Publisher(latched, String, latch=True, queue_size=1)
        publisher.publish('always')
        with RecorderUnderTest(topics=[topic, latched]) as recorder, Stream(topic):
            self.assertTrue(wait_for_count(recorder, latched, 1))
            first = recorder.start(name='a', configuration='{}', split_duration_s=1.0)
            self.assertIsNotNone(
                recorder.client.wait_for(lambda state: len(state.files) == 3, TIMEOUT_S))
            recorder.client.mark('now')
            paths = recorder.client.stop()
            self.assertEqual(paths[0], first)
            state = recorder.client.wait_for(
                lambda state: state.state == RecorderState.IDLE, TIMEOUT_S)
            self.assertEqual(state.messages, sum(map(message_count, paths)))
            for record in state.topics:
                self.assertEqual(record.messages,
                                 sum(message_count(path, record.name) for path in paths))
            self.assertEqual(state.messages, read_catalogue(paths).message_count)

    def assert_seconds(self, path, topic, least, most):
        """The topic's messages are all there, and span about so many seconds."""
        found = numbers(path, topic)
        self.assertEqual(found, list(range(found[0], found[0] + len(found))))
        times = [time for _, time in contents(path, topic)]
        self.assertGreater(times[-1] - times[0], least)
        self.assertLess(times[-1] - times[0], most)

    def test_the_past_begins_with_what_was_latched_then(self):
        latched, topic = new_topic(), new_topic()
        publisher = rospy.Publisher(latched, String, latch=True, queue_size=10)
        publisher.publish('old')
        with Stream(topic), RecorderUnderTest(
                recent_duration=2, topics=[topic, latched]) as recorder:
            # at 200 Hz: so many that the memory of 2 s has not "old" itself any more
            recorder.client.wait_for(lambda state: state.messages > 500, TIMEOUT_S)
            publisher.publish('new')
            recorder.client.wait_for(
                lambda state: (latched, 2) in [(it.name, it.messages) for it in state.topics],
                TIMEOUT_S)
            path = recorder.client.save_recent(
                RecordingOptions(folder=recorder.folder, name='a'))
            self.assertEqual([m.data for m, _ in contents(path, latched)], ['old', 'new'])

    def test_the_calibration_in_force_is_in_the_bag(self):
        topic = new_topic()
        frame = {'parent': 'world', 'child': 'base', 'xyz': [1.0, 2.0, 3.0], 'ypr': [0, 0, 0]}
        rospy.set_param('/cell_frames/frames', [frame])
        frames = subprocess.Popen(['rosrun', 'process_visualizer', 'cell_frames',
                                   '__name:=cell_frames'])
        try:
            rospy.wait_for_message('/tf_static', TFMessage, TIMEOUT_S)
            with RecorderUnderTest() as recorder, Stream(topic):
                path = recorder.start(topic, name='a')
                recorder.client.stop()
                message, _ = contents(path, '/process_visualizer/calibration')[0]
        finally:
            frames.send_signal(signal.SIGINT)
            frames.wait(TIMEOUT_S)
        self.assertEqual(message.transforms[0].child_frame_id, 'base')
        self.assertEqual(message.transforms[0].transform.translation.y, 2.0)

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


if __name__ == '__main__':
    rospy.init_node('bag_recorder_test')
    rostest.rosrun('process_visualizer', 'bag_recorder_test', BagRecorderTest)
