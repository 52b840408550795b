# SPDX-License-Identifier: BSD-3-Clause
"""Decides which frame is a robot's tool; this is the only place."""
from __future__ import annotations

from dataclasses import dataclass
from typing import List, Optional, Tuple

from process_visualizer.cell.model import Device, Pose, TopicFunction
from process_visualizer.robot.description import RobotDescription
from process_visualizer.robot.frames import default_base_frame, default_tool_frame

_NAMES = ('tool', 'tcp', 'tool_center_point', 'tool_tip', 'tool0', 'end_effector', 'eef', 'ee',
          'hand', 'gripper', 'flange')
"""Names of tool frames, beginning with the nearest to the workpiece."""
_ENDINGS = ('_link', '_frame')


@dataclass(frozen=True)
class ToolFrame:
    """A robot's tool frame.

    ``frame`` is its name in tf. Its ``pose`` is relative to ``parent``, a link of the model if
    there is one; if the pose is zero, the frame is the parent. ``reason`` explains the choice.
    """

    frame: str
    parent: str
    pose: Pose
    reason: str


def tool_frame(device: Device, description: Optional[RobotDescription]) -> ToolFrame:
    """Return the tool frame of a robot: the configured one, else one suggested by its model."""
    if device.tool is not None:
        moved = device.tool.pose != Pose()
        return ToolFrame(f'{device.name}/tool_center_frame' if moved else device.tool.frame,
                         device.tool.frame, device.tool.pose, 'as configured')
    topic = device.topic_for(TopicFunction.TOOL_CENTER_FRAME)
    if topic is not None and topic.frame is not None \
            and (description is None or topic.frame in description.links):
        return _as_it_is(topic.frame, 'the frame of the topic')
    if description is not None:
        return _of_model(description)
    if device.force is not None:
        return _as_it_is(device.force.parent_frame, 'the parent of the force frame')
    return _as_it_is(default_tool_frame(device.name), 'there is no model to choose from')


def tool_name_rank(frame: str) -> Optional[int]:
    """Return the rank of a tool frame's name, 0 nearest to the workpiece; None for other names."""
    return next((rank for rank, name in enumerate(_NAMES) if _is_called(frame, name)), None)


def _as_it_is(frame: str, reason: str) -> ToolFrame:
    return ToolFrame(frame, frame, Pose(), reason)


def _of_model(description: RobotDescription) -> ToolFrame:
    """Return the link named like a tool, or the end of the arm; never a collision-only link."""
    links = [link for link in description.links if link not in description.collision_only]
    for name in _NAMES:
        named = [link for link in links if _is_called(link, name)]
        if named:
            return _as_it_is(_deepest(description, named), 'chosen by its name')
    drawn = [link for link in links if link in description.drawn]
    last = _deepest(description, drawn or links or list(description.links))
    return _as_it_is(_flange(description, last), 'chosen as the last link of the longest chain')


def _is_called(link: str, name: str) -> bool:
    """Return whether a link has a name after a namespace or a prefix, as in ``left_tool0``."""
    word = link.split('/')[-1].lower()
    for ending in _ENDINGS:
        word = word[:-len(ending)] if word.endswith(ending) else word
    return word == name or word.endswith(f'_{name}')


def _deepest(description: RobotDescription, links: List[str]) -> str:
    return max(links, key=lambda link: len(description.ancestors(link)))


def _flange(description: RobotDescription, link: str) -> str:
    """Return the last in the chain of single child frames after the last drawn link."""
    while True:
        children = [child for child in description.children(link)
                    if child not in description.collision_only]
        if len(children) != 1:
            return link
        link = children[0]


# A robot's base frame, and the transform of its tool pose if that comes from tf.

def base_frame(device: Device) -> str:
    """Return the base frame of a robot."""
    return default_base_frame(device.name) if device.base is None else device.base.frame


def pose_frames(device: Device, description: Optional[RobotDescription]) -> Tuple[str, str]:
    """Return parent and child of the transform in tf that is the pose of a robot's tool.

    Without a topic for the pose, the child is the tool frame itself, placed by model and joints.
    """
    topic, tool = device.topic_for(TopicFunction.TOOL_CENTER_FRAME), tool_frame(device, description)
    if topic is None:
        return base_frame(device), tool.frame
    return base_frame(device), topic.frame or tool.parent
