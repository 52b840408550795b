# SPDX-License-Identifier: BSD-3-Clause
"""The poses of a robot's links at the moments that restored messages of sensors show."""
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

_BEFORE_S = 0.5  # the player adds the last value of each joint before it
_AFTER_S = 1.0  # what was measured just after a moment comes late
_HELD_S = 0.5  # a joint of which nothing is sent for so long has stood, and then moved at once
_TURNING = 'revolute', 'continuous'

Told = Mapping[str, Sequence[Tuple[float, float]]]
"""By joint: when it was measured [s from the recording's beginning] and its position [rad or m]."""


class RestoredPoses:
    """Publishes where a robot's links were when something was measured that the player restores.

    What is restored after a jump and while paused is stamped with the present, as the robot is,
    which stands at the position. A cloud of that scene was taken a while before. In the poses that
    this publishes, with the stamp of the cloud, the robot is where it was then. They do not go to
    /tf: the robot that RViz shows stays at the position. Only while somebody subscribes.
    """

    def __init__(self, node: NodeHandle, joints: RecordedJoints, model: Kinematics) -> None:
        """Follow the player.

        Args:
            node: its connection to ROS.
            joints: reads the recorded joints.
            model: the robot's.
        """
        self._node, self._joints, self._model = node, joints, model
        self._turning = {joint.name for joint in map(model.joint, model.links)
                         if joint is not None and joint.kind in _TURNING}
        self._present: Dict[str, float] = {}
        self._state = PlayerState()
        self._told: List[rospy.Time] = []
        self._service = node.connect(SERVICE, ReadTopic, ANSWER_S)
        self._publisher = node.publisher(RESTORED_TF_TOPIC, TFMessage)
        self._worker = node.worker(self._tell, 'restored poses')
        node.subscribe(PLAYER_STATE_TOPIC, PlayerState, self._follow)

    def take_joints(self, positions: Mapping[str, float]) -> None:
        """Take present positions [rad or m], for joints of which the recording says nothing."""
        self._present = {**self._present, **positions}

    def _follow(self, state: PlayerState) -> None:
        self._state = state
        if state.restored and self._publisher.get_num_connections() > 0:
            self._worker.wake()

    def _tell(self) -> None:
        """Publish the poses of what is new; what has come meanwhile wakes the worker again."""
        state = self._state
        moments = {it.stamp: (it.recorded - state.begin).to_sec() for it in state.restored}
        new = {stamp: moment_s for stamp, moment_s in moments.items() if stamp not in self._told}
        if not new:
            return
        try:
            told = self._joints_around(min(new.values()), max(new.values()))
        except ServiceUnreachable:
            return  # the player has ended
        self._told = list(moments)
        self._publisher.publish(TFMessage([transform for stamp, moment_s in new.items()
                                           for transform in self._poses(stamp, moment_s, told)]))

    def _poses(self, stamp: rospy.Time, moment_s: float, told: Told) -> List[TransformStamped]:
        positions = {**self._present,
                     **{name: self._position(name, it, moment_s) for name, it in told.items()}}
        return [TransformStamped(Header(0, stamp, parent), child,
                                 Transform(Vector3(*place.position), Quaternion(*place.quaternion)))
                for parent, child, place in self._model.moved(positions)]

    def _position(self, joint: str, told: Sequence[Tuple[float, float]], moment_s: float) -> float:
        """Return where a joint was at a moment, between its values before and after it."""
        times_s, positions = np.array(told).T
        if joint in self._turning:  # some drivers begin anew after a full turn
            positions = np.unwrap(positions)
        after = int(np.searchsorted(times_s, moment_s))
        if 0 < after < len(times_s) and times_s[after] - times_s[after - 1] > _HELD_S:
            return float(positions[after - (times_s[after] > moment_s)])
        return float(np.interp(moment_s, times_s, positions))

    def _joints_around(self, first_s: float, last_s: float) -> Told:
        """Return the values of each joint, from before the first of some moments [s] on.

        Raises:
            ServiceUnreachable: the player does not answer.
        """
        part = PosePart(first_s - _BEFORE_S, last_s + _AFTER_S)
        told: DefaultDict[str, List[Tuple[float, float]]] = defaultdict(list)
        for topic, messages in self._joints.read(self._node, self._service, part).items():
            for recorded_s, message in messages.messages:
                try:
                    found = self._joints.decode(topic, messages.type, message,
                                                messages.begin_s + recorded_s)
                except ValueError:
                    continue  # joint_proc reports it when it is played
                measured_s = found.stamp.to_sec() - messages.begin_s
                for name, position in found.positions.items():
                    told[name].append((measured_s, position))
        return {name: sorted(it) for name, it in told.items()}
