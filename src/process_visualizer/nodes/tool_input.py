"""Subscribes what brings the tool's pose, and understands recorded messages of it likewise."""
from __future__ import annotations

from typing import Callable, Optional

from process_visualizer.nodes.base_frames import BaseFrames
from process_visualizer.nodes.complaints import Complaints
from process_visualizer.nodes.frame_reader import TF_MESSAGE, FrameReader, PoseDecoder
from process_visualizer.nodes.message_reader import TopicReader
from process_visualizer.nodes.parameters import RobotParameters
from process_visualizer.nodes.robot_messages import POSE_DECODERS, ToolPose


class ToolInput:
    """The tool's poses, from messages of a pose or of transforms; each in the base frame."""

    def __init__(self, parameters: RobotParameters, complaints: Complaints,
                 callback: Callable[[ToolPose], None], on_static: Callable[[], None],
                 base_frames: BaseFrames) -> None:
        """Subscribe, if there is a topic.

        Args:
            parameters, complaints, base_frames: the robot processor's.
            callback: called with each pose; may raise as that of TopicReader.
            on_static: called when static transforms have changed that the poses depend on.
        """
        self._topic, self._callback = parameters.tool_center_frame, callback
        self._base_frames = base_frames
        self._frames: Optional[FrameReader] = None
        if self._topic.message_type == TF_MESSAGE:
            frame = self._topic.frame or parameters.tool_frame
            self._frames = FrameReader(complaints, self._topic.name, parameters.base_frame, frame,
                                       callback, on_static)
        elif self._topic.name:
            TopicReader(complaints, self._topic.name, self._topic.message_type,
                        POSE_DECODERS, self._take)

    def decoder(self, message_type: str) -> Optional[PoseDecoder]:
        """Return what understands messages of a type, in their order; None if it is not taken.

        Nor is it where joints move the frame of the poses: those are not known ahead.
        """
        if self._frames is not None:
            return self._frames.decoder() if message_type == TF_MESSAGE else None
        decode = POSE_DECODERS.get(message_type)
        if decode is None or self._base_frames.follows_joints:
            return None
        if self._topic.message_type not in ('', message_type):
            return None
        return lambda message: self._base_frames.in_base(decode(message))

    def _take(self, pose: ToolPose) -> None:
        self._callback(self._base_frames.in_base(pose))
