# SPDX-License-Identifier: BSD-3-Clause
"""Rotations in three dimensions, and the difference of two poses.

A rotation is a matrix (3, 3) that turns column vectors, a unit quaternion (4,) in ROS's order
x y z w, yaw pitch roll (3,) in radians, or a rotation vector (3,) in radians (axis times angle).
"""
from __future__ import annotations

import math
from typing import NamedTuple, Sequence, Tuple, Union

import numpy as np

from process_visualizer.cell.model import Pose

Vector = Union[Sequence[float], np.ndarray]
Triple = Tuple[float, float, float]
Quaternion = Tuple[float, float, float, float]  # x y z w

NO_ROTATION: Quaternion = (0.0, 0.0, 0.0, 1.0)


def matrix_from_ypr(ypr: Vector) -> np.ndarray:
    """Return the matrix (3, 3) of yaw pitch roll [rad], intrinsic z-y'-x'' (REP 103)."""
    (sy, sp, sr), (cy, cp, cr) = np.sin(ypr), np.cos(ypr)
    return np.array([
        [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
        [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
        [-sp, cp * sr, cp * cr],
    ])


def ypr_from_matrix(matrix: np.ndarray) -> np.ndarray:
    """Return yaw pitch roll (3,) [rad], pitch in [-pi/2, pi/2]; roll is 0 where pitch is +-pi/2."""
    cos_pitch = math.hypot(matrix[0, 0], matrix[1, 0])
    pitch = math.atan2(-matrix[2, 0], cos_pitch)
    if cos_pitch < 1e-9:  # only yaw - roll (or their sum) is defined here
        return np.array([math.atan2(-matrix[0, 1], matrix[1, 1]), pitch, 0.0])
    yaw = math.atan2(matrix[1, 0], matrix[0, 0])
    return np.array([yaw, pitch, math.atan2(matrix[2, 1], matrix[2, 2])])


def quaternion_from_ypr(ypr: Vector) -> np.ndarray:
    """Return the quaternion (4,) x y z w of yaw pitch roll [rad], intrinsic z-y'-x''."""
    half = 0.5 * np.asarray(ypr, dtype=float)
    (sy, sp, sr), (cy, cp, cr) = np.sin(half), np.cos(half)
    return np.array([
        cy * cp * sr - sy * sp * cr,
        cy * sp * cr + sy * cp * sr,
        sy * cp * cr - cy * sp * sr,
        cy * cp * cr + sy * sp * sr,
    ])


def matrix_from_quaternion(quaternion: Vector) -> np.ndarray:
    """Return the matrix (3, 3) of a quaternion (4,) x y z w of any length.

    Raises:
        ValueError: the quaternion is zero.
    """
    array = np.asarray(quaternion, dtype=float)
    length = np.linalg.norm(array)
    if length < 1e-9:
        raise ValueError('the quaternion is zero, which is not a rotation')
    x, y, z, w = array / length
    return np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ])


def quaternion_from_matrix(matrix: np.ndarray) -> np.ndarray:
    """Return the quaternion (4,) x y z w, w >= 0, of a rotation matrix (3, 3).

    The eigenvector of the greatest eigenvalue of a symmetric matrix: one formula, accurate for
    every rotation (I. Y. Bar-Itzhack, New method for extracting the quaternion from a rotation
    matrix, Journal of Guidance, Control, and Dynamics 23(6), 2000).
    """
    (a, b, c), (d, e, f), (g, h, i) = matrix
    symmetric = np.array([
        [a - e - i, 0, 0, 0],
        [b + d, e - a - i, 0, 0],
        [c + g, f + h, i - a - e, 0],
        [h - f, c - g, d - b, a + e + i],
    ])
    quaternion: np.ndarray = np.linalg.eigh(symmetric)[1][:, 3]  # eigh reads the lower half
    return quaternion * math.copysign(1.0, quaternion[3])


def matrix_from_rotation_vector(rotation_vector: Vector) -> np.ndarray:
    """Return the matrix (3, 3) of a rotation vector (3,) [rad] (Rodrigues' formula)."""
    x, y, z = rotation_vector
    angle = math.sqrt(x * x + y * y + z * z)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]], dtype=float)
    if angle < 1e-6:  # the two quotients at their limits
        sine, cosine = 1.0, 0.5
    else:
        sine, cosine = math.sin(angle) / angle, (1 - math.cos(angle)) / angle ** 2
    matrix: np.ndarray = np.eye(3) + sine * cross + cosine * (cross @ cross)
    return matrix


# The following functions run for each message of a driver. For so few numbers Python's own
# arithmetic is several times as fast as arrays.

def quaternion_from_rotation_vector(rotation_vector: Vector) -> Quaternion:
    """Return the quaternion (4,) x y z w of a rotation vector (3,) [rad]."""
    x, y, z = rotation_vector
    angle = math.sqrt(x * x + y * y + z * z)
    scale = 0.5 if angle < 1e-6 else math.sin(0.5 * angle) / angle
    return x * scale, y * scale, z * scale, math.cos(0.5 * angle)


def rotated(quaternion: Vector, vector: Vector) -> Triple:
    """Return a vector (3,) rotated by a quaternion (4,) x y z w of any length but zero."""
    x, y, z, w = quaternion
    a, b, c = vector
    scale = 2.0 / (x * x + y * y + z * z + w * w)
    # v + scale * (w (q x v) + q x (q x v)) with the quaternion's vector part q
    p, q, r = y * c - z * b, z * a - x * c, x * b - y * a
    return (a + scale * (w * p + y * r - z * q), b + scale * (w * q + z * p - x * r),
            c + scale * (w * r + x * q - y * p))


def product(first: Vector, second: Vector) -> Quaternion:
    """Return the quaternion (4,) x y z w of the second rotation, then the first one."""
    a, b, c, d = first
    x, y, z, w = second
    return (d * x + a * w + b * z - c * y, d * y - a * z + b * w + c * x,
            d * z + a * y - b * x + c * w, d * w - a * x - b * y - c * z)


def conjugate(quaternion: Vector) -> Quaternion:
    """Return the quaternion (4,) x y z w of the inverse rotation."""
    x, y, z, w = quaternion
    return -x, -y, -z, w


def rotation_vector_between(first: Vector, second: Vector) -> Triple:
    """Return the shortest rotation vector (3,) [rad], in the first's axes, from first to second.

    Args:
        first, second: quaternions (4,) x y z w of any length but zero.
    """
    a, b, c, d = first
    x, y, z, w = second
    p = d * x - a * w - b * z + c * y
    q = d * y + a * z - b * w - c * x
    r = d * z - a * y + b * x - c * w
    cosine = d * w + a * x + b * y + c * z
    sine = math.sqrt(p * p + q * q + r * r)
    if sine <= 1e-9 * abs(cosine):
        scale = 2.0 / cosine
    else:
        scale = 2.0 * math.atan2(math.copysign(sine, cosine), abs(cosine)) / sine
    return p * scale, q * scale, r * scale


def rotation_vector_from_matrix(matrix: np.ndarray) -> np.ndarray:
    """Return the rotation vector (3,) [rad], of length at most pi, of a matrix (3, 3)."""
    quaternion = quaternion_from_matrix(matrix)
    sine = float(np.linalg.norm(quaternion[:3]))
    scale = 2.0 if sine < 1e-9 else 2.0 * math.atan2(sine, quaternion[3]) / sine
    vector: np.ndarray = quaternion[:3] * scale
    return vector


def quaternion_turning_x_onto(vector: Vector) -> np.ndarray:
    """Return the shortest rotation, as a quaternion (4,) x y z w, of the x axis onto a vector (3,).

    The rotation is defined for every finite vector: half a turn about z for the opposite direction,
    the identity for zero. (The thesis' equations 5.2 and 5.3 exchange axis and angle and are
    undefined there.) With the unit vector u and the x axis e, the quaternion is (e x u, 1 + e.u)
    over its length.
    """
    largest = max(map(abs, vector))
    if largest == 0.0:
        return np.array([0.0, 0.0, 0.0, 1.0])
    x, y, z = (part / largest for part in vector)  # tiny lengths are too imprecise to divide by
    length = math.hypot(x, y, z)
    x, y, z = x / length, y / length, z / length
    # 1 + x loses its digits near the opposite direction; it equals (y^2 + z^2) / (1 - x).
    w = 1.0 + x if x > -0.5 else (y * y + z * z) / (1.0 - x)
    length = math.sqrt(2.0 * w)
    if length < 1e-150:
        return np.array([0.0, 0.0, 1.0, 0.0])
    return np.array([0.0, -z, y, w]) / length


class PoseDifference(NamedTuple):
    """The distance of two origins [m], and the angle between two rotations [rad]."""

    distance_m: float
    angle_rad: float

    def __str__(self) -> str:
        return f'{1000.0 * self.distance_m:.1f} mm and {math.degrees(self.angle_rad):.2f}°'


def pose_difference(one: Pose, other: Pose) -> PoseDifference:
    """Return the difference of two poses in the same frame.

    The angle is that of the rotation between them: yaw and roll of a sensor that looks down may
    differ a lot although the sensor is hardly turned.
    """
    turn = matrix_from_ypr(one.ypr).T @ matrix_from_ypr(other.ypr)
    # sine and cosine: the arc cosine alone is wrong by 1e-8 rad near zero
    sine = 0.5 * math.sqrt((turn[2, 1] - turn[1, 2]) ** 2 + (turn[0, 2] - turn[2, 0]) ** 2
                           + (turn[1, 0] - turn[0, 1]) ** 2)
    cosine = 0.5 * (float(np.trace(turn)) - 1.0)
    return PoseDifference(math.dist(one.xyz, other.xyz), math.atan2(sine, cosine))
