# SPDX-License-Identifier: BSD-3-Clause
"""The basic bodies: turned on a lathe, or pushed out of an outline. All edges are rounded."""

from __future__ import annotations

import math
from typing import List, Sequence, Tuple

import numpy as np

from .outline import Path, Point, rectangle, rounded_profile, triangulated
from .surface import Surface

Vector = Tuple[float, float, float]
#: Inset and height of a ring of points (m), and the outward and upward parts of its normals.
Ring = Tuple[float, float, float, float]


def lathe(corners: Sequence[Point], edge: float = 0.002) -> Surface:
    """A body turned about z from (radius, z) corners listed bottom to top along its outside.

    `edge` is the radius (m) that rounds every corner of the profile.
    """
    profile, profile_normals = rounded_profile(corners, edge)
    segments = _segments(max(radius for radius, _ in corners))
    angles = [2 * math.pi * index / segments for index in range(segments)]
    around = np.array([(math.cos(angle), math.sin(angle)) for angle in angles])
    points = _turned(profile, around)
    return Surface(points, _turned(profile_normals, around), _grid(len(profile), segments, points))


def cylinder(radius: float, start: float, end: float, edge: float = 0.002) -> Surface:
    """A closed cylinder about z, from height `start` to `end`, all in meters."""
    return lathe([(0, start), (radius, start), (radius, end), (0, end)], edge)


def band(radius: float, start: float, end: float) -> Surface:
    """A cylinder without lids, from height `start` to `end`, all in meters."""
    return lathe([(radius, start), (radius, end)])


def extrude(outline: Path, start: float, end: float, edge: float = 0.002) -> Surface:
    """An outline in x and y pushed from height `start` to `end`, its rims rounded by `edge` (m).

    Corners of the outline need a radius of at least `edge`.
    """
    rims = [*_rim(start, edge, -1.0), *reversed(_rim(end, edge, 1.0))]
    flat, flat_normals = outline
    points, normals = [], []
    for inset, height, sideways, upwards in rims:
        points.append(_raised(flat - inset * flat_normals, height))
        normals.append(_raised(sideways * flat_normals, upwards))
    sides = _grid(len(rims), len(flat), np.vstack(points))
    lid = np.array(triangulated(flat - edge * flat_normals))
    lids = [lid[:, ::-1], lid + (len(rims) - 1) * len(flat)]
    return Surface(np.vstack(points), np.vstack(normals), np.vstack([sides, *lids]))


def box(size: Vector, center: Vector, edge: float = 0.003) -> Surface:
    """A box with rounded edges; size and center in meters."""
    outline = rectangle(size[0], size[1], edge, steps=1 if edge < 0.004 else 2)
    return extrude(outline, -size[2] / 2, size[2] / 2, edge).moved(*center)


def _segments(radius: float) -> int:
    """Return the number of sides with which a circle of this radius (m) looks round: 12 to 36."""
    return 4 * min(9, max(3, round(48 * math.sqrt(radius))))


def _turned(profile: np.ndarray, around: np.ndarray) -> np.ndarray:
    """Profile vectors (p, 2) turned to all directions (s, 2): (p * s, 3), ring after ring."""
    rings = [_raised(radius * around, height) for radius, height in profile]
    return np.vstack(rings)


def _raised(flat: np.ndarray, height: float) -> np.ndarray:
    return np.column_stack([flat, np.full(len(flat), height)])


def _rim(level: float, edge: float, side: float) -> List[Ring]:
    """The rings that round a rim, from the lid to the wall."""
    steps = 1 if edge < 0.004 else 2
    rings = []
    for step in range(steps + 1):
        angle = math.pi / 2 * step / steps
        sideways, upwards = math.sin(angle), math.cos(angle)
        height = level - side * edge * (1 - upwards)
        rings.append((edge * (1 - sideways), height, sideways, side * upwards))
    return rings


def _grid(rings: int, columns: int, points: np.ndarray) -> np.ndarray:
    """Triangles between neighboring closed rings of points, without those of no area."""
    triangles = []
    for ring in range(rings - 1):
        for column in range(columns):
            a, b = ring * columns + column, ring * columns + (column + 1) % columns
            triangles += [(a, b, b + columns), (a, b + columns, a + columns)]
    return np.array([t for t in triangles if _has_area(*points[list(t)])])


def _has_area(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> bool:
    return bool(np.linalg.norm(np.cross(b - a, c - a)) > 1e-10)
