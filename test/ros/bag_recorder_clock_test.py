#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The recorder where the time is simulated."""
from __future__ import annotations

import threading
import unittest

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
from rosgraph_msgs.msg import Clock
from std_msgs.msg import String

from process_visualizer.bags.recording import Recording
from process_visualizer.clients.recording_options import RecorderError, RecordingOptions

BEGIN_S = 1_600_000_000


class SimulatedTime:
    """Publishes a time that goes on from BEGIN_S; use it in a ``with``."""

    def __init__(self) -> None:
        self._publisher = rospy.Publisher('/clock', Clock, queue_size=10)
        self._end = threading.Event()
        self._thread = threading.Thread(target=self._run)

    def __enter__(self) -> SimulatedTime:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._end.set()
        self._thread.join()
        self._publisher.unregister()

    def _run(self) -> None:
        step = 0
        while not self._end.wait(0.01):
            step += 1
            self._publisher.publish(rospy.Time(BEGIN_S + step // 100, step % 100 * 10_000_000))


class BagRecorderClockTest(unittest.TestCase):
    """This process was started before the time is simulated, and keeps the machine's."""

    def setUp(self) -> None:
        rospy.set_param('/use_sim_time', True)
        self.addCleanup(rospy.delete_param, '/use_sim_time')

    def test_nothing_is_recorded_before_the_first_time(self):
        topic, latched = new_topic(), new_topic()
        publisher = rospy.Publisher(latched, String, latch=True, queue_size=1)
        publisher.publish('before the first time')
        with RecorderUnderTest(topics=[topic, latched], connection_timeout=1,
                               recent_duration=30) as recorder, Stream(topic):
            self.assertTrue(wait_for_count(recorder, topic, 20))
            for command in (recorder.client.start, recorder.client.save_recent):
                with self.assertRaisesRegex(RecorderError, 'nothing publishes /clock'):
                    command(RecordingOptions((topic, latched), recorder.folder, name='a'))
            with self.assertRaisesRegex(RecorderError, 'nothing publishes /clock'):
                recorder.client.mark('now')
            self.assertEqual(recorder.files(), [])
            with SimulatedTime():
                path = recorder.start(topic, latched, name='a', recent_s=20.0)
                self.assertTrue(wait_for_count(recorder, topic, 100))
                recorder.client.stop()
            with Recording([path]) as recording:
                self.assertGreaterEqual(recording.begin_ns, BEGIN_S * 10 ** 9)
                self.assertLess(recording.end_ns, (BEGIN_S + 200) * 10 ** 9)
            found = numbers(path, topic)
            self.assertEqual(found, list(range(found[0], found[0] + len(found))))
            self.assertEqual(contents(path, latched)[0][0].data, 'before the first time')

    def test_start_waits_for_the_first_time(self):
        topic = new_topic()
        with RecorderUnderTest(topics=[topic], connection_timeout=TIMEOUT_S) as recorder, \
                Stream(topic):
            time = SimulatedTime()
            threading.Timer(1.0, time.__enter__).start()
            try:
                path = recorder.start(topic, name='a')
                self.assertTrue(wait_for_count(recorder, topic, 100))
                recorder.client.stop()
            finally:
                time.__exit__()
            with Recording([path]) as recording:
                self.assertGreaterEqual(recording.begin_ns, BEGIN_S * 10 ** 9)


if __name__ == '__main__':
    rospy.init_node('bag_recorder_clock_test')
    rostest.rosrun('process_visualizer', 'bag_recorder_clock_test', BagRecorderClockTest)
