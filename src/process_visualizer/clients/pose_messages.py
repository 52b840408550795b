# SPDX-License-Identifier: BSD-3-Clause
"""Poses of messages as a configuration has them."""
from __future__ import annotations

import geometry_msgs.msg

from process_visualizer.cell.model import Pose
from process_visualizer.motion.rotations import matrix_from_quaternion, ypr_from_matrix


def pose_of(message: geometry_msgs.msg.Pose) -> Pose:
    """Return position [m] and yaw pitch roll [rad] of a message."""
    position, turned = message.position, message.orientation
    matrix = matrix_from_quaternion((turned.x, turned.y, turned.z, turned.w))
    yaw, pitch, roll = ypr_from_matrix(matrix).tolist()
    return Pose((position.x, position.y, position.z), (yaw, pitch, roll))
