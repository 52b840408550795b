#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Scans agree with the robot backwards, at each rate."""
from __future__ import annotations

import statistics
import unittest
from pathlib import Path
from typing import List

import numpy as np
import rospy
import rostest
from player_testing import Listener, Player, Row, stamp, temporary_folder, write_bag
from sensor_msgs.msg import LaserScan
from std_msgs.msg import Float32MultiArray
from std_srvs.srv import Trigger

from process_visualizer.srv import Seek, SetRate

LENGTH_MS, SCAN_MS, ROBOT_MS = 4000, 33, 8
AGE_MS = 25
"""How old a scan is when it is recorded."""


def rows() -> List[Row]:
    """A robot without stamps, and scans; each has the time [s] at which it was measured."""
    found = [Row('/robot', time_ms, Float32MultiArray(data=[time_ms / 1000.0]))
             for time_ms in range(0, LENGTH_MS, ROBOT_MS)]
    for time_ms in range(0, LENGTH_MS - AGE_MS, SCAN_MS):
        scan = LaserScan(ranges=[time_ms / 1000.0])
        scan.header.stamp = stamp(time_ms)
        found.append(Row('/scan', time_ms + AGE_MS, scan))
    return sorted(found, key=lambda row: row.time_ms)


def apart_s(heard: Listener) -> List[float]:
    """How far [s of the recording] the robot was from each scan at the stamp of the scan."""
    states = [(it.time_s, Float32MultiArray().deserialize(it.data).data[0])
              for it in heard.received if it.topic == '/robot']
    walls, places = np.array(states).T
    scans = [LaserScan().deserialize(data) for data in heard.of('/scan')]
    return [abs(float(np.interp(scan.header.stamp.to_sec(), walls, places)) - scan.ranges[0])
            for scan in scans[3:-3]]


class SensorPlaybackTest(unittest.TestCase):
    """Plays a recording of a robot and a scanner."""

    def test_scans_agree_with_the_robot(self) -> None:
        with temporary_folder() as folder:
            bag = write_bag(Path(folder) / 'scans.bag', rows(), latched=())
            with Player('--pause', '--keep-alive', '-q', bag) as player, \
                    Listener('/robot', '/scan') as heard:
                for rate in (1.0, -1.0, -0.5, -2.0):
                    self.check_playing(player, heard, rate)

    def check_playing(self, player: Player, heard: Listener, rate: float) -> None:
        player.call('pause', Trigger)
        player.call('seek', Seek, 0.5 if rate > 0 else 3.5)
        player.call('set_rate', SetRate, rate)
        player.call('play', Trigger)
        player.wait_for_state(lambda it: not it.paused and it.rate == rate, 'it plays')
        heard.clear()
        heard.wait_for(lambda: len(heard.of('/scan')) > 40, 'scans')
        apart = statistics.median(apart_s(heard))
        self.assertLess(apart, 1.5 * ROBOT_MS / 1000, f'at {rate}x')


if __name__ == '__main__':
    rospy.init_node('sensor_playback_test')
    rostest.rosrun('process_visualizer', 'sensor_playback_test', SensorPlaybackTest)
