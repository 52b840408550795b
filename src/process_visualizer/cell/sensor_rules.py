# SPDX-License-Identifier: BSD-3-Clause
"""Rules about depth sensors beside each other: clouds of their own, and which ones are joined."""
from __future__ import annotations

from typing import Dict, Sequence

from process_visualizer.cell.errors import ProblemList
from process_visualizer.cell.model import Device, DeviceType, Fusion, Topic, TopicFunction
from process_visualizer.cell.suggestions import advice

_DATA = (TopicFunction.POINTCLOUD, TopicFunction.DEPTH_IMAGE)


def check_sensors(devices: Sequence[Device], problems: ProblemList) -> None:
    """Check that each depth sensor has its own data, and that only clouds are joined."""
    _check_own_data(devices, problems)
    for device in devices:
        if device.fusion is not None:
            _check_fusion(device, device.fusion, devices, problems)


def _check_own_data(devices: Sequence[Device], problems: ProblemList) -> None:
    """Two sensors on one topic would be drawn on top of each other, each as a mixture of both."""
    owners: Dict[str, Device] = {}
    for device in devices:
        for topic in device.topics:
            owner = owners.setdefault(topic.name, device) if _is_data(topic) else device
            if owner is not device:
                problems.add(topic.location, 'topic',
                             f'"{topic.name}" belongs to the depth sensor "{owner.name}" already '
                             f'({owner.location}); start each driver in a namespace of its own, '
                             'and name the topic there')


def _is_data(topic: Topic) -> bool:
    return topic.function in _DATA


def _check_fusion(device: Device, fusion: Fusion, devices: Sequence[Device],
                  problems: ProblemList) -> None:
    if device.type is not DeviceType.DEPTH_SENSOR:
        problems.add(fusion.location, 'fusion', 'belongs to depth sensors only; this device has '
                                                f'the type "{device.type.value}"')
    if device.roi is not None or any(topic.function is not None for topic in device.topics):
        problems.add(fusion.location, 'fusion', 'the device has a cloud of its own; give the '
                                                'joined cloud a device of its own')
    clouds = [other.name for other in devices if other.fusion is None and other.has_cloud]
    for name in fusion.sensors:
        if name not in clouds:
            expected = advice(name, clouds) if clouds else 'describe the sensors as devices'
            problems.add(fusion.location, 'fusion', f'there is no depth sensor "{name}" with a '
                                                    f'cloud; {expected}')
