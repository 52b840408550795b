# SPDX-License-Identifier: BSD-3-Clause
"""The transform that is the pose of a robot's tool, if it comes from tf."""
from __future__ import annotations

from typing import Optional, Tuple

from process_visualizer.cell.model import Device, TopicFunction
from process_visualizer.descriptions.robot_description import RobotDescription
from process_visualizer.descriptions.tool_frame import tool_frame


def pose_frames(device: Device, description: Optional[RobotDescription]) -> Tuple[str, str]:
    """Parent and child of the transform that is the pose of a robot's tool in tf."""
    tool = device.topic_for(TopicFunction.TOOL_CENTER_FRAME)
    base = device.base.frame if device.base is not None else f'{device.name}/link0'
    frame = tool.frame if tool is not None else None
    return base, frame or tool_frame(device, description).parent
