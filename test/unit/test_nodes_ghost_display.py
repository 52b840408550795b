# SPDX-License-Identifier: BSD-3-Clause
"""The ghost has the other run's pose at the player's position, at once and in any order."""
from __future__ import annotations

import math
import random
from typing import Dict, Optional, Sequence

import numpy as np
import pytest
from rospy import Time
from sensor_msgs.msg import JointState
from simulated_node import SimulatedNode
from std_msgs.msg import Header
from visualization_msgs.msg import Marker

from process_visualizer.clients.ghost_client import ghost_request
from process_visualizer.msg import PlayerState
from process_visualizer.nodes.common.markers import LIFETIME_S
from process_visualizer.nodes.ghost.ghost_display import RATE_HZ, GhostDisplay
from process_visualizer.nodes.ghost.ghost_robot import BESIDE_M
from process_visualizer.robot.joints import joint_track
from process_visualizer.ros_names import GHOST_TOPIC, PLAYER_STATE_TOPIC
from process_visualizer.runs.comparison.ghost import GhostTrack, ReferenceArrow

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
PICTURE_S = 1.001 / RATE_HZ


def angle_rad(time_s: np.ndarray) -> np.ndarray:
    return np.asarray(1.5 * np.sin(0.7 * time_s))


def track(device: str = 'arm') -> GhostTrack:
    """A track with no data from 10 s to 12 s."""
    positions = angle_rad(TIMES_S)
    positions[(TIMES_S >= 10.0) & (TIMES_S <= 12.0)] = np.nan
    return GhostTrack(device, 'tool', joint_track(('turn',), TIMES_S, positions),
                      (positions + 0.002)[:, np.newaxis])


class Scene:
    """The node, a player that the test controls, and RViz's state."""

    def __init__(self) -> None:
        self.node = SimulatedNode('/ghost', {'/arm/robot_description': ARM})
        GhostDisplay(self.node)
        self.markers: Dict[str, Marker] = {}

    def show(self, tracks: Sequence[GhostTrack], arrows: Sequence[ReferenceArrow] = ()) -> str:
        """Show tracks and arrows; return the reason of a refusal, '' if accepted."""
        answer = self.node.call('~show', ghost_request(tracks, arrows))
        assert answer.success == (answer.message == '')
        return str(answer.message)

    def say(self, position_s: float, rate: float = 0.0, segment: int = 0) -> None:
        """Send a player state: paused at a position, or playing from there on."""
        now = self.node.now()
        self.node.send(PLAYER_STATE_TOPIC, PlayerState(
            stamp=now, since=now, position=position_s, rate=rate or 1.0, paused=rate == 0.0,
            segment=segment, duration=TIMES_S[-1]))

    def draw_robot(self, stamp_s: float) -> None:
        """Send joint states with this stamp, which move the robot's picture only now."""
        self.node.send('/arm/joint_states', JointState(
            Header(stamp=Time.from_sec(stamp_s)), ['turn'], [0.0], [], []))

    def wait(self, duration_s: float = PICTURE_S) -> int:
        """Let time pass, and draw; return the number of messages received."""
        self.node.advance(duration_s)
        arrived = self.node.sent(GHOST_TOPIC)
        for message in arrived:
            if message.markers[0].action == Marker.DELETEALL:
                self.markers = {}
            else:
                self.markers = {f'{it.ns} {it.id}': it for it in message.markers}
        count = len(arrived)
        arrived.clear()
        return count

    def error_m(self, position_s: float) -> Optional[float]:
        """The distance of the ghost's tool from its expected position; None if it is not drawn."""
        tool = self.markers.get('arm/ghost 0')
        if tool is None:
            return None
        angle = float(angle_rad(np.array(position_s)))
        place = tool.pose.position
        return math.hypot(place.y + LENGTH_M * math.sin(angle),
                          place.z - LENGTH_M * math.cos(angle))


@pytest.fixture
def scene() -> Scene:
    return Scene()


def test_it_is_at_each_of_a_hundred_positions_in_the_next_picture(scene: Scene) -> None:
    scene.show((track(),))
    chance = random.Random(16)
    for _ in range(100):
        position_s = chance.choice((chance.uniform(0.0, 9.9), chance.uniform(12.1, 20.0)))
        scene.say(position_s)
        scene.wait()
        error_m = scene.error_m(position_s)
        assert error_m is not None and error_m < 1e-3
    assert scene.markers['arm/deviation 1'].text == f'Δ {2.0 * LENGTH_M:.1f} mm'


@pytest.mark.parametrize('begin_s, rate', [(2.0, 1.0), (9.0, -2.0)])
def test_it_moves_while_it_plays_forward_and_backwards(scene: Scene, begin_s: float,
                                                       rate: float) -> None:
    scene.show((track(),))
    scene.wait(0.0)
    speed = 1.5 * 0.7 * LENGTH_M * abs(rate)
    position_s = begin_s
    for number in range(30):
        if number % 3 == 0:
            scene.say(position_s, rate)
        assert scene.wait() == 1
        position_s += rate * PICTURE_S
        error_m = scene.error_m(position_s)
        assert error_m is not None and error_m < speed * PICTURE_S + 1e-3


def test_its_arrows_are_there_too(scene: Scene) -> None:
    """One on the tool, whose length grows with time; one in a frame of no robot."""
    vectors = np.column_stack((np.zeros((len(TIMES_S), 2)), 0.01 * TIMES_S + 0.1))
    scene.show((track(),), (
        ReferenceArrow('arm/force', 'tool', 'tool', (0.0, 0.0, 0.0), TIMES_S, vectors),
        ReferenceArrow('machine/feed', 'table', 'table', (1.0, 2.0, 3.0), TIMES_S, vectors)))
    for position_s in (4.0, 13.0, 9.0):
        scene.say(position_s)
        scene.wait()
        force, feed = scene.markers['arm/force/ghost 0'], scene.markers['machine/feed/ghost 0']
        assert force.scale.x == pytest.approx(0.01 * position_s + 0.1, abs=1e-4)
        assert feed.scale.x == pytest.approx(force.scale.x)
        assert (force.header.frame_id, feed.header.frame_id) == ('foot', 'table')
        foot, tool = force.pose.position, scene.markers['arm/ghost 0'].pose.position
        assert math.dist((foot.x, foot.y, foot.z), (tool.x, tool.y, tool.z)) == pytest.approx(
            BESIDE_M, abs=1e-6)


def test_where_there_is_no_run_there_is_no_ghost(scene: Scene) -> None:
    scene.show((track(),))
    for position_s, is_there in ((5.0, True), (11.0, False), (13.0, True)):
        scene.say(position_s)
        scene.wait()
        assert bool(scene.markers) == is_there
    scene.show(())
    scene.wait(0.0)
    assert not scene.markers
    scene.say(13.0)
    assert scene.wait(1.0) == 0


def test_one_that_stands_still_is_drawn_again_before_rviz_removes_it(scene: Scene) -> None:
    scene.show((track(),))
    scene.wait(0.0)
    count = 0
    for _ in range(30):
        scene.say(5.0)
        count += scene.wait(0.1)
    assert 3.0 / LIFETIME_S < count <= 13


def test_it_goes_with_the_player(scene: Scene) -> None:
    scene.show((track(),))
    scene.wait()
    assert not scene.markers
    scene.say(5.0)
    scene.wait(0.9)
    assert scene.markers
    scene.wait(0.2)  # the player is silent from now on
    assert not scene.markers


def test_what_cannot_be_shown_is_told(scene: Scene) -> None:
    assert scene.show((track('leg'),)) == (
        'leg: there is no parameter /leg/robot_description; launch the device first')
    scene.node.params['/bad/robot_description'] = '<robot'
    assert scene.show((track('bad'),)).startswith('bad: not well-formed XML')
    wrong = track()
    refused = scene.show((wrong._replace(here=wrong.here[:5]),))
    assert refused.startswith('arm: ') and 'positions of 1 joints at' in refused
    vectors = np.zeros((9, 3))
    refused = scene.show((), (ReferenceArrow('feed', 'a', 'a', (0.0, 0.0, 0.0), TIMES_S, vectors),))
    assert refused.startswith('feed: ') and 'positions of 3 joints at' in refused


@pytest.mark.parametrize('rate', [1.0, -1.0, 4.0])
def test_it_is_where_the_robot_is_drawn_on_a_computer_that_is_late(scene: Scene, rate: float
                                                                   ) -> None:
    """Joint states from 0.2 s ago move the robot's picture now; those of other parts do not."""
    scene.show((track(),))
    scene.say(5.0, rate)
    begin_s = scene.node.now().to_sec()
    scene.wait(0.4)
    scene.draw_robot(begin_s + 0.2)
    scene.wait()
    error_m = scene.error_m(5.0 + 0.2 * rate)
    assert error_m is not None and error_m < 1e-3
    scene.say(14.0, rate, segment=1)
    scene.wait()
    error_m = scene.error_m(14.0 + PICTURE_S * rate)
    assert error_m is not None and error_m < 1e-2


def test_a_robot_whose_joints_have_ended_does_not_hold_it(scene: Scene) -> None:
    scene.show((track(),))
    scene.say(5.0, 1.0)
    scene.draw_robot(scene.node.now().to_sec())
    scene.wait(0.9)
    error_m = scene.error_m(5.9)
    assert error_m is not None and error_m < 5e-2


def test_at_rest_it_is_at_the_position_whatever_was_drawn_before(scene: Scene) -> None:
    scene.show((track(),))
    scene.say(5.0)
    scene.draw_robot(scene.node.now().to_sec() - 0.1)
    scene.wait()
    error_m = scene.error_m(5.0)
    assert error_m is not None and error_m < 1e-3


def test_nobody_listens_to_joints_without_a_ghost(scene: Scene) -> None:
    for tracks in ((track(),), ()):
        scene.show(tracks)
        assert scene.node.listens('/arm/joint_states') is bool(tracks)


def test_an_arrow_without_length_is_not_drawn_and_holds_up_nothing(scene: Scene) -> None:
    vectors = np.where(TIMES_S[:, np.newaxis] < 5.0, 0.0, (0.0, 0.0, 0.3))
    scene.show((track(),), (
        ReferenceArrow('arm/force', 'tool', 'tool', (0.0, 0.0, 0.0), TIMES_S, vectors),))
    for position_s, is_drawn in ((4.0, False), (9.0, True)):
        scene.say(position_s)
        scene.wait()
        assert ('arm/force/ghost 0' in scene.markers) == is_drawn


def test_a_request_that_would_overflow_or_names_nothing_is_refused(scene: Scene) -> None:
    huge = track()._replace(there=joint_track(('turn',), TIMES_S, np.zeros(len(TIMES_S))))
    request = ghost_request((huge,), ())
    request.robots[0].there = [1e308] * len(TIMES_S)
    answer = scene.node.call('~show', request)
    assert not answer.success and 'out of range' in answer.message
    assert 'is not a name' in scene.show((track('a\x1b[31m'),))
    assert scene.show((track(),)) == ''
