# SPDX-License-Identifier: BSD-3-Clause
"""The Kinects' scene apart from the covers: static objects, robots, and an unmodeled object."""
from __future__ import annotations

from functools import lru_cache
from typing import Mapping

import numpy as np
import rospkg

from sewing_cell import layout, pinhole
from sewing_cell.kinematics import link_frames
from sewing_cell.layout import Arm
from sewing_cell.mesh_picture import Mesh, Picture, box_mesh, joined, read_mesh

# The static objects in the Kinect's view, in ``world``, and their picture from above.
#
# Objects with a model in the cell are drawn with the same model, so that cloud and model agree.

_TILE_M, _JOINT_M = 0.5, 0.008
_FRAME, _SUPPLY, _FLOOR = (92, 96, 102), (120, 134, 150), (118, 116, 112)

#: Objects without a model, the floor and a supply table: two opposite corners [m], and a color.
BOXES = (
    ((-9, -9, layout.FLOOR_Z - 0.1), (9, 9, layout.FLOOR_Z), _FLOOR),
    ((-0.80, 0.62, 0.0), (-0.24, 1.50, 0.03), _SUPPLY),
    ((-0.76, 0.66, -1.0), (-0.70, 0.72, 0.0), _FRAME),
    ((-0.34, 0.66, -1.0), (-0.28, 0.72, 0.0), _FRAME),
)

#: The static models of this package, and their positions.
MESHES = (
    ("sewing_machine", layout.MACHINE_BASE),
    ("cell_stand", np.zeros(3)),
)


def still_picture(camera: np.ndarray = pinhole.POSITION) -> Picture:
    """Return the picture of boxes and meshes from ``camera`` [m]."""
    picture = Picture.empty()
    camera_from_world = pinhole.camera_from_world(camera)
    picture.draw(joined([box_mesh(*box) for box in BOXES]), camera_from_world)
    points = camera + picture.depth[..., None] * pinhole.rays()
    picture.color[:] = picture.color * _tiles(points)[..., None]
    folder = rospkg.RosPack().get_path("sewing_cell")
    for name, position in MESHES:
        mesh = read_mesh(f"{folder}/meshes/{name}.dae")
        picture.draw(mesh, camera_from_world @ pinhole.moved_by(position))
    return picture


def _tiles(points: np.ndarray) -> np.ndarray:
    """Return the brightness of the floor's tiles: darker in the gaps; 1 above the floor."""
    on_floor = points[..., 2] < layout.FLOOR_Z + 1e-4
    joint = (np.mod(points[..., :2], _TILE_M) < _JOINT_M).any(axis=-1)
    return np.where(on_floor & joint, 0.8, 1.0)


# The Kinect's picture of the robots: the meshes of their links, as the URDF has them.

ROBOT_MESHES = (*(f"ur-link{number}" for number in range(8)), "ur-tool")
"""Meshes of the frames that ``link_frames`` returns, in their order."""


def link_poses(
    arm: Arm, joints: np.ndarray, camera: np.ndarray = pinhole.POSITION
) -> np.ndarray:
    """Poses (..., 9, 4, 4) of an arm's links and tool in a camera, given its joints (..., 6) [rad].

    ``camera`` (3,) is the camera's position in ``world`` [m].
    """
    base = np.eye(4)
    base[:3, :3] = arm.base_rotation
    return pinhole.camera_from_world(camera) @ base @ link_frames(joints)


def draw_robot(picture: Picture, poses: np.ndarray) -> None:
    """Draw a robot whose links and tool have the poses (9, 4, 4) in the camera."""
    for mesh, pose in zip(_meshes(), poses):
        picture.draw(mesh, pose)


@lru_cache(maxsize=1)
def _meshes() -> tuple[Mesh, ...]:
    folder = rospkg.RosPack().get_path("process_visualizer")
    return tuple(read_mesh(f"{folder}/meshes/{name}.dae") for name in ROBOT_MESHES)


_PERIOD_S = 8.0  # of the hand's motion in and out


class Intruder:
    """An unmodeled object: size [m], color, and its center in ``world`` [m] outside and inside."""

    def __init__(self, size: tuple[float, float, float], outside: tuple[float, float, float],
                 inside: tuple[float, float, float], color: tuple[int, int, int]) -> None:
        self.size = np.array(size)
        self._outside, self._inside = np.array(outside), np.array(inside)
        self._mesh = box_mesh(-self.size / 2, self.size / 2, color)

    def center(self, time_s: float) -> np.ndarray:
        """Return the center (3,) [m] of the object, which moves in and out smoothly."""
        share = 0.5 - 0.5 * np.cos(2 * np.pi * time_s / _PERIOD_S)
        return self._outside + share * (self._inside - self._outside)

    def draw(self, picture: Picture, time_s: float,
             camera: np.ndarray = pinhole.POSITION) -> None:
        """Draw it unless occluded; ``camera`` (3,) is a position in ``world`` [m]."""
        pose = pinhole.camera_from_world(camera) @ pinhole.moved_by(self.center(time_s))
        picture.draw(self._mesh, pose)


_ON_SUPPLY = (-0.45, 0.90, 0.105)

#: A box on the supply table, and a hand that approaches the upper robot's gripper.
INTRUDERS: Mapping[str, Intruder] = {
    "box": Intruder((0.30, 0.20, 0.15), _ON_SUPPLY, _ON_SUPPLY, (196, 160, 104)),
    "hand": Intruder((0.20, 0.10, 0.06), (-1.0, 0.15, 0.30), (-0.78, 0.15, 0.22), (222, 170, 140)),
}
