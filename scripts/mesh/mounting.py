# SPDX-License-Identifier: BSD-3-Clause
"""The mounting of robots and Kinect: the cell's stand in world, the Kinect in camera_link."""

from __future__ import annotations

import math

import numpy as np

from .outline import rounded_polygon
from .primitives import box, cylinder, extrude
from .surface import Parts, Surface, moved

PLATE_THICKNESS_M = 0.020
FLOOR_Z_M = -1.0
COLUMN_X_M = 0.35
BEAM_Z_M = 1.985
KINECT_XY_M = (-0.53, 0.09)


def cell_stand() -> Parts:
    """The plate that carries both robots, its column, and the post with the Kinect's beam."""
    return plate() + column() + kinect_beam()


def plate() -> Parts:
    """The horizontal plate, centered on z = 0: one robot stands on it, the other hangs below."""
    corners = [(-0.12, -0.12), (0.43, -0.12), (0.43, 0.12), (-0.12, 0.12)]
    outline = rounded_polygon(corners, [0.06, 0.02, 0.02, 0.06])
    half = PLATE_THICKNESS_M / 2
    return [("steel", extrude(outline, -half, half, 0.002))]


def column() -> Parts:
    """The column from the floor to the plate, its foot, and the ribs below the plate."""
    height = -PLATE_THICKNESS_M / 2 - FLOOR_Z_M
    pillar = box((0.14, 0.14, height), (COLUMN_X_M, 0, FLOOR_Z_M + height / 2), 0.012)
    foot = box((0.60, 0.60, 0.025), (COLUMN_X_M - 0.05, 0, FLOOR_Z_M + 0.0125), 0.006)
    bolts = [
        cylinder(0.016, 0.02, 0.040, 0.003).moved(COLUMN_X_M - 0.05 + x, y, FLOOR_Z_M)
        for x in (-0.25, 0.25)
        for y in (-0.25, 0.25)
    ]
    ribs = [_rib().moved(y=y) for y in (-0.05, 0.05)]
    return [
        ("frame_grey", pillar),
        ("frame_grey", foot),
        *(("frame_grey", rib) for rib in ribs),
        *(("steel", bolt) for bolt in bolts),
    ]


def _rib() -> Surface:
    """A triangular rib in the x-z plane between the column's front and the plate's underside."""
    corners = [(0.29, -0.12), (0.29, -0.008), (0.19, -0.008)]
    return extrude(rounded_polygon(corners, [0.003] * 3, 2), -0.006, 0.006, 0.002).along("-y")


def kinect_beam() -> Parts:
    """The thin post above the column and the beam from its head to above the Kinect."""
    post = box((0.06, 0.06, BEAM_Z_M), (COLUMN_X_M, 0, BEAM_Z_M / 2), 0.006)
    reach_x, reach_y = KINECT_XY_M[0] - COLUMN_X_M, KINECT_XY_M[1]
    length = math.hypot(reach_x, reach_y)
    cosine, sine = reach_x / length, reach_y / length
    turn = np.array([[cosine, -sine, 0], [sine, cosine, 0], [0, 0, 1]])
    beam = box((length + 0.06, 0.045, 0.045), (length / 2, 0, 0), 0.005).rotated(turn)
    brace = box((0.10, 0.10, 0.012), (COLUMN_X_M, 0, 0.014), 0.003)
    return [
        ("frame_grey", post),
        ("frame_grey", brace),
        ("frame_grey", beam.moved(COLUMN_X_M, 0, BEAM_Z_M)),
    ]


def kinect() -> Parts:
    """The Kinect: x looks out of its face, y to its left; its back hangs on the beam."""
    bar = box((0.062, 0.280, 0.038), (-0.010, 0, 0), 0.010)
    face = box((0.004, 0.250, 0.028), (0.021, 0, 0), 0.001)
    neck = cylinder(0.012, 0.030, 0.068, 0.002).along("-x")
    eyes = [_eye(0.0125, y) for y in (0.075, -0.020, -0.060)]
    return [
        ("graphite", bar),
        ("black", face),
        ("frame_grey", neck),
        *(part for eye in eyes for part in eye),
    ]


def _eye(radius: float, y: float) -> Parts:
    ring = cylinder(radius, 0.020, 0.026, 0.001).along("x")
    lens = cylinder(0.7 * radius, 0.020, 0.028, 0.001).along("x")
    return moved([("frame_grey", ring), ("lens", lens)], y=y)
