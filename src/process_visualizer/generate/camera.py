"""Where RViz's camera stands so that the whole cell is in view."""
from __future__ import annotations

import math
from typing import Any, Dict, Sequence

from process_visualizer.cell.model import Device, DeviceType

_REACH_M = 0.85
"""How far a robot or a machine extends around its base."""
_DISTANCE_PER_RADIUS = 2.35


def camera_pose(devices: Sequence[Device]) -> Dict[str, Any]:
    """Focal point and distance (m) of an orbiting camera, in RViz's terms.

    Depth sensors do not count: they look at the scene from far away. Without a base frame to go
    by, the result is empty and the default view stays.
    """
    points = [device.base.pose.xyz for device in devices
              if device.base is not None and device.type is not DeviceType.DEPTH_SENSOR]
    if not points:
        return {}
    low = [min(point[axis] for point in points) for axis in range(3)]
    high = [max(point[axis] for point in points) for axis in range(3)]
    center = [(a + b) / 2 for a, b in zip(low, high)]
    radius = _REACH_M + math.dist(low, high) / 2
    return {'Distance': round(radius * _DISTANCE_PER_RADIUS, 3),
            'Focal Point': {axis: round(value, 3) for axis, value in zip('XYZ', center)}}
