# SPDX-License-Identifier: BSD-3-Clause
"""Series that every robot has, without a line in the configuration: joints, lags, tool torques."""
from __future__ import annotations

from typing import Dict, Iterator, List, Optional, Sequence, Tuple

from process_visualizer.bagio.bag_errors import BagDamaged
from process_visualizer.bagio.message_definition import (
    Connection,
    DefinitionError,
    parse_definitions,
    short_name,
)
from process_visualizer.bagio.message_layout import MessageDamaged
from process_visualizer.bagio.message_values import message_values
from process_visualizer.bagio.number_places import FieldLocator, Locator
from process_visualizer.bagio.recording import Recording
from process_visualizer.cell.model import Device, DeviceType, TopicFunction
from process_visualizer.curves.curve_sources import CurveSource, Quantity
from process_visualizer.curves.samples import Series, found_series
from process_visualizer.curves.source_locators import SourceLocators, joint_locator, joint_matching
from process_visualizer.robot.description import RobotDescription, usable_description
from process_visualizer.robot.joints import JointMatching

_COLOR = (0.5, 0.5, 0.5)
CONTROLLER_STATE = 'control_msgs/JointTrajectoryControllerState'
_CONTROLLER_STATES = (CONTROLLER_STATE, 'pr2_controllers_msgs/JointTrajectoryControllerState')
"""Message types with the desired and the actual positions of joints."""
_LOOKED_AT = 5


def robot_series(recording: Recording, devices: Sequence[Device]) -> List[Series]:
    """Return the series of the robots among the devices, as far as a recording has them.

    These are, for each joint of a model that can be loaded, its position and its lag behind the
    command, if a controller sends both; and the torque of each force sensor.
    """
    robots = [it for it in devices if it.type is DeviceType.ROBOT]
    found: List[Series] = []
    for device in robots:
        description = usable_description(device)
        if description is not None:
            found += joint_series(recording, device, description).values()
            found += _lags(recording, device, description)
    return found + found_series(recording, list(_torques(robots)), devices)


def joint_series(recording: Recording, device: Device,
                 description: RobotDescription) -> Dict[str, Series]:
    """Return the series of a robot's joints by their names, as far as a recording has them."""
    topics = device.topics_for(TopicFunction.JOINT_STATES)
    matching = joint_matching(device, description)
    found: Dict[str, Series] = {}
    connections = [number for topic in topics
                   for number in recording.index.connections_of(topic.name)]
    for joint in matching.joints:
        located: Dict[int, Locator] = {}
        for number in connections:
            locator = joint_locator(recording.index.connections[number].type, joint, matching)
            if locator is not None:
                located[number] = locator
        if located:
            found[joint] = Series(
                _source(device, description, joint, '', Quantity.JOINT, topics[0].name),
                SourceLocators((located,)))
    return found


def _source(device: Device, description: RobotDescription, joint: str, suffix: str,
            quantity: Quantity, topic: str) -> CurveSource:
    unit = 'm' if description.joints[joint] == 'prismatic' else 'rad'
    return CurveSource(device.name, f'joint {joint.rpartition("/")[2]}{suffix}', unit, _COLOR,
                       quantity, topic)


def _lags(recording: Recording, device: Device,
          description: RobotDescription) -> Iterator[Series]:
    matching = joint_matching(device, description)
    located: Dict[str, Tuple[str, Dict[int, Locator]]] = {}
    for number, connection in enumerate(recording.index.connections):
        if short_name(connection.type) not in _CONTROLLER_STATES:
            continue
        for joint, row in _controlled(recording, number, matching).items():
            locator = _lag_locator(connection, row)
            topic, locators = located.setdefault(joint, (connection.topic, {}))
            if locator is not None and topic == connection.topic:
                locators[number] = locator
    for joint, (topic, locators) in located.items():
        if locators:
            yield Series(_source(device, description, joint, ' lag', Quantity.LAG, topic),
                         SourceLocators((locators,)))


def _controlled(recording: Recording, number: int, matching: JointMatching) -> Dict[str, int]:
    """Return the joints of a robot in the messages of a controller, with their rows."""
    connection = recording.index.connections[number]
    kind = short_name(connection.type)
    for position in recording.index.positions(number)[:_LOOKED_AT].tolist():
        try:
            definitions = parse_definitions(kind, connection.message_definition)
            names = message_values(kind, definitions, recording.message(position))['joint_names']
        except (BagDamaged, MessageDamaged, DefinitionError, KeyError):
            continue
        if isinstance(names, list):
            return {joint: names.index(name) for joint in matching.joints
                    for name in matching.names(joint)[::-1] if name in names}
    return {}


def _lag_locator(connection: Connection, row: int) -> Optional[Locator]:
    try:
        return FieldLocator(connection.type, connection.message_definition,
                            [f'{side}.positions[{row}]' for side in ('desired', 'actual')])
    except (DefinitionError, ValueError):
        return None


def _torques(robots: Sequence[Device]) -> Iterator[CurveSource]:
    for device in robots:
        topic = device.topic_for(TopicFunction.FORCE_SENSOR)
        if topic is not None:
            yield CurveSource(device.name, 'tool torque', 'Nm', _COLOR, Quantity.TORQUE, topic.name,
                              topic.message_type or '')
