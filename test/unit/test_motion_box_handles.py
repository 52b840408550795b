# SPDX-License-Identifier: BSD-3-Clause
"""A box that is dragged by its middle or by a face."""
from __future__ import annotations

from typing import Tuple

import pytest
from hypothesis import given
from hypothesis import strategies as st

from process_visualizer.cell.errors import Location
from process_visualizer.cell.model import RegionOfInterest
from process_visualizer.gui.ros.rviz_markers import FACES, MIN_M, dragged, handle_places

BOX = RegionOfInterest('world', (1.0, 2.0, 3.0), (0.2, 0.4, 0.6), Location('cell.xml', 1))
PLACES = st.tuples(*[st.floats(-10, 10)] * 3)


def ends(region: RegionOfInterest, axis: int) -> Tuple[float, float]:
    half = region.size[axis] / 2
    return region.center[axis] - half, region.center[axis] + half


def test_handles_lie_on_the_faces() -> None:
    places = handle_places(BOX)
    assert places['middle'] == BOX.center
    assert places['+x'] == pytest.approx((1.1, 2.0, 3.0))
    assert places['-z'] == pytest.approx((1.0, 2.0, 2.7))
    assert len(places) == 7


@given(PLACES)
def test_the_middle_moves_the_box(place: Tuple[float, float, float]) -> None:
    moved = dragged(BOX, 'middle', place)
    assert (moved.center, moved.size) == (place, BOX.size)


@given(st.sampled_from(sorted(FACES)), PLACES)
def test_a_face_moves_alone(face: str, place: Tuple[float, float, float]) -> None:
    moved, (axis, side) = dragged(BOX, face, place), FACES[face]
    fixed, free = (0, 1) if side > 0 else (1, 0)
    assert ends(moved, axis)[fixed] == pytest.approx(ends(BOX, axis)[fixed])
    assert moved.size[axis] >= MIN_M
    if moved.size[axis] > MIN_M:
        assert ends(moved, axis)[free] == pytest.approx(place[axis])
    for other in {0, 1, 2} - {axis}:
        assert ends(moved, other) == ends(BOX, other)


def test_other_handles_are_unknown() -> None:
    with pytest.raises(KeyError):
        dragged(BOX, 'corner', (0.0, 0.0, 0.0))
