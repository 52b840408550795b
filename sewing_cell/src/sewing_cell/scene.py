# SPDX-License-Identifier: BSD-3-Clause
"""The static objects in the Kinect's view, in ``world``, and their picture from above.

What the cell shows as a model is drawn as the same model, so that cloud and model agree.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import rospkg

from sewing_cell import layout, pinhole
from sewing_cell.mesh_picture import draw, read_mesh

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


_FRAME, _SUPPLY = (92, 96, 102), (120, 134, 150)

FLOOR = _box((-9, 9), (-9, 9), (layout.FLOOR_Z - 0.1, layout.FLOOR_Z), (118, 116, 112))

#: What no model shows: the floor, and a supply table.
BOXES = (
    FLOOR,
    _box((-0.80, -0.24), (0.62, 1.50), (0.0, 0.03), _SUPPLY),
    _box((-0.76, -0.70), (0.66, 0.72), (-1.0, 0.0), _FRAME),
    _box((-0.34, -0.28), (0.66, 0.72), (-1.0, 0.0), _FRAME),
)

#: The models of this package that stand still, and where.
MESHES = (
    ("sewing_machine", layout.MACHINE_BASE),
    ("cell_stand", np.zeros(3)),
)


class Picture(NamedTuple):
    """True depth [m] (480, 640) and colour (480, 640, 3), 0 to 255, of every pixel."""

    depth: np.ndarray
    colour: np.ndarray


def trace(camera: np.ndarray = pinhole.POSITION) -> Picture:
    """The picture of boxes and meshes from ``camera`` [m]: what each pixel's ray meets first."""
    picture = _boxes(camera)
    folder = rospkg.RosPack().get_path("sewing_cell")
    for name, position in MESHES:
        seen_from_first = np.array(position) + pinhole.POSITION - camera
        mesh = read_mesh(f"{folder}/meshes/{name}.dae").placed(np.eye(3), seen_from_first)
        draw(mesh, picture.depth, picture.colour)
    return picture


def _boxes(camera: np.ndarray) -> Picture:
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
