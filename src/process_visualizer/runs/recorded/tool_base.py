# SPDX-License-Identifier: BSD-3-Clause
"""The pose, in the global frame, of the frame in which a recorded tool position is given."""
from __future__ import annotations

from typing import Optional

from process_visualizer.bags.bag_errors import BagDamaged
from process_visualizer.bags.recording import Recording
from process_visualizer.cell.model import Cell, TopicFunction
from process_visualizer.curves.curve_sources import CurveSource
from process_visualizer.descriptions.robot_frames import base_frame
from process_visualizer.messages.message_layout import MessageDamaged, checked_end, read_length
from process_visualizer.motion.kinematics import Placement
from process_visualizer.motion.rotations import quaternion_from_ypr
from process_visualizer.ros_names import POSE_STAMPED

_FRAME_OFFSET = 12
"""In a std_msgs/Header, behind sequence number and stamp."""


def tool_base(recording: Recording, cell: Cell, source: CurveSource) -> Placement:
    """Return the place of the frame of a source's positions; an unknown frame counts as global.

    The frame is that of the messages, otherwise the one that the configuration names.
    """
    device = cell.device(source.device)
    topic = device.topic_for(TopicFunction.TOOL_CENTER_FRAME)
    named = None if topic is None else topic.parent_frame
    frame = header_frame(recording, source.topic, POSE_STAMPED) or named or base_frame(device)
    for base in (it.base for it in cell.devices):
        if base is not None and base.frame == frame:
            x, y, z, w = (float(it) for it in quaternion_from_ypr(base.pose.ypr))
            return Placement(base.pose.xyz, (x, y, z, w))
    return Placement()


def header_frame(recording: Recording, topic: str, kind: str) -> Optional[str]:
    """Return the frame in the first message of a topic, if it is of a type with a header."""
    index = recording.index
    for number in index.connections_of(topic):
        positions = index.positions(number)
        if index.connections[number].type != kind or not len(positions):
            continue
        try:
            data = recording.message(int(positions[0]))
            length, begin = read_length(data, _FRAME_OFFSET)
            return bytes(data[begin:checked_end(data, begin, length)]).decode(
                'utf-8', 'replace').strip('/') or None
        except (BagDamaged, MessageDamaged):
            continue
    return None
