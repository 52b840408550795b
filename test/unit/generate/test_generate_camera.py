# SPDX-License-Identifier: BSD-3-Clause
"""The camera: everything is in view, as large as possible, from any side and in any window."""
from __future__ import annotations

import itertools
import math
from typing import List, Tuple

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from process_visualizer.rviz.camera import FIELD_OF_VIEW_RAD, camera_axes, camera_pose, grid_below
from process_visualizer.rviz.window_geometry import scene_aspect

VIEW = {'Pitch': 0.4, 'Yaw': 2.28}
Point = Tuple[float, float, float]


def in_picture(points: np.ndarray, pose: dict, view: dict, aspect: float) -> np.ndarray:
    """Image coordinates of points: (n, 2), from -1 to 1 between the edges."""
    axes = camera_axes(view['Pitch'], view['Yaw'])
    focus = np.array([pose['Focal Point'][axis] for axis in 'XYZ'])
    across = (points - focus) @ axes
    depth = pose['Distance'] - across[:, 2]
    assert (depth > 0.0).all()
    slope = math.tan(0.5 * FIELD_OF_VIEW_RAD)
    return across[:, :2] / (depth[:, None] * slope * np.array([aspect, 1.0]))


def test_axes_are_those_of_rviz() -> None:
    """rviz/OrbitViewController: the camera is at cos yaw cos pitch, sin yaw cos pitch, sin pitch"""
    right, up, back = camera_axes(0.3, 1.1).T
    np.testing.assert_allclose(back, [math.cos(1.1) * math.cos(0.3), math.sin(1.1) * math.cos(0.3),
                                      math.sin(0.3)])
    assert right[2] == pytest.approx(0.0)
    assert up[2] > 0.0
    np.testing.assert_allclose(np.cross(right, up), back, atol=1e-12)


@given(st.lists(st.tuples(*[st.floats(-20, 20)] * 3), min_size=1, max_size=12),
       st.floats(-1.4, 1.4), st.floats(-3.1, 3.1), st.floats(0.5, 2.5))
def test_everything_is_in_the_picture(points: List[Point], pitch: float, yaw: float,
                                      aspect: float) -> None:
    view, array = {'Pitch': pitch, 'Yaw': yaw}, np.array(points)
    places = in_picture(array, camera_pose(array, view, aspect), view, aspect)
    assert np.abs(places).max() < 1.0


@given(st.tuples(*[st.floats(-50, 50)] * 3), st.tuples(*[st.floats(0.3, 9)] * 3),
       st.floats(0.5, 2.5))
def test_the_picture_is_filled(middle: Point, size: Point, aspect: float) -> None:
    corners = np.array(list(itertools.product((-0.5, 0.5), repeat=3)))
    array = np.array(middle) + corners * np.array(size)
    places = in_picture(array, camera_pose(array, VIEW, aspect), VIEW, aspect)
    assert np.ptp(places, axis=0).max() > 1.5
    np.testing.assert_allclose(places.max(axis=0), -places.min(axis=0), atol=0.02)


def test_far_away_and_tiny() -> None:
    box = np.array([(x, y, z) for x in (5.0, 5.1) for y in (-2.0, -1.9) for z in (0.8, 0.9)])
    pose = camera_pose(box, VIEW, 1.36)
    assert pose['Distance'] < 0.5
    np.testing.assert_allclose([pose['Focal Point'][axis] for axis in 'XYZ'], [5.05, -1.95, 0.85],
                               atol=0.02)


def test_nothing_to_see_leaves_the_default() -> None:
    assert camera_pose(np.empty((0, 3)), VIEW, 1.0) == {} == grid_below(np.empty((0, 3)))


@pytest.mark.parametrize(('size', 'cell'), [(0.1, 0.02), (1.9, 0.2), (4.0, 0.5), (12.9, 2.0)])
def test_grid_suits_what_is_on_it(size: float, cell: float) -> None:
    grid = grid_below(np.array([(5.0, 0.0, 0.0), (5.0 + size, 0.1 * size, 1.0)]))
    assert grid['Cell Size'] == pytest.approx(cell)
    assert abs(grid['Offset']['X'] - (5.0 + 0.5 * size)) <= 0.5 * cell
    assert grid['Offset']['X'] / cell == pytest.approx(round(grid['Offset']['X'] / cell), abs=0.06)
    assert grid['Cell Size'] * grid['Plane Cell Count'] >= 1.2 * size


def test_aspect_of_windows() -> None:
    """As measured in RViz under Xvfb: the scene is 1180 x 869 in a window of 1560 x 960."""
    assert scene_aspect(1560, 960) == pytest.approx(1180 / 869, abs=0.03)
    assert scene_aspect(1024, 700) > scene_aspect(1560, 960)  # without the list of displays
    assert scene_aspect(10, 10) > 0
