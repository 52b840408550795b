# SPDX-License-Identifier: BSD-3-Clause
"""The Kinect's color camera as a pinhole camera that looks down at the cell."""

from __future__ import annotations

import numpy as np

from sewing_cell import layout

WIDTH, HEIGHT = 640, 480
FOCAL_LENGTH_PX = 525.0
CENTER_U, CENTER_V = 319.5, 239.5

#: Axes of an optical frame (x right, y down, z forward) in a body frame (x forward, y left).
_BODY_FROM_OPTICAL = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])


def _world_from_body() -> np.ndarray:
    cos, sin = np.cos(layout.CAMERA_PITCH), np.sin(layout.CAMERA_PITCH)
    return np.array([[cos, 0.0, sin], [0.0, 1.0, 0.0], [-sin, 0.0, cos]])


def position(camera_link: np.ndarray) -> np.ndarray:
    """Return a Kinect's color camera position (3,) in ``world`` [m], from its ``camera_link``."""
    return camera_link + _world_from_body() @ layout.COLOR_CAMERA_OFFSET


#: Pose of camera_rgb_optical_frame in world; a second Kinect differs in its position only.
WORLD_FROM_OPTICAL = _world_from_body() @ _BODY_FROM_OPTICAL
POSITION = position(layout.CAMERA_XYZ)


def camera_from_world(camera: np.ndarray = POSITION) -> np.ndarray:
    """Pose (4, 4) of ``world`` in the optical frame of a camera at ``camera`` (3,) [m]."""
    pose = np.eye(4)
    pose[:3, :3] = WORLD_FROM_OPTICAL.T
    return pose @ moved_by(-camera)


def moved_by(shift: np.ndarray) -> np.ndarray:
    """Return the pose (4, 4) of a translation by ``shift`` (3,) [m], without rotation."""
    pose = np.eye(4)
    pose[:3, 3] = shift
    return pose


def rays() -> np.ndarray:
    """Direction of each pixel's ray in ``world``, per m of depth, shape (480, 640, 3)."""
    u, v = np.meshgrid(np.arange(WIDTH), np.arange(HEIGHT))
    x = (u - CENTER_U) / FOCAL_LENGTH_PX
    y = (v - CENTER_V) / FOCAL_LENGTH_PX
    return np.stack([x, y, np.ones_like(x)], axis=-1) @ WORLD_FROM_OPTICAL.T


def project(points: np.ndarray, camera: np.ndarray = POSITION) -> np.ndarray:
    """Pixel u, v and depth [m] of points (..., 3) in ``world``, shape (..., 3)."""
    optical = (np.asarray(points) - camera) @ WORLD_FROM_OPTICAL
    depth = optical[..., 2]
    u = CENTER_U + FOCAL_LENGTH_PX * optical[..., 0] / depth
    v = CENTER_V + FOCAL_LENGTH_PX * optical[..., 1] / depth
    return np.stack([u, v, depth], axis=-1)


def plane_rows(
    height_m: float, camera: np.ndarray = POSITION
) -> tuple[np.ndarray, np.ndarray]:
    """Depth and world x [m] at which each image row meets the plane z = ``height_m``, (480,).

    The camera is turned about y only, so that each image row has a single x and depth.
    """
    down = rays()[:, 0, :]
    depth = (height_m - camera[2]) / down[:, 2]
    return depth, camera[0] + depth * down[:, 0]
