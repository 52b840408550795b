# SPDX-License-Identifier: BSD-3-Clause
"""Adds the topics of variables to a device's topics, to be recorded and played."""
from __future__ import annotations

from dataclasses import replace
from typing import Iterable, Set, Tuple

from process_visualizer.cell.model import Device, Topic
from process_visualizer.cell.outputs import outputs


def with_variable_topics(devices: Iterable[Device]) -> Tuple[Device, ...]:
    """Return the devices with the topics of their variables that no <topic> names.

    Topics that the program itself publishes are left out, as they are not recorded.
    """
    found = tuple(devices)
    taken = {topic.name for device in found for topic in device.topics} | set(outputs(found))
    return tuple(_completed(device, taken) for device in found)


def _completed(device: Device, taken: Set[str]) -> Device:
    topics = list(device.topics)
    for variable in device.variables:
        if variable.topic not in taken:
            taken.add(variable.topic)
            topics.append(Topic(variable.topic, None, None, True, variable.location))
    return replace(device, topics=tuple(topics))
