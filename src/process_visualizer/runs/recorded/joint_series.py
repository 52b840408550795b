# SPDX-License-Identifier: BSD-3-Clause
"""The joints of robots as series of a recording."""
from __future__ import annotations

from typing import Dict, List, Optional, Sequence

from process_visualizer.bags.recording import Recording
from process_visualizer.cell.model import Device, DeviceType, Topic, TopicFunction
from process_visualizer.curves.curve_sources import CurveSource, Quantity
from process_visualizer.curves.samples import Series
from process_visualizer.curves.source_locators import SourceLocators
from process_visualizer.curves.tool_on_tf import joint_locator, joint_matching
from process_visualizer.descriptions.robot_description import (
    ModelError,
    RobotDescription,
    describe_device,
)
from process_visualizer.messages.number_places import Locator

_COLOR = (0.5, 0.5, 0.5)


def joint_series(recording: Recording, devices: Sequence[Device]) -> List[Series]:
    """Return a series for each joint of the robots whose models can be loaded."""
    found: List[Series] = []
    for device in devices:
        topics = device.topics_for(TopicFunction.JOINT_STATES)
        description = _description(device) if device.type is DeviceType.ROBOT else None
        if topics and description is not None:
            found += _series(recording, device, topics, description)
    return found


def _description(device: Device) -> Optional[RobotDescription]:
    try:
        return describe_device(device)
    except ModelError:
        return None


def _series(recording: Recording, device: Device, topics: Sequence[Topic],
            description: RobotDescription) -> List[Series]:
    matching = joint_matching(device, description)
    connections = [number for topic in topics
                   for number in recording.index.connections_of(topic.name)]
    found = []
    for joint in matching.joints:
        located: Dict[int, Locator] = {}
        for number in connections:
            locator = joint_locator(recording.index.connections[number].type, joint, matching)
            if locator is not None:
                located[number] = locator
        if located:
            name = joint.rpartition('/')[2]
            unit = 'm' if description.joints[joint] == 'prismatic' else 'rad'
            source = CurveSource(device.name, f'joint {name}', unit, _COLOR, Quantity.JOINT,
                                 topics[0].name)
            found.append(Series(source, SourceLocators((located,))))
    return found
