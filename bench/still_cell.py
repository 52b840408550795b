# SPDX-License-Identifier: BSD-3-Clause
"""The simulated sewing cell at one moment: the simulator's picture, and frames of the same moment.

Frames, cloud and models are published as those of a running cell.
"""
from __future__ import annotations

import math
from typing import Dict, List, NamedTuple, Tuple

import numpy as np
import rospkg
import rospy
from geometry_msgs.msg import Quaternion, TransformStamped, Vector3
from sensor_msgs.msg import PointCloud2, PointField
from tf2_msgs.msg import TFMessage

from process_visualizer.cell.model import Cell, Device, Pose
from process_visualizer.cell.xml_parser import XmlParser
from process_visualizer.robot.description import describe_devices
from process_visualizer.robot.kinematics import Kinematics, Placement
from process_visualizer.robot.rotations import quaternion_from_ypr
from sewing_cell import layout, pinhole
from sewing_cell.camera import Camera
from sewing_cell.cycle import SewingCycle
from sewing_cell.layout import ARMS, Arm

RATE_HZ = 30.0
CLOUD = '/camera/depth_registered/points'
OPTICAL = 'camera_rgb_optical_frame'
_HALF_PI = math.pi / 2


class RobotModel(NamedTuple):
    """A robot's description, and its movable joints."""

    arm: Arm
    urdf: str
    kinematics: Kinematics
    joints: Tuple[str, ...]

    def links(self, cycle: SewingCycle, time_s: float) -> Dict[str, Placement]:
        """Return the poses of its links in its base, link0."""
        angles = cycle.joints(self.arm, np.array([time_s]))[0].tolist()
        positions = dict(zip(self.joints, angles))
        found = {it: self.kinematics.placement(it, f'ur_rt_{self.arm.name}/link0', positions)
                 for it in self.kinematics.links}
        return {name: place for name, place in found.items() if place is not None}


class StillCell:
    """Publishes the cell of a configuration at moments of the sewing cycle."""

    def __init__(self, seed: int = 0) -> None:
        """Needs an initialized rospy node."""
        self.cell: Cell = XmlParser().parse(
            rospkg.RosPack().get_path('sewing_cell') + '/devices/simulated.xml')
        self.sensor: Device = self.cell.device('kinect')
        self._cycle = SewingCycle(seed=seed)
        self._robots = [_robot(arm, self.cell) for arm in ARMS]
        self._camera = Camera(self._cycle, RATE_HZ, seed)
        self._transforms: Dict[str, TransformStamped] = {}
        self._frames = rospy.Publisher('/tf_static', TFMessage, latch=True, queue_size=1)
        self._cloud = rospy.Publisher(CLOUD, PointCloud2, latch=True, queue_size=1)
        for robot in self._robots:
            rospy.set_param(f'/ur_rt_{robot.arm.name}/robot_description', robot.urdf)
        for name in ('cell_stand', 'sewing_machine'):
            rospy.set_param(f'/{name}/robot_description', _urdf(self.cell, name))

    @property
    def truth(self) -> Pose:
        """Return the true pose of the sensor."""
        assert self.sensor.base is not None
        return self.sensor.base.pose

    def show(self, number: int) -> None:
        """Publish picture ``number`` of the cycle as a cloud, and all frames as they are then."""
        time_s = number / RATE_HZ
        transforms = [_optical()]
        for device in self.cell.devices:
            if device.base is not None:
                transforms.append(_transform(self.cell.frame, device.base.frame, device.base.pose))
        for robot in self._robots:
            base = f'ur_rt_{robot.arm.name}/link0'
            transforms += [_placed(base, link, place)
                           for link, place in robot.links(self._cycle, time_s).items()
                           if link != base]
        self._send(transforms)
        self._cloud.publish(_cloud(self._camera.render(number).depth))

    def move_sensor(self, pose: Pose) -> None:
        """Publish a pose of the sensor that differs from its true one."""
        assert self.sensor.base is not None
        self._send([_transform(self.cell.frame, self.sensor.base.frame, pose)])

    def _send(self, transforms: List[TransformStamped]) -> None:
        """Send all transforms, as a latched topic keeps one message only."""
        self._transforms.update({it.child_frame_id: it for it in transforms})
        self._frames.publish(TFMessage(list(self._transforms.values())))


def _urdf(cell: Cell, name: str) -> str:
    return describe_devices([cell.device(name)])[0][name].text


def _robot(arm: Arm, cell: Cell) -> RobotModel:
    name = f'ur_rt_{arm.name}'
    description = describe_devices([cell.device(name)])[0][name]
    return RobotModel(arm, description.text, Kinematics(description.text),
                      tuple(description.joints))


def _cloud(depth_mm: np.ndarray) -> PointCloud2:
    """Return all pixels in the optical frame; NaN where there is no depth."""
    depth_m = np.where(depth_mm > 0, depth_mm / 1000.0, np.nan)
    u, v = np.meshgrid(np.arange(pinhole.WIDTH), np.arange(pinhole.HEIGHT))
    x = (u - pinhole.CENTER_U) / pinhole.FOCAL_LENGTH_PX * depth_m
    y = (v - pinhole.CENTER_V) / pinhole.FOCAL_LENGTH_PX * depth_m
    points = np.stack([x, y, depth_m], axis=-1).astype('<f4')
    cloud = PointCloud2(height=pinhole.HEIGHT, width=pinhole.WIDTH, point_step=12,
                        row_step=12 * pinhole.WIDTH, data=points.tobytes())
    cloud.header.frame_id, cloud.header.stamp = OPTICAL, rospy.Time.now()
    cloud.fields = [PointField(name, 4 * number, PointField.FLOAT32, 1)
                    for number, name in enumerate('xyz')]
    return cloud


def _optical() -> TransformStamped:
    offset = layout.COLOR_CAMERA_OFFSET.tolist()
    return _transform('camera_link', OPTICAL, Pose(
        (offset[0], offset[1], offset[2]), (-_HALF_PI, 0.0, -_HALF_PI)))


def _transform(parent: str, child: str, pose: Pose) -> TransformStamped:
    x, y, z, w = np.asarray(quaternion_from_ypr(pose.ypr)).tolist()
    return _placed(parent, child, Placement(pose.xyz, (x, y, z, w)))


def _placed(parent: str, child: str, place: Placement) -> TransformStamped:
    message = TransformStamped(child_frame_id=child)
    message.header.frame_id, message.header.stamp = parent, rospy.Time.now()
    message.transform.translation = Vector3(*place.position)
    message.transform.rotation = Quaternion(*place.quaternion)
    return message
