# SPDX-License-Identifier: BSD-3-Clause
"""Poses and forces in the maker's frames, which the model connects with the robot's base."""
from __future__ import annotations

import math
from typing import Callable, Sequence

import numpy as np
import pytest
from geometry_msgs.msg import PoseStamped, WrenchStamped
from robot_stage import RobotStage, direction, transform
from rospy import Time
from sensor_msgs.msg import JointState
from tf2_msgs.msg import TFMessage

SPEED_M_PER_S = 0.2


@pytest.fixture
def robot() -> RobotStage:
    """A maker's model with a prefix that its driver does not know."""
    return RobotStage({'base_frame': 'left_base_link', 'tool_frame': 'left_tool',
                       'link_prefix': 'left_', 'topics': {
                           'joint_states': {'name': 'joints'},
                           'tool_center_frame': {'name': 'pose'},
                           'force_sensor': {'name': 'wrench'}}}, 'm', 'maker_robot.urdf')


def driver(robot: RobotStage, frames: Sequence[str], moves: bool = True
           ) -> Callable[[float], None]:
    """The axis moves along +y; the tool moves along -y of the maker's base, or is on the cart."""
    def drive(time_s: float) -> None:
        y, now = SPEED_M_PER_S * time_s, Time.from_sec(robot.node.now_s)
        state = JointState(name=['axis'], position=[y])
        pose, wrench = PoseStamped(), WrenchStamped()
        state.header.stamp = pose.header.stamp = now
        frame = frames[round(time_s * 125.0) % len(frames)]
        pose.header.frame_id = wrench.header.frame_id = frame
        pose.pose.position.x, pose.pose.position.y = (-1.0, -y) if moves else (1.0, 0.0)
        pose.pose.orientation.w = 1.0
        wrench.wrench.force.x = 20.0
        for topic, message in (('joint_states', state), ('pose', pose), ('wrench', wrench)):
            robot.send(f'/m/{topic}', message)
    return drive


def assert_moves(robot: RobotStage, *velocity: float, atol: float = 1e-6) -> None:
    """Assert the last published values, over half a second."""
    np.testing.assert_allclose(robot.velocities(60), [velocity] * 60, atol=atol)


def test_poses_and_forces_in_the_base_of_the_maker(robot: RobotStage) -> None:
    """By its names with and without prefix, tf prefix and slash; as arrows at the tool."""
    robot.run(1.0, driver(robot, ('base', '/base', 'left_base', 'left/base', '/m/base')))
    assert_moves(robot, 0.0, SPEED_M_PER_S, 0.0)
    for name, wanted in (('velocity', (1.0, 0.0, 0.0)), ('force', (0.0, 1.0, 0.0))):
        marker = robot.markers()[name, 0]
        assert marker.header.frame_id == 'left_tool'
        np.testing.assert_allclose(direction(marker), wanted, atol=1e-6)
    assert {it.header.frame_id for it in robot.node.sent('tool_force')} == {'left_base'}


def test_a_joint_between_the_frame_and_the_base(robot: RobotStage) -> None:
    robot.run(1.0, driver(robot, ['cart'], moves=False))
    assert_moves(robot, 0.0, SPEED_M_PER_S, 0.0)


def test_a_frame_that_a_static_transform_connects(robot: RobotStage) -> None:
    robot.node.send('/tf_static', TFMessage([transform('m/floor', 'left_base_link', 0.0,
                                                       turn=math.pi / 2)]), latch=True)
    robot.run(1.0, driver(robot, ['m/floor']))
    assert_moves(robot, -SPEED_M_PER_S, 0.0, 0.0)


def test_a_frame_that_nothing_connects_is_named(robot: RobotStage) -> None:
    robot.run(0.1, driver(robot, ['right_base']))
    assert robot.warnings('m: ', '/m/pose', 'its frame is right_base',
                          'connects with the base frame left_base_link')
