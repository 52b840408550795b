# SPDX-License-Identifier: BSD-3-Clause
"""Something in the cell that no model knows: a box put down, or something of a hand's size."""

from __future__ import annotations

from typing import Mapping

import numpy as np

from sewing_cell import pinhole
from sewing_cell.mesh_picture import Picture, box_mesh

_PERIOD_S = 8.0  # of the hand's way in and out


class Intruder:
    """A thing's size [m] and colour, and its centre in ``world`` [m] outside and inside."""

    def __init__(self, size: tuple[float, float, float], outside: tuple[float, float, float],
                 inside: tuple[float, float, float], colour: tuple[int, int, int]) -> None:
        self.size = np.array(size)
        self._outside, self._inside = np.array(outside), np.array(inside)
        self._mesh = box_mesh(-self.size / 2, self.size / 2, colour)

    def centre(self, time_s: float) -> np.ndarray:
        """Return where it is, (3,) [m]: it moves in and out evenly, and without a jerk."""
        share = 0.5 - 0.5 * np.cos(2 * np.pi * time_s / _PERIOD_S)
        return self._outside + share * (self._inside - self._outside)

    def draw(self, picture: Picture, time_s: float,
             camera: np.ndarray = pinhole.POSITION) -> None:
        """Draw it where it is in front; ``camera`` (3,) is the camera's place in ``world`` [m]."""
        pose = pinhole.camera_from_world(camera) @ pinhole.moved_by(self.centre(time_s))
        picture.draw(self._mesh, pose)


_ON_SUPPLY = (-0.45, 0.90, 0.105)

#: A box on the supply table, and a hand that comes near the upper robot's gripper.
INTRUDERS: Mapping[str, Intruder] = {
    "box": Intruder((0.30, 0.20, 0.15), _ON_SUPPLY, _ON_SUPPLY, (196, 160, 104)),
    "hand": Intruder((0.20, 0.10, 0.06), (-1.0, 0.15, 0.30), (-0.78, 0.15, 0.22), (222, 170, 140)),
}
