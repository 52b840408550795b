# SPDX-License-Identifier: BSD-3-Clause
"""The models of the robots whose reference is drawn as a ghost."""
from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from typing import Dict, Mapping, Optional

from process_visualizer.cell.model import Cell, Device, DeviceType
from process_visualizer.descriptions.robot_description import (
    ModelError,
    RobotDescription,
    describe_device,
)

Models = Mapping[str, RobotDescription]
"""By the names of their devices."""


def robot_models(cell: Cell) -> Models:
    """Return the models that can be used; the cell itself tells of the others."""
    robots = [it for it in cell.devices if it.type is DeviceType.ROBOT]
    with ThreadPoolExecutor(2) as pool:  # most of the time xacro reads models, as processes
        found: Dict[str, Optional[RobotDescription]] = dict(
            zip((it.name for it in robots), pool.map(_model, robots)))
    return {name: model for name, model in found.items() if model is not None}


def _model(device: Device) -> Optional[RobotDescription]:
    try:
        return describe_device(device)
    except ModelError:
        return None
