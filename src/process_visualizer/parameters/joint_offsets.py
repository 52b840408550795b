# SPDX-License-Identifier: BSD-3-Clause
"""Offsets that are added to the measured positions of a robot's joints, for joint_proc."""
from __future__ import annotations

from typing import Any, Dict, Mapping

from process_visualizer.parameters.reading import is_number
from process_visualizer.ros_names import JOINT_PROC

JOINT_OFFSETS = f'{JOINT_PROC}/joint_offsets'
"""Its name in the robot's namespace; joint_proc (C++) reads it as ~joint_offsets."""


def usable_offsets(values: Any) -> Dict[str, float]:
    """Return the offsets [rad or m] by the names of joints; joint_proc refuses any others."""
    if not isinstance(values, Mapping):
        return {}
    return {name: float(value) for name, value in values.items() if is_number(value)}
