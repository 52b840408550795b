# SPDX-License-Identifier: BSD-3-Clause
"""Subscribes to the tool's poses, and decodes recorded messages in the same way."""
from __future__ import annotations

from typing import Callable, Dict, Mapping, Optional

import rospy

from process_visualizer.motion.joint_history import JointHistory
from process_visualizer.motion.kinematics import Kinematics
from process_visualizer.nodes.common.complaints import Complaints
from process_visualizer.nodes.common.node_handle import NodeHandle
from process_visualizer.nodes.robot.base_frames import BaseFrames
from process_visualizer.nodes.robot.frame_reader import FrameReader
from process_visualizer.nodes.robot.message_reader import Decoder, TopicReader
from process_visualizer.nodes.robot.pose_decoder import FramesNotConnected, PoseDecoder
from process_visualizer.nodes.robot.robot_messages import POSE_DECODERS, ToolPose
from process_visualizer.parameters.robot_parameters import RobotParameters
from process_visualizer.ros_names import TF_MESSAGE

_EQUAL_M = 0.02  # so near, two publishers say the same


class ToolInput:
    """The tool's poses, from messages of a pose or of transforms; each in the base frame.

    Most drivers send joints only. Then the model has the tool, and recorded joints are decoded.
    """

    def __init__(self, node: NodeHandle, parameters: RobotParameters, complaints: Complaints,
                 callback: Callable[[ToolPose], None], on_static: Callable[[], None],
                 base_frames: BaseFrames, model: Kinematics) -> None:
        """Subscribe, if there is a topic.

        Args:
            node, parameters, complaints, base_frames, model: those of the robot processor.
            callback: called with each pose; may raise like that of TopicReader.
            on_static: called when static transforms on which the poses depend have changed.
        """
        self._topic, self._callback = parameters.tool_center_frame, callback
        self._parameters, self._base_frames, self._model = parameters, base_frames, model
        self._frames: Optional[FrameReader] = None
        if self._topic.message_type == TF_MESSAGE:
            frame = self._topic.frame or parameters.tool_frame
            self._frames = FrameReader(node, complaints, self._topic.name, parameters.base_frame,
                                       frame, callback, on_static, model, base_frames.name)
        elif self._topic.name:
            TopicReader(node, complaints, self._topic.name, self._topic.message_type,
                        POSE_DECODERS, self._take, lambda pose: pose.position, _EQUAL_M)

    def decoder(self, message_type: str) -> Optional[PoseDecoder]:
        """Return a decoder of messages of a type, in their order; None if it is not supported.

        Without a type ('') joints may be enough, which move the frame of a tool in tf.
        """
        if self._frames is not None:
            return self._frames.decoder() if message_type in ('', TF_MESSAGE) else None
        if not self._topic.name:
            return _ModelDecoder(self._parameters, self._model)
        decode = POSE_DECODERS.get(message_type)
        if decode is None or self._topic.message_type not in ('', message_type):
            return None
        return _MessageDecoder(decode, self._base_frames)

    def _take(self, pose: ToolPose) -> None:
        self._callback(self._base_frames.in_base(pose))


class _ModelDecoder(PoseDecoder):
    """Finds the tool by the model, from joints alone."""

    def __init__(self, parameters: RobotParameters, model: Kinematics) -> None:
        self._tool, self._base = parameters.tool_frame, parameters.base_frame
        self._model = model
        self._positions: Dict[str, float] = {}

    def pose(self, message: bytes) -> Optional[ToolPose]:
        """See PoseDecoder; there are no messages with a pose."""
        return None

    def take_joints(self, positions: Mapping[str, float], stamp: rospy.Time
                    ) -> Optional[ToolPose]:
        """See PoseDecoder; joints that do not move the tool, as a gripper's, give no pose."""
        self._positions.update(positions)
        if positions.keys().isdisjoint(self._model.joints_between(self._tool, self._base)):
            return None
        place = self._model.placement(self._tool, self._base, self._positions)
        if place is None:
            raise FramesNotConnected(f'the place of the tool frame {self._tool} in {self._base} '
                                     'is not known')
        return ToolPose(place.position, place.quaternion, stamp_s=stamp.to_sec())


class _MessageDecoder(PoseDecoder):
    """Decodes messages with a pose in any frame; joints may be between it and the base."""

    def __init__(self, decode: Decoder[ToolPose], base_frames: BaseFrames) -> None:
        self._decode, self._base_frames = decode, base_frames
        self._joints = JointHistory()

    def pose(self, message: bytes) -> Optional[ToolPose]:
        """See PoseDecoder."""
        return self._base_frames.in_base(self._decode(message), self._joints)

    def take_joints(self, positions: Mapping[str, float], stamp: rospy.Time
                    ) -> Optional[ToolPose]:
        """See PoseDecoder."""
        self._joints.add(stamp.to_sec(), positions)
        return None
