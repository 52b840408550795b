# SPDX-License-Identifier: BSD-3-Clause
"""A robot's base frame, and the transform that is the pose of its tool, if it comes from tf."""
from __future__ import annotations

from typing import Optional, Tuple

from process_visualizer.cell.model import Device, TopicFunction
from process_visualizer.descriptions.robot_description import RobotDescription
from process_visualizer.descriptions.tool_frame import tool_frame
from process_visualizer.motion.frame_names import default_base_frame


def base_frame(device: Device) -> str:
    """Return the base frame of a robot."""
    return default_base_frame(device.name) if device.base is None else device.base.frame


def pose_frames(device: Device, description: Optional[RobotDescription]) -> Tuple[str, str]:
    """Parent and child of the transform that is the pose of a robot's tool in tf.

    Without a topic that has the pose, the child is the tool frame itself, where model and joints
    have it.
    """
    topic, tool = device.topic_for(TopicFunction.TOOL_CENTER_FRAME), tool_frame(device, description)
    if topic is None:
        return base_frame(device), tool.frame
    return base_frame(device), topic.frame or tool.parent
