#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The ghost moves beside live robots that are faster or slower than the reference, or pause."""
from __future__ import annotations

import threading
import unittest
from typing import Callable, List, NamedTuple

import numpy as np
import rospy
import rostest
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64
from visualization_msgs.msg import Marker, MarkerArray

from process_visualizer.cell.model import Location, ProcessEvent, RunSpan
from process_visualizer.clients.ghost_client import GhostError, follow_ghost
from process_visualizer.motion.joint_track import joint_track
from process_visualizer.msg import GhostPhase
from process_visualizer.ros_names import GHOST, GHOST_PHASE_TOPIC, GHOST_TOPIC
from process_visualizer.runs.comparison.ghost_tracks import GhostTrack
from process_visualizer.runs.comparison.live_reference import LiveReference, ReferenceEvent

TIMEOUT_S = 20.0
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
"""When a live run that pauses does so, in the time of the reference."""


def angle_rad(time_s: np.ndarray) -> np.ndarray:
    """At rest for a second, then there and back, and at rest again."""
    return np.asarray(0.5 * (1.0 - np.cos(np.pi / 3.0 * np.clip(time_s - BEGIN_S, 0.0, 6.0))))


class Said(NamedTuple):
    """What the node said, and the moment of the reference that it should have said."""

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


class LiveGhostTest(unittest.TestCase):
    """With a robot that moves as the test wants."""

    def setUp(self) -> None:
        self.phases: List[GhostPhase] = []
        self.markers: List[Marker] = []
        self.changed = threading.Condition()
        self.joints = rospy.Publisher('/arm/joint_states', JointState, queue_size=10,
                                      tcp_nodelay=True)
        self.feed = rospy.Publisher('/feed', Float64, queue_size=10, latch=True)
        self.ears = (rospy.Subscriber(GHOST_TOPIC, MarkerArray, self.take_markers),
                     rospy.Subscriber(GHOST_PHASE_TOPIC, GhostPhase, self.take_phase,
                                      tcp_nodelay=True))
        rospy.set_param('/arm/robot_description', ARM)
        rospy.wait_for_service(f'/{GHOST}/follow', TIMEOUT_S)
        self.feed.publish(0.0)

    def tearDown(self) -> None:
        follow_ghost(LiveReference(()))
        for it in self.ears:
            it.unregister()

    def take_markers(self, message: MarkerArray) -> None:
        with self.changed:
            self.markers = [it for it in message.markers if it.action == Marker.ADD]
            self.changed.notify_all()

    def take_phase(self, message: GhostPhase) -> None:
        with self.changed:
            self.phases.append(message)
            self.changed.notify_all()

    def wait(self, condition: Callable[[], bool]) -> bool:
        with self.changed:
            return self.changed.wait_for(condition, TIMEOUT_S)

    def show(self, reference: LiveReference) -> None:
        follow_ghost(reference)
        self.assertTrue(self.wait(lambda: self.joints.get_num_connections() > 0))

    def begin(self) -> None:
        """Let the run begin, with the robot where the reference has it then."""
        self.assertTrue(self.wait_for_node())
        self.joints.publish(JointState(name=['turn'], position=[0.0]))
        for feed in (0.0, 1.0):
            self.feed.publish(feed)
        self.assertTrue(self.wait(lambda: bool(self.phases) and self.phases[-1].known))

    def wait_for_node(self) -> bool:
        return self.wait(lambda: min(it.get_num_connections()
                                     for it in (self.joints, self.feed)) > 0)

    def move(self, speed: float, begin_s: float = 0.0, pause_s: float = 0.0) -> List[Said]:
        """Run from a time of the reference to its end; return what the node said meanwhile."""
        with self.changed:
            self.phases.clear()
        began_s = rospy.get_time()
        end_s = (DURATION_S - begin_s) / speed + pause_s
        tick = threading.Event()  # never set
        for number in range(int(end_s * RATE_HZ)):
            tick.wait(max(began_s + number / RATE_HZ - rospy.get_time(), 0.0))
            now = rospy.Time.now()
            there_s = moment_s(now.to_sec() - began_s, speed, begin_s, pause_s)
            self.joints.publish(JointState(header=rospy.Header(stamp=now), name=['turn'],
                                           position=[float(angle_rad(np.array(there_s)))]))
            self.feed.publish(float(BEGIN_S <= there_s < END_S))
        with self.changed:
            return [Said(moment_s(it.stamp.to_sec() - began_s, speed, begin_s, pause_s), it)
                    for it in self.phases]

    def test_it_follows_faster_and_slower_runs_and_a_pause(self) -> None:
        """Each speed is in test/unit, of the alignment alone; this is one with all of it."""
        self.show(REFERENCE)
        said = self.move(1.1, pause_s=0.8)
        errors = phase_errors_s(said, BEGIN_S + 0.5, END_S - 0.5)
        print(f'phase error median {1e3 * np.median(errors):.0f} ms, '
              f'p95 {1e3 * np.quantile(errors, 0.95):.0f} ms')
        self.assertGreater(len(errors), 100)
        self.assertLess(float(np.quantile(errors, 0.95)), 0.05)
        behind_s = [it.found.behind for it in said if 5.5 < it.wanted_s < 6.5]
        self.assertAlmostEqual(float(np.median(behind_s)), 5.0 / 1.1 - 5.0 + 0.8, delta=0.1)

    def test_it_is_found_in_the_midst_of_a_run(self) -> None:
        self.show(WITHOUT_EVENTS)
        errors = phase_errors_s(self.move(1.0, begin_s=3.0), 3.5, END_S - 0.5)
        self.assertLess(float(np.quantile(errors, 0.95)), 0.05)
        self.assertTrue(np.isnan(self.phases[-1].elapsed))

    def test_between_runs_there_is_none(self) -> None:
        self.show(REFERENCE)
        self.move(1.0, begin_s=6.0)
        self.assertTrue(self.wait(lambda: bool(self.phases) and not self.phases[-1].known))
        self.assertTrue(self.wait(lambda: not self.markers))
        self.feed.publish(1.0)
        self.assertTrue(self.wait(lambda: self.phases[-1].known and bool(self.markers)))

    def test_the_deviation_is_shown(self) -> None:
        self.show(REFERENCE)
        self.begin()
        self.joints.publish(JointState(name=['turn'], position=[-0.01]))
        self.assertTrue(self.wait(lambda: any(it.text.startswith('Δ') for it in self.markers)))

    def test_what_cannot_be_followed_is_told(self) -> None:
        track, = REFERENCE.tracks
        with self.assertRaisesRegex(GhostError, 'no robot of the reference has a tool'):
            follow_ghost(LiveReference((track._replace(tool=''),)))
        bad = REFERENCE.events[0].event
        with self.assertRaisesRegex(GhostError, 'is no field'):
            follow_ghost(LiveReference((track,), (ReferenceEvent(
                ProcessEvent(bad.name, bad.topic, 'a..b', 0.0, True, 0.0, HERE), ()),)))

    def test_foreign_messages_are_survived(self) -> None:
        event_of = REFERENCE.events[0].event
        odd = ProcessEvent('odd', '/feed', 'wrench.force.z', 0.0, True, 0.0, event_of.location)
        self.show(REFERENCE._replace(events=(*REFERENCE.events, ReferenceEvent(odd, (2.0,)))))
        self.joints.publish(JointState(name=['turn', 'other'], position=[float('nan')]))
        self.joints.publish(JointState(name=['other'], position=[1.0]))
        errors = phase_errors_s(self.move(1.0, begin_s=4.5), 5.0, END_S - 0.5)
        self.assertLess(float(np.quantile(errors, 0.95)), 0.05)

    def test_it_may_be_followed_without_being_drawn(self) -> None:
        follow_ghost(REFERENCE, is_visible=False)
        self.begin()
        self.assertEqual(self.markers, [])


def moment_s(elapsed_s: float, speed: float, begin_s: float, pause_s: float) -> float:
    """The moment of the reference at which the live robot is."""
    pause_at_s = (PAUSE_S - begin_s) / speed
    paused_s = min(max(elapsed_s - pause_at_s, 0.0), pause_s)
    return begin_s + speed * (elapsed_s - paused_s)


def phase_errors_s(said: List[Said], begin_s: float, end_s: float) -> np.ndarray:
    """Where it is known and the robot moves, (n,)."""
    return np.array([abs(it.found.reference - it.wanted_s) for it in said
                     if begin_s < it.wanted_s < end_s and it.found.known])


if __name__ == '__main__':
    rospy.init_node('live_ghost_test')
    rostest.rosrun('process_visualizer', 'live_ghost_test', LiveGhostTest)
