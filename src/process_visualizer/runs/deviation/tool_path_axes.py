# SPDX-License-Identifier: BSD-3-Clause
"""Axes along, to the left of, and up from the path of a tool."""
from __future__ import annotations

import numpy as np

_LEAST_SPEED_M_S = 0.005


def path_axes(positions: np.ndarray, rate_hz: float) -> np.ndarray:
    """Return unit vectors (n, 3, 3): along the path, sideways (left), up; in the positions' frame.

    Up is z; along is the horizontal direction of the path. Where the tool rests or moves straight
    up or down, it is that of the nearest moment at which the tool moves horizontally.

    Args:
        positions: (n, 3) [m], with z up; NaN where unknown.
        rate_hz: of the rows.
    """
    along = np.column_stack((_directions(positions[:, :2], rate_hz), np.zeros(len(positions))))
    up = np.tile((0.0, 0.0, 1.0), (len(positions), 1))
    return np.stack((along, np.cross(up, along), up), axis=1)


def _directions(positions: np.ndarray, rate_hz: float) -> np.ndarray:
    if len(positions) < 2:
        return np.tile((1.0, 0.0), (len(positions), 1))
    velocity = np.gradient(positions, axis=0) * rate_hz
    speed = np.linalg.norm(velocity, axis=1)
    moving = np.flatnonzero(speed > _LEAST_SPEED_M_S)  # not where it is NaN
    if not len(moving):
        return np.tile((1.0, 0.0), (len(positions), 1))
    behind = np.searchsorted(moving, np.arange(len(positions)))
    later = moving[np.minimum(behind, len(moving) - 1)]
    earlier = moving[np.maximum(behind - 1, 0)]
    here = np.arange(len(positions))
    nearest = np.where(np.abs(later - here) <= np.abs(here - earlier), later, earlier)
    result: np.ndarray = velocity[nearest] / speed[nearest, np.newaxis]
    return result
