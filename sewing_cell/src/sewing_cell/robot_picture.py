# SPDX-License-Identifier: BSD-3-Clause
"""The Kinect's picture of the robots: the meshes of their links, as the URDF has them."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import rospkg

from sewing_cell import pinhole
from sewing_cell.arms import Arm
from sewing_cell.collada import read_mesh
from sewing_cell.kinematics import link_frames
from sewing_cell.mesh_picture import Mesh, Picture

MESHES = (*(f"ur-link{number}" for number in range(8)), "ur-tool")
"""Of the frames that ``link_frames`` returns, in their order."""


def link_poses(
    arm: Arm, joints: np.ndarray, camera: np.ndarray = pinhole.POSITION
) -> np.ndarray:
    """Poses (..., 9, 4, 4) of an arm's links and tool in a camera, given its joints (..., 6) [rad].

    ``camera`` (3,) is the camera's place in ``world`` [m].
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
    return tuple(read_mesh(f"{folder}/meshes/{name}.dae") for name in MESHES)
