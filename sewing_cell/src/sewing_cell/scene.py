# SPDX-License-Identifier: BSD-3-Clause
"""The static objects in the Kinect's view, as boxes in ``world``, and their picture from above."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sewing_cell import layout, pinhole

LIGHT = np.array([0.75, 0.85, 1.0])  # brightness of faces along x, y, z
_TILE_M, _JOINT_M = 0.5, 0.008


class Box(NamedTuple):
    """An axis-aligned box: two opposite corners [m] and a colour (red, green, blue; 0 to 255)."""

    lower: np.ndarray
    upper: np.ndarray
    colour: tuple[int, int, int]


def _box(x: tuple[float, float], y: tuple[float, float], z: tuple[float, float],
         colour: tuple[int, int, int]) -> Box:
    ends = np.array([x, y, z], dtype=float)
    return Box(ends[:, 0], ends[:, 1], colour)


def _machine_box(x: tuple[float, float], y: tuple[float, float], z: tuple[float, float],
                 colour: tuple[int, int, int]) -> Box:
    """A box given in sewing_machine/base."""
    box = _box(x, y, z, colour)
    return Box(box.lower + layout.MACHINE_BASE, box.upper + layout.MACHINE_BASE, colour)


_WOOD, _PAINT, _STEEL = (186, 158, 118), (206, 208, 196), (150, 154, 158)
_FRAME, _SUPPLY, _DARK = (92, 96, 102), (120, 134, 150), (52, 54, 58)

FLOOR = _box((-9, 9), (-9, 9), (layout.FLOOR_Z - 0.1, layout.FLOOR_Z), (118, 116, 112))

#: After the collision boxes of sewing_machine.urdf and cell_stand.urdf, with a supply table.
BOXES = (
    FLOOR,
    _machine_box((-0.72, 0.32), (-0.62, -0.163), (-0.042, -0.012), _WOOD),
    _machine_box((-0.72, -0.503), (-0.163, 0.03), (-0.042, -0.012), _WOOD),
    _machine_box((-0.50, 0.0), (-0.16, 0.0), (-0.14, 0.0), _STEEL),
    _machine_box((-0.49, -0.33), (-0.135, -0.025), (0.0, 0.30), _PAINT),
    _machine_box((-0.475, -0.025), (-0.135, -0.025), (0.175, 0.305), _PAINT),
    _machine_box((-0.13, -0.03), (-0.135, -0.025), (0.11, 0.18), _PAINT),
    _machine_box((-0.52, -0.475), (-0.12, -0.04), (0.20, 0.28), _DARK),
    _box((-0.12, 0.43), (-0.12, 0.12), (-0.01, 0.01), _STEEL),
    _box((0.0, 0.60), (-0.30, 0.30), (-1.0, -0.975), _FRAME),
    _box((0.28, 0.42), (-0.07, 0.07), (-1.0, -0.01), _FRAME),
    _box((-0.80, -0.24), (0.62, 1.50), (0.0, 0.03), _SUPPLY),
    _box((-0.76, -0.70), (0.66, 0.72), (-1.0, 0.0), _FRAME),
    _box((-0.34, -0.28), (0.66, 0.72), (-1.0, 0.0), _FRAME),
)


class Picture(NamedTuple):
    """True depth [m] (480, 640) and colour (480, 640, 3), 0 to 255, of every pixel."""

    depth: np.ndarray
    colour: np.ndarray


def trace(camera: np.ndarray = pinhole.POSITION) -> Picture:
    """The boxes' picture from ``camera`` [m]: for each pixel the nearest face its ray meets."""
    directions = pinhole.rays()
    directions = np.where(np.abs(directions) < 1e-9, 1e-9, directions)
    depth = np.full(directions.shape[:2], np.inf)
    colour = np.zeros(directions.shape)
    for box in BOXES:
        box_depth, face = intersect(box, camera, directions)
        nearer = box_depth < depth
        depth[nearer] = box_depth[nearer]
        colour[nearer] = LIGHT[face[nearer], None] * np.array(box.colour)
    points = camera + depth[..., None] * directions
    return Picture(depth, colour * _tiles(points)[..., None])


def intersect(
    box: Box, camera: np.ndarray, directions: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Depth where each ray enters the box (inf beside it) and the axis of the face it enters."""
    first = (box.lower - camera) / directions
    second = (box.upper - camera) / directions
    enter, leave = np.minimum(first, second), np.maximum(first, second)
    depth = enter.max(axis=-1)
    meets = (depth <= leave.min(axis=-1)) & (depth > 0)
    return np.where(meets, depth, np.inf), enter.argmax(axis=-1)


def _tiles(points: np.ndarray) -> np.ndarray:
    """Brightness of the floor's tiles: darker in the joints; 1 above the floor."""
    on_floor = points[..., 2] < layout.FLOOR_Z + 1e-6
    joint = (np.mod(points[..., :2], _TILE_M) < _JOINT_M).any(axis=-1)
    return np.where(on_floor & joint, 0.8, 1.0)
