# SPDX-License-Identifier: BSD-3-Clause
"""Plane outlines: polygons with rounded corners, and their triangulation."""

from __future__ import annotations

import math
from typing import List, Sequence, Tuple

import numpy as np

Point = Tuple[float, float]
#: Points (n, 2) in meters and their unit normals (n, 2), to the right of the direction of travel.
Path = Tuple[np.ndarray, np.ndarray]


def rounded_polygon(corners: Sequence[Point], radii: Sequence[float], steps: int = 4) -> Path:
    """A closed counter-clockwise polygon, each corner rounded with its radius (m)."""
    count = len(corners)
    points, normals = [], []
    for index in range(count):
        neighbors = corners[index - 1], corners[index], corners[(index + 1) % count]
        for point, normal in _arc(*neighbors, radii[index], steps):
            points.append(point)
            normals.append(normal)
    return np.array(points), np.array(normals)


def rounded_profile(corners: Sequence[Point], radius: float, steps: int = 2) -> Path:
    """An open polygon whose inner corners are rounded with one radius (m)."""
    points, normals = [corners[0]], [_right_of(_heading(corners[0], corners[1]))]
    for before, corner, after in zip(corners, corners[1:], corners[2:]):
        for point, normal in _arc(before, corner, after, radius, steps):
            points.append(point)
            normals.append(normal)
    points.append(corners[-1])
    normals.append(_right_of(_heading(corners[-2], corners[-1])))
    return np.array(points), np.array(normals)


def rectangle(width_x: float, width_y: float, radius: float, steps: int = 4) -> Path:
    """A rectangle about the origin with rounded corners, all in meters."""
    x, y = width_x / 2, width_y / 2
    return rounded_polygon([(-x, -y), (x, -y), (x, y), (-x, y)], [radius] * 4, steps)


def _heading(start: Point, end: Point) -> float:
    return math.atan2(end[1] - start[1], end[0] - start[0])


def _right_of(heading: float) -> Point:
    return math.sin(heading), -math.cos(heading)


def _arc(
    before: Point, corner: Point, after: Point, radius: float, steps: int
) -> List[Tuple[Point, Point]]:
    """Points and normals of the arc that replaces a corner; it touches both sides."""
    heading = _heading(before, corner)
    turn = math.remainder(_heading(corner, after) - heading, 2 * math.pi)
    room = 0.499 * min(math.dist(before, corner), math.dist(corner, after))
    cut = min(radius * math.tan(abs(turn) / 2), room)
    signed_radius = math.copysign(cut / math.tan(abs(turn) / 2), turn)
    start = corner[0] - cut * math.cos(heading), corner[1] - cut * math.sin(heading)
    inward = _right_of(heading)
    center = start[0] - signed_radius * inward[0], start[1] - signed_radius * inward[1]
    arc = []
    for step in range(steps + 1):
        normal = _right_of(heading + turn * step / steps)
        point = center[0] + signed_radius * normal[0], center[1] + signed_radius * normal[1]
        arc.append((point, normal))
    return arc


def triangulated(points: np.ndarray) -> List[Tuple[int, int, int]]:
    """Triangles (point numbers) that fill a simple counter-clockwise polygon: ear clipping."""
    left = list(range(len(points)))
    triangles = []
    while len(left) > 3:
        ear = next(i for i in range(len(left)) if _is_ear(points, left, i))
        triangles.append((left[ear - 1], left[ear], left[(ear + 1) % len(left)]))
        del left[ear]
    return triangles + [(left[0], left[1], left[2])]


def _is_ear(points: np.ndarray, left: Sequence[int], index: int) -> bool:
    """Return whether the corner is convex and no other corner lies inside its triangle."""
    corners = left[index - 1], left[index], left[(index + 1) % len(left)]
    a, b, c = (points[corner] for corner in corners)
    if _cross(a, b, c) < -1e-12:
        return False
    others = [points[other] for other in left if other not in corners]
    return not any(_contains(a, b, c, point) for point in others)


def _contains(a: np.ndarray, b: np.ndarray, c: np.ndarray, point: np.ndarray) -> bool:
    sides = _cross(a, b, point), _cross(b, c, point), _cross(c, a, point)
    return min(sides) > 1e-12


def _cross(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> float:
    """Twice the signed area of the triangle a b c; positive when counter-clockwise."""
    return float((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))
