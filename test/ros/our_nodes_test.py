#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Our nodes as processes, one case of each; test/unit/test_nodes_*.py tests their behavior."""
from __future__ import annotations

import itertools
import os
import signal
import subprocess
import unittest
from contextlib import contextmanager
from queue import Queue
from typing import Any, Callable, Iterator
from xmlrpc.client import ServerProxy

import numpy as np
import rosgraph
import rospy
import rostest
from cloud_testing import make_cloud
from roslib.packages import find_node
from sensor_msgs.msg import JointState, PointCloud2, Temperature
from std_msgs.msg import Float64
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import Marker, MarkerArray

from process_visualizer.cell.model import Location, ProcessEvent, RunSpan
from process_visualizer.clients.ghost_client import GhostError, follow_ghost, show_ghost
from process_visualizer.msg import GhostPhase, PlayerState
from process_visualizer.robot.joints import joint_track
from process_visualizer.ros_names import GHOST_PHASE_TOPIC, GHOST_TOPIC, PLAYER_STATE_TOPIC
from process_visualizer.runs.comparison.ghost import GhostTrack, LiveReference, ReferenceEvent
from process_visualizer.srv import SetFrame

TIMEOUT_S = 60.0
ARM = '''<robot name="arm"><link name="foot"/>
  <link name="tool"><visual><geometry><sphere radius="0.1"/></geometry></visual></link>
  <joint name="slide" type="prismatic"><parent link="foot"/><child link="tool"/>
    <axis xyz="1 0 0"/><limit lower="0" upper="9" effort="1" velocity="1"/></joint>
</robot>'''
TIMES_S = np.arange(0.0, 8.0, 0.02)
TRACK = GhostTrack('arm', 'tool', joint_track(('slide',), TIMES_S, 0.1 * TIMES_S),
                   np.empty((0, 1)))
"""Position of the tool [m] at each time [s]: a tenth of it."""


class Topic:
    """The messages of a topic, in order."""

    def __init__(self, name: str, message_class: type) -> None:
        self._arrived: 'Queue[Any]' = Queue()
        self._subscriber = rospy.Subscriber(name, message_class, self._arrived.put)

    def __enter__(self) -> Topic:
        return self

    def __exit__(self, *_exception: object) -> None:
        self._subscriber.unregister()

    def next(self, wanted: Callable[[Any], bool] = lambda _message: True) -> Any:
        """Wait for a wanted message; fail if none arrives in time."""
        while True:
            message = self._arrived.get(timeout=TIMEOUT_S)
            if wanted(message):
                return message


@contextmanager
def driver(topic: str, message_class: type, *make: Callable[[], Any]) -> Iterator[None]:
    """Publish messages ten times a second: those of each function in turn."""
    publisher = rospy.Publisher(topic, message_class, queue_size=1)
    makers = itertools.cycle(make)
    timer = rospy.Timer(rospy.Duration(0, 100_000_000),
                        lambda _event: publisher.publish(next(makers)()))
    yield
    timer.shutdown()
    timer.join()
    publisher.unregister()


def says(text: str) -> Callable[[MarkerArray], bool]:
    """Return whether an array of markers has a text."""
    return lambda array: any(text in marker.text for marker in array.markers)


class OurNodesTest(unittest.TestCase):
    """Plays drivers and RViz."""

    def test_a_number_is_shown_and_compared_with_a_live_parameter(self) -> None:
        with driver('/oven/temperature', Temperature, lambda: Temperature(temperature=45.5)), \
                Topic('/oven/marker_array', MarkerArray) as markers:
            markers.next(says('oven 45.5 °C, 25.5 above 20'))
            rospy.set_param('/oven/setpoint', 40.0)
            markers.next(says('5.5 above 40'))
            rospy.delete_param('/oven/setpoint')
            markers.next(says('25.5 above 20'))

    def test_a_cloud_passes_from_a_remapped_input(self) -> None:
        cloud = make_cloud([(1, 2, 3), (4, 5, 6)], '/camera', stamp_s=5)
        begin = rospy.Time.now()
        with driver('/some/cloud', PointCloud2, lambda: cloud), \
                Topic('/kinect/points', PointCloud2) as points:
            result = points.next()
        self.assertLessEqual(begin, result.header.stamp)
        self.assertEqual(result.header.frame_id, 'camera')
        result.header = cloud.header
        self.assertEqual(result, cloud)

    def test_who_comes_late_gets_the_frames_and_may_move_them(self) -> None:
        with Topic('/tf_static', TFMessage) as frames:
            self.assertEqual([it.child_frame_id for it in frames.next().transforms],
                             ['r/link0', 'r/force'])
            rospy.wait_for_service('/cell_frames/set_frame', TIMEOUT_S)
            answer = rospy.ServiceProxy('/cell_frames/set_frame', SetFrame)(
                '', '/r/force', (0.1, 0.2, 0.3), (0.0, 0.0, 0.0))
            self.assertTrue(answer.success, answer.message)
            self.assertEqual(frames.next().transforms[1].transform.translation.y, 0.2)

    def test_wrong_parameters_end_a_node_with_one_message(self) -> None:
        """Two nodes start at the same time."""
        cases = [('variable_proc', '_variables:=[{topic: /a, frame: f, scale: long}]',
                  "/bad/variable_proc/variables[0]/scale: a number is expected, not 'long'"),
                 ('cell_frames', '_frames:=[{parent: a, child: a}]',
                  'parameter /bad/cell_frames/frames: ')]
        nodes = [subprocess.Popen(
            [find_node('process_visualizer', name)[0], '__ns:=bad', parameter], text=True,
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT) for name, parameter, _ in cases]
        for node, (_, _, problem) in zip(nodes, cases):
            output, _ = node.communicate(timeout=TIMEOUT_S)
            self.assertEqual(node.returncode, 1, output)
            self.assertIn(problem, output)
            self.assertEqual(len(output.strip().splitlines()), 1, output)

    def test_a_ghost_is_shown_at_the_position_of_the_player(self) -> None:
        rospy.set_param('/arm/robot_description', ARM)
        show_ghost((TRACK,), start_s=TIMEOUT_S)
        with driver(PLAYER_STATE_TOPIC, PlayerState, lambda: PlayerState(
                stamp=rospy.Time.now(), position=5.0, rate=1.0, paused=True)), \
                Topic(GHOST_TOPIC, MarkerArray) as markers:
            drawn = markers.next(lambda it: it.markers[0].action == Marker.ADD)
            self.assertAlmostEqual(drawn.markers[0].pose.position.x, 0.5)
            show_ghost(())
            markers.next(lambda it: it.markers[0].action == Marker.DELETEALL)
        with self.assertRaisesRegex(GhostError, 'leg: there is no parameter /leg/robot_desc'):
            show_ghost((TRACK._replace(device='leg'),))

    def test_a_ghost_goes_beside_a_live_robot(self) -> None:
        rospy.set_param('/arm/robot_description', ARM)
        here = Location('cell.xml', 1)
        start, stop = (ReferenceEvent(
            ProcessEvent(name, '/feed', 'data', 0.5, is_above, 0.0, here), (time_s,))
            for name, is_above, time_s in (('start', True, 0.0), ('stop', False, 7.0)))
        follow_ghost(LiveReference((TRACK,), (start, stop),
                                   RunSpan('start', 'stop', 1.0, 1.0, here)))
        with driver('/arm/joint_states', JointState,
                    lambda: JointState(name=['slide'], position=[0.0])), \
                driver('/feed', Float64, lambda: Float64(0.0), lambda: Float64(1.0)), \
                Topic(GHOST_PHASE_TOPIC, GhostPhase) as phases, \
                Topic(GHOST_TOPIC, MarkerArray) as markers:
            phases.next(lambda it: it.known)
            markers.next(lambda it: it.markers[0].action == Marker.ADD)
        follow_ghost(LiveReference(()))

    def test_a_process_that_hangs_or_is_killed_is_named(self) -> None:
        """The process is watched because it publishes what is shown."""
        rospy.wait_for_service('/watched/depth_proc/get_loggers', TIMEOUT_S)
        uri = rosgraph.Master('/our_nodes_test').lookupNode('/watched/depth_proc')
        process = ServerProxy(uri).getPid('/our_nodes_test')[2]
        with Topic('/scene_watch/marker_array', MarkerArray) as markers:
            for _ in range(5):  # a second apart: meanwhile the process is asked and answers
                markers.next()
            os.kill(process, signal.SIGSTOP)
            try:
                markers.next(says('watched: depth_proc is not responding; this picture'))
            finally:
                os.kill(process, signal.SIGCONT)
            markers.next(lambda array: not says('watched')(array))
            os.kill(process, signal.SIGKILL)
            markers.next(says('watched: depth_proc stopped; this picture is out of date'))


if __name__ == '__main__':
    rospy.init_node('our_nodes_test')
    rostest.rosrun('process_visualizer', 'our_nodes_test', OurNodesTest)
