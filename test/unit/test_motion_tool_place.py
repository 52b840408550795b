# SPDX-License-Identifier: BSD-3-Clause
"""How far a reported tool is from the model's, and vectors in the frame that is drawn in."""
from __future__ import annotations

import math

import numpy as np

from process_visualizer.nodes.robot.tool_placing import ToolDifference, ToolPlace, base_place
from process_visualizer.robot.kinematics import Placement

TURNED = (0.0, 0.0, math.sqrt(0.5), math.sqrt(0.5))  # a quarter turn about z


def test_offset_is_in_the_tool_frame_and_outliers_do_not_count() -> None:
    difference = ToolDifference()
    for number in range(15):
        assert not difference.is_settled()
        position = (1.0, 2.0, 3.1) if number % 3 else (9.0, 9.0, 9.0)
        difference.add(Placement((1.0, 2.5, 3.0), TURNED), position, (0.0, 0.0, 0.0, 1.0))
    found = difference.median()
    assert difference.is_settled()
    assert np.allclose(found.offset, (-0.5, 0.0, 0.1))
    assert math.isclose(found.angle, math.pi / 2)
    assert math.isclose(found.distance_m(), math.hypot(0.5, 0.1))


def test_a_pose_without_an_orientation_has_no_angle() -> None:
    difference = ToolDifference()
    difference.add(Placement(), (0.1, 0.0, 0.0), None)
    assert math.isnan(difference.median().angle)
    assert np.allclose(difference.median().offset, (0.1, 0.0, 0.0))


def test_nothing_to_compare_is_no_difference() -> None:
    assert ToolDifference().median().distance_m() == 0.0


def test_vectors_in_the_frame() -> None:
    place = ToolPlace('tool', TURNED, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    assert np.allclose(place.in_frame((0.0, 1.0, 0.0)), (1.0, 0.0, 0.0))
    place = base_place('base', (1.0, 2.0, 3.0))
    assert (place.frame, place.foot) == ('base', (1.0, 2.0, 3.0))
    assert np.allclose(place.in_frame((0.0, 1.0, 0.0)), (0.0, 1.0, 0.0))
