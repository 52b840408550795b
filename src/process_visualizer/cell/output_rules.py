# SPDX-License-Identifier: BSD-3-Clause
"""What the program itself publishes must not be named as what a driver publishes."""
from __future__ import annotations

from typing import Sequence

from process_visualizer.cell.errors import ProblemList
from process_visualizer.cell.model import Device
from process_visualizer.cell.outputs import outputs


def check_outputs(devices: Sequence[Device], problems: ProblemList) -> None:
    """Report topics that are outputs: a node would take its own for a driver's.

    Nor are they recorded: in playback the nodes compute them again, beside the recorded ones.
    """
    owners = outputs(devices)
    for device in devices:
        for topic in device.topics:
            owner = owners.get(topic.name)
            if owner is not None:
                problems.add(topic.location, 'topic', f'"{topic.name}" is what the program '
                             f'publishes for the device "{owner}"; name the topic of its driver, '
                             'and if that is called so, give the device another name')
