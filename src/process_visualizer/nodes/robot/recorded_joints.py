# SPDX-License-Identifier: BSD-3-Clause
"""A robot's recorded joints, under the names in its model."""
from __future__ import annotations

from typing import Dict, NamedTuple, Tuple

import genpy
import rospy
from sensor_msgs.msg import JointState

from process_visualizer.motion.float32_multi_array import float32_values
from process_visualizer.motion.joint_matching import JointMatching
from process_visualizer.motion.velocity.measuring_time import USABLE_WITHIN_S
from process_visualizer.nodes.robot.robot_messages import deserialize
from process_visualizer.ros_names import FLOAT_ARRAY, JOINT_STATE


class JointsAt(NamedTuple):
    """Positions [rad or m] of joints by name, and when they were measured."""

    positions: Dict[str, float]
    stamp: rospy.Time


class RecordedJoints(NamedTuple):
    """The topics on which drivers send the joints, and the meaning of their messages."""

    topics: Tuple[str, ...]
    matching: JointMatching

    def decode(self, kind: str, message: bytes, recorded_s: float) -> JointsAt:
        """Return the robot's joints in a message that was recorded at a time [s].

        Raises:
            ValueError: it cannot be used.
        """
        if kind == FLOAT_ARRAY:
            return JointsAt(self.matching.match((), float32_values(message)),
                            rospy.Time.from_sec(recorded_s))
        if kind != JOINT_STATE:
            raise ValueError(f'{kind} carries no joints')
        try:
            state = deserialize(JointState, message)
        except genpy.DeserializationError as error:
            raise ValueError(f'its bytes are not those of {kind}: {error}') from error
        stamp = state.header.stamp
        if abs(stamp.to_sec() - recorded_s) > USABLE_WITHIN_S:  # none, or another computer's
            stamp = rospy.Time.from_sec(recorded_s)
        return JointsAt(self.matching.match(state.name, state.position), stamp)
