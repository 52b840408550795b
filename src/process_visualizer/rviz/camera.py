# SPDX-License-Identifier: BSD-3-Clause
"""Decides the pose of RViz's orbiting camera for a whole cell, and the grid below the cell."""
from __future__ import annotations

import math
from typing import Any, Dict, Mapping

import numpy as np

from process_visualizer.robot.rotations import matrix_from_ypr

FIELD_OF_VIEW_RAD = math.pi / 4
"""Vertical field of view of RViz's camera."""
_MARGIN = 1.08
_BEFORE, _MIN_M = 0.1, 0.1
"""Minimum distance from the camera to the nearest point: as a share of the size, and in m."""
_HALVINGS = 40
_GRID_CELLS = 12
_GRID_STEPS = (1.0, 2.0, 5.0, 10.0)


def camera_pose(points: np.ndarray, view: Mapping[str, Any], aspect: float) -> Dict[str, Any]:
    """Return focal point and distance [m] of an orbiting camera that sees all points, for RViz.

    The camera is as close as possible. ``points`` (n, 3) are in m in the global frame, ``view`` has
    the camera's angles ``Pitch`` and ``Yaw``, and ``aspect`` is the width of the picture divided by
    its height. Without points the result is empty and the default view is kept.
    """
    if not len(points):
        return {}
    axes = camera_axes(float(view.get('Pitch', 0.0)), float(view.get('Yaw', 0.0)))
    right, up, back = (points @ axes).T
    slope = math.tan(0.5 * FIELD_OF_VIEW_RAD) / _MARGIN
    size = float(np.ptp(points, axis=0).max())
    camera = max(_nearest(right, back, slope * aspect), _nearest(up, back, slope),
                 float(back.max()) + max(_BEFORE * size, _MIN_M))
    middle = 0.5 * float(back.min() + back.max())
    focus = axes @ np.array([_middle(right, camera - back), _middle(up, camera - back), middle])
    return {'Distance': round(camera - middle, 3),
            'Focal Point': {axis: round(float(value), 3) for axis, value in zip('XYZ', focus)}}


def seen_points(points: np.ndarray, view: Mapping[str, Any], aspect: float) -> np.ndarray:
    """Return for each point (n, 3) whether an orbiting camera of RViz sees it."""
    focus = view.get('Focal Point') or {}
    axes = camera_axes(float(view.get('Pitch', 0.0)), float(view.get('Yaw', 0.0)))
    place = np.array([float(focus.get(axis, 0.0)) for axis in 'XYZ'])
    right, up, back = ((points - place) @ axes).T
    reach = math.tan(0.5 * FIELD_OF_VIEW_RAD) * (float(view.get('Distance', 0.0)) - back)
    return np.asarray((reach > 0.0) & (np.abs(right) < aspect * reach) & (np.abs(up) < reach))


def camera_axes(pitch: float, yaw: float) -> np.ndarray:
    """Return the directions right, up and to the camera, as columns (3, 3) in the global frame.

    The angles give the direction from the focal point to RViz's orbiting camera.
    """
    turned = matrix_from_ypr((yaw, -pitch, 0.0))
    return np.column_stack([turned[:, 1], turned[:, 2], turned[:, 0]])


def _nearest(across: np.ndarray, back: np.ndarray, slope: float) -> float:
    """Return the smallest position back at which a camera sees all points between its edges.

    A camera at x sees a point if ``|across - x| <= slope * (camera - back)``. The camera is as near
    as possible when the lower and upper bounds for x that follow from all points meet.
    """
    least, greatest = (across + slope * back).max(), (across - slope * back).min()
    return float(0.5 * (least - greatest) / slope)


def _middle(across: np.ndarray, depth: np.ndarray) -> float:
    """Return the camera position from which points extend equally far to both sides."""
    low, high = float(across.min()), float(across.max())
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        slopes = (across - middle) / depth
        low, high = (middle, high) if slopes.max() + slopes.min() > 0.0 else (low, middle)
    return 0.5 * (low + high)


def grid_below(points: np.ndarray) -> Dict[str, Any]:
    """Return cell size and position of a grid below the points, in RViz's terms."""
    if not len(points):
        return {}
    low, high = points.min(axis=0), points.max(axis=0)
    cell = _round_size(1.25 * float((high - low)[:2].max()) / _GRID_CELLS)
    x, y = (cell * round(float(value) / cell) for value in 0.5 * (low + high)[:2])
    return {'Cell Size': cell, 'Offset': {'X': round(x, 3), 'Y': round(y, 3), 'Z': 0},
            'Plane Cell Count': _GRID_CELLS}


def _round_size(size: float) -> float:
    """Return the next larger round size (1, 2, 5, 10 and so on)."""
    power = 10.0 ** math.floor(math.log10(max(size, 1e-3)))
    return float(next(step * power for step in _GRID_STEPS if step * power >= 0.999 * size))
