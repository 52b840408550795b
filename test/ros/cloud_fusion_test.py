#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The nodelet CloudFusion: joined clouds, silent sensors, playback, and bad input."""
from __future__ import annotations

import unittest
from typing import Callable, Optional, Set, Tuple

import numpy as np
import rospy
import rostest
from cloud_testing import Listener, log_listener, logged, make_cloud, wait_until
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rosgraph_msgs.msg import Log
from sensor_msgs.msg import PointCloud2

from process_visualizer.msg import PlayerState

OUTPUT = '/cloud/fusion/output'
LEFT, RIGHT = '/left/points', '/right/points'
Point = Tuple[float, float, float]
Points = Set[Point]
LEFT_POINT, RIGHT_POINT = (0.002, 0.002, 0.002), (0.002, 0.102, 0.002)  # in their frames, m
JOINED_LEFT, JOINED_RIGHT = (1.0, 0.0, 0.0), (-1.0, 0.1, 0.0)
BOTH = {JOINED_LEFT, JOINED_RIGHT}


def points_of(cloud: PointCloud2) -> Points:
    """Return the points of a cloud, rounded to cm."""
    table = np.frombuffer(cloud.data, '<f4').reshape(-1, cloud.point_step // 4)
    return {(x, y, z) for x, y, z in np.round(table[:, :3].astype(float), 2).tolist()}


class CloudFusionTest(unittest.TestCase):
    """Publishes the clouds of two sensors and checks the output."""

    @classmethod
    def setUpClass(cls) -> None:
        cls.left, cls.right = (rospy.Publisher(topic, PointCloud2, queue_size=1)
                               for topic in (LEFT, RIGHT))
        cls.player = rospy.Publisher('/bag_player/state', PlayerState, queue_size=10)

    def send(self, left: Optional[Point] = LEFT_POINT,
             right: Optional[Point] = RIGHT_POINT) -> rospy.Time:
        """Publish a cloud of one point for each sensor that is given one, and return its stamp."""
        stamp = rospy.Time.now()
        for publisher, point, frame in ((self.left, left, '/left'), (self.right, right, 'right')):
            if point is not None:
                cloud = make_cloud([point, point], frame)
                cloud.header.stamp = stamp
                publisher.publish(cloud)
        return stamp

    def wait_for(self, output: Listener, points: Points,
                 meanwhile: Callable[[], object]) -> PointCloud2:
        """Wait until the newest cloud has these points."""
        wait_until(lambda: bool(output.messages) and points_of(output.messages[-1]) == points,
                   f'a cloud with {points}', lambda: meanwhile() and None)
        return output.messages[-1]

    def test_joins_clouds_in_the_global_frame(self) -> None:
        stamps: Set[rospy.Time] = set()
        with Listener(OUTPUT, PointCloud2) as output:
            cloud = self.wait_for(output, BOTH, lambda: stamps.add(self.send()))
        self.assertEqual(cloud.header.frame_id, 'world')
        self.assertIn(cloud.header.stamp, stamps)

    def test_leaves_out_who_is_silent_says_so_and_takes_it_back(self) -> None:
        with Listener(OUTPUT, PointCloud2) as output, log_listener() as log, \
                Listener('/diagnostics', DiagnosticArray) as diagnostics:
            self.wait_for(output, BOTH, self.send)
            self.wait_for(output, {JOINED_LEFT}, lambda: self.send(right=None))
            wait_until(lambda: logged(log, Log.WARN, 'cloud: ', RIGHT, 'left out')
                       and RIGHT in _problems(diagnostics), 'a warning',
                       lambda: self.send(right=None) and None)
            self.wait_for(output, BOTH, self.send)
            wait_until(lambda: RIGHT not in _problems(diagnostics), 'all is well',
                       lambda: self.send() and None)

    def test_a_paused_recording_is_joined_anew_after_each_jump(self) -> None:
        state = PlayerState(paused=True, rate=1.0)
        with Listener(OUTPUT, PointCloud2) as output:
            self.wait_for(output, BOTH, self.send)
            wait_until(lambda: self.player.get_num_connections() > 0, 'a subscriber')
            for segment in (1, 2):  # the first state is no jump
                state.stamp = state.since = rospy.Time.now()
                state.segment = segment
                self.player.publish(state)
            # Nothing of the right one was recorded at that position: one cloud must be enough.
            self.send((0.002, 0.202, 0.002), None)
            self.wait_for(output, {(1.0, 0.2, 0.0)}, lambda: self.player.publish(_later(state)))
        state.paused = False
        self.player.publish(_later(state))

    def test_complains_of_what_cannot_be_joined_and_lives(self) -> None:
        def no_coordinates() -> None:
            cloud = make_cloud([(0, 0, 0)], 'right')
            cloud.header.stamp = rospy.Time.now()
            del cloud.fields[0]
            self.right.publish(cloud)

        def nowhere() -> None:
            cloud = make_cloud([(0, 0, 0)], 'nowhere')
            cloud.header.stamp = rospy.Time.now()
            self.right.publish(cloud)

        with Listener(OUTPUT, PointCloud2) as output, \
                Listener('/diagnostics', DiagnosticArray) as diagnostics:
            wait_until(lambda: "'x'" in _problems(diagnostics).get(RIGHT, ''), 'x', no_coordinates)
            wait_until(lambda: 'nowhere' in _problems(diagnostics).get(RIGHT, ''), 'tf', nowhere)
            self.wait_for(output, BOTH, self.send)

    def test_says_which_parameter_is_wrong_until_it_is_right(self) -> None:
        with log_listener() as log, Listener('/twice/fusion/output', PointCloud2) as output:
            wait_until(lambda: logged(log, Log.ERROR, '/twice/fusion/topics', 'different'),
                       'an error about the topics')
            rospy.set_param('/twice/fusion/topics', [LEFT])
            self.wait_for(output, {JOINED_LEFT}, self.send)


def _later(state: PlayerState) -> PlayerState:
    state.stamp = rospy.Time.now()
    return state


def _problems(diagnostics: Listener) -> 'dict[str, str]':
    """Return the current problem of each topic."""
    problems: 'dict[str, str]' = {}
    for status in (status for message in list(diagnostics.messages) for status in message.status):
        topic = status.name.split(': ')[-1]
        problems[topic] = status.message
        if status.level == DiagnosticStatus.OK:
            del problems[topic]
    return problems


if __name__ == '__main__':
    rospy.init_node('cloud_fusion_test')
    rostest.rosrun('process_visualizer', 'cloud_fusion_test', CloudFusionTest)
