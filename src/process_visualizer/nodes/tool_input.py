"""Subscribes what brings the tool's pose, and understands recorded messages of it likewise."""
from __future__ import annotations

from typing import Callable, Optional

from process_visualizer.nodes.frame_reader import TF_MESSAGE, FrameReader, PoseDecoder
from process_visualizer.nodes.message_reader import TopicReader
from process_visualizer.nodes.parameters import RobotParameters
from process_visualizer.nodes.robot_messages import POSE_DECODERS, ToolPose


class ToolInput:
    """The tool's poses, from messages of a pose or of transforms; each in the base frame."""

    def __init__(self, parameters: RobotParameters, callback: Callable[[ToolPose], None],
                 on_static: Callable[[], None]) -> None:
        """Subscribe, if there is a topic.

        Args:
            parameters: the robot processor's.
            callback: called with each pose; may raise as that of TopicReader.
            on_static: called when static transforms have changed that the poses depend on.
        """
        self._topic, self._base_frame = parameters.tool_center_frame, parameters.base_frame
        self._callback = callback
        self._frames: Optional[FrameReader] = None
        if self._topic.message_type == TF_MESSAGE:
            self._frames = FrameReader(parameters.robot_name, self._topic.name, self._base_frame,
                                       self._topic.frame or parameters.tool_frame, callback,
                                       on_static)
        elif self._topic.name:
            TopicReader(parameters.robot_name, self._topic.name, self._topic.message_type,
                        POSE_DECODERS, self._take)

    def decoder(self, message_type: str) -> Optional[PoseDecoder]:
        """Return what understands messages of a type, in their order; None if it is not taken."""
        if self._frames is not None:
            return self._frames.decoder() if message_type == TF_MESSAGE else None
        decode = POSE_DECODERS.get(message_type)
        if decode is None or self._topic.message_type not in ('', message_type):
            return None
        return lambda message: self._checked(decode(message))

    def _take(self, pose: ToolPose) -> None:
        self._callback(self._checked(pose))

    def _checked(self, pose: ToolPose) -> ToolPose:
        if pose.frame not in ('', self._base_frame):
            raise ValueError(f'its frame is {pose.frame}, and the base frame '
                             f'{self._base_frame} is expected')
        return pose
