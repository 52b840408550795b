# SPDX-License-Identifier: BSD-3-Clause
"""The topics that the nodes of the program publish for devices (thesis, appendix D.2)."""
from __future__ import annotations

from dataclasses import replace
from typing import Dict, Iterable, Set, Tuple

from process_visualizer.cell.builder import absolute_topic
from process_visualizer.cell.model import Device, DeviceType, Topic
from process_visualizer.ros_names import FINDER_OUTPUTS, OBJECTS, ROBOT_OUTPUTS

_OUTPUTS: Dict[DeviceType, Tuple[str, ...]] = {
    DeviceType.ROBOT: ROBOT_OUTPUTS,
    DeviceType.DEPTH_SENSOR: ('points', 'points_age'),
    DeviceType.OTHER: ()}
"""Topics that are published in the namespace of a device, by its type."""


def outputs(devices: Iterable[Device]) -> Dict[str, str]:
    """Return the topics that the program publishes for devices, with the device of each."""
    return {absolute_topic(device.name, output): device.name
            for device in devices for output in _outputs(device)}


def _outputs(device: Device) -> Tuple[str, ...]:
    return _OUTPUTS[device.type] + (
        ('marker_array',) if any(it.is_shown for it in device.variables) else ()) + (
        () if device.objects is None else FINDER_OUTPUTS)


def recorded_outputs(device: Device) -> Tuple[str, ...]:
    """Return the topics of `outputs` that are recorded by default: unmodeled objects.

    They are never played, as the nodes compute them again; pages of recordings show them.
    """
    return () if device.objects is None else (absolute_topic(device.name, OBJECTS),)


def with_variable_topics(devices: Iterable[Device]) -> Tuple[Device, ...]:
    """Return the devices, with topics added for variables whose topic no <topic> names.

    Topics that the program itself publishes are not added, as they are not played.
    """
    given = tuple(devices)
    taken = {topic.name for device in given for topic in device.topics} | set(outputs(given))
    return tuple(_completed(device, taken) for device in given)


def _completed(device: Device, taken: Set[str]) -> Device:
    topics = list(device.topics)
    for variable in device.variables:
        if variable.topic not in taken:
            taken.add(variable.topic)
            topics.append(Topic(variable.topic, None, None, True, variable.location))
    return replace(device, topics=tuple(topics))
