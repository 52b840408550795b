# SPDX-License-Identifier: BSD-3-Clause
"""A triangulated surface with one normal per vertex, and how to move it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Iterable, List, Sequence, Tuple

import numpy as np

#: Rotations (3x3) that turn the z axis into the named direction.
TURN_Z_TO = {
    "x": np.array([[0, 0, 1], [0, 1, 0], [-1, 0, 0]]),
    "-x": np.array([[0, 0, -1], [0, 1, 0], [1, 0, 0]]),
    "y": np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]]),
    "-y": np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]]),
    "z": np.eye(3, dtype=int),
    "-z": np.array([[1, 0, 0], [0, -1, 0], [0, 0, -1]]),
}


@dataclass(frozen=True)
class Surface:
    """Points (n, 3) in meters, unit normals (n, 3) and triangles (m, 3) of point numbers.

    Triangles run counter-clockwise when seen from outside.
    """

    points: np.ndarray
    normals: np.ndarray
    triangles: np.ndarray

    def moved(self, x: float = 0.0, y: float = 0.0, z: float = 0.0) -> Surface:
        """The surface shifted by x, y, z meters."""
        return Surface(self.points + np.array([x, y, z]), self.normals, self.triangles)

    def along(self, direction: str) -> Surface:
        """The surface turned so that its z axis points in `direction`, e.g. "-y"."""
        return self.rotated(TURN_Z_TO[direction])

    def rotated(self, rotation: np.ndarray) -> Surface:
        """The surface turned about the origin by a rotation matrix (3x3)."""
        return Surface(self.points @ rotation.T, self.normals @ rotation.T, self.triangles)


#: A piece of a machine: the name of its material and its surface.
Part = Tuple[str, Surface]
Parts = List[Part]


def merged(surfaces: Iterable[Surface]) -> Surface:
    """One surface made of all `surfaces` (at least one), in their order."""
    pieces = list(surfaces)
    starts = np.cumsum([0] + [len(piece.points) for piece in pieces])
    return Surface(
        np.vstack([piece.points for piece in pieces]),
        np.vstack([piece.normals for piece in pieces]),
        np.vstack([piece.triangles + start for piece, start in zip(pieces, starts)]),
    )


def moved(parts: Sequence[Part], x: float = 0.0, y: float = 0.0, z: float = 0.0) -> Parts:
    """All `parts` shifted by x, y, z meters."""
    return [(material, surface.moved(x, y, z)) for material, surface in parts]


def along(parts: Sequence[Part], direction: str) -> Parts:
    """All `parts` turned so that their z axis points in `direction`."""
    return [(material, surface.along(direction)) for material, surface in parts]
