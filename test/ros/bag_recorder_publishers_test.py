#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The recorder and publishers that are odd, dead, or follow each other."""
from __future__ import annotations

import signal
import time
import unittest
from contextlib import contextmanager
from pathlib import Path
from typing import Iterator, List

import rosbag
import rospy
import rostest
from odd_publisher import OddPublisher, header_of
from recorder_testing import (
    TIMEOUT_S,
    RecorderUnderTest,
    Stream,
    message_count,
    new_topic,
    rostopic_pub,
    wait_for_count,
)
from rosbags.rosbag1 import Reader
from std_msgs.msg import UInt32

from process_visualizer.bags.recording import Recording


class BagRecorderPublishersTest(unittest.TestCase):
    """Every test has a recorder of its own."""

    def test_odd_answers_about_connections(self):
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
                    self.assertEqual(numbers_in_order(path, topic), [7])

    def test_a_publisher_without_definition(self):
        header = header_of(UInt32, '/undefined')
        del header['message_definition']
        self.assert_readable(header)

    def test_a_publisher_that_says_only_what_has_to_be_said(self):
        self.assert_readable({'type': UInt32._type.encode(), 'md5sum': UInt32._md5sum.encode()})

    def test_odd_bytes_in_what_a_publisher_says(self):
        header = header_of(UInt32, '/odd')
        header['callerid'] = b'/odd\xff\xc3('
        header['message_definition'] += b'\n# 20 \xb0C'
        header['note'] = b'\xed\xa0\x80 \xf5'
        self.assert_readable(header)

    def test_a_missing_definition_is_that_of_others(self):
        topic, other = new_topic(), new_topic()
        header = header_of(UInt32, '/undefined')
        del header['message_definition']
        with RecorderUnderTest(topics=[topic, other]) as recorder, Stream(other):
            self.assertTrue(wait_for_count(recorder, other, 10))
            with OddPublisher(topic, header) as publisher:
                path = recorder.start(topic, other, name='a')
                publisher.publish(7)
                self.assertTrue(wait_for_count(recorder, topic, 1))
                recorder.client.stop()
            with Recording([path]) as recording:
                definitions = {it.topic: it.message_definition for it in
                               recording.index.connections}
            self.assertEqual(definitions[topic], UInt32._full_text)

    def assert_readable(self, header):
        """What such a publisher sends, and all else, can be read by everybody."""
        topic, other = new_topic(), new_topic()
        with RecorderUnderTest() as recorder, OddPublisher(topic, header) as publisher, \
                Stream(other):
            path = recorder.start(topic, other, name='a')
            publisher.publish(7)
            self.assertTrue(wait_for_count(recorder, topic, 1))
            self.assertTrue(wait_for_count(recorder, other, 10))
            recorder.client.stop()
            self.assertEqual(message_count(path, topic), 1)
            with rosbag.Bag(path) as bag:
                # as bytes: rosbag keeps one class for each type, for all bags that it reads
                read = [(name, data[1]) for name, data, _ in bag.read_messages(raw=True)]
            self.assertIn((topic, b'\7\0\0\0'), read)
            self.assertGreaterEqual([name for name, _ in read].count(other), 10)
            with Reader(Path(path)) as reader:
                self.assertIn(b'\7\0\0\0', [bytes(data) for connection, _, data
                                            in reader.messages() if connection.topic == topic])
            with Recording([path]) as recording:
                self.assertEqual(len(recording.index.connections_of(topic)), 1)

    def test_a_killed_node_that_stays_registered_is_not_subscribed_anew(self):
        topic = new_topic()
        driver = rostopic_pub(topic)
        try:
            with RecorderUnderTest(topics=[topic]) as recorder:
                recorder.start(topic, name='a')
                self.assertTrue(wait_for_count(recorder, topic, 1))
                driver.send_signal(signal.SIGKILL)
                driver.wait()
                # twice the time after which the recorder takes it for a changed type
                self.assertIsNone(recorder.client.wait_for(
                    lambda state: any('anew' in problem for problem in state.problems), 8.0))
        finally:
            driver.kill()
            driver.wait()

    def test_a_node_that_died_before_it_was_ever_connected_is_not_subscribed_anew(self):
        topic = new_topic()
        publisher = OddPublisher(topic)
        publisher.die()
        self.addCleanup(publisher.unregister)
        with RecorderUnderTest(topics=[topic]) as recorder:
            self.assertIsNone(recorder.client.wait_for(
                lambda state: any('anew' in problem for problem in state.problems), 8.0))

    def test_of_latched_messages_the_newest_is_the_last(self):
        topic = new_topic()
        with RecorderUnderTest(topics=[topic]) as recorder, latched(topic, '/z', 1):
            self.assertTrue(wait_for_count(recorder, topic, 1))
            with latched(topic, '/a', 2):
                self.assertTrue(wait_for_count(recorder, topic, 2))
                path = recorder.start(topic, name='a')
                recorder.client.stop()
                self.assertEqual(numbers_in_order(path, topic), [1, 2])

    def test_a_dead_publisher_is_forgotten_when_another_took_its_place(self):
        topic = new_topic()
        with RecorderUnderTest(topics=[topic], recent_duration=30) as recorder:
            with latched(topic, '/old', 1):
                self.assertTrue(wait_for_count(recorder, topic, 1))
            path = recorder.start(topic, name='only')
            recorder.client.stop()
            self.assertEqual(numbers_in_order(path, topic), [1])  # everybody still shows it
            with latched(topic, '/new', 2):
                end_s = time.monotonic() + TIMEOUT_S
                found: List[int] = []
                while found != [2] and time.monotonic() < end_s:
                    recorder.client.wait_for(lambda state: False, 1.0)  # it looks between commands
                    path = recorder.start(topic, name=f'a{time.monotonic_ns()}')
                    recorder.client.stop()
                    found = numbers_in_order(path, topic)
                self.assertEqual(found, [2])


@contextmanager
def latched(topic: str, name: str, number: int) -> Iterator[OddPublisher]:
    """A node that latches a number, which it has sent to the recorder."""
    header = header_of(UInt32, name, latching=True)
    with OddPublisher(topic, header, name=name) as publisher:
        publisher.publish(number)
        yield publisher


def numbers_in_order(path: str, topic: str) -> List[int]:
    """The numbers of a topic as the player sends them."""
    with Recording([path]) as recording:
        positions = recording.index.positions_of(recording.index.connections_of(topic))
        return [int.from_bytes(recording.message(position), 'little')
                for position in positions.tolist()]


if __name__ == '__main__':
    rospy.init_node('bag_recorder_publishers_test')
    rostest.rosrun('process_visualizer', 'bag_recorder_publishers_test', BagRecorderPublishersTest)
