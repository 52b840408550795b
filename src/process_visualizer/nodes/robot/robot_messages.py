# SPDX-License-Identifier: BSD-3-Clause
"""The quantities that a robot's driver sends, and the message types for them."""
from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any, Dict, Sequence, Type

import genpy
from geometry_msgs.msg import PoseStamped, WrenchStamped

from process_visualizer.motion.float32_multi_array import float32_values
from process_visualizer.motion.rotations import (
    NO_ROTATION,
    Quaternion,
    quaternion_from_rotation_vector,
)
from process_visualizer.nodes.robot.message_reader import Decoder
from process_visualizer.ros_names import FLOAT_ARRAY, POSE_STAMPED, WRENCH_STAMPED

_FARTHEST_M, _LARGEST_FORCE_N, _LARGEST_TORQUE_NM = 1e5, 1e7, 1e7
"""Far beyond what any robot reaches or bears."""


@dataclass(frozen=True)
class ToolPose:
    """Pose of the tool in a frame ('' is the robot's base frame)."""

    position: Sequence[float]  # (3,) [m]
    quaternion: Quaternion = NO_ROTATION  # x y z w, not zero, of any length
    frame: str = ''
    stamp_s: float = 0.0  # when it was measured; 0: the message does not say
    has_rotation: bool = True  # False: the message holds a position only
    child_frame: str = ''  # the frame of tf that has this pose


@dataclass(frozen=True)
class Wrench:
    """Force (3,) [N] and torque (3,) [Nm] in a frame ('' is the robot's force frame)."""

    force: Sequence[float]
    torque: Sequence[float]
    frame: str = ''


def _pose_from_array(message: bytes) -> ToolPose:
    """Read x y z [m], and a rotation vector [rad] (Universal Robots) or a quaternion x y z w."""
    values = _finite(float32_values(message))
    _in_range(values[:3], 'position', _FARTHEST_M, 'm')
    if len(values) == 3:
        return ToolPose(values, has_rotation=False)
    if len(values) == 6:
        return ToolPose(values[:3], quaternion_from_rotation_vector(values[3:]))
    if len(values) == 7:
        return _with_rotation(ToolPose(values[:3]), values[3:])
    raise ValueError('3 values (x y z), 6 (with a rotation vector) or 7 (with a quaternion '
                     f'x y z w) are expected, not {len(values)}')


def _pose_from_pose_stamped(message: bytes) -> ToolPose:
    stamped = deserialize(PoseStamped, message)
    position, rotation = stamped.pose.position, stamped.pose.orientation
    quaternion = _finite((rotation.x, rotation.y, rotation.z, rotation.w))
    return _with_rotation(ToolPose(
        _in_range(_finite(_numbers(position)), 'position', _FARTHEST_M, 'm'),
        frame=stamped.header.frame_id.lstrip('/'),
        stamp_s=stamped.header.stamp.to_sec()), quaternion)


def _wrench_from_array(message: bytes) -> Wrench:
    """Read fx fy fz [N], and tx ty tz [Nm] if present."""
    values = _finite(float32_values(message))
    if len(values) not in (3, 6):
        raise ValueError('3 values (a force) or 6 (a force and a torque) are expected, '
                         f'not {len(values)}')
    return _wrench(values[:3], values[3:] if len(values) == 6 else (0.0, 0.0, 0.0))


def _wrench_from_wrench_stamped(message: bytes) -> Wrench:
    stamped = deserialize(WrenchStamped, message)
    return _wrench(_finite(_numbers(stamped.wrench.force)),
                   _finite(_numbers(stamped.wrench.torque)),
                   stamped.header.frame_id.lstrip('/'))


def _wrench(force: Sequence[float], torque: Sequence[float], frame: str = '') -> Wrench:
    return Wrench(_in_range(force, 'force', _LARGEST_FORCE_N, 'N'),
                  _in_range(torque, 'torque', _LARGEST_TORQUE_NM, 'Nm'), frame)


POSE_DECODERS: Dict[str, Decoder[ToolPose]] = {
    FLOAT_ARRAY: _pose_from_array,
    POSE_STAMPED: _pose_from_pose_stamped,
}
WRENCH_DECODERS: Dict[str, Decoder[Wrench]] = {
    FLOAT_ARRAY: _wrench_from_array,
    WRENCH_STAMPED: _wrench_from_wrench_stamped,
}


def deserialize(message_class: Type[genpy.Message], message: bytes) -> Any:
    """Return a message from its bytes; raises genpy.DeserializationError."""
    return message_class().deserialize(message)


def _numbers(vector: Any) -> Sequence[float]:
    return vector.x, vector.y, vector.z


def _finite(values: Sequence[float]) -> Sequence[float]:
    if not all(map(math.isfinite, values)):
        raise ValueError('it holds NaN or infinity')
    return values


def _in_range(values: Sequence[float], what: str, largest: float, unit: str) -> Sequence[float]:
    """Return values that a robot can have; raise ValueError for others, which nobody should see."""
    if max(map(abs, values), default=0.0) > largest:
        raise ValueError(f'a {what} of {max(values, key=abs):.3g} {unit} is out of any physical '
                         f'range (up to {largest:g} {unit})')
    return values


def _with_rotation(pose: ToolPose, quaternion: Sequence[float]) -> ToolPose:
    """Return a pose with its rotation; drivers that know only the position leave that zero."""
    if max(map(abs, quaternion)) < 1e-6:
        return replace(pose, has_rotation=False)
    x, y, z, w = quaternion
    return replace(pose, quaternion=(x, y, z, w))
