#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Display of robots in a recording with the real player; see test_nodes_robot_at_position."""
from __future__ import annotations

import math
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
from roslib.packages import find_node
from sensor_msgs.msg import JointState
from std_msgs.msg import Float32MultiArray, Header
from std_srvs.srv import Trigger
from tf2_msgs.msg import TFMessage

from process_visualizer.msg import PlayerState
from process_visualizer.srv import Seek, SetRate, Step

LENGTH_MS = 12_000
NEAR_M_PER_S = 0.004  # the slope is one over 0.2 s, and joints are recorded at 50 Hz


def place(time_s: float) -> Tuple[float, float, float]:
    """Return the tool's position [m]: it swings."""
    return -0.6 + 0.02 * time_s, 0.15 * math.sin(2.0 * time_s), 0.2


def axis(time_s: float) -> Tuple[float, float, float]:
    """Return the position of a tool on the linear axis [m]."""
    return 0.0, 0.3 * math.sin(1.5 * time_s), 0.0


def velocity(way: object, time_s: float) -> np.ndarray:
    """Return the velocity (3,) [m/s] along a path, averaged over a window of 0.2 s."""
    times_s = time_s + np.linspace(-0.1, 0.1, 21)
    return np.polyfit(times_s, [way(it) for it in times_s], 1)[0]


def rows() -> List[Row]:
    """Return poses at 125 Hz; transforms and a joint at 50 Hz, with stamps."""
    found = []
    for time_ms in range(0, LENGTH_MS + 1, 8):
        found.append(Row('/n/tcf', time_ms, Float32MultiArray(
            data=[*place(time_ms / 1000.0), 0.0, 0.0, 0.0])))
    for time_ms in range(0, LENGTH_MS + 1, 20):
        tip = transform('left_tip', time_ms)
        tip.header.frame_id, tip.transform.translation.x = 'left_tool', 0.1
        found.append(Row('/tf', time_ms + 4, TFMessage([tip])))
        found.append(Row('/driver/joints', time_ms + 4, JointState(
            header=Header(stamp=tip.header.stamp), name=['left_axis'],
            position=[axis(time_ms / 1000.0)[1]])))
    return sorted(found, key=lambda row: row.time_ms)


class Shown:
    """The velocity of a robot that was published last."""

    def __init__(self, robot: str) -> None:
        self._listener = Listener(f'/{robot}/tool_velocity', TwistStamped)

    def is_near(self, wanted: np.ndarray) -> bool:
        """Return whether it is the wanted one (3,) [m/s]."""
        found = self.last()
        return found is not None and np.abs(found - wanted).max() < NEAR_M_PER_S

    def last(self) -> Optional[np.ndarray]:
        """Return it (3,) [m/s]."""
        messages = list(self._listener.messages)
        if not messages:
            return None
        linear = messages[-1].twist.linear
        return np.array([linear.x, linear.y, linear.z])


class RobotAtPositionTest(unittest.TestCase):
    """Seeks, steps and plays in a recording of 12 s."""

    @classmethod
    def setUpClass(cls) -> None:
        cls.folder = temporary_folder()
        cls.bag = write_bag(Path(cls.folder.name) / 'robot.bag', rows())
        cls.robots = ((Shown('n'), place), (Shown('c'), axis))

    @classmethod
    def tearDownClass(cls) -> None:
        cls.folder.cleanup()

    def setUp(self) -> None:
        self.player = Player(self.bag, '--pause', '-k')
        self.addCleanup(self.player.__exit__, None, None, None)
        self.player.wait_for_state(lambda it: it.paused, 'the player runs')

    def command(self, name: str, service: type, *arguments: object) -> None:
        """Give a command; the robots then show the velocity at the position of playback."""
        answer = self.player.call(name, service, *arguments)
        self.assertTrue(answer.success, answer.message)
        now = rospy.Time.now()
        state: PlayerState = self.player.wait_for_state(
            lambda it: it.paused and it.stamp >= now, name)
        for shown, way in self.robots:
            self.wait_for(shown, velocity(way, state.position), f'{name} at {state.position:.3f} s')

    @staticmethod
    def wait_for(shown: Shown, wanted: np.ndarray, what: str) -> None:
        """Wait until a robot shows a velocity."""
        wait_until(lambda: shown.is_near(wanted), f'{what}: {wanted} m/s')

    def test_after_seeks_and_steps(self) -> None:
        for position_s in (4.0, 11.5, 0.5):
            self.command('seek', Seek, position_s)
        for count in (1, -40):
            self.command('step', Step, count, '/driver/joints', 0.0)

    def test_when_it_is_paused_while_it_plays(self) -> None:
        for rate, begin_s in ((1.0, 1.0), (-1.0, 7.5), (4.0, 0.5)):
            self.player.call('set_rate', SetRate, rate)
            self.command('seek', Seek, begin_s)
            self.player.call('play', Trigger)
            self.player.wait_for_state(lambda it, at=begin_s: abs(it.position - at) > 0.4,
                                       'it plays')
            self.command('pause', Trigger)

    def test_a_robot_processor_that_is_started_while_paused(self) -> None:
        self.command('seek', Seek, 6.0)
        shown = Shown('late')
        with robot_processor('late', '/n/tcf'):
            self.wait_for(shown, velocity(place, 6.0), 'the late one')


@contextmanager
def robot_processor(namespace: str, topic: str) -> Iterator[None]:
    """Run a separate robot processor."""
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
