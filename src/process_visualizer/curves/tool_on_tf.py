# SPDX-License-Identifier: BSD-3-Clause
"""Tool poses in a recording's tf, with the frames that the cell itself adds."""
from __future__ import annotations

from typing import Dict, List, Optional, Protocol, Sequence, Tuple

import numpy as np

from process_visualizer.bags.bag_errors import BagDamaged
from process_visualizer.bags.bag_index import BagIndex
from process_visualizer.cell.model import Device, TopicFunction
from process_visualizer.curves.curve_sources import CurveSource
from process_visualizer.curves.given_parameters import given_parameters
from process_visualizer.descriptions.robot_description import (
    ModelError,
    RobotDescription,
    describe_device,
)
from process_visualizer.descriptions.robot_frames import pose_frames
from process_visualizer.descriptions.tool_frame import tool_frame
from process_visualizer.messages.number_places import (
    FloatArrayLocator,
    JointLocator,
    Locator,
    TransformLocator,
    transforms_in,
)
from process_visualizer.motion.joint_matching import JointMatching
from process_visualizer.motion.kinematics import Kinematics, Placement
from process_visualizer.motion.rotations import quaternion_from_ypr
from process_visualizer.motion.tool_path import (
    FrameSources,
    MovingPart,
    SentTransform,
    ToolPath,
)
from process_visualizer.parameters.joint_offsets import JOINT_OFFSETS, usable_offsets
from process_visualizer.ros_names import FLOAT_ARRAY, JOINT_STATE, STATIC_TF_TOPIC

_BLOCKS, _BLOCK = 5, 100
"""In so many parts of a recording, so many messages of each publisher are looked at."""


class Messages(Protocol):
    """Messages that have come: a recording, or what a recorder has in memory."""

    @property
    def index(self) -> BagIndex:
        """Their connections and times."""

    def message(self, position: int) -> memoryview:
        """Return the bytes of one; raises BagDamaged if it cannot be read."""


Parts = Tuple[Dict[int, Locator], ...]


def tool_on_tf(messages: Messages, source: CurveSource, device: Device,
               connections: Sequence[int]) -> Optional[Tuple[ToolPath, Parts]]:
    """Return how a tool is found from transforms, and what finds the numbers of its moving parts.

    Frames that the recording does not have are those of the device's model, which the cell's
    robot_state_publisher sends; what moves them are the recorded joint states. The model is
    loaded where it is needed. None where nothing that moves leads to the tool.
    """
    frames = _recorded_frames(messages, connections)
    _add_tool(frames, device)
    description = _description(device) if source.model else None
    base, tool = pose_frames(device, description) if source.model else source.frames
    path, matching = frames.path(base, tool), None
    if path is None:
        description = description or _description(device)
        if description is not None:
            matching = joint_matching(device, description)
            frames.add_model(Kinematics(description.text), matching.offset)
            path = frames.path(base, tool)
    if path is None or not path.moving:
        return None
    return path, tuple(_locators(messages, part, device, matching, connections)
                       for part in path.moving)


def _add_tool(frames: FrameSources, device: Device) -> None:
    """Add the frame in which a configured tool is: cell_frames sends it."""
    tool = tool_frame(device, None)
    if device.tool is not None and tool.frame != tool.parent:
        x, y, z, w = (float(it) for it in quaternion_from_ypr(tool.pose.ypr))
        frames.add_fixed(tool.parent, tool.frame, Placement(tool.pose.xyz, (x, y, z, w)))


def joint_matching(device: Device, description: RobotDescription) -> JointMatching:
    """Return what joint_proc makes of joints, with the offsets that the configuration gives it."""
    prefix = '' if device.model is None else device.model.prefix
    return JointMatching(device.name, list(description.joints),
                         usable_offsets(given_parameters(device, JOINT_OFFSETS)), prefix)


def _description(device: Device) -> Optional[RobotDescription]:
    """A model that cannot be used counts for none: a recording needs none to be looked at."""
    try:
        return describe_device(device)
    except ModelError:
        return None


def _recorded_frames(messages: Messages, connections: Sequence[int]) -> FrameSources:
    frames = FrameSources()
    for data in _some_messages(messages, connections):
        for transform in transforms_in(data):
            frames.add_sent(SentTransform(transform.parent, transform.child))
    index = messages.index
    for data in _some_messages(messages, index.connections_of(STATIC_TF_TOPIC)):
        for it in transforms_in(data):
            x, y, z, *turn = np.frombuffer(data, '<f8', 7, it.pose).tolist()
            frames.add_fixed(it.parent, it.child, Placement((x, y, z), tuple(turn)))
    return frames


def _some_messages(messages: Messages, connections: Sequence[int]) -> List[memoryview]:
    found = []
    for connection in connections:
        positions = messages.index.positions(connection)
        begins = np.linspace(0, max(len(positions) - _BLOCK, 0), _BLOCKS).astype(int).tolist()
        rows = sorted({row for begin in begins for row in range(begin, begin + _BLOCK)})
        for position in positions[rows[:len(positions)]].tolist():
            try:
                found.append(messages.message(position))
            except BagDamaged:
                continue
    return found


def _locators(messages: Messages, part: MovingPart, device: Device,
              matching: Optional[JointMatching],
              connections: Sequence[int]) -> Dict[int, Locator]:
    if isinstance(part, SentTransform):
        return {number: TransformLocator(*part) for number in connections}
    if matching is None:
        return {}
    found = {}
    for topic in device.topics_for(TopicFunction.JOINT_STATES):
        for number in messages.index.connections_of(topic.name):
            locator = joint_locator(messages.index.connections[number].type, part.name, matching)
            if locator is not None:
                found[number] = locator
    return found


def joint_locator(message_type: str, joint: str, matching: JointMatching) -> Optional[Locator]:
    """Return what finds a joint's position as joint_proc does: by its name, or in model order."""
    if message_type == JOINT_STATE:
        return JointLocator(matching.names(joint))
    if message_type == FLOAT_ARRAY and joint in matching.joints:
        return FloatArrayLocator(matching.joints.index(joint) + 1, (len(matching.joints),))
    return None
