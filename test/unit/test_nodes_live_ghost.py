# SPDX-License-Identifier: BSD-3-Clause
"""The ghost moves next to live robots that are faster or slower than the reference, or pause."""
from __future__ import annotations

import math
from typing import List, NamedTuple

import numpy as np
import pytest
import rospy
from sensor_msgs.msg import JointState
from simulated_node import SimulatedNode
from std_msgs.msg import Float64
from visualization_msgs.msg import Marker

from process_visualizer.cell.model import Location, ProcessEvent, RunSpan
from process_visualizer.clients.ghost_client import follow_request
from process_visualizer.msg import GhostPhase
from process_visualizer.nodes.ghost.ghost_display import GhostDisplay
from process_visualizer.robot.joints import joint_track
from process_visualizer.ros_names import GHOST_PHASE_TOPIC, GHOST_TOPIC
from process_visualizer.runs.comparison.ghost import GhostTrack, LiveReference, ReferenceEvent

RATE_HZ = 125.0
HERE = Location('cell.xml', 1)
ARM = '''<robot name="arm">
  <link name="foot"/><link name="upper"/>
  <link name="tool"><visual><geometry><sphere radius="0.1"/></geometry></visual></link>
  <joint name="turn" type="revolute"><parent link="foot"/><child link="upper"/>
    <axis xyz="1 0 0"/></joint>
  <joint name="hand" type="fixed"><parent link="upper"/><child link="tool"/>
    <origin xyz="0 0 1"/></joint>
</robot>'''
DURATION_S, BEGIN_S, END_S = 8.0, 1.0, 7.0
TIMES_S = np.arange(0.0, DURATION_S + 0.01, 0.02)
PAUSE_S = 3.0
"""Time of the pause in a live run, in the time of the reference."""


def angle_rad(time_s: np.ndarray) -> np.ndarray:
    """The angle at rest for a second, then there and back, and at rest again."""
    return np.asarray(0.5 * (1.0 - np.cos(np.pi / 3.0 * np.clip(time_s - BEGIN_S, 0.0, 6.0))))


class Said(NamedTuple):
    """Message of the node, and the reference moment that is expected in it."""

    wanted_s: float
    found: GhostPhase


def event(name: str, threshold: float, is_above: bool, time_s: float) -> ReferenceEvent:
    return ReferenceEvent(ProcessEvent(name, '/feed', 'data', threshold, is_above, 0.0, HERE),
                          (time_s,))


REFERENCE = LiveReference(
    (GhostTrack('arm', 'tool', joint_track(('turn',), TIMES_S, angle_rad(TIMES_S)),
                np.empty((0, 1))),),
    (event('start', 0.5, True, BEGIN_S), event('stop', 0.5, False, END_S)),
    RunSpan('start', 'stop', 1.0, 1.0, HERE))
WITHOUT_EVENTS = LiveReference(REFERENCE.tracks)


class Cell:
    """The node, next to a robot that the test moves."""

    def __init__(self) -> None:
        self.node = SimulatedNode('/ghost', {'/arm/robot_description': ARM})
        GhostDisplay(self.node)
        self.node.send('/feed', Float64(0.0), latch=True)

    def follow(self, reference: LiveReference, is_visible: bool = True) -> str:
        """Follow a reference; return the reason of a refusal, '' if accepted."""
        answer = self.node.call('~follow', follow_request(reference, is_visible))
        assert answer.success == (answer.message == '')
        return str(answer.message)

    @property
    def phases(self) -> List[GhostPhase]:
        return self.node.sent(GHOST_PHASE_TOPIC)

    @property
    def markers(self) -> List[Marker]:
        """The markers that are drawn now."""
        return [it for it in self.node.sent(GHOST_TOPIC)[-1].markers if it.action == Marker.ADD]

    def send(self, angle: float, feed: float) -> None:
        self.node.send('/arm/joint_states', JointState(
            header=rospy.Header(stamp=self.node.now()), name=['turn'], position=[angle]))
        self.node.send('/feed', Float64(feed))

    def begin(self) -> None:
        """Begin the run, with the robot in the reference's pose at that time."""
        self.send(0.0, 0.0)
        self.send(0.0, 1.0)
        self.node.advance(0.1)
        assert self.phases[-1].known

    def move(self, speed: float, begin_s: float = 0.0, pause_s: float = 0.0) -> List[Said]:
        """Run from a time of the reference to its end; return the node's messages meanwhile."""
        self.phases.clear()
        began_s = self.node.ros_s()
        end_s = (DURATION_S - begin_s) / speed + pause_s
        for number in range(int(end_s * RATE_HZ)):
            there_s = moment_s(number / RATE_HZ, speed, begin_s, pause_s)
            self.send(float(angle_rad(np.array(there_s))), float(BEGIN_S <= there_s < END_S))
            self.node.advance(1.0 / RATE_HZ)
        return [Said(moment_s(it.stamp.to_sec() - began_s, speed, begin_s, pause_s), it)
                for it in self.phases]


def moment_s(elapsed_s: float, speed: float, begin_s: float, pause_s: float) -> float:
    """The moment of the reference that corresponds to the live robot."""
    pause_at_s = (PAUSE_S - begin_s) / speed
    paused_s = min(max(elapsed_s - pause_at_s, 0.0), pause_s)
    return begin_s + speed * (elapsed_s - paused_s)


def phase_errors_s(said: List[Said], begin_s: float, end_s: float) -> np.ndarray:
    """The errors of the moment (n,) where it is known and the robot moves."""
    return np.array([abs(it.found.reference - it.wanted_s) for it in said
                     if begin_s < it.wanted_s < end_s and it.found.known])


@pytest.fixture
def cell() -> Cell:
    return Cell()


def test_it_follows_a_faster_run_and_a_pause(cell: Cell) -> None:
    """Each speed is tested with the alignment alone; this test covers the whole node."""
    assert cell.follow(REFERENCE) == ''
    said = cell.move(1.1, pause_s=0.8)
    errors = phase_errors_s(said, BEGIN_S + 0.5, END_S - 0.5)
    assert len(errors) > 150  # thirty per second
    assert float(np.quantile(errors, 0.95)) < 0.03
    behind_s = [it.found.behind for it in said if 5.5 < it.wanted_s < 6.5]
    assert float(np.median(behind_s)) == pytest.approx(5.0 / 1.1 - 5.0 + 0.8, abs=0.1)


def test_it_is_found_in_the_midst_of_a_run(cell: Cell) -> None:
    cell.follow(WITHOUT_EVENTS)
    errors = phase_errors_s(cell.move(1.0, begin_s=3.0), 3.5, END_S - 0.5)
    assert len(errors) > 70
    assert float(np.quantile(errors, 0.95)) < 0.03
    assert math.isnan(cell.phases[-1].elapsed)


def test_its_moment_is_that_of_the_joints(cell: Cell) -> None:
    """So live values of exactly this time can be compared with the reference at its moment."""
    cell.follow(REFERENCE)
    cell.begin()
    measured = cell.node.now()
    cell.send(0.0, 1.0)
    cell.phases.clear()
    cell.node.advance(0.15)
    assert {it.stamp for it in cell.phases} == {measured}
    cell.node.advance(0.3)  # no more states arrive: as far as is known, the robot is at rest
    assert cell.phases[-1].stamp > measured


def test_a_run_whose_joints_have_ended_is_over(cell: Cell) -> None:
    cell.follow(REFERENCE)
    cell.begin()
    for number in range(400):
        cell.send(float(angle_rad(np.array(1.0 + number / RATE_HZ))), 1.0)
        cell.node.advance(1.0 / RATE_HZ)
    assert cell.phases[-1].known
    cell.node.advance(4.0)
    assert cell.phases[-1].known, 'they may come again'
    cell.node.advance(3.0)
    assert not cell.phases[-1].known
    assert len(phase_errors_s(cell.move(1.0), BEGIN_S + 0.5, END_S - 0.5)) > 100


def test_between_runs_there_is_none(cell: Cell) -> None:
    cell.follow(REFERENCE)
    cell.move(1.0, begin_s=6.0)
    cell.node.advance(3.0)
    assert not cell.phases[-1].known and not cell.markers
    cell.node.send('/feed', Float64(1.0))
    cell.node.advance(0.1)
    assert cell.phases[-1].known and cell.markers


def test_the_deviation_is_shown_also_if_joints_come_in_parts(cell: Cell) -> None:
    cell.follow(REFERENCE)
    cell.begin()
    cell.send(-0.01, 1.0)
    cell.node.send('/arm/joint_states', JointState(name=['other'], position=[1.0]))
    cell.node.advance(0.3)
    assert any(it.text.startswith('Δ') for it in cell.markers)


def test_what_cannot_be_followed_is_told(cell: Cell) -> None:
    track, = REFERENCE.tracks
    assert 'no robot of the reference has a tool' in cell.follow(
        LiveReference((track._replace(tool=''),)))
    bad = REFERENCE.events[0].event
    assert 'is not a valid field path' in cell.follow(LiveReference((track,), (ReferenceEvent(
        ProcessEvent(bad.name, bad.topic, 'a..b', 0.0, True, 0.0, HERE), ()),)))
    assert 'topic: ' in cell.follow(LiveReference((track,), (ReferenceEvent(
        ProcessEvent(bad.name, '/\x1b', 'data', 0.0, True, 0.0, HERE), ()),)))
    assert 'is not a name' in cell.follow(LiveReference((track._replace(device='arm\n'),)))
    cell.node.advance(1.0)
    assert cell.phases == []


def test_foreign_messages_are_survived(cell: Cell) -> None:
    odd = ProcessEvent('odd', '/feed', 'wrench.force.z', 0.0, True, 0.0, HERE)
    cell.follow(REFERENCE._replace(events=(*REFERENCE.events, ReferenceEvent(odd, (2.0,)))))
    for name, position in ((['turn', 'other'], [math.nan]), (['other'], [1.0])):
        cell.node.send('/arm/joint_states', JointState(name=name, position=position))
    errors = phase_errors_s(cell.move(1.0, begin_s=4.5), 5.0, END_S - 0.5)
    assert len(errors) > 30
    assert float(np.quantile(errors, 0.95)) < 0.03
    assert [text.partition(': /feed: ')[0] for _, text in cell.node.log] == [
        'the event "odd" is not seen']


def test_it_may_be_followed_without_being_drawn(cell: Cell) -> None:
    cell.follow(REFERENCE, is_visible=False)
    cell.begin()
    assert cell.markers == []


def test_nothing_is_said_after_the_end_of_following(cell: Cell) -> None:
    odd = ProcessEvent('odd', '/odd', 'no_field', 0.0, True, 0.0, HERE)
    cell.follow(REFERENCE._replace(events=(*REFERENCE.events, ReferenceEvent(odd, ()))))
    cell.begin()
    assert cell.markers
    cell.follow(LiveReference(()))
    cell.phases.clear()
    cell.node.send('/odd', Float64(1.0))
    assert cell.node.log == []  # the topic is no longer read
    cell.send(0.0, 0.0)
    cell.send(0.0, 1.0)
    cell.node.advance(1.0)
    assert cell.phases == [] and cell.markers == []
