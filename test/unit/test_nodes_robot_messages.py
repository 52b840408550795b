# SPDX-License-Identifier: BSD-3-Clause
"""Messages with a robot's quantities, valid and invalid."""
import io
import math

import numpy as np
import pytest
from geometry_msgs.msg import PoseStamped, WrenchStamped
from std_msgs.msg import Float32MultiArray, MultiArrayDimension

from process_visualizer.nodes.robot.message_reader import POSE_DECODERS, WRENCH_DECODERS
from process_visualizer.robot.rotations import matrix_from_quaternion, matrix_from_rotation_vector


def decode(decoders, message):
    """Return the result of a decoder for a message's bytes."""
    buffer = io.BytesIO()
    message.serialize(buffer)
    return decoders[message._type](buffer.getvalue())


def array(*values):
    message = Float32MultiArray(data=values)
    message.layout.dim.append(MultiArrayDimension('values', len(values), len(values)))
    return message


def pose_stamped(quaternion=(0.0, 0.0, 0.0, 1.0)):
    message = PoseStamped()
    message.header.frame_id = '/r/link0'
    message.pose.position.x = 0.25
    orientation = message.pose.orientation
    orientation.x, orientation.y, orientation.z, orientation.w = quaternion
    return message


def wrench_stamped(x=1.0):
    message = WrenchStamped()
    message.header.frame_id = 'r/force'
    message.wrench.force.x = x
    message.wrench.torque.z = 2.0
    return message


def rotation(pose):
    return matrix_from_quaternion(pose.quaternion)


@pytest.mark.parametrize(('decoders', 'message', 'problem'), [
    (WRENCH_DECODERS, array(0.0, 1e38, 0.0), r'a force of 1e.38 N is out of any physical range'),
    (WRENCH_DECODERS, array(0.0, 0.0, 0.0, -1e30, 0.0, 0.0), r'a torque of -1e.30 Nm'),
    (WRENCH_DECODERS, wrench_stamped(-1e38), r'a force of -1e.38 N'),
    (POSE_DECODERS, array(1e38, 0.0, 0.0), r'a position of 1e.38 m'),
    (POSE_DECODERS, array(0.0, 0.0, 2e5, 0.0, 0.0, 0.0, 1.0), r'a position of 2e.05 m')])
def test_what_is_out_of_any_physical_range_is_named(decoders, message, problem):
    with pytest.raises(ValueError, match=problem):
        decode(decoders, message)


def test_tool_pose():
    vector = decode(POSE_DECODERS, array(0.5, 0.25, -1.0, 0.1, 0.2, 0.3))
    assert tuple(vector.position) == (0.5, 0.25, -1.0)
    assert np.allclose(rotation(vector), matrix_from_rotation_vector((0.1, 0.2, 0.3)), atol=1e-6)
    quaternion = decode(POSE_DECODERS, array(0.5, 0.25, -1.0, 0.0, 0.0, 2.0, 2.0))
    assert np.allclose(rotation(quaternion) @ [1, 0, 0], [0, 1, 0])
    stamped = decode(POSE_DECODERS, pose_stamped())
    assert (stamped.position[0], stamped.frame) == (0.25, 'r/link0')
    assert all(pose.has_rotation for pose in (vector, quaternion, stamped))


def test_tool_pose_without_a_rotation():
    pose = decode(POSE_DECODERS, array(0.5, 0.25, -1.0))
    assert (tuple(pose.position), pose.has_rotation) == ((0.5, 0.25, -1.0), False)
    assert pose.quaternion == (0.0, 0.0, 0.0, 1.0)


def test_wrench():
    assert tuple(decode(WRENCH_DECODERS, array(1, 2, 3, 4, 5, 6)).torque) == (4, 5, 6)
    assert tuple(decode(WRENCH_DECODERS, array(1, 2, 3)).torque) == (0, 0, 0)
    stamped = decode(WRENCH_DECODERS, wrench_stamped())
    assert (stamped.force[0], stamped.torque[2], stamped.frame) == (1.0, 2.0, 'r/force')


@pytest.mark.parametrize('message', [array(0.5, 0, 0, 0, 0, 0, 0),
                                     pose_stamped((0.0, 0.0, 0.0, 0.0))])
def test_a_position_counts_where_the_rotation_is_left_zero(message):
    pose = decode(POSE_DECODERS, message)
    assert not pose.has_rotation and pose.quaternion == (0.0, 0.0, 0.0, 1.0)


@pytest.mark.parametrize('decoders, message, problem', [
    (POSE_DECODERS, array(), '3 values.*not 0'),
    (POSE_DECODERS, array(1, 2, 3, 4), '3 values.*not 4'),
    (POSE_DECODERS, array(1, 2, 3, 4, 5, math.inf), 'NaN or infinity'),
    (POSE_DECODERS, pose_stamped((0.0, 0.0, math.nan, 1.0)), 'NaN'),
    (WRENCH_DECODERS, array(1, 2), '3 values.*not 2'),
    (WRENCH_DECODERS, wrench_stamped(math.nan), 'NaN'),
])
def test_what_cannot_be_used_says_why(decoders, message, problem):
    with pytest.raises(ValueError, match=problem):
        decode(decoders, message)
