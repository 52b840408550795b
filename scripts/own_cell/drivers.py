#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Simulates one driver of the cell in docs/own_cell.md: its topics, names and frames.

usage: drivers.py ur5e|panda|camera|oven     (started by drivers.launch)

The robots move on known paths; what their drivers report follows from the makers' models, which
are in the parameter robot_description. The names are those of the makers' ROS 1 drivers.
"""
from __future__ import annotations

import math
from contextlib import suppress
from typing import Dict

import numpy as np
import rospy
import tf2_ros
from geometry_msgs.msg import Transform, TransformStamped, Vector3, WrenchStamped
from sensor_msgs.msg import JointState, PointCloud2, PointField, Temperature
from std_msgs.msg import Header
from tf2_msgs.msg import TFMessage

from process_visualizer.robot.kinematics import Kinematics, Placement

UR_JOINTS = {'shoulder_pan_joint': 0.2, 'shoulder_lift_joint': -1.5, 'elbow_joint': 1.9,
             'wrist_1_joint': -2.0, 'wrist_2_joint': -1.571, 'wrist_3_joint': 0.0}
PANDA_JOINTS = {f'panda_joint{number}': angle for number, angle in enumerate(
    (0.3, 0.1, 0.1, -2.0, 0.0, 2.1, 0.785), 1)}
BASE_LINK_IN_BASE = Placement(quaternion=(0.0, 0.0, 1.0, 0.0))  # turned by 180° about z
FINGERS = {'panda_finger_joint1': 0.02, 'panda_finger_joint2': 0.02}
HALF_RAD = -math.pi / 8
HAND = Placement((0.0, 0.0, 0.1034), (0.0, 0.0, math.sin(HALF_RAD), math.cos(HALF_RAD)))
SWEEP_RAD, SWEEP_RAD_PER_S = 0.6, 1.2


def sweep(middle: Dict[str, float], time_s: float) -> Dict[str, float]:
    """Return joint positions [rad] at a time: the first and fourth joint move back and forth."""
    names = list(middle)
    offset = SWEEP_RAD * math.sin(SWEEP_RAD_PER_S * (time_s % 1e4))
    return {**middle, names[0]: middle[names[0]] + offset,
            names[3]: middle[names[3]] + 0.4 * offset}


def joint_state(header: Header, positions: Dict[str, float]) -> JointState:
    names = sorted(positions)  # the joint state controller's order
    return JointState(header=header, name=names, position=[positions[name] for name in names])


def wrench(header: Header, *force: float) -> WrenchStamped:
    message = WrenchStamped(header=header)
    message.wrench.force = Vector3(*force)
    return message


def transform(header: Header, child: str, place: Placement) -> TransformStamped:
    message = TransformStamped(header, child, Transform())
    it = message.transform
    it.translation = Vector3(*place.position)
    it.rotation.x, it.rotation.y, it.rotation.z, it.rotation.w = place.quaternion
    return message


class UniversalRobotsDriver:
    """ur_robot_driver: joints and wrench in its namespace; the tool in the frame base, on tf."""

    rate_hz = 125.0

    def __init__(self) -> None:
        self._tf = rospy.Publisher('/tf', TFMessage, queue_size=10)
        self._model = Kinematics(rospy.get_param('robot_description'))
        self._joints = rospy.Publisher('joint_states', JointState, queue_size=10)
        self._wrench = rospy.Publisher('wrench', WrenchStamped, queue_size=10)

    def send(self, now: rospy.Time) -> None:
        """Send the present state."""
        positions = sweep(UR_JOINTS, now.to_sec())
        tool = self._model.placement('tool0', 'base_link', positions)
        assert tool is not None
        tool = BASE_LINK_IN_BASE.then(tool)
        self._joints.publish(joint_state(Header(stamp=now), positions))
        self._tf.publish([transform(Header(stamp=now, frame_id='base'), 'tool0_controller', tool)])
        self._wrench.publish(wrench(Header(stamp=now, frame_id='tool0_controller'),
                                    0.0, 20.0 + 5.0 * math.sin(now.to_sec()), 0.0))


class FrankaDriver:
    """franka_control with its gripper: all nine joints, external wrench, frames behind link 8."""

    rate_hz = 30.0

    def __init__(self) -> None:
        self._tf = rospy.Publisher('/tf', TFMessage, queue_size=10)
        self._joints = rospy.Publisher('joint_states', JointState, queue_size=10)
        self._arm_joints = rospy.Publisher('franka_state_controller/joint_states',
                                           JointState, queue_size=10)
        self._wrench = rospy.Publisher('franka_state_controller/F_ext', WrenchStamped,
                                       queue_size=10)

    def send(self, now: rospy.Time) -> None:
        """Send the present state."""
        arm = sweep(PANDA_JOINTS, now.to_sec())
        self._arm_joints.publish(joint_state(Header(stamp=now), arm))
        self._joints.publish(joint_state(Header(stamp=now), {**arm, **FINGERS}))
        links = ('panda_link8', 'panda_NE', 'panda_EE', 'panda_K')
        places = (HAND, Placement(), Placement())
        self._tf.publish([transform(Header(stamp=now, frame_id=parent), child, place)
                          for parent, child, place in zip(links, links[1:], places)])
        self._wrench.publish(wrench(Header(stamp=now, frame_id='panda_K'), 0.0, 12.0, 0.0))


class Camera:
    """A depth camera that looks at a table with two parts, 1 m above them."""

    rate_hz = 30.0
    FIELDS = [PointField(name, 4 * number, PointField.FLOAT32, 1)
              for number, name in enumerate(('x', 'y', 'z', 'rgb'))]

    def __init__(self) -> None:
        tf2_ros.StaticTransformBroadcaster().sendTransform(transform(
            Header(frame_id='camera_link'), 'camera_depth_optical_frame',
            Placement((0.0, 0.0, 0.0), (-0.5, 0.5, -0.5, 0.5))))
        self._points = rospy.Publisher('camera/depth/color/points', PointCloud2, queue_size=2)
        cloud = self._cloud()
        self._message = PointCloud2(height=1, width=len(cloud), fields=self.FIELDS, point_step=16,
                                    row_step=16 * len(cloud), data=cloud.tobytes(), is_dense=True)

    def send(self, now: rospy.Time) -> None:
        """Send the image of the camera."""
        self._message.header = Header(stamp=now, frame_id='camera_depth_optical_frame')
        self._points.publish(self._message)

    @staticmethod
    def _cloud() -> np.ndarray:
        """Return x y z [m] and color of each point, in the optical frame: z ahead, y down."""
        x, y = (axis.ravel() for axis in np.meshgrid(np.arange(-0.3, 0.3, 0.004),
                                                     np.arange(-0.45, 0.45, 0.004)))
        part = (np.abs(np.abs(y) - 0.25) < 0.05) & (np.abs(x) < 0.08)
        color = np.where(part, 0xe0a030, 0x707880).astype(np.uint32).view(np.float32)
        return np.stack([x, y, np.where(part, 0.94, 1.0), color], axis=1).astype(np.float32)


class Thermometer:
    """The temperature of an oven that is heated up to 200 °C and cools down, in a minute."""

    rate_hz = 10.0

    def __init__(self) -> None:
        self._publisher = rospy.Publisher('oven/temperature', Temperature, queue_size=2)

    def send(self, now: rospy.Time) -> None:
        """Send the temperature."""
        celsius = 185.0 + 15.0 * math.sin(now.to_sec() / 10.0)
        self._publisher.publish(Header(stamp=now, frame_id='oven'), celsius, 0.0)


DRIVERS = {'ur5e': UniversalRobotsDriver, 'panda': FrankaDriver, 'camera': Camera,
           'oven': Thermometer}


def main() -> None:
    """Send a driver's messages until the program ends, when the topics are closed."""
    name = rospy.myargv()[1]
    rospy.init_node(name)
    driver = DRIVERS[name]()
    rate = rospy.Rate(driver.rate_hz)
    with suppress(rospy.ROSException):
        while not rospy.is_shutdown():
            driver.send(rospy.Time.now())
            rate.sleep()


if __name__ == '__main__':
    main()
