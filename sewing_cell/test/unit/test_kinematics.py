# SPDX-License-Identifier: BSD-3-Clause
"""Kinematics of the UR-6-85-5-A against independent products of elementary transforms."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from sewing_cell import kinematics
from sewing_cell.kinematics import Branch, UnreachableError

ANGLES = st.floats(-np.pi + 1e-6, np.pi - 1e-6)
JOINTS = st.lists(ANGLES, min_size=6, max_size=6).map(np.array)
SIGNS = st.sampled_from([-1, 1])
#: Elbow and wrist bent, neither stretched nor folded.
BENT = st.builds(lambda sign, angle: sign * angle, SIGNS, st.floats(0.05, np.pi - 0.05))
BENT_JOINTS = st.tuples(ANGLES, ANGLES, BENT, ANGLES, BENT, ANGLES).map(np.array)
BRANCHES = st.builds(Branch, shoulder=SIGNS, elbow=SIGNS, wrist=SIGNS)

#: Table 6.1 of the thesis, repeated independently: a, alpha, d of the rows 1 to 6.
TABLE_6_1 = [
    (0, np.pi / 2, 0.0892),
    (-0.425, 0, 0),
    (-0.39243, 0, 0),
    (0, np.pi / 2, 0.109),
    (0, -np.pi / 2, 0.093),
    (0, 0, 0.082),
]


def rotation(axis: int, angle: float) -> np.ndarray:
    """Homogeneous rotation about a coordinate axis."""
    result = np.eye(4)
    i, j = [(1, 2), (2, 0), (0, 1)][axis]
    result[i, i] = result[j, j] = np.cos(angle)
    result[j, i] = np.sin(angle)
    result[i, j] = -np.sin(angle)
    return result


def translation(x: float, y: float, z: float) -> np.ndarray:
    """Homogeneous translation."""
    result = np.eye(4)
    result[:3, 3] = x, y, z
    return result


def product_of_table(joints: np.ndarray) -> np.ndarray:
    """Rz(theta) Tz(d) Tx(a) Rx(alpha) of each row, multiplied in order."""
    pose = np.eye(4)
    for theta, (a, alpha, d) in zip(joints, TABLE_6_1):
        for step in (rotation(2, theta), translation(0, 0, d), translation(a, 0, 0)):
            pose = pose @ step
        pose = pose @ rotation(0, alpha)
    return pose


def product_of_urdf(joints: np.ndarray) -> list[np.ndarray]:
    """Frames link0 to link7 and tool from the joint origins of appendix D.1."""
    origins = [
        np.eye(4),
        translation(0, 0, 0.0892) @ rotation(0, np.pi / 2),
        translation(-0.425, 0, 0),
        np.eye(4),
        translation(-0.39243, 0, 0),
        translation(0, 0, 0.109) @ rotation(0, np.pi / 2),
        translation(0, 0, 0.093) @ rotation(0, -np.pi / 2),
        translation(0, 0, 0.082),
    ]
    angles = [joints[0], joints[1], joints[2], 0.0, joints[3], joints[4], joints[5], 0.0]
    frames = [np.eye(4)]
    for origin, angle in zip(origins, angles):
        frames.append(frames[-1] @ origin @ rotation(2, angle))
    return frames


@given(JOINTS)
def test_forward_is_the_product_of_the_table(joints: np.ndarray) -> None:
    np.testing.assert_allclose(kinematics.forward(joints), product_of_table(joints), atol=1e-12)


@given(JOINTS)
def test_link_frames_are_those_of_the_urdf(joints: np.ndarray) -> None:
    np.testing.assert_allclose(
        kinematics.link_frames(joints), product_of_urdf(joints), atol=1e-12
    )


def test_home_pose_stands_upright() -> None:
    home = np.array([0, -np.pi / 2, 0, -np.pi / 2, 0, 0])
    wrist = kinematics.link_frames(home)[5, :3, 3]
    np.testing.assert_allclose(wrist, [0, 0, 0.0892 + 0.425 + 0.39243], atol=1e-12)


@given(JOINTS, JOINTS)
def test_leading_dimensions_are_kept(first: np.ndarray, second: np.ndarray) -> None:
    both = kinematics.link_frames(np.stack([first, second]))
    assert both.shape == (2, 9, 4, 4)
    np.testing.assert_array_equal(both[0], kinematics.link_frames(first))
    np.testing.assert_array_equal(both[1], kinematics.link_frames(second))


@given(JOINTS)
def test_jacobian_is_the_derivative(joints: np.ndarray) -> None:
    step = 1e-6
    jacobian = kinematics.jacobian(joints)
    pose = kinematics.forward(joints)
    for column, unit in enumerate(np.eye(6)):
        later = kinematics.forward(joints + step * unit)
        earlier = kinematics.forward(joints - step * unit)
        rate = (later - earlier) / (2 * step)
        spin = rate[:3, :3] @ pose[:3, :3].T
        twist = [*rate[:3, 3], spin[2, 1], spin[0, 2], spin[1, 0]]
        np.testing.assert_allclose(jacobian[:, column], twist, atol=1e-8)


@given(BENT_JOINTS, BRANCHES)
def test_inverse_brings_the_tool_to_the_pose(joints: np.ndarray, branch: Branch) -> None:
    pose = kinematics.forward(joints)
    try:
        solution = kinematics.inverse(pose, branch)
    except UnreachableError:
        assume(False)
    np.testing.assert_allclose(kinematics.forward(solution), pose, atol=1e-6)
    assert np.sign(solution[2]) in (0, branch.elbow)
    assert np.sign(solution[4]) == branch.wrist


@given(BENT_JOINTS)
def test_some_branch_gives_the_joints_back(joints: np.ndarray) -> None:
    pose = kinematics.forward(joints)
    center = pose[:2, 3] - 0.082 * pose[:2, 2]
    assume(np.linalg.norm(center) > 0.109 + 1e-4)
    solutions = []
    for branch in [Branch(s, e, w) for s in (-1, 1) for e in (-1, 1) for w in (-1, 1)]:
        try:
            solutions.append(kinematics.inverse(pose, branch, near=joints))
        except UnreachableError:
            continue
    assert min(np.abs(solution - joints).max() for solution in solutions) < 1e-5


@given(BENT_JOINTS, st.lists(st.floats(-9, 9), min_size=6, max_size=6).map(np.array))
def test_solution_is_within_half_a_turn_of_the_wanted(
    joints: np.ndarray, near: np.ndarray
) -> None:
    try:
        solution = kinematics.inverse(kinematics.forward(joints), Branch(1, 1, 1), near)
    except UnreachableError:
        assume(False)
    assert np.all(np.abs(solution - near) <= np.pi + 1e-9)


@pytest.mark.parametrize("position", [(2.0, 0.0, 0.0), (0.05, 0.0, 0.4)])
def test_unreachable_poses_are_refused(position: tuple[float, float, float]) -> None:
    pose = translation(*position) @ rotation(0, np.pi)
    with pytest.raises(UnreachableError):
        kinematics.inverse(pose, Branch(1, 1, -1))


def test_stretched_wrist_is_refused() -> None:
    pose = kinematics.forward(np.array([0.1, -1.0, 1.5, -2.0, 0.0, 0.3]))
    with pytest.raises(UnreachableError, match="wrist"):
        kinematics.inverse(pose, Branch(1, 1, 1))


VECTORS = st.lists(st.floats(-2, 2), min_size=3, max_size=3).map(np.array)


@given(VECTORS, ANGLES)
def test_rotation_vector_round_trip(axis: np.ndarray, angle: float) -> None:
    assume(np.linalg.norm(axis) > 1e-3)
    vector = abs(angle) * axis / np.linalg.norm(axis)
    matrix = kinematics.rotation_matrix(vector)
    np.testing.assert_allclose(matrix @ matrix.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(matrix) == pytest.approx(1.0)
    again = kinematics.rotation_vector(matrix)
    np.testing.assert_allclose(kinematics.rotation_matrix(again), matrix, atol=1e-9)
    if abs(angle) < np.pi - 1e-3:
        np.testing.assert_allclose(again, vector, atol=1e-7)


@given(ANGLES)
def test_rotation_vector_about_an_axis(angle: float) -> None:
    for axis in range(3):
        expected = rotation(axis, angle)[:3, :3]
        np.testing.assert_allclose(
            kinematics.rotation_matrix(angle * np.eye(3)[axis]), expected, atol=1e-12
        )


def test_half_turns_and_no_turn() -> None:
    np.testing.assert_array_equal(kinematics.rotation_vector(np.eye(3)), np.zeros(3))
    for axis in np.eye(3):
        half = 2 * np.outer(axis, axis) - np.eye(3)
        np.testing.assert_allclose(np.abs(kinematics.rotation_vector(half)), np.pi * axis)
