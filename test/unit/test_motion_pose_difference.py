# SPDX-License-Identifier: BSD-3-Clause
"""The difference between poses."""
from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from process_visualizer.cell.model import Pose
from process_visualizer.robot.rotations import matrix_from_ypr, pose_difference, ypr_from_matrix

ANGLES = st.floats(-math.pi, math.pi)


def test_distance_and_angle_of_a_simple_pose():
    assert pose_difference(Pose((3.0, 4.0, 0.0), (0.0, -0.5, 0.0)), Pose()) == (
        5.0, pytest.approx(0.5))
    assert str(pose_difference(Pose((0.02, 0.0, 0.0), (0.0, 0.0, math.radians(2.0))), Pose())) \
        == '20.0 mm and 2.00°'


def test_a_sensor_that_looks_down_is_hardly_turned_though_yaw_and_roll_are_far_apart():
    one, other = Pose(ypr=(0.0, math.pi / 2 - 1e-4, 0.0)), Pose(ypr=(2.0, math.pi / 2 - 1e-4, 2.0))
    assert pose_difference(one, other).angle_rad < 1e-3


@given(st.tuples(ANGLES, ANGLES, ANGLES), ANGLES)
def test_the_angle_is_that_of_the_rotation_between_them(ypr, turn):
    turned = matrix_from_ypr((turn, 0.0, 0.0)) @ matrix_from_ypr(ypr)
    yaw, pitch, roll = ypr_from_matrix(turned).tolist()
    found = pose_difference(Pose(ypr=ypr), Pose(ypr=(yaw, pitch, roll)))
    assert found.angle_rad == pytest.approx(abs(turn), abs=1e-6)
    assert found.distance_m == 0.0
