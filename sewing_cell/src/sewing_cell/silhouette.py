# SPDX-License-Identifier: BSD-3-Clause
"""Crude pictures of the robots' links: thick lines from joint to joint."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sewing_cell import layout, pinhole
from sewing_cell.arms import Arm
from sewing_cell.kinematics import link_frames

_TOOL, _TIP = 8, 9

#: Frames between which a link is drawn (link0 = 0 ... link7 = 7) and its radius [m].
_LINKS = (
    (0, 2, 0.072), (2, 3, 0.055), (3, 5, 0.048), (5, 6, 0.043), (6, 7, 0.043), (7, _TOOL, 0.036),
    (_TOOL, _TIP, 0.022),
)
#: The links of the lower robot that the covers and the stand leave to be seen.
_LOWER_LINKS = _LINKS[1:4]


class Patch(NamedTuple):
    """A part of the image: its rows and columns, the pixels drawn, their depth [m] and light."""

    rows: slice
    columns: slice
    mask: np.ndarray
    depth: np.ndarray
    light: np.ndarray


def skeleton(
    arm: Arm, joints: np.ndarray, camera: np.ndarray = pinhole.POSITION
) -> np.ndarray:
    """Pixel u, v and depth [m] of the links' frames and the gripper's tip, shape (..., 10, 3).

    ``joints`` (..., 6) are the arm's angles [rad], ``camera`` (3,) is its place in ``world`` [m].
    """
    frames = link_frames(joints)
    tool = frames[..., _TOOL, :3, :]
    tip = tool[..., 3] + layout.GRIP_HEIGHT * tool[..., 2]
    points = np.concatenate([frames[..., :3, 3], tip[..., None, :]], axis=-2)
    return pinhole.project(points @ arm.base_rotation.T, camera)


def robot(arm: Arm, pixels: list[list[float]]) -> list[Patch]:
    """The links and the gripper of ``arm``, far to near, from one of its skeletons as a list."""
    links = sorted(
        _LINKS if arm.side > 0 else _LOWER_LINKS,
        key=lambda link: -(pixels[link[0]][2] + pixels[link[1]][2]),
    )
    patches = [capsule(pixels[first], pixels[last], radius) for first, last, radius in links]
    return [patch for patch in patches if patch.mask.size]


def capsule(begin: list[float], end: list[float], radius: float) -> Patch:
    """Picture of a round bar between two points (pixel u, v and depth [m] of each)."""
    (u_0, v_0, z_0), (u_1, v_1, z_1) = begin, end
    radius_px = radius * pinhole.FOCAL_LENGTH_PX / min(z_0, z_1)
    rows = _span(v_0, v_1, radius_px, pinhole.HEIGHT)
    columns = _span(u_0, u_1, radius_px, pinhole.WIDTH)
    v = np.arange(rows.start - v_0, rows.stop - v_0 - 0.5, dtype=np.float32)[:, None]
    u = np.arange(columns.start - u_0, columns.stop - u_0 - 0.5, dtype=np.float32)[None, :]
    along_u, along_v = u_1 - u_0, v_1 - v_0
    square = max(along_u**2 + along_v**2, 1e-6)
    share = u * (along_u / square) + v * (along_v / square)
    share = np.minimum(np.maximum(share, 0.0), 1.0)
    distance = (u - share * along_u) ** 2 + (v - share * along_v) ** 2
    bulge = 1.0 - distance * (1.0 / radius_px**2)
    rise = np.sqrt(np.maximum(bulge, 0.0))
    depth = z_0 + (z_1 - z_0) * share - radius * rise
    return Patch(rows, columns, bulge > 0, depth, 0.55 + 0.45 * rise)


def _span(first: float, second: float, margin: float, limit: int) -> slice:
    low = min(max(int(min(first, second) - margin), 0), limit)
    return slice(low, min(max(int(max(first, second) + margin + 1), low), limit))
