#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""What the recorder has in memory, read by another program while it records."""
from __future__ import annotations

import signal
import time
import unittest
from typing import List

import rospy
import rostest
from recorder_testing import (
    TIMEOUT_S,
    RecorderUnderTest,
    Stream,
    new_topic,
    numbers,
    wait_for_count,
)
from std_msgs.msg import String

from process_visualizer.clients.recorder_memory import RecorderMemory
from process_visualizer.clients.service_connection import ServiceUnreachable
from process_visualizer.curves.live.recent_part import RecentPart


def numbers_in(part: RecentPart, topic: str) -> List[int]:
    """The numbers of a topic of type std_msgs/UInt32."""
    return [int.from_bytes(part.message(row), 'little') for row in range(len(part.numbers))
            if part.connections[part.numbers[row]].topic == topic]


class RecorderMemoryTest(unittest.TestCase):
    """Every test has a recorder of its own."""

    def test_each_message_is_read_once_also_while_it_is_recorded(self):
        topic, other, latched = new_topic(), new_topic(), new_topic()
        publisher = rospy.Publisher(latched, String, latch=True, queue_size=1)
        publisher.publish('old')
        with Stream(topic), Stream(other), RecorderUnderTest(
                recent_duration=1, topics=[topic, other, latched]) as recorder:
            self.assertIsNotNone(
                recorder.client.wait_for(lambda state: state.recent > 0.9, TIMEOUT_S))
            memory = RecorderMemory(recorder.node)
            part, _ = memory.read((topic, latched))
            names = [part.connections[number].topic for number in part.numbers]
            self.assertEqual((names[0], set(names)), (latched, {topic, latched}))
            self.assertEqual(part.message(0)[4:], b'old')
            found = numbers_in(part, topic)
            path = recorder.start(name='a')
            wanted = found[-1] + 300
            while found[-1] < wanted:
                part, more = memory.read((topic, latched))
                self.assertFalse(more)
                found += numbers_in(part, topic)
                rospy.sleep(0.05)
            recorder.client.stop()
            self.assertEqual(found, list(range(found[0], found[0] + len(found))))
            self.assertGreater(len(set(found) & set(numbers(path, topic))), 200)
            self.assertLess(abs(part.now_ns / 1e9 - time.time()), 10.0)

    def test_much_comes_in_parts(self):
        large = new_topic()
        publisher = rospy.Publisher(large, String, queue_size=100)
        with RecorderUnderTest(recent_duration=60, topics=[large]) as recorder:
            while publisher.get_num_connections() == 0:
                rospy.sleep(0.01)
            for number in range(12):
                publisher.publish(chr(ord('a') + number) * 1_000_000)
            self.assertTrue(wait_for_count(recorder, large, 12))
            memory = RecorderMemory(recorder.node, largest_bytes=0)
            letters, count, more = '', 0, True
            while more:
                part, more = memory.read((large,))
                letters += ''.join(chr(part.message(row)[4]) for row in range(len(part.numbers)))
                count += 1
            self.assertEqual((letters, count), ('abcdefghijkl', 3))
            part, more = RecorderMemory(recorder.node).read((large,))
            self.assertEqual((len(part.numbers), more), (0, False))  # too large for numbers

    def test_a_recorder_that_was_started_again_is_noticed(self):
        topic = new_topic()
        with Stream(topic):
            with RecorderUnderTest(recent_duration=5, topics=[topic]) as recorder:
                self.assertTrue(wait_for_count(recorder, topic, 100))
                memory = RecorderMemory(recorder.node)
                self.assertFalse(memory.read((topic,))[0].is_anew)
                self.assertEqual(recorder.end(signal.SIGINT), 0)
                with self.assertRaises(ServiceUnreachable):
                    memory.read((topic,))
            with RecorderUnderTest(node=recorder.node, recent_duration=5,
                                   topics=[topic]) as recorder:
                self.assertTrue(wait_for_count(recorder, topic, 1))
                part, _ = memory.read((topic,))
                self.assertTrue(part.is_anew)
                found = numbers_in(part, topic)
                self.assertEqual(found, list(range(found[0], found[0] + len(found))))

    def test_a_publisher_that_sends_no_definition(self):
        """As rosjava does; the installed one stands in."""
        class Bare(String):
            _full_text = ''

        topic = new_topic()
        publisher = rospy.Publisher(topic, Bare, latch=True, queue_size=1)
        publisher.publish('x')
        with RecorderUnderTest(recent_duration=60, topics=[topic]) as recorder:
            self.assertTrue(wait_for_count(recorder, topic, 1))
            part, _ = RecorderMemory(recorder.node).read((topic,))
            connection, = part.connections
            self.assertEqual((connection.type, connection.md5sum, connection.message_definition),
                             (String._type, String._md5sum, String._full_text))

    def test_topics_that_nobody_watches_have_no_messages(self):
        with RecorderUnderTest(recent_duration=5) as recorder:
            part, more = RecorderMemory(recorder.node).read(('/nothing', ''))
            self.assertEqual((len(part.numbers), part.connections, more), (0, (), False))


if __name__ == '__main__':
    rospy.init_node('recorder_memory_test')
    rostest.rosrun('process_visualizer', 'recorder_memory_test', RecorderMemoryTest)
