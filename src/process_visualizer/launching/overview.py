"""A cell in words, for the terminal."""
from __future__ import annotations

from typing import List, Sequence

from process_visualizer.cell.model import Cell, Device, Mode, Topic


def overview(cell: Cell, devices: Sequence[Device]) -> str:
    """The devices with their frames, nodes and topics."""
    blocks = [f'{cell.file}\nglobal frame: {cell.frame}']
    return '\n\n'.join(blocks + ['\n'.join(_device_lines(device)) for device in devices])


def _device_lines(device: Device) -> List[str]:
    lines = [f'{device.name} ({device.type.value})']
    if device.base is not None:
        pose = device.base.pose
        lines.append(f'  base frame  {device.base.frame}  xyz {_numbers(pose.xyz)} m  '
                     f'yaw pitch roll {_numbers(pose.ypr)} rad')
    if device.model is not None:
        lines.append(f'  model       {device.model.package}/{device.model.path}')
    for node in device.nodes:
        lines.append(f'  node        {node.package}/{node.type}{_mode(node.mode)}')
    for file in device.launch_files:
        lines.append(f'  launch      {file.package}/{file.type}{_mode(file.mode)}')
    lines += [f'  topic       {_topic(topic)}' for topic in device.topics]
    return lines + [f'  variable    {variable.topic} {variable.field}, at {variable.frame}'
                    for variable in device.variables]


def _numbers(values: Sequence[float]) -> str:
    return ' '.join(f'{value:g}' for value in values)


def _mode(mode: 'Mode | None') -> str:
    return '' if mode is None else f'  ({mode.value} only)'


def _topic(topic: Topic) -> str:
    notes = [] if topic.function is None else [topic.function.value]
    if not topic.record:
        notes.append('not recorded')
    return topic.name + (f'  ({", ".join(notes)})' if notes else '')
