# SPDX-License-Identifier: BSD-3-Clause
"""Topics of the program itself must not be named as topics of a driver."""
from __future__ import annotations

from typing import Sequence

from process_visualizer.cell.errors import ProblemList
from process_visualizer.cell.model import Device
from process_visualizer.cell.outputs import outputs


def check_outputs(devices: Sequence[Device], problems: ProblemList) -> None:
    """Report topics that are outputs: a node would mistake its own messages for a driver's.

    They are not recorded either: in playback the nodes compute them again.
    """
    owners = outputs(devices)
    for device in devices:
        for topic in device.topics:
            owner = owners.get(topic.name)
            if owner is not None:
                problems.add(topic.location, 'topic', f'"{topic.name}" is published by the '
                                                      f'program itself for the device "{owner}"; '
                                                      'name the topic of its driver, or rename '
                                                      'the device if that topic has this name')
