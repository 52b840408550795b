# SPDX-License-Identifier: BSD-3-Clause
"""Kinematics of the UR-6-85-5-A, after table 6.1 of the thesis.

Angles in rad, lengths in m.  Every function takes leading dimensions: joint vectors are
``(..., 6)``, transforms ``(..., 4, 4)``.  Joint angles are the thetas of the table's rows 1 to 6;
row 0 is the identity.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Optional

import numpy as np

HEIGHT_D1 = 0.0892
UPPER_ARM_A2 = -0.425
FOREARM_A3 = -0.39243
WRIST_D4 = 0.109
WRIST_D5 = 0.093
FLANGE_D6 = 0.082

#: Rows 1 to 6 of table 6.1: a [m], alpha [rad], d [m].
DH_TABLE = (
    (0.0, np.pi / 2, HEIGHT_D1),
    (UPPER_ARM_A2, 0.0, 0.0),
    (FOREARM_A3, 0.0, 0.0),
    (0.0, np.pi / 2, WRIST_D4),
    (0.0, -np.pi / 2, WRIST_D5),
    (0.0, 0.0, FLANGE_D6),
)

_SINGULAR = 1e-9


class UnreachableError(ValueError):
    """Error: the robot cannot bring its tool to a pose."""


@dataclass(frozen=True)
class Branch:
    """The branch of an inverse solution, of eight; each field is +1 or -1.

    ``shoulder`` is the sign in theta_1, ``elbow`` the sign of theta_3, ``wrist`` that of theta_5.
    """

    shoulder: int
    elbow: int
    wrist: int


def dh_transform(theta: np.ndarray, a: float, alpha: float, d: float) -> np.ndarray:
    """Rz(theta) Tz(d) Tx(a) Rx(alpha), shape (..., 4, 4) (standard DH)."""
    cos, sin = np.cos(theta), np.sin(theta)
    cos_alpha, sin_alpha = np.cos(alpha), np.sin(alpha)
    result = np.zeros(np.shape(theta) + (4, 4))
    result[..., 0, 0], result[..., 0, 1], result[..., 0, 2] = cos, -sin * cos_alpha, sin * sin_alpha
    result[..., 1, 0], result[..., 1, 1], result[..., 1, 2] = sin, cos * cos_alpha, -cos * sin_alpha
    result[..., 2, 1], result[..., 2, 2] = sin_alpha, cos_alpha
    result[..., 0, 3], result[..., 1, 3], result[..., 2, 3] = a * cos, a * sin, d
    result[..., 3, 3] = 1.0
    return result


def dh_frames(joints: np.ndarray) -> np.ndarray:
    """Frames 0 to 6 of the DH chain in link0, shape (..., 7, 4, 4); frame 6 is the tool."""
    joints = np.asarray(joints, dtype=float)
    frames = [np.broadcast_to(np.eye(4), joints.shape[:-1] + (4, 4))]
    for index, (a, alpha, d) in enumerate(DH_TABLE):
        frames.append(frames[-1] @ dh_transform(joints[..., index], a, alpha, d))
    return np.stack(frames, axis=-3)


def forward(joints: np.ndarray) -> np.ndarray:
    """Pose of the tool in link0, shape (..., 4, 4)."""
    return dh_frames(joints)[..., 6, :, :]


def link_frames(joints: np.ndarray) -> np.ndarray:
    """Frames link0 to link7 and tool of the URDF (appendix D.1), shape (..., 9, 4, 4).

    A URDF link turns with its joint; a DH frame is at the next joint.  Link 4 is
    fixed to link 3.
    """
    joints = np.asarray(joints, dtype=float)
    dh = dh_frames(joints)
    turned = [dh[..., i, :, :] @ dh_transform(joints[..., i], 0.0, 0.0, 0.0) for i in range(6)]
    order = [dh[..., 0, :, :], *turned[:3], turned[2], *turned[3:], dh[..., 6, :, :]]
    return np.stack(order, axis=-3)


def jacobian(joints: np.ndarray) -> np.ndarray:
    """Geometric Jacobian of the tool in link0, shape (..., 6, 6): linear rows, then angular."""
    frames = dh_frames(joints)
    axes = frames[..., :6, :3, 2]
    levers = frames[..., 6:7, :3, 3] - frames[..., :6, :3, 3]
    columns = np.concatenate([np.cross(axes, levers), axes], axis=-1)
    return np.swapaxes(columns, -1, -2)


def inverse(pose: np.ndarray, branch: Branch, near: Optional[np.ndarray] = None) -> np.ndarray:
    """Joint angles that bring the tool to ``pose`` in link0, shape (..., 6).

    Closed form: theta_1 and theta_5 from the wrist's offset, theta_6 and the sum
    theta_2 + theta_3 + theta_4 from the tool's axes, the rest is a planar two-link arm.
    Angles are in (-pi, pi], or within pi of those in ``near``.

    Raises UnreachableError if the pose is out of reach or the wrist is stretched
    (theta_5 = 0: theta_4 and theta_6 are not determined).
    """
    pose = np.asarray(pose, dtype=float)
    theta_1 = _shoulder_angle(pose, branch.shoulder)
    in_1 = _in_shoulder_frame(pose, theta_1)
    theta_5 = branch.wrist * _arccos((in_1[..., 2, 3] - WRIST_D4) / FLANGE_D6)
    if np.any(np.abs(np.sin(theta_5)) < _SINGULAR):
        raise UnreachableError("the wrist is stretched: joints 4 and 6 are in line")
    theta_6 = np.arctan2(-branch.wrist * in_1[..., 2, 1], branch.wrist * in_1[..., 2, 0])
    angle_sum = np.arctan2(-branch.wrist * in_1[..., 1, 2], -branch.wrist * in_1[..., 0, 2])
    theta_2, theta_3 = _two_link_angles(_wrist_point(in_1, angle_sum), branch.elbow)
    theta_4 = angle_sum - theta_2 - theta_3
    joints = np.stack([theta_1, theta_2, theta_3, theta_4, theta_5, theta_6], axis=-1)
    return _nearest_turn(joints, np.zeros(6) if near is None else near)


def _shoulder_angle(pose: np.ndarray, side: int) -> np.ndarray:
    center = pose[..., :2, 3] - FLANGE_D6 * pose[..., :2, 2]
    radius = np.hypot(center[..., 0], center[..., 1])
    if np.any(radius < WRIST_D4):
        raise UnreachableError("the wrist would be inside the robot's own column")
    heading = np.arctan2(center[..., 1], center[..., 0])
    return heading + side * np.arccos(WRIST_D4 / radius) + np.pi / 2


def _in_shoulder_frame(pose: np.ndarray, theta_1: np.ndarray) -> np.ndarray:
    """``pose`` in DH frame 1: its x is horizontal in the arm's plane, its y is up."""
    cos, sin = np.cos(theta_1)[..., None], np.sin(theta_1)[..., None]
    rows = [
        cos * pose[..., 0, :] + sin * pose[..., 1, :],
        pose[..., 2, :] - HEIGHT_D1 * np.array([0.0, 0.0, 0.0, 1.0]),
        sin * pose[..., 0, :] - cos * pose[..., 1, :],
    ]
    return np.stack(rows, axis=-2)


def _wrist_point(in_1: np.ndarray, angle_sum: np.ndarray) -> np.ndarray:
    """Origin of DH frame 4 in the arm's plane, shape (..., 2)."""
    axis_4 = np.stack([np.sin(angle_sum), -np.cos(angle_sum)], axis=-1)
    return in_1[..., :2, 3] - FLANGE_D6 * in_1[..., :2, 2] - WRIST_D5 * axis_4


def _two_link_angles(point: np.ndarray, elbow: int) -> tuple[np.ndarray, np.ndarray]:
    """theta_2 and theta_3 that put the planar arm's end at ``point`` (law of cosines)."""
    square = np.sum(point**2, axis=-1) - UPPER_ARM_A2**2 - FOREARM_A3**2
    theta_3 = elbow * _arccos(square / (2 * UPPER_ARM_A2 * FOREARM_A3))
    arm = np.arctan2(
        FOREARM_A3 * np.sin(theta_3), UPPER_ARM_A2 + FOREARM_A3 * np.cos(theta_3)
    )
    return np.arctan2(point[..., 1], point[..., 0]) - arm, theta_3


def _arccos(cosine: np.ndarray) -> np.ndarray:
    if np.any(np.abs(cosine) > 1.0 + _SINGULAR):
        raise UnreachableError("the pose is out of the robot's reach")
    return np.arccos(np.minimum(np.maximum(cosine, -1.0), 1.0))


def _nearest_turn(angles: np.ndarray, near: np.ndarray) -> np.ndarray:
    return angles - 2 * np.pi * np.ceil((angles - near - np.pi) / (2 * np.pi))


def rotation_matrix(vector: np.ndarray) -> np.ndarray:
    """Matrix of a rotation vector (axis times angle in rad), shape (..., 3, 3) (Rodrigues)."""
    vector = np.asarray(vector, dtype=float)
    angle = np.linalg.norm(vector, axis=-1)[..., None, None]
    cross = np.zeros(vector.shape + (3,))
    cross[..., 2, 1], cross[..., 0, 2], cross[..., 1, 0] = np.moveaxis(vector, -1, 0)
    cross = cross - np.swapaxes(cross, -1, -2)
    return np.eye(3) + np.sinc(angle / np.pi) * cross + _versine(angle) * (cross @ cross)


def _versine(angle: np.ndarray) -> np.ndarray:
    """(1 - cos x) / x^2, also at zero."""
    return 0.5 * np.sinc(angle / (2 * np.pi)) ** 2


def rotation_vector(matrix: np.ndarray) -> np.ndarray:
    """Rotation vector (axis times angle in rad, angle at most pi) of one (3, 3) matrix.

    Computed from the largest component of the quaternion (Shepperd 1978), so that it is also
    valid at half a turn.
    """
    matrix = np.asarray(matrix, dtype=float)
    x_x, y_y, z_z = np.diag(matrix)
    squares = 1 + np.array(
        [x_x + y_y + z_z, x_x - y_y - z_z, y_y - x_x - z_z, z_z - x_x - y_y]
    )
    products = _quaternion_products(matrix, squares)
    largest = int(np.argmax(squares))
    quaternion = products[largest] / (2 * np.sqrt(squares[largest]))
    quaternion = quaternion if quaternion[0] >= 0 else -quaternion
    sine = np.linalg.norm(quaternion[1:])
    if sine < _SINGULAR:
        return 2 * quaternion[1:]
    return 2 * np.arctan2(sine, quaternion[0]) / sine * quaternion[1:]


def _quaternion_products(matrix: np.ndarray, squares: np.ndarray) -> np.ndarray:
    """4 q q^T of the quaternion q = (w, x, y, z), shape (4, 4)."""
    result = np.diag(squares)
    skew, even = matrix - matrix.T, matrix + matrix.T
    result[0, 1:] = result[1:, 0] = skew[2, 1], skew[0, 2], skew[1, 0]
    for row, column in ((0, 1), (0, 2), (1, 2)):
        result[row + 1, column + 1] = result[column + 1, row + 1] = even[row, column]
    return result
