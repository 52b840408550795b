#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The recorder with real publishers: start, a mark, stop, and the bag as rosbag reads it.

Its handling of messages, memory, disks and time is tested in test/cpp/test_recorder*.cpp.
"""
from __future__ import annotations

import json
import unittest

import rosbag
import rospy
import rostest
from recorder_testing import (
    TIMEOUT_S,
    RecorderUnderTest,
    Subscription,
    contents,
    new_topic,
    numbers,
    wait_for_count,
)
from std_msgs.msg import String, UInt32
from tf2_msgs.msg import TFMessage

from process_visualizer.bagio.marks import read_marks
from process_visualizer.bagio.recorder_topics import recorded_configuration
from process_visualizer.bagio.recording import Recording
from process_visualizer.bagio.report import Completeness, make_report
from process_visualizer.clients.bag_recorder import RecorderError, RecordingOptions
from process_visualizer.msg import RecorderState

COUNT = 300
CONFIGURATION = {'file': '/c.xml', 'files': {'/c.xml': '<visualizer/>'}, 'arguments': {}}


class BagRecorderTest(unittest.TestCase):
    """Every test has a recorder of its own."""

    def test_all_that_is_published_between_start_and_stop_is_in_the_bag(self) -> None:
        topics, latched = [new_topic(), new_topic()], new_topic()
        publishers = [rospy.Publisher(topic, UInt32, queue_size=COUNT) for topic in topics]
        always = rospy.Publisher(latched, String, latch=True, queue_size=1)
        always.publish('always')
        rospy.wait_for_message('/tf_static', TFMessage, TIMEOUT_S)
        with RecorderUnderTest() as recorder:
            with self.assertRaisesRegex(RecorderError, 'nothing is being recorded'):
                recorder.client.mark('too early')
            path = recorder.start(*topics, latched, name='a',
                                  configuration=json.dumps(CONFIGURATION))
            self.assertEqual(recorder.files(), ['a.bag.active'])
            for number in range(COUNT):
                for publisher in publishers:
                    publisher.publish(number)
            recorder.client.mark('the seam tears ü')
            state = recorder.client.wait_for(lambda state: state.messages > 2 * COUNT, TIMEOUT_S)
            self.assertEqual(state.state, RecorderState.RECORDING)
            self.assertEqual({it.name: (it.type, it.latching, it.publishers)
                              for it in state.topics},
                             {latched: ('std_msgs/String', True, 1),
                              **{topic: ('std_msgs/UInt32', False, 1) for topic in topics}})
            self.assertEqual(recorder.client.stop(), [path])
            self.assertEqual(recorder.files(), ['a.bag'])
            for topic in topics:
                self.assertEqual(numbers(path, topic), list(range(COUNT)))
            self.assertEqual([it.data for it, _ in contents(path, latched)], ['always'])
            self.check_what_it_adds(path)

    def check_what_it_adds(self, path: str) -> None:
        """It adds configuration, current base frames and mark, and says that nothing is missing."""
        (frames, _), = contents(path, '/process_visualizer/calibration')
        self.assertEqual(frames.transforms[0].child_frame_id, 'base')
        self.assertEqual(frames.transforms[0].transform.translation.y, 2.0)
        with rosbag.Bag(path) as bag:
            count = bag.get_message_count()
        with Recording([path]) as recording:
            self.assertEqual(len(recording.index.time_ns), count)
            self.assertEqual([it.label for it in read_marks(recording)], ['the seam tears ü'])
            self.assertEqual(recorded_configuration(recording).files, CONFIGURATION['files'])
            self.assertIs(make_report(recording).completeness, Completeness.COMPLETE)

    def test_all_of_a_topic_is_there_each_time_it_is_recorded(self) -> None:
        topic = new_topic()
        publisher = rospy.Publisher(topic, UInt32, queue_size=COUNT)
        with RecorderUnderTest() as recorder:
            for name in 'abcd':  # rospy keeps the earlier connections until it sends again
                path = recorder.start(topic, name=name)
                for number in range(COUNT):
                    publisher.publish(number)
                self.assertTrue(wait_for_count(recorder, topic, COUNT))
                recorder.client.stop()
                self.assertEqual(numbers(path, topic), list(range(COUNT)))

    def test_the_moment_before_goes_on_into_a_recording(self) -> None:
        topic, subscription = new_topic(), Subscription()
        publisher = rospy.Publisher(topic, UInt32, subscription, queue_size=COUNT)
        with RecorderUnderTest(recent_duration=600, topics=[topic]) as recorder:
            subscription.wait()
            for number in range(COUNT):
                publisher.publish(number)
            self.assertIsNotNone(recorder.client.wait_for(
                lambda state: state.topics[0].messages == COUNT, TIMEOUT_S))
            saved = recorder.client.save_recent(
                RecordingOptions(folder=recorder.folder, name='saved'))
            before = recorder.client.state.recent_bytes
            publisher.publish(COUNT)
            self.assertIsNotNone(recorder.client.wait_for(
                lambda state: state.recent_bytes > before, TIMEOUT_S))
            path = recorder.start(name='on', recent_s=600.0)
            self.assertIsNotNone(recorder.client.wait_for(
                lambda state: state.recent == 0.0 < state.remembered, TIMEOUT_S))
            publisher.publish(COUNT + 1)
            recorder.client.stop()
            self.assertEqual(numbers(saved, topic), list(range(COUNT)))
            self.assertEqual(numbers(path, topic), [COUNT, COUNT + 1])

    def test_other_topics_leave_in_memory_what_is_there(self) -> None:
        first, second = new_topic(), new_topic()
        subscriptions = [Subscription(), Subscription()]
        publishers = [rospy.Publisher(topic, UInt32, it, queue_size=COUNT)
                      for topic, it in zip((first, second), subscriptions)]
        with RecorderUnderTest(recent_duration=600, topics=[first]) as recorder:
            subscriptions[0].wait()
            publishers[0].publish(1)
            self.assertIsNotNone(recorder.client.wait_for(
                lambda state: state.topics[0].messages == 1, TIMEOUT_S))
            recorder.client.watch([first, second])
            subscriptions[1].wait()
            publishers[1].publish(2)
            self.assertIsNotNone(recorder.client.wait_for(
                lambda state: {it.name: it.messages for it in state.topics} == {
                    first: 1, second: 1}, TIMEOUT_S))
            with self.assertRaisesRegex(RecorderError, 'no topic is chosen'):
                recorder.client.watch([])
            saved = recorder.client.copy_recent(recorder.folder, 'both')
            self.assertEqual([numbers(saved, it) for it in (first, second)], [[1], [2]])
            recorder.start(name='on')
            with self.assertRaisesRegex(RecorderError, 'is being recorded'):
                recorder.client.watch([first])
            recorder.client.stop()


if __name__ == '__main__':
    rospy.init_node('bag_recorder_test')
    rostest.rosrun('process_visualizer', 'bag_recorder_test', BagRecorderTest)
