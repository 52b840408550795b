# SPDX-License-Identifier: BSD-3-Clause
"""The distance between two poses."""
from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from process_visualizer.cell.model import Pose
from process_visualizer.motion.rotations import matrix_from_ypr


class PoseDifference(NamedTuple):
    """The distance of two origins [m], and the angle [rad] by which one has to be turned."""

    distance_m: float
    angle_rad: float

    def __str__(self) -> str:
        return f'{1000.0 * self.distance_m:.1f} mm and {math.degrees(self.angle_rad):.2f}°'


def pose_difference(one: Pose, other: Pose) -> PoseDifference:
    """Return the difference of two poses in the same frame.

    The angle is that of the rotation between them: yaw and roll of a sensor that looks down may
    differ by much while it is hardly turned.
    """
    turn = matrix_from_ypr(one.ypr).T @ matrix_from_ypr(other.ypr)
    # sin and cos: the arc cosine alone is wrong by 1e-8 rad near zero
    sine = 0.5 * math.sqrt((turn[2, 1] - turn[1, 2]) ** 2 + (turn[0, 2] - turn[2, 0]) ** 2
                           + (turn[1, 0] - turn[0, 1]) ** 2)
    cosine = 0.5 * (float(np.trace(turn)) - 1.0)
    return PoseDifference(math.dist(one.xyz, other.xyz), math.atan2(sine, cosine))
