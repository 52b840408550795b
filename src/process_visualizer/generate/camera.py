"""Where RViz's camera stands so that the whole cell is in view."""
from __future__ import annotations

import math
from typing import Any, Dict, Sequence

from process_visualizer.cell.model import Device, DeviceType

_RADIUS_M = {DeviceType.ROBOT: 0.95, DeviceType.OTHER: 0.55}
_DISTANCE_PER_RADIUS = 1.75


def camera_pose(devices: Sequence[Device]) -> Dict[str, Any]:
    """Focal point and distance (m) of an orbiting camera, in RViz's terms.

    Depth sensors do not count: they look at the scene from far away. Without a base frame to go
    by, the result is empty and the default view stays.
    """
    reaches = [(device.base.pose.xyz, _RADIUS_M[device.type]) for device in devices
               if device.base is not None and device.type in _RADIUS_M]
    if not reaches:
        return {}
    low = [min(xyz[axis] - radius for xyz, radius in reaches) for axis in range(3)]
    high = [max(xyz[axis] + radius for xyz, radius in reaches) for axis in range(3)]
    center = [(a + b) / 2 for a, b in zip(low, high)]
    radius = math.sqrt(sum((b - a) ** 2 for a, b in zip(low, high))) / 2
    return {'Distance': round(radius * _DISTANCE_PER_RADIUS, 3),
            'Focal Point': {axis: round(value, 3) for axis, value in zip('XYZ', center)}}
