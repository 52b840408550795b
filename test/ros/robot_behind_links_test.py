#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""A tool on tf behind links that only the cell's own nodes place: its velocity at a position."""
from __future__ import annotations

import math
import shutil
import time
import unittest
from pathlib import Path
from typing import List, Optional

import numpy as np
import rospy
import rostest
from cloud_testing import Listener, wait_until
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import PoseStamped, TwistStamped
from player_testing import Player, Row, temporary_folder, transform, write_bag
from robot_testing import array
from sensor_msgs.msg import JointState
from std_msgs.msg import Header
from std_srvs.srv import Trigger
from tf2_msgs.msg import TFMessage

from process_visualizer.cell.xml_parser import XmlParser
from process_visualizer.curves.curves import read_curves
from process_visualizer.msg import PlayerState
from process_visualizer.srv import Seek, SetRate, Step

LENGTH_MS = 9000
OFFSET_M = 2.0  # of joint_proc; it moves the tool, and leaves its velocity
NEAR_M_PER_S = 0.004  # of 0.45 m/s: joints are recorded at 100 Hz, and the slope is one over 0.2 s

MODEL = Path(__file__).resolve().with_name('maker_robot.urdf')
CELL = """<visualizer><device type="robot" name="r">
  <model path="{model}" /><base frame="left_base_link" /><tool frame="left_tool" />
  <topic ns="driver" name="array" type="joint_states" />
  <topic name="tf" type="tool_center_frame" msg="tf2_msgs/TFMessage" frame="{frame}" />
</device></visualizer>"""


def axis(time_s: float) -> float:
    """Where the linear axis is [m]."""
    return 0.3 * math.sin(1.5 * time_s)


def velocity(time_s: float) -> float:
    """Its velocity [m/s], seen through a window of 0.2 s."""
    times_s = time_s + np.linspace(-0.1, 0.1, 21)
    return float(np.polyfit(times_s, [axis(it) for it in times_s], 1)[0])


def rows(names: bool = True) -> List[Row]:
    """As a hand's driver has it: the tool behind its flange at 30 Hz, joints at 100 Hz."""
    found = []
    for time_ms in range(0, LENGTH_MS + 1, 33):
        for parent, child in (('left_tool', 'left_tip'), ('tool', 'bare_tip'),
                              ('my_left_tool', 'odd_tip')):
            tip = transform(child, time_ms)
            tip.header.frame_id, tip.transform.translation.x = parent, 0.1
            found.append(Row('/tf', time_ms + 2, TFMessage([tip])))
    for time_ms in range(0, LENGTH_MS + 1, 10):
        place, header = axis(time_ms / 1000.0), Header(stamp=transform('', time_ms).header.stamp)
        state = JointState(header=header, name=['left_axis'] if names else [], position=[place])
        found += [Row('/driver/joints', time_ms + 3, state),
                  Row('/driver/array', time_ms + 3, array(place))]
        pose = PoseStamped(header=Header(stamp=header.stamp, frame_id='cart'))
        pose.pose.position.x = pose.pose.orientation.w = 1.0
        found.append(Row('/driver/pose', time_ms + 4, pose))
    return sorted(found, key=lambda row: row.time_ms)


class Velocities:
    """What is published of a robot's velocity."""

    def __init__(self, robot: str) -> None:
        self.listener = Listener(f'/{robot}/tool_velocity', TwistStamped)

    def last(self) -> Optional[np.ndarray]:
        """The velocity that came last [m/s]."""
        messages = list(self.listener.messages)
        if not messages:
            return None
        linear = messages[-1].twist.linear
        return np.array([linear.x, linear.y, linear.z])

    def all(self) -> np.ndarray:
        """Those that came, along the axis [m/s]."""
        return np.array([message.twist.linear.y for message in list(self.listener.messages)])


class RobotBehindLinksTest(unittest.TestCase):
    """Goes to positions in all ways; whatever is published then is the velocity there."""

    @classmethod
    def setUpClass(cls) -> None:
        cls.folder = temporary_folder()
        cls.bag = write_bag(Path(cls.folder.name) / 'hand.bag', rows())
        cls.without = write_bag(Path(cls.folder.name) / 'without.bag',
                                [row for row in rows() if row.topic == '/tf'])
        cls.joints_only = write_bag(Path(cls.folder.name) / 'joints.bag',
                                    [row for row in rows() if row.topic == '/driver/joints'])

    @classmethod
    def tearDownClass(cls) -> None:
        cls.folder.cleanup()

    def player(self, bag: str) -> Player:
        """A player that stands at the beginning."""
        player = Player(bag, '--pause', '-k')
        self.addCleanup(player.__exit__, None, None, None)
        player.wait_for_state(lambda it: it.paused, 'the player runs')
        return player

    def check(self, player: Player, name: str, service: type, *arguments: object) -> PlayerState:
        """Give a command; what is published from then on is the velocity of the position."""
        answer = player.call(name, service, *arguments)
        self.assertTrue(answer.success, answer.message)
        now = rospy.Time.now()
        state = player.wait_for_state(lambda it: it.paused and it.stamp >= now, name)
        wanted = velocity(state.position)
        for robot in self.robots:
            robot.listener.messages.clear()
        for robot in self.robots:
            try:
                wait_until(lambda it=robot: it.last() is not None and abs(
                    it.last()[1] - wanted) < NEAR_M_PER_S, f'{name} at {state.position:.3f} s')
            except AssertionError as error:
                raise AssertionError(f'{error}: {wanted:.4f} m/s wanted, {robot.last()} came; now '
                                     f'at {player.states[-1].position:.3f} s') from error
        time.sleep(0.3)  # nothing else follows
        for robot in self.robots:
            found = np.abs(robot.all() - wanted) < NEAR_M_PER_S
            self.assertTrue(found[np.argmax(found):].all(), f'{name}: {robot.all()}, not {wanted}')
        return state

    def begin(self, *robots: str) -> Player:
        """Have a player, and look at some robots."""
        self.robots = [Velocities(robot) for robot in robots]
        return self.player(self.bag)

    def test_the_curves_of_the_launcher_say_the_same(self) -> None:
        path = Path(self.folder.name) / 'cell.xml'
        shutil.copy(MODEL, self.folder.name)
        for frame in ('left_tip', 'left_tool'):
            path.write_text(CELL.format(model=MODEL.name, frame=frame))
            devices = XmlParser().parse(str(path)).devices
            (curve,) = read_curves([self.bag], devices, columns=LENGTH_MS // 100)
            wanted = np.abs([velocity(time_s) for time_s in curve.times_s])
            self.assertLess(np.max(np.maximum(curve.low - wanted, wanted - curve.high)[2:-2]),
                            2.0 * NEAR_M_PER_S)  # arrays are recorded 3 ms late
            self.assertLess(np.max((curve.high - curve.low)[2:-2]), 0.1)

    def test_after_seeks_and_steps(self) -> None:
        player = self.begin('tip', 'array', 'cart', 'link', 'bare')
        for position_s in (4.0, 7.7, 0.5, 4.0):
            self.check(player, 'seek', Seek, position_s)
        for count in (1, -1, -20, 60):
            self.check(player, 'step', Step, count, '/driver/joints', 0.0)
        self.check(player, 'step', Step, 0, '', -0.3)

    def test_when_it_is_paused_while_it_plays(self) -> None:
        player = self.begin('tip', 'array', 'cart', 'link')
        for rate, begin_s in ((1.0, 1.0), (-1.0, 7.5), (4.0, 0.5), (0.25, 3.0)):
            player.call('set_rate', SetRate, rate)
            self.check(player, 'seek', Seek, begin_s)
            player.call('play', Trigger)
            player.wait_for_state(lambda it, at=begin_s: abs(it.position - at) > 0.4, 'it plays')
            self.check(player, 'pause', Trigger)

    def test_while_it_plays_each_velocity_is_the_one_of_its_stamp(self) -> None:
        player = self.begin('tip')
        for rate, begin_s in ((1.0, 1.0), (-1.0, 7.5), (4.0, 0.5)):
            player.call('set_rate', SetRate, rate)
            self.check(player, 'seek', Seek, begin_s)
            player.call('play', Trigger)
            begun = player.wait_for_state(lambda it: not it.paused, 'it plays')
            self.robots[0].listener.messages.clear()
            end = player.wait_for_state(
                lambda it, at=begin_s: not it.paused and abs(it.position - at) > 1.0
                and (it.stamp - it.since).to_sec() > 0.2, 'it is there')
            errors = self.errors(max(begun.stamp, end.since), end)
            player.call('pause', Trigger)
            self.assertGreater(len(errors), 3)
            self.assertLess(np.median(errors), NEAR_M_PER_S * max(abs(rate), 1.0))
            # on a busy machine a message or two go by the state before
            self.assertLess(np.quantile(errors, 0.8), 0.1)

    def errors(self, begun: rospy.Time, end: PlayerState) -> List[float]:
        """How far each velocity between a time and a state is from the one of its stamp [m/s].

        The position must have run evenly meanwhile.
        """
        return [abs(message.twist.linear.y - velocity(
            end.position - end.rate * (end.stamp - message.header.stamp).to_sec()))
            for message in list(self.robots[0].listener.messages)
            if begun < message.header.stamp < end.stamp]

    def test_a_recording_of_joints_alone(self) -> None:
        self.robots = [Velocities('link')]
        player = self.player(self.joints_only)
        for position_s in (4.0, 0.5):
            self.check(player, 'seek', Seek, position_s)

    def test_without_the_joints_there_is_none_and_it_is_said_why(self) -> None:
        diagnostics = Listener('/diagnostics', DiagnosticArray)
        player = self.player(self.without)
        tip = Velocities('tip')
        for position_s in (4.0, 6.0, 4.5):
            player.call('seek', Seek, position_s)
        wait_until(lambda: told(diagnostics, 'does not say where the tool is',
                                'record /driver/joints'), 'why there is no velocity')
        player.call('play', Trigger)
        player.wait_for_state(lambda it: it.position > 5.5, 'it plays')
        self.assertEqual(list(tip.listener.messages), [])

    def test_a_frame_with_a_prefix_that_the_model_lacks(self) -> None:
        diagnostics = Listener('/diagnostics', DiagnosticArray)
        self.player(self.bag)
        wait_until(lambda: told(diagnostics, 'my_left_tool left_tool', 'prefix="my_"'),
                   'what to write into the configuration')


def told(diagnostics: Listener, *parts: str) -> bool:
    """Return whether a node complains with some words."""
    return any(status.level == DiagnosticStatus.WARN
               and all(part in status.message for part in parts)
               for message in list(diagnostics.messages) for status in message.status)


if __name__ == '__main__':
    rospy.init_node('robot_behind_links_test')
    rostest.rosrun('process_visualizer', 'robot_behind_links_test', RobotBehindLinksTest)
