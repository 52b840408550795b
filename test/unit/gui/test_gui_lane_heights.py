# SPDX-License-Identifier: BSD-3-Clause
"""The heights of the timeline's lanes."""
from __future__ import annotations

from dataclasses import replace

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from process_visualizer.gui.lanes.lane_scale import (
    GROWTH,
    LANE_HEIGHT,
    NUMBER_HEIGHT,
    SHRINKAGE,
    heights,
    least_height,
    number_bottoms,
)
from process_visualizer.gui.lanes.timeline_lanes import Lane

LANE = Lane('v', 'm/s', (0.0, 1.0, 0.0), np.zeros(1), np.zeros(1))
FOLDED = replace(LANE, is_folded=True)


def test_seven_curves_are_visible_where_six_and_a_half_would_be() -> None:
    """As on a 1920x1080 screen in playback mode."""
    assert heights([LANE] * 7, 255) == (36,) * 7


def test_too_many_lanes_have_their_usual_height_and_are_scrolled() -> None:
    assert heights([LANE] * 7, 7 * (LANE_HEIGHT - SHRINKAGE) - 1) == (LANE_HEIGHT,) * 7


@given(st.lists(st.sampled_from([LANE, FOLDED]), max_size=30), st.integers(0, 2000))
def test_lanes_fill_no_more_than_the_room_if_they_can_and_never_vanish(
        lanes: 'list[Lane]', room: int) -> None:
    found = heights(lanes, room)
    smallest = sum(least_height(it) - (0 if it.is_folded else SHRINKAGE) for it in lanes)
    assert (sum(found) <= room) is (smallest <= room)
    for lane, height in zip(lanes, found):
        least = least_height(lane)
        assert (height == least if lane.is_folded
                else least - SHRINKAGE <= height <= least + GROWTH)


@given(st.integers(1, 30), st.integers(0, 2000))
def test_a_larger_room_makes_no_lane_smaller_once_all_are_visible(number: int, room: int) -> None:
    smaller, larger = (heights([LANE] * number, it)[0] for it in (room, room + 1))
    if number * smaller <= room:
        assert larger >= smaller


@given(st.lists(st.floats(0.0, 100.0), min_size=1, max_size=4), st.floats(15.0, 40.0),
       st.floats(20.0, 80.0))
def test_numbers_of_a_scale_do_not_overlap_and_stay_in_their_lane(
        lines: 'list[float]', highest: float, room: float) -> None:
    lines, lowest = sorted(lines, reverse=True), highest + room
    found = number_bottoms(lines, highest, lowest)
    assert 0 in found
    assert all(highest <= it <= lowest for it in found.values())
    ordered = sorted(found.values())
    assert all(after - before >= NUMBER_HEIGHT - 1.0 for before, after in zip(ordered, ordered[1:]))


def test_if_two_numbers_have_room_they_are_those_of_the_ends() -> None:
    assert set(number_bottoms([30.0, 23.0, 16.0], 22.0, 36.0)) == {0, 2}
    assert set(number_bottoms([40.0, 28.0, 16.0], 22.0, 46.0)) == {0, 1, 2}
