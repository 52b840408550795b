# SPDX-License-Identifier: BSD-3-Clause
"""A box that is dragged: by its middle, or by one of its faces while the opposite one stays."""
from __future__ import annotations

from dataclasses import replace
from typing import Dict, List, Tuple

from process_visualizer.cell.model import RegionOfInterest, Vector3

MIDDLE = 'middle'
FACES: Dict[str, Tuple[int, float]] = {
    f'{"+" if side > 0 else "-"}{axis}': (number, side)
    for number, axis in enumerate('xyz') for side in (1.0, -1.0)}
"""The axis (0 to 2) to which a face is orthogonal, and the side of the middle on which it lies."""
SHORTEST_M = 0.01


def handle_places(region: RegionOfInterest) -> Dict[str, Vector3]:
    """Return where the middle and the middles of the faces are, m in the box's frame."""
    places = {MIDDLE: region.center}
    for name, (axis, side) in FACES.items():
        place = list(region.center)
        place[axis] += side * region.size[axis] / 2
        places[name] = _vector(place)
    return places


def dragged(region: RegionOfInterest, handle: str, place: Vector3) -> RegionOfInterest:
    """Return the box whose handle has been dragged to a place [m]; no edge becomes too short.

    Raises:
        KeyError: there is no such handle.
    """
    if handle == MIDDLE:
        return replace(region, center=place)
    axis, side = FACES[handle]
    fixed_m = region.center[axis] - side * region.size[axis] / 2
    length_m = max(side * (place[axis] - fixed_m), SHORTEST_M)
    center, size = list(region.center), list(region.size)
    center[axis], size[axis] = fixed_m + side * length_m / 2, length_m
    return replace(region, center=_vector(center), size=_vector(size))


def _vector(values: List[float]) -> Vector3:
    x, y, z = values
    return x, y, z
