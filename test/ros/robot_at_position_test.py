#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""What a robot shows of a recording is that of the position, however one came there."""
from __future__ import annotations

import math
import random
import signal
import subprocess
import unittest
from contextlib import contextmanager
from pathlib import Path
from typing import Iterator, List, Optional, Tuple

import numpy as np
import rospy
import rostest
from cloud_testing import TIMEOUT_S, Listener, wait_until
from geometry_msgs.msg import TwistStamped
from player_testing import Player, Row, temporary_folder, transform, write_bag
from robot_testing import array
from roslib.packages import find_node
from sensor_msgs.msg import JointState
from std_msgs.msg import Header
from std_srvs.srv import Trigger
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import MarkerArray

from process_visualizer.motion.velocity.recorded_velocity import RecordedVelocity
from process_visualizer.motion.velocity.speed_series import measuring_times, speeds
from process_visualizer.msg import PlayerState
from process_visualizer.srv import Seek, SetRate, Step

LENGTH_MS, GAP_MS = 12_000, (8_000, 10_500)
CART_M_PER_S = 0.1
NEAR_M_PER_S = 2e-4  # what a print of a float32 position may make of a velocity


def place(time_ms: float) -> Tuple[float, float, float]:
    """Where the tool is [m]: it swings, slower and faster."""
    time_s = time_ms / 1000.0
    return -0.6 + 0.02 * time_s, 0.15 * math.sin(2.0 * time_s), 0.2 + 0.05 * math.cos(time_s ** 1.5)


def rows() -> List[Row]:
    """Poses at 125 Hz but for a gap, some late; transforms and a joint at 50 Hz, with stamps."""
    late = random.Random(3)
    found, free_ms = [], 0
    for time_ms in range(0, LENGTH_MS + 1, 8):
        if not GAP_MS[0] < time_ms < GAP_MS[1]:
            free_ms = max(free_ms, time_ms + (late.randrange(60) if late.random() < 0.03 else 0))
            found.append(Row('/n/tcf', free_ms, array(*place(time_ms), 0.0, 0.0, time_ms / 2000)))
    for time_ms in range(0, LENGTH_MS + 1, 20):
        link = transform('t/flange', time_ms)
        link.header.frame_id = 't/base'
        link.transform.translation.x, link.transform.translation.y, _ = place(time_ms)
        found.append(Row('/tf', time_ms + 3, TFMessage([link])))
        tip = transform('left_tip', time_ms)
        tip.header.frame_id, tip.transform.translation.x = 'left_tool', 0.1
        found.append(Row('/tf', time_ms + 4, TFMessage([tip])))
        joints = JointState(header=Header(stamp=tip.header.stamp), name=['axis'],
                            position=[CART_M_PER_S * time_ms / 1000.0])
        found.append(Row('/c/joint_states', time_ms + 4, joints))
    tip = transform('t/tip', 0)
    tip.header.frame_id, tip.transform.translation.x = 't/flange', 0.25
    return sorted([*found, Row('/tf_static', 0, TFMessage([tip]))], key=lambda row: row.time_ms)


class Truth:
    """What the curves of the launcher say of the recording."""

    def __init__(self, recording: List[Row]) -> None:
        poses = [row for row in recording if row.topic == '/n/tcf']
        times_s = measuring_times(np.array([row.time_ms / 1000.0 for row in poses]),
                                  np.full(len(poses), np.nan))
        positions = np.float32([row.message.data[:3] for row in poses]).astype(float)
        self.recorded = RecordedVelocity(times_s, positions)
        self.curve = speeds(times_s, positions)

    def velocity(self, position_s: float) -> Optional[Tuple[float, float, float]]:
        """The velocity at a position."""
        return self.recorded.velocity(position_s)


class Screen:
    """What is shown and published of a robot, as the last message of each says it."""

    def __init__(self, robot: str) -> None:
        self.velocities = Listener(f'/{robot}/tool_velocity', TwistStamped)
        self.arrays = Listener(f'/{robot}/marker_array', MarkerArray)

    def velocity(self) -> Optional[np.ndarray]:
        """The velocity that was published last."""
        if not self.velocities.messages:
            return None
        linear = self.velocities.messages[-1].twist.linear
        return np.array([linear.x, linear.y, linear.z])

    def speed(self) -> Optional[float]:
        """The number that RViz shows; none if it shows none."""
        shown = {}
        for message in list(self.arrays.messages):
            shown.update({marker.ns: marker for marker in message.markers if marker.id == 1})
        text = shown['velocity'].text.strip() if 'velocity' in shown else ''
        return float(text.split()[1]) if text.endswith(' m/s') else None

    def clear(self) -> None:
        """Forget what was published; what is shown stays."""
        self.velocities.messages.clear()


class RobotAtPositionTest(unittest.TestCase):
    """Moves in a recording of 12 s with a gap of 2.5 s."""

    @classmethod
    def setUpClass(cls) -> None:
        cls.folder = temporary_folder()
        recording = rows()
        cls.truth = Truth(recording)
        cls.bag = write_bag(Path(cls.folder.name) / 'robot.bag', recording)

    @classmethod
    def tearDownClass(cls) -> None:
        cls.folder.cleanup()

    def setUp(self) -> None:
        self.screen = Screen('n')

    def assert_shown(self, position_s: float, truth: Optional[np.ndarray] = None) -> None:
        """The velocity of a position is shown, published, and the one of the curve."""
        wanted = self.truth.velocity(position_s) if truth is None else truth
        wait_until(lambda: self._is_near(self.screen.velocity(), wanted),
                   f'{wanted} at {position_s:.3f} s; it was {self.screen.velocity()}')
        wait_until(lambda: self.screen.speed() is not None and
                   abs(self.screen.speed() - np.linalg.norm(wanted)) < 0.0011,
                   f'{np.linalg.norm(wanted)} in RViz, not {self.screen.speed()}')

    @staticmethod
    def _is_near(found: Optional[np.ndarray], wanted: object) -> bool:
        return found is not None and np.abs(found - wanted).max() < NEAR_M_PER_S

    def paused_player(self) -> Player:
        """A player that stands at the beginning."""
        player = Player(self.bag, '--pause', '-k')
        self.addCleanup(player.__exit__, None, None, None)
        player.wait_for_state(lambda it: it.paused, 'the player runs')
        return player

    def command(self, player: Player, name: str, service: type, *arguments: object) -> PlayerState:
        """Give a command; return the state in which playback stands after it."""
        self.screen.clear()
        answer = player.call(name, service, *arguments)
        self.assertTrue(answer.success, answer.message)
        now = rospy.Time.now()
        return player.wait_for_state(lambda it: it.paused and it.stamp >= now, name)

    def test_after_a_seek(self) -> None:
        player = self.paused_player()
        for position_s in (4.0, 7.9, 0.0, 11.95, 0.02, 4.0, 5.5, 12.0):
            self.command(player, 'seek', Seek, position_s)
            self.assert_shown(position_s)

    def test_after_single_steps_in_both_directions(self) -> None:
        player = self.paused_player()
        self.command(player, 'seek', Seek, 3.0)
        for count in (1, 1, 1, -1, -1, 5, -40, 250, -1):
            state = self.command(player, 'step', Step, count, '/n/tcf', 0.0)
            self.assert_shown(state.position)
        for duration_s in (0.1, -0.3, 2.0):
            state = self.command(player, 'step', Step, 0, '', duration_s)
            self.assert_shown(state.position)

    def test_when_it_is_paused_while_it_plays(self) -> None:
        player = self.paused_player()
        for rate, begin_s in ((1.0, 1.0), (-1.0, 7.5), (4.0, 0.5), (0.25, 3.0)):
            player.call('set_rate', SetRate, rate)
            self.command(player, 'seek', Seek, begin_s)
            player.call('play', Trigger)
            player.wait_for_state(lambda it, at=begin_s: abs(it.position - at) > 0.4, 'it plays')
            state = self.command(player, 'pause', Trigger)
            self.assert_shown(state.position)

    def test_scrubbing_leaves_the_velocity_of_the_last_position(self) -> None:
        player = self.paused_player()
        for position_s in np.linspace(1.0, 6.0, 60):
            player.call('seek', Seek, position_s)
        self.assert_shown(6.0)

    def test_while_it_plays_each_velocity_is_the_one_of_its_stamp(self) -> None:
        player = self.paused_player()
        for rate, begin_s in ((1.0, 1.0), (-1.0, 7.5), (8.0, 0.0)):
            player.call('set_rate', SetRate, rate)
            self.command(player, 'seek', Seek, begin_s)
            player.call('play', Trigger)
            begun = player.wait_for_state(lambda it: not it.paused, 'it plays')
            end = player.wait_for_state(
                lambda it, at=begin_s: not it.paused and abs(it.position - at) > 2.0, 'it is there')
            self.check_played(begun, end)
            player.call('pause', Trigger)
            state = player.wait_for_state(lambda it: it.paused, 'it stands')
            self.assert_shown(state.position)

    def check_played(self, begun: PlayerState, end: PlayerState) -> None:
        """Between two states the position is known at every stamp, but where playback slipped."""
        errors = []
        for message in list(self.screen.velocities.messages):
            ago_s = (end.stamp - message.header.stamp).to_sec()
            wanted = self.truth.velocity(end.position - end.rate * ago_s)
            if begun.stamp < message.header.stamp < end.stamp and wanted is not None:
                linear = message.twist.linear
                errors.append(np.abs(np.subtract([linear.x, linear.y, linear.z], wanted)).max())
        self.assertGreater(len(errors), 5)
        self.assertLess(np.median(errors), 0.003 * max(abs(end.rate), 1.0))

    def test_it_is_the_curve_of_the_launcher(self) -> None:
        player = self.paused_player()
        times_s, curve = self.truth.curve
        for position_s in (0.5, 2.2, 6.6, 11.0):
            self.command(player, 'seek', Seek, position_s)
            self.assert_shown(position_s)
            self.assertAlmostEqual(np.linalg.norm(self.screen.velocity()),
                                   np.interp(position_s, times_s, curve), delta=1e-3)

    def test_where_poses_are_missing_no_velocity_is_shown(self) -> None:
        player = self.paused_player()
        self.command(player, 'seek', Seek, 4.0)
        self.assert_shown(4.0)
        self.command(player, 'seek', Seek, 8.4)
        wait_until(lambda: self.screen.speed() is None, 'no velocity in the gap')
        self.assertEqual(self.screen.velocities.messages, [])
        self.command(player, 'seek', Seek, 9.5)
        wait_until(lambda: 'no data for 1.5 s' in self.text(), 'since when there are no poses')
        self.command(player, 'seek', Seek, 11.0)
        self.assert_shown(11.0)

    def text(self) -> str:
        """What stands in RViz beside the arrow."""
        texts = [marker.text for message in list(self.screen.arrays.messages)
                 for marker in message.markers if (marker.ns, marker.id) == ('velocity', 1)]
        return texts[-1] if texts else ''

    def test_a_subscriber_that_comes_later_gets_it(self) -> None:
        player = self.paused_player()
        self.command(player, 'seek', Seek, 5.0)
        self.assert_shown(5.0)
        self.screen = Screen('n')
        self.assert_shown(5.0)

    def test_another_recording_is_another_one(self) -> None:
        self.command(self.paused_player(), 'seek', Seek, 4.0)
        self.assert_shown(4.0)
        self.doCleanups()
        still = [Row('/n/tcf', time_ms, array(0.1, 0.2, 0.3, 0.0, 0.0, 0.0))
                 for time_ms in range(0, 6000, 8)]
        bag = write_bag(Path(self.folder.name) / 'still.bag', still)
        with Player(bag, '--pause', '-k') as player:
            self.command(player, 'seek', Seek, 4.0)
            self.assert_shown(4.0, np.zeros(3))

    def test_a_robot_processor_that_is_restarted_while_paused(self) -> None:
        player = self.paused_player()
        self.command(player, 'seek', Seek, 6.0)
        self.assert_shown(6.0)
        self.screen = Screen('late')
        with robot_processor('late', '/n/tcf'):
            self.assert_shown(6.0)

    def test_a_tool_on_tf(self) -> None:
        self.screen = Screen('t')
        player = self.paused_player()
        for position_s in (4.0, 11.0, 0.5):
            self.command(player, 'seek', Seek, position_s)
            before, after = (np.array(place(1000 * (position_s + by))) for by in (-0.05, 0.05))
            wait_until(lambda at=(after - before)[:2] / 0.1: self.screen.velocity() is not None and
                       np.abs(self.screen.velocity()[:2] - at).max() < 0.005, str(position_s))

    def test_a_tool_on_tf_behind_links_that_the_cell_sends(self) -> None:
        """The recording holds none of them, but the joints."""
        self.screen = Screen('c')
        player = self.paused_player()
        player.call('play', Trigger)
        wait_until(lambda: self.screen.velocity() is not None and
                   np.abs(self.screen.velocity() - (0.0, CART_M_PER_S, 0.0)).max() < 0.01,
                   'the velocity of the joint')

    def test_poses_in_the_frame_of_the_maker(self) -> None:
        self.screen = Screen('m')
        player = self.paused_player()
        for position_s in (4.0, 11.0, 0.5):
            self.command(player, 'seek', Seek, position_s)
            self.assert_shown(position_s, np.multiply(self.truth.velocity(position_s), (-1, -1, 1)))


@contextmanager
def robot_processor(namespace: str, topic: str) -> Iterator[None]:
    """A robot processor of its own, running meanwhile."""
    process = subprocess.Popen([find_node('process_visualizer', 'robot_proc')[0],
                                f'__ns:=/{namespace}', '_base_frame:=n/base',
                                f'_topics/tool_center_frame/name:={topic}'],
                               stdin=subprocess.DEVNULL)
    try:
        yield
    finally:
        process.send_signal(signal.SIGINT)
        process.wait(TIMEOUT_S)


if __name__ == '__main__':
    rospy.init_node('robot_at_position_test')
    rostest.rosrun('process_visualizer', 'robot_at_position_test', RobotAtPositionTest)
