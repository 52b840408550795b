# SPDX-License-Identifier: BSD-3-Clause
"""The static objects in the Kinect's view, in ``world``, and their picture from above.

What the cell shows as a model is drawn as the same model, so that cloud and model agree.
"""

from __future__ import annotations

import numpy as np
import rospkg

from sewing_cell import layout, pinhole
from sewing_cell.collada import read_mesh
from sewing_cell.mesh_picture import Picture, box_mesh, joined

_TILE_M, _JOINT_M = 0.5, 0.008
_FRAME, _SUPPLY, _FLOOR = (92, 96, 102), (120, 134, 150), (118, 116, 112)

#: What no model shows, the floor and a supply table: two opposite corners [m], and a colour.
BOXES = (
    ((-9, -9, layout.FLOOR_Z - 0.1), (9, 9, layout.FLOOR_Z), _FLOOR),
    ((-0.80, 0.62, 0.0), (-0.24, 1.50, 0.03), _SUPPLY),
    ((-0.76, 0.66, -1.0), (-0.70, 0.72, 0.0), _FRAME),
    ((-0.34, 0.66, -1.0), (-0.28, 0.72, 0.0), _FRAME),
)

#: The models of this package that stand still, and where.
MESHES = (
    ("sewing_machine", layout.MACHINE_BASE),
    ("cell_stand", np.zeros(3)),
)


def still_picture(camera: np.ndarray = pinhole.POSITION) -> Picture:
    """The picture of boxes and meshes from ``camera`` [m]."""
    picture = Picture.empty()
    camera_from_world = pinhole.camera_from_world(camera)
    picture.draw(joined([box_mesh(*box) for box in BOXES]), camera_from_world)
    points = camera + picture.depth[..., None] * pinhole.rays()
    picture.colour[:] = picture.colour * _tiles(points)[..., None]
    folder = rospkg.RosPack().get_path("sewing_cell")
    for name, position in MESHES:
        mesh = read_mesh(f"{folder}/meshes/{name}.dae")
        picture.draw(mesh, camera_from_world @ pinhole.moved_by(position))
    return picture


def _tiles(points: np.ndarray) -> np.ndarray:
    """Brightness of the floor's tiles: darker in the joints; 1 above the floor."""
    on_floor = points[..., 2] < layout.FLOOR_Z + 1e-4
    joint = (np.mod(points[..., :2], _TILE_M) < _JOINT_M).any(axis=-1)
    return np.where(on_floor & joint, 0.8, 1.0)
