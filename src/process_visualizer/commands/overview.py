# SPDX-License-Identifier: BSD-3-Clause
"""A cell in words, for the terminal."""
from __future__ import annotations

import os
from typing import List, Mapping, Sequence, Tuple

from process_visualizer.cell.model import Cell, Device, DeviceType, Mode, Topic, TopicFunction
from process_visualizer.descriptions.robot_description import RobotDescription
from process_visualizer.descriptions.robot_frames import pose_frames
from process_visualizer.descriptions.tool_frame import tool_frame
from process_visualizer.ros_names import TF_MESSAGE


def overview(cell: Cell, devices: Sequence[Device],
             descriptions: Mapping[str, RobotDescription]) -> str:
    """The devices with their frames, nodes and topics, given the models that can be used."""
    blocks = [f'{cell.file}\nglobal frame: {cell.frame}']
    return '\n\n'.join(blocks + ['\n'.join(_device_lines(device, descriptions))
                                 for device in devices])


def _device_lines(device: Device, descriptions: Mapping[str, RobotDescription]) -> List[str]:
    lines = [f'{device.name} ({device.type.value})']
    if device.base is not None:
        pose = device.base.pose
        lines.append(f'  base frame  {device.base.frame}  xyz {_numbers(pose.xyz)} m  '
                     f'yaw pitch roll {_numbers(pose.ypr)} rad')
    if device.model is not None:
        lines.append(f'  model       {os.path.join(device.model.package, device.model.path)}')
    if device.type is DeviceType.ROBOT:
        lines.append(f'  tool frame  {_tool(device, descriptions)}')
    for node in device.nodes:
        lines.append(f'  node        {node.package}/{node.type}{_mode(node.mode)}')
    for file in device.launch_files:
        lines.append(f'  launch      {file.package}/{file.type}{_mode(file.mode)}')
    lines += [f'  topic       {_topic(topic, _frames(topic, device, descriptions))}'
              for topic in device.topics]
    return lines + [f'  variable    {variable.topic} {variable.field}, at {variable.frame}'
                    for variable in device.variables]


def _tool(device: Device, descriptions: Mapping[str, RobotDescription]) -> str:
    if device.tool is None and device.model is not None and device.name not in descriptions:
        return 'not known, as the model cannot be used (see cell check)'
    tool = tool_frame(device, descriptions.get(device.name))
    place = '' if tool.frame == tool.parent else (
        f'  in {tool.parent}  xyz {_numbers(tool.pose.xyz)} m  '
        f'yaw pitch roll {_numbers(tool.pose.ypr)} rad')
    return f'{tool.frame}{place}  ({tool.reason})'


def _numbers(values: Sequence[float]) -> str:
    return ' '.join(f'{value:g}' for value in values)


def _mode(mode: 'Mode | None') -> str:
    return '' if mode is None else f'  ({mode.value} only)'


def _frames(topic: Topic, device: Device,
            descriptions: Mapping[str, RobotDescription]) -> Tuple[str, ...]:
    """The frames of the values, if the configuration says them."""
    if topic.message_type == TF_MESSAGE and topic.function is TopicFunction.TOOL_CENTER_FRAME:
        base, frame = pose_frames(device, descriptions.get(device.name))
        return (f'{frame} in {base}',)
    return () if topic.parent_frame is None else (f'in {topic.parent_frame}',)


def _topic(topic: Topic, frames: Tuple[str, ...]) -> str:
    notes = [*([] if topic.function is None else [topic.function.value]), *frames]
    if not topic.record:
        notes.append('not recorded')
    return topic.name + (f'  ({", ".join(notes)})' if notes else '')
