# SPDX-License-Identifier: BSD-3-Clause
"""The poses of a robot's links at the times when restored sensor messages were measured."""
from __future__ import annotations

from collections import defaultdict
from typing import DefaultDict, Dict, List, Mapping, Sequence, Tuple

import numpy as np
import rospy
from geometry_msgs.msg import Quaternion, Transform, TransformStamped, Vector3
from std_msgs.msg import Header
from tf2_msgs.msg import TFMessage

from process_visualizer.clients.service_connection import ServiceUnreachable
from process_visualizer.msg import PlayerState
from process_visualizer.nodes.common.node_handle import NodeHandle
from process_visualizer.nodes.robot.twist_source import (
    ANSWER_S,
    SERVICE,
    RecordedJoints,
)
from process_visualizer.robot.kinematics import Kinematics
from process_visualizer.robot.recorded_velocity import PosePart
from process_visualizer.ros_names import PLAYER_STATE_TOPIC, RESTORED_TF_TOPIC
from process_visualizer.srv import ReadTopic

_BEFORE_S = 0.5  # the player adds the last value of each joint before this time
_AFTER_S = 1.0  # values measured just after a moment arrive late
_HELD_S = 0.5  # in a longer gap, the joint counts as at rest until the next value
_TURNING = 'revolute', 'continuous'

Values = Mapping[str, Sequence[Tuple[float, float]]]
"""By joint: time of measurement [s from the recording's beginning] and position [rad or m]."""


class RestoredPoses:
    """Publishes the poses of a robot's links at the measurement of each restored message.

    After a jump and while paused, the player restores messages with present stamps, and the robot
    has its pose at the position. But a restored cloud was taken some time before. The published
    poses have the stamp of the cloud, and show the robot as it was then. They are not published on
    /tf, so that the robot in RViz keeps its pose at the position. They are published only while
    there is a subscriber.
    """

    def __init__(self, node: NodeHandle, joints: RecordedJoints, model: Kinematics) -> None:
        """Follow the player.

        Args:
            node: the connection to ROS.
            joints: reads the recorded joints.
            model: the robot's model.
        """
        self._node, self._joints, self._model = node, joints, model
        self._turning = {joint.name for joint in map(model.joint, model.links)
                         if joint is not None and joint.kind in _TURNING}
        self._present: Dict[str, float] = {}
        self._state = PlayerState()
        self._published: List[rospy.Time] = []
        self._service = node.connect(SERVICE, ReadTopic, ANSWER_S)
        self._publisher = node.publisher(RESTORED_TF_TOPIC, TFMessage)
        self._worker = node.worker(self._publish_new, 'restored poses')
        node.subscribe(PLAYER_STATE_TOPIC, PlayerState, self._follow)

    def take_joints(self, positions: Mapping[str, float]) -> None:
        """Note present positions [rad or m], used for joints that the recording lacks."""
        self._present = {**self._present, **positions}

    def _follow(self, state: PlayerState) -> None:
        self._state = state
        if state.restored and self._publisher.get_num_connections() > 0:
            self._worker.wake()

    def _publish_new(self) -> None:
        """Publish the poses for newly restored messages; later ones wake the worker again."""
        state = self._state
        moments = {it.stamp: (it.recorded - state.begin).to_sec() for it in state.restored}
        new = {stamp: moment_s for stamp, moment_s in moments.items()
               if stamp not in self._published}
        if not new:
            return
        try:
            values = self._joints_around(min(new.values()), max(new.values()))
        except ServiceUnreachable:
            return  # the player has ended
        self._published = list(moments)
        self._publisher.publish(TFMessage([transform for stamp, moment_s in new.items()
                                           for transform in self._poses(stamp, moment_s, values)]))

    def _poses(self, stamp: rospy.Time, moment_s: float, values: Values) -> List[TransformStamped]:
        positions = {**self._present,
                     **{name: self._position(name, it, moment_s) for name, it in values.items()}}
        return [TransformStamped(Header(0, stamp, parent), child,
                                 Transform(Vector3(*place.position), Quaternion(*place.quaternion)))
                for parent, child, place in self._model.moved(positions)]

    def _position(self, joint: str, values: Sequence[Tuple[float, float]], moment_s: float
                  ) -> float:
        """Return a joint's position at a moment, interpolated between the values around it."""
        times_s, positions = np.array(values).T
        if joint in self._turning:  # some drivers wrap around after a full turn
            positions = np.unwrap(positions)
        after = int(np.searchsorted(times_s, moment_s))
        if 0 < after < len(times_s) and times_s[after] - times_s[after - 1] > _HELD_S:
            return float(positions[after - (times_s[after] > moment_s)])
        return float(np.interp(moment_s, times_s, positions))

    def _joints_around(self, first_s: float, last_s: float) -> Values:
        """Return the values of each joint, from just before the first time to after the last [s].

        Raises:
            ServiceUnreachable: the player does not answer.
        """
        part = PosePart(first_s - _BEFORE_S, last_s + _AFTER_S)
        values: DefaultDict[str, List[Tuple[float, float]]] = defaultdict(list)
        for topic, messages in self._joints.read(self._node, self._service, part).items():
            for _, found in self._joints.decoded(topic, messages):
                measured_s = found.stamp.to_sec() - messages.begin_s
                for name, position in found.positions.items():
                    values[name].append((measured_s, position))
        return {name: sorted(it) for name, it in values.items()}
