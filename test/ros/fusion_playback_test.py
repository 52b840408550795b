#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""CloudFusion's clouds of a recording match the position, however it was reached."""
from __future__ import annotations

import unittest
from pathlib import Path
from typing import List, Tuple

import numpy as np
import rospy
import rostest
from cloud_testing import Listener, make_cloud, wait_until
from player_testing import Player, Row, stamp, temporary_folder, write_bag
from sensor_msgs.msg import PointCloud2
from std_srvs.srv import Trigger

from process_visualizer.srv import Seek, SetRate

LENGTH_MS = 8000
RIGHT_BEGINS_MS = 4000
PERIODS_MS = {'left': 100, 'right': 200}


def rows() -> List[Row]:
    """Clouds of one point whose x [m] is its time [s]; the right sensor begins later."""
    found = []
    for sensor, begin_ms in (('left', 0), ('right', RIGHT_BEGINS_MS)):
        for time_ms in range(begin_ms, LENGTH_MS + 1, PERIODS_MS[sensor]):
            cloud = make_cloud([(time_ms / 1000 + 0.002, 0.002, 0.002)], sensor)
            cloud.header.stamp = stamp(time_ms - 30)
            found.append(Row(f'/{sensor}/points', time_ms, cloud))
    return sorted(found, key=lambda row: row.time_ms)


def times_of(cloud: PointCloud2) -> Tuple[float, ...]:
    """Return the times [s] of the points, that of the left sensor first."""
    points = np.frombuffer(cloud.data, '<f4').reshape(-1, cloud.point_step // 4)[:, :3]
    ordered = points[points[:, 1].argsort()]
    return tuple(np.round(ordered[:, 0].astype(float), 1).tolist())


class FusionPlaybackTest(unittest.TestCase):
    """Seeks and plays, and checks the joined clouds."""

    def test_joins_what_belongs_to_the_position(self) -> None:
        with temporary_folder() as folder:
            bag = write_bag(Path(folder) / 'clouds.bag', rows(), latched=())
            with Player('--pause', '--keep-alive', '-q', bag) as player, \
                    Listener('/cloud/fusion/output', PointCloud2) as output:
                player.call('seek', Seek, 5.0)
                wait_until(lambda: bool(output.messages), 'a first cloud')
                self.check_jumps(player, output)
                self.check_playing(player, output, 1.0, 4.5)
                self.check_playing(player, output, -1.0, 7.5)

    def check_jumps(self, player: Player, output: Listener) -> None:
        for position_s, expected in ((6.05, (6.0, 6.0)), (2.0, (2.0,)), (7.35, (7.3, 7.2)),
                                     (0.5, (0.5,)), (4.15, (4.1, 4.0))):
            player.call('seek', Seek, position_s)
            self.wait_for(output, expected)

    def wait_for(self, output: Listener, expected: Tuple[float, ...]) -> None:
        wait_until(lambda: times_of(output.messages[-1]) == expected, f'clouds of {expected}')

    def check_playing(self, player: Player, output: Listener, rate: float, begin_s: float) -> None:
        """While playing, both have nearly the same time, which passes in the right direction."""
        player.call('set_rate', SetRate, rate)
        player.call('seek', Seek, begin_s)
        begin = len(output.messages)
        player.call('play', Trigger)
        wait_until(lambda: len(output.messages) >= begin + 9, 'clouds while playing')
        player.call('pause', Trigger)
        found = [times_of(cloud) for cloud in output.messages[begin + 2:begin + 9]]
        self.assertTrue(all(len(times) == 2 for times in found), found)
        self.assertLess(max(abs(left - right) for left, right in found), 0.45, found)
        ordered = sorted(found, reverse=rate < 0)
        self.assertEqual(found, ordered)
        for cloud in output.messages[begin:]:
            self.assertLess(cloud.header.stamp, rospy.Time.now())


if __name__ == '__main__':
    rospy.init_node('fusion_playback_test')
    rostest.rosrun('process_visualizer', 'fusion_playback_test', FusionPlaybackTest)
