#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The ghost is where the other run was at the player's position, at once and in any order."""
from __future__ import annotations

import math
import random
import threading
import unittest
from typing import Callable, Dict, List, Optional

import numpy as np
import rospy
import rostest
from visualization_msgs.msg import Marker, MarkerArray

from process_visualizer.clients.ghost_client import GhostError, show_ghost
from process_visualizer.motion.joint_track import joint_track
from process_visualizer.msg import PlayerState
from process_visualizer.nodes.ghost.ghost_arrow import BESIDE_M
from process_visualizer.ros_names import GHOST, GHOST_TOPIC, PLAYER_STATE_TOPIC
from process_visualizer.runs.comparison.ghost_arrows import GhostArrow
from process_visualizer.runs.comparison.ghost_tracks import GhostTrack

TIMEOUT_S = 20.0
LENGTH_M = 1.3
ARM = f'''<robot name="arm">
  <link name="foot"/><link name="upper"/>
  <link name="tool"><visual><geometry><sphere radius="0.1"/></geometry></visual></link>
  <joint name="turn" type="revolute"><parent link="foot"/><child link="upper"/>
    <axis xyz="1 0 0"/></joint>
  <joint name="hand" type="fixed"><parent link="upper"/><child link="tool"/>
    <origin xyz="0 0 {LENGTH_M}"/></joint>
</robot>'''
TIMES_S = np.append(np.arange(0.0, 20.0, 0.02), 20.0)


def angle_rad(time_s: np.ndarray) -> np.ndarray:
    return np.asarray(1.5 * np.sin(0.7 * time_s))


def track(device: str = 'arm') -> GhostTrack:
    """Nothing from 10 s to 12 s."""
    positions = angle_rad(TIMES_S)
    positions[(TIMES_S >= 10.0) & (TIMES_S <= 12.0)] = np.nan
    return GhostTrack(device, 'tool', joint_track(('turn',), TIMES_S, positions),
                      (positions + 0.002)[:, np.newaxis])


class GhostTest(unittest.TestCase):
    """With a player that says what the test wants."""

    def setUp(self) -> None:
        self.markers: Dict[str, Marker] = {}
        self.changed = threading.Condition()
        self.player = rospy.Publisher(PLAYER_STATE_TOPIC, PlayerState, queue_size=10)
        self.ear = rospy.Subscriber(GHOST_TOPIC, MarkerArray, self.take)
        rospy.set_param('/arm/robot_description', ARM)
        rospy.wait_for_service(f'/{GHOST}/show', TIMEOUT_S)
        self.assertTrue(self.wait(lambda: self.player.get_num_connections() > 0))

    def tearDown(self) -> None:
        show_ghost(())
        self.ear.unregister()

    def take(self, message: MarkerArray) -> None:
        with self.changed:
            if message.markers[0].action == Marker.DELETEALL:
                self.markers = {}
            else:
                self.markers = {f'{it.ns} {it.id}': it for it in message.markers}
            self.changed.notify_all()

    def wait(self, condition: Callable[[], bool], timeout_s: float = TIMEOUT_S) -> bool:
        with self.changed:
            end_s = rospy.get_time() + timeout_s
            while not condition() and rospy.get_time() < end_s:
                self.changed.wait(0.05)
            return condition()

    def say(self, position_s: float, rate: float = 0.0) -> None:
        """As the player does: paused at a position, or playing from there on."""
        now = rospy.Time.now()
        self.player.publish(PlayerState(stamp=now, since=now, position=position_s,
                                        rate=rate or 1.0, paused=rate == 0.0,
                                        duration=TIMES_S[-1]))

    def error_m(self, position_s: float) -> Optional[float]:
        """How far the ghost's tool is from where it should be; None if it is not drawn."""
        tool = self.markers.get('arm/ghost 0')
        if tool is None:
            return None
        angle = float(angle_rad(np.array(position_s)))
        place = tool.pose.position
        return math.hypot(place.y + LENGTH_M * math.sin(angle),
                          place.z - LENGTH_M * math.cos(angle))

    def test_it_is_at_each_of_a_hundred_positions(self) -> None:
        show_ghost((track(),))
        chance = random.Random(16)
        worst = 0.0
        for _ in range(100):
            position_s = chance.choice((chance.uniform(0.0, 9.9), chance.uniform(12.1, 20.0)))
            self.say(position_s)
            self.assertTrue(self.wait(lambda at_s=position_s: (self.error_m(at_s) or 0.0) < 1e-3
                                      and self.error_m(at_s) is not None), position_s)
            worst = max(worst, self.error_m(position_s) or 0.0)
        print(f'100 positions: at most {1000.0 * worst:.3f} mm')
        self.assertLess(worst, 1e-3)
        text = self.markers['arm/deviation 1']
        self.assertEqual(text.text, f'Δ {2.0 * LENGTH_M:.1f} mm')

    def test_it_moves_while_it_plays_forward_and_backwards(self) -> None:
        show_ghost((track(),))
        for position_s, rate in ((2.0, 1.0), (9.0, -2.0)):
            self.say(position_s, rate)
            found: List[float] = []
            begin_s = rospy.get_time()
            for _ in range(15):
                before = self.markers.get('arm/ghost 0')
                self.assertTrue(self.wait(lambda it=before: self.markers.get('arm/ghost 0')
                                          is not it))
                at_s = position_s + rate * (rospy.get_time() - begin_s)
                found.append(self.error_m(at_s) or 0.0)
                self.say(at_s, rate)
                begin_s, position_s = rospy.get_time(), at_s
            speed = 1.5 * 0.7 * LENGTH_M * abs(rate)
            self.assertLess(sorted(found)[len(found) // 2] / speed, 0.05)

    def test_its_arrows_are_there_too(self) -> None:
        """One on the tool, as long as the time; one in a frame of no robot."""
        vectors = np.column_stack((np.zeros((len(TIMES_S), 2)), 0.01 * TIMES_S + 0.1))
        show_ghost((track(),), (
            GhostArrow('arm/force', 'tool', 'tool', (0.0, 0.0, 0.0), TIMES_S, vectors),
            GhostArrow('machine/feed', 'table', 'table', (1.0, 2.0, 3.0), TIMES_S, vectors)))
        for position_s in (4.0, 13.0, 9.0):
            self.say(position_s)
            self.assertTrue(self.wait(lambda at_s=position_s: self.length_error_m(at_s) < 1e-4),
                            position_s)
            force, feed = self.markers['arm/force/ghost 0'], self.markers['machine/feed/ghost 0']
            self.assertEqual((force.header.frame_id, feed.header.frame_id), ('foot', 'table'))
            self.assertAlmostEqual(force.scale.x, feed.scale.x)
            foot, tool = force.pose.position, self.markers['arm/ghost 0'].pose.position
            self.assertAlmostEqual(math.dist((foot.x, foot.y, foot.z), (tool.x, tool.y, tool.z)),
                                   BESIDE_M, 6)
        with self.assertRaisesRegex(GhostError, 'feed: .* positions of 3 joints at'):
            show_ghost((), (GhostArrow('feed', 'a', 'a', (0.0, 0.0, 0.0), TIMES_S, vectors[:9]),))

    def length_error_m(self, position_s: float) -> float:
        """How much longer or shorter than it should be the arrow is."""
        arrow = self.markers.get('arm/force/ghost 0')
        return math.inf if arrow is None else abs(arrow.scale.x - 0.01 * position_s - 0.1)

    def test_where_there_is_no_run_there_is_no_ghost(self) -> None:
        show_ghost((track(),))
        self.say(5.0)
        self.assertTrue(self.wait(lambda: bool(self.markers)))
        self.say(11.0)
        self.assertTrue(self.wait(lambda: not self.markers))
        self.say(13.0)
        self.assertTrue(self.wait(lambda: bool(self.markers)))
        show_ghost(())
        self.assertTrue(self.wait(lambda: not self.markers))

    def test_it_goes_with_the_player(self) -> None:
        show_ghost((track(),))
        self.say(5.0)
        self.assertTrue(self.wait(lambda: bool(self.markers)))
        self.assertTrue(self.wait(lambda: not self.markers))  # which says nothing any more

    def test_what_cannot_be_shown_is_told(self) -> None:
        with self.assertRaisesRegex(GhostError, 'leg: there is no parameter /leg/robot_desc'):
            show_ghost((track('leg'),))
        rospy.set_param('/bad/robot_description', '<robot')
        with self.assertRaisesRegex(GhostError, 'bad: not well-formed XML'):
            show_ghost((track('bad'),))
        wrong = track()
        with self.assertRaisesRegex(GhostError, 'arm: .* positions of 1 joints at'):
            show_ghost((wrong._replace(here=wrong.here[:5]),))


if __name__ == '__main__':
    rospy.init_node('ghost_test')
    rostest.rosrun('process_visualizer', 'ghost_test', GhostTest)
