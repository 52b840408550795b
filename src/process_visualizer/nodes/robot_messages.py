"""The quantities a robot's driver sends, and the messages that can carry them."""
from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Dict, List, Type

import genpy
import numpy as np
from geometry_msgs.msg import PoseStamped, WrenchStamped
from sensor_msgs.msg import JointState

from process_visualizer.motion.float32_multi_array import float32_values
from process_visualizer.motion.rotations import (matrix_from_quaternion,
                                                 matrix_from_rotation_vector)
from process_visualizer.nodes.message_reader import Decoder

FLOAT_ARRAY = 'std_msgs/Float32MultiArray'


@dataclass(frozen=True)
class JointPositions:
    """Positions [rad or m]; names is empty where the message has none."""

    names: List[str]
    positions: List[float]


@dataclass(frozen=True)
class ToolPose:
    """Pose of the tool in a frame ('' is the robot's base frame)."""

    position: np.ndarray  # (3,) [m]
    rotation: np.ndarray  # (3, 3)
    frame: str = ''


@dataclass(frozen=True)
class Wrench:
    """Force (3,) [N] and torque (3,) [Nm] in a frame ('' is the robot's force frame)."""

    force: np.ndarray
    torque: np.ndarray
    frame: str = ''


def _joints_from_array(message: bytes) -> JointPositions:
    return JointPositions([], _finite(float32_values(message)).tolist())


def _joints_from_joint_state(message: bytes) -> JointPositions:
    state = _deserialize(JointState, message)
    return JointPositions(state.name, _finite(np.array(state.position)).tolist())


def _pose_from_array(message: bytes) -> ToolPose:
    """Read x y z [m] and a rotation vector [rad] (Universal Robots) or a quaternion x y z w."""
    values = _finite(float32_values(message))
    if len(values) == 6:
        return ToolPose(values[:3], matrix_from_rotation_vector(values[3:]))
    if len(values) == 7:
        return ToolPose(values[:3], matrix_from_quaternion(values[3:]))
    raise ValueError('6 values (x y z and a rotation vector) or 7 (x y z and a quaternion x y z w) '
                     f'are expected, not {len(values)}')


def _pose_from_pose_stamped(message: bytes) -> ToolPose:
    stamped = _deserialize(PoseStamped, message)
    position, rotation = stamped.pose.position, stamped.pose.orientation
    quaternion = _finite(np.array([rotation.x, rotation.y, rotation.z, rotation.w]))
    return ToolPose(_finite(_array(position)), matrix_from_quaternion(quaternion),
                    stamped.header.frame_id.lstrip('/'))


def _wrench_from_array(message: bytes) -> Wrench:
    """Read fx fy fz [N], and tx ty tz [Nm] where they are there."""
    values = _finite(float32_values(message))
    if len(values) not in (3, 6):
        raise ValueError('3 values (a force) or 6 (a force and a torque) are expected, '
                         f'not {len(values)}')
    return Wrench(values[:3], values[3:] if len(values) == 6 else np.zeros(3))


def _wrench_from_wrench_stamped(message: bytes) -> Wrench:
    stamped = _deserialize(WrenchStamped, message)
    return Wrench(_finite(_array(stamped.wrench.force)), _finite(_array(stamped.wrench.torque)),
                  stamped.header.frame_id.lstrip('/'))


JOINT_DECODERS: Dict[str, Decoder[JointPositions]] = {
    FLOAT_ARRAY: _joints_from_array,
    'sensor_msgs/JointState': _joints_from_joint_state,
}
POSE_DECODERS: Dict[str, Decoder[ToolPose]] = {
    FLOAT_ARRAY: _pose_from_array,
    'geometry_msgs/PoseStamped': _pose_from_pose_stamped,
}
WRENCH_DECODERS: Dict[str, Decoder[Wrench]] = {
    FLOAT_ARRAY: _wrench_from_array,
    'geometry_msgs/WrenchStamped': _wrench_from_wrench_stamped,
}


def _deserialize(message_class: Type[genpy.Message], message: bytes) -> Any:
    return message_class().deserialize(message)


def _array(vector: Any) -> np.ndarray:
    return np.array([vector.x, vector.y, vector.z])


def _finite(values: np.ndarray) -> np.ndarray:
    if not np.isfinite(values).all():
        raise ValueError('it holds NaN or infinity')
    return values
