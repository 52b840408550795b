# SPDX-License-Identifier: BSD-3-Clause
"""Clouds of a live page: some of the points, with their positions and colors."""
from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from small_clouds import cloud, line, read

from process_visualizer.page.clouds import Points, cloud_message, live_points, placed
from process_visualizer.robot.kinematics import Placement


@pytest.mark.parametrize('is_big', [False, True])
def test_points_have_their_places_and_colors(is_big: bool) -> None:
    points = live_points(cloud(line(50), is_big=is_big), 100)
    assert points is not None
    assert points.frame == 'camera'
    assert points.positions[:, 0] == pytest.approx(np.arange(50) / 100.0)
    assert points.colors.tolist() == [[0x10, 0x20, 0x30]] * 50


def test_of_many_points_some_are_kept_evenly_and_none_that_are_nowhere() -> None:
    points = line(10_000)
    points['z'][::2] = math.nan
    points['x'][1] = math.inf
    found = live_points(cloud(points), 100)
    assert found is not None
    assert 50 <= len(found.positions) <= 100
    assert np.isfinite(found.positions).all()
    assert np.ptp(found.positions[:, 0]) > 95.0


def test_a_cloud_without_colors_is_gray() -> None:
    found = live_points(cloud(line(3), rgb=False), 100)
    assert found is not None
    assert np.ptp(found.colors) == 0


def test_clouds_are_seen_from_the_cell_and_sent_within_their_box() -> None:
    half = math.sqrt(0.5)
    there = placed(Points('', np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 2.0]]),
                          np.array([[1, 2, 3], [4, 5, 6]], np.uint8)),
                   Placement((10.0, 0.0, 0.0), (0.0, 0.0, half, half)))
    data = cloud_message(5.0, [there, there._replace(positions=there.positions + 1.0)])
    time_s, positions, colors = read(data)
    assert time_s == 5.0
    assert positions == pytest.approx(np.array(
        [[10, 1, 0], [10, 0, 2], [11, 2, 1], [11, 1, 3]]), abs=1e-4)
    assert colors.tolist() == [[1, 2, 3], [4, 5, 6]] * 2


def test_no_clouds_are_an_empty_one() -> None:
    assert len(read(cloud_message(1.0, []))[1]) == 0


@given(st.integers(0, 200), st.binary(min_size=1, max_size=8))
def test_damaged_clouds_are_none(at: int, other: bytes) -> None:
    data = cloud(line(5))
    at = min(at, len(data) - len(other))
    damaged = data[:at] + other + data[at + len(other):]
    found = live_points(damaged, 10)
    assert found is None or len(found.positions) <= 10
    live_points(data[:at], 10)
