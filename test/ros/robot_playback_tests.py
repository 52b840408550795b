# SPDX-License-Identifier: BSD-3-Clause
"""A robot in playback: velocities in the time of the recording, and pauses."""
from __future__ import annotations

import time
import unittest

import numpy as np
import rospy
from cloud_testing import TIMEOUT_S, Listener, wait_until
from geometry_msgs.msg import TwistStamped
from player_testing import serialised
from robot_testing import (
    array,
    last_markers,
    median_velocity,
    move_while,
    publisher,
)
from std_msgs.msg import Float32MultiArray
from visualization_msgs.msg import MarkerArray

from process_visualizer.msg import PlayerState
from process_visualizer.srv import ReadTopic, ReadTopicRequest, ReadTopicResponse

RATE_PARAMETER = '/process_visualizer/playback_rate'


def player_state(position_s: float, rate: float, segment: int, paused: bool = False
                 ) -> PlayerState:
    """Return what a player says now."""
    return PlayerState(stamp=rospy.Time.now(), position=position_s, rate=rate, segment=segment,
                       paused=paused, duration=60.0)


def recorded(request: ReadTopicRequest) -> ReadTopicResponse:
    """Answer with a recording of 60 s of a tool that moves at 0.1 m/s along +y."""
    times_s = [number / 125 for number in range(60 * 125)
               if request.begin <= number / 125 <= request.end]
    messages = [serialised(array(-0.6, 0.1 * time_s, 0.2, np.pi, 0.0, 0.0)) for time_s in times_s]
    return ReadTopicResponse(
        success=request.topic == '/p/tcf', type=Float32MultiArray._type, end=request.end,
        positions=times_s, sizes=list(map(len, messages)), data=b''.join(messages))


def play(states: rospy.Publisher, tool: rospy.Publisher, position_s: float, segment: int) -> float:
    """Play 2 s (wall) of that recording; return the position [s]."""
    start_s, ticker, tick = time.monotonic(), rospy.Rate(125), 0
    now_s = position_s
    while time.monotonic() < start_s + 2.0:
        now_s = position_s + (time.monotonic() - start_s)
        if tick % 10 == 0:
            states.publish(player_state(now_s, 1.0, segment))
        tool.publish(array(-0.6, 0.1 * now_s, 0.2, np.pi, 0.0, 0.0))
        ticker.sleep()
        tick += 1
    return now_s


class RobotPlaybackTest(unittest.TestCase):
    """Plays the player."""

    def tearDown(self) -> None:
        rospy.set_param(RATE_PARAMETER, 1.0)

    def test_data_is_not_stale_while_playback_is_paused(self) -> None:
        reading = rospy.Service('/p/player_read', ReadTopic, recorded)
        self.addCleanup(reading.shutdown)
        tool = publisher('/p/tcf', Float32MultiArray)
        states = publisher('/p/player_state', PlayerState)
        with Listener('/p/marker_array', MarkerArray) as arrays:
            position = play(states, tool, 10.0, 2)
            rate, paused_s = rospy.Rate(20), time.monotonic()
            while time.monotonic() < paused_s + 2.5:
                states.publish(player_state(position, 1.0, 2, paused=True))
                rate.sleep()
            self.assertRegex(last_markers(arrays)['velocity', 1].text, r'^v 0\.100 m/s')
            wait_until(lambda: 'no data' in last_markers(arrays)['velocity', 1].text,
                       'a stale velocity once the player is gone')

    def test_playback_rate_scales_the_time_while_it_changes(self) -> None:
        tool = publisher('/r/tcf', Float32MultiArray)
        with Listener('/r/tool_velocity', TwistStamped) as velocities:
            for rate in (2.0, -1.0, 0.5):
                rospy.set_param(RATE_PARAMETER, rate)
                velocities.messages.clear()
                # 1.5 s; on a loaded machine longer, as the last 80 are to be of this rate
                end_s = time.monotonic() + TIMEOUT_S
                move_while(lambda at=end_s: len(velocities.messages) < 187
                           and time.monotonic() < at, tool, 0.1)
                self.assertAlmostEqual(median_velocity(velocities)[1], 0.1 / rate, delta=0.02)
