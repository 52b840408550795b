# SPDX-License-Identifier: BSD-3-Clause
"""Layout of the simulated cell: poses of objects, and the two robots that hold the covers.

Frame ``world``, z up, lengths in m.
"""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sewing_cell.kinematics import Branch, inverse, rotation_matrix

FLOOR_Z = -1.0

#: Origin of sewing_machine/base: the (+x, +y) top corner of the machine's bed.
MACHINE_BASE = np.array([-0.667, -0.499, 0.05])
SEWING_PLANE_Z = 0.05
NEEDLE = MACHINE_BASE + np.array([-0.08, -0.08, 0.0])

#: The covers' extent about the point under the grippers: x_min, x_max, y_min, y_max.
COVER_BOX = (-0.14, 0.26, -0.84, 0.04)
COVER_THICKNESS = 0.003

#: Points where the grippers fetch the next covers, and where the seam starts and ends.
FETCH_XY = (-0.54, 0.45)
SEAM_START_XY = (-0.62, 0.25)
SEAM_END_XY = (-0.62, -0.25)

#: The tools' height above the sewing plane while they hold a cover, and their lift when free of it.
GRIP_HEIGHT = 0.11
LIFT_HEIGHT = 0.08

#: The Kinect: camera_link, its pitch [rad], and the color camera in camera_link (as in openni).
CAMERA_XYZ = np.array([-0.53, 0.09, 1.90])
CAMERA_PITCH = 1.55
#: camera_2_link of a second Kinect, with the orientation of the first one.
SECOND_CAMERA_XYZ = np.array([-0.53, -0.45, 1.90])
COLOR_CAMERA_OFFSET = np.array([0.0, -0.045, 0.0])


_FORCE_YAW = rotation_matrix(np.array([0.0, 0.0, -np.pi / 2]))


@dataclass(frozen=True)
class Arm:
    """One robot.  ``side`` is +1 above the sewing plane and -1 below it.

    ``tool_vector`` is the tool's constant rotation vector in link0: half a turn about a
    horizontal axis, so that the tool points at the sewing plane.  ``rest`` is a joint vector
    near which all the solutions lie.
    """

    name: str
    side: int
    base_rotation: np.ndarray
    tool_vector: np.ndarray
    branch: Branch
    rest: np.ndarray

    def tool_pose(self, position_world: np.ndarray) -> np.ndarray:
        """Tool pose in link0, (..., 4, 4), with the tool at ``position_world`` (..., 3) [m]."""
        pose = np.zeros(np.shape(position_world)[:-1] + (4, 4))
        pose[..., :3, :3] = rotation_matrix(self.tool_vector)
        pose[..., :3, 3] = self.to_base(position_world)
        pose[..., 3, 3] = 1.0
        return pose

    def to_base(self, vector_world: np.ndarray) -> np.ndarray:
        """A vector (..., 3) of ``world`` in link0; the origins coincide."""
        return np.asarray(vector_world) @ self.base_rotation

    def to_force_frame(self, vector_world: np.ndarray) -> np.ndarray:
        """A vector (..., 3) of ``world`` in the force frame (the tool, turned by yaw -pi/2)."""
        return self.to_base(vector_world) @ rotation_matrix(self.tool_vector) @ _FORCE_YAW

    def joints(self, position_world: np.ndarray) -> np.ndarray:
        """Joint angles (..., 6) [rad] for the tool at ``position_world`` (..., 3) [m]."""
        return inverse(self.tool_pose(position_world), self.branch, self.rest)


def _half_turn(yaw: float) -> np.ndarray:
    """Rotation vector of Rz(yaw) Rx(pi): a tool that points down, turned by ``yaw``."""
    return np.pi * np.array([np.cos(yaw / 2), np.sin(yaw / 2), 0.0])


UPPER = Arm(
    name="upper",
    side=1,
    base_rotation=np.eye(3),
    tool_vector=_half_turn(np.pi / 2),
    branch=Branch(shoulder=1, elbow=1, wrist=-1),
    rest=np.array([0.0, -1.0, 1.5, -2.1, -1.57, 0.0]),
)

LOWER = Arm(
    name="lower",
    side=-1,
    base_rotation=np.diag([-1.0, 1.0, -1.0]),
    tool_vector=_half_turn(-np.pi / 2),
    branch=Branch(shoulder=1, elbow=1, wrist=-1),
    rest=np.array([-np.pi, -1.0, 1.5, -2.1, -1.57, 0.0]),
)

ARMS = (UPPER, LOWER)
