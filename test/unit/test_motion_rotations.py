# SPDX-License-Identifier: BSD-3-Clause
"""Rotations against SciPy, and the arrow's rotation for every vector."""
import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from process_visualizer.robot import rotations

angles = st.floats(-np.pi, np.pi)
ypr_vectors = st.tuples(angles, st.floats(-np.pi / 2, np.pi / 2), angles)
rotation_vectors = st.tuples(*[st.floats(-6.0, 6.0)] * 3)
vectors = st.tuples(*[st.floats(-1e150, 1e150)] * 3)


def same_rotation(quaternion, other):
    return abs(abs(float(np.dot(quaternion, other))) - 1.0) < 1e-9


@given(ypr_vectors)
@example((0.0, np.pi, 0.0))  # the lower robot of the sewing cell
def test_ypr_is_intrinsic_zyx(ypr):
    expected = Rotation.from_euler('ZYX', ypr)
    assert np.allclose(rotations.matrix_from_ypr(ypr), expected.as_matrix(), atol=1e-12)
    assert same_rotation(rotations.quaternion_from_ypr(ypr), expected.as_quat())


@given(ypr_vectors)
@example((0.3, np.pi / 2, 0.4))
@example((0.3, -np.pi / 2, 0.4))
@example((0.0, np.pi, 0.0))
def test_ypr_of_a_matrix_gives_the_matrix(ypr):
    matrix = rotations.matrix_from_ypr(ypr)
    again = rotations.matrix_from_ypr(rotations.ypr_from_matrix(matrix))
    assert np.allclose(again, matrix, atol=1e-7)


def test_ypr_of_a_matrix_with_numbers():
    ypr = rotations.ypr_from_matrix(rotations.matrix_from_ypr((0.1, -0.2, 3.0)))
    assert np.allclose(ypr, (0.1, -0.2, 3.0))


@given(rotation_vectors)
@example((0.0, 0.0, 0.0))
@example((1e-8, 0.0, 0.0))
@example((0.0, np.pi, 0.0))
def test_rotation_vectors_and_quaternions(vector):
    expected = Rotation.from_rotvec(vector)
    matrix = rotations.matrix_from_rotation_vector(vector)
    assert np.allclose(matrix, expected.as_matrix(), atol=1e-12)
    assert same_rotation(rotations.quaternion_from_rotation_vector(vector), expected.as_quat())
    quaternion = rotations.quaternion_from_matrix(matrix)
    assert quaternion[3] >= 0.0
    assert same_rotation(quaternion, expected.as_quat())
    assert np.allclose(rotations.matrix_from_quaternion(quaternion), matrix, atol=1e-12)
    again = rotations.rotation_vector_from_matrix(matrix)
    assert np.linalg.norm(again) <= np.pi + 1e-12
    assert np.allclose(rotations.matrix_from_rotation_vector(again), matrix, atol=1e-8)


def test_quaternion_of_any_length_but_zero():
    assert np.allclose(rotations.matrix_from_quaternion((0, 0, 3, 3)),
                       [[0, -1, 0], [1, 0, 0], [0, 0, 1]])
    with pytest.raises(ValueError, match='zero'):
        rotations.matrix_from_quaternion((0, 0, 0, 0))


@given(vectors)
@example((1.0, 0.0, 0.0))
@example((-1.0, 0.0, 0.0))
@example((-1.0, 1e-9, 0.0))
@example((-1.0, 0.0, 1e-170))
@example((-3.0, 1e-160, 1e-160))
@example((5e-324, 0.0, 0.0))
@example((0.0, 5e-324, 5e-324))
@example((0.0, -2.0, 0.0))
def test_x_axis_is_turned_onto_the_vector(vector):
    quaternion = rotations.quaternion_turning_x_onto(vector)
    assert abs(np.linalg.norm(quaternion) - 1.0) < 1e-9
    largest = np.abs(vector).max()
    if largest > 0.0:
        unit = np.array(vector) / largest
        unit /= np.linalg.norm(unit)
        turned = rotations.matrix_from_quaternion(quaternion) @ [1.0, 0.0, 0.0]
        assert np.allclose(turned, unit, atol=1e-9)
        shortest = np.arccos(np.clip(unit[0], -1.0, 1.0))
        assert 2.0 * np.arccos(np.clip(quaternion[3], -1.0, 1.0)) <= shortest + 1e-6


def test_zero_vector_is_the_identity():
    assert rotations.quaternion_turning_x_onto((0.0, 0.0, 0.0)).tolist() == [0, 0, 0, 1]


quaternions = st.tuples(*[st.floats(-2.0, 2.0)] * 4).filter(lambda q: np.linalg.norm(q) > 0.1)


@given(quaternions, st.tuples(*[st.floats(-5.0, 5.0)] * 3))
def test_vectors_are_turned(quaternion, vector):
    expected = Rotation.from_quat(quaternion).apply(vector)
    assert np.allclose(rotations.rotated(quaternion, vector), expected, atol=1e-9)
    back = rotations.rotated(rotations.conjugate(quaternion), expected)
    assert np.allclose(back, vector, atol=1e-9)


@given(quaternions, quaternions)
@example((0.0, 0.0, 0.0, 1.0), (0.0, 0.0, 0.0, -1.0))
@example((0.0, 0.0, 0.0, 1.0), (0.0, 0.0, 1.0, 0.0))
@example((0.0, 0.0, 0.0, 1.0), (1e-12, 0.0, 0.0, 1.0))
def test_rotation_between_two_poses(first, second):
    vector = rotations.rotation_vector_between(first, second)
    assert np.linalg.norm(vector) <= np.pi + 1e-9
    between = Rotation.from_quat(first).inv() * Rotation.from_quat(second)
    assert (between * Rotation.from_rotvec(vector).inv()).magnitude() < 1e-7
