# SPDX-License-Identifier: BSD-3-Clause
"""The pose of a depth sensor, from the node sensor_fit."""
from __future__ import annotations

from typing import NamedTuple, Optional, Sequence, Tuple

import geometry_msgs.msg
import rosgraph
import rospy

from process_visualizer.cell.model import Device, Pose, TopicFunction
from process_visualizer.clients.model_markers import models_of
from process_visualizer.clients.service_connection import ServiceConnection, ServiceUnreachable
from process_visualizer.robot.rotations import matrix_from_quaternion, ypr_from_matrix
from process_visualizer.ros_names import SENSOR_FIT
from process_visualizer.srv import FitSensor


def pose_of(message: geometry_msgs.msg.Pose) -> Pose:
    """Return position [m] and yaw pitch roll [rad] of a message."""
    position, turned = message.position, message.orientation
    matrix = matrix_from_quaternion((turned.x, turned.y, turned.z, turned.w))
    yaw, pitch, roll = ypr_from_matrix(matrix).tolist()
    return Pose((position.x, position.y, position.z), (yaw, pitch, roll))


_TIMEOUT_S = 60.0
_CLOUD = 'sensor_msgs/PointCloud2'


class FitError(Exception):
    """The pose of a sensor was not found; the text gives the reason."""


class SensorFit(NamedTuple):
    """The pose found for a sensor, in the global frame; distances [m]."""

    pose: Pose
    before_m: float
    residual_m: float
    points: int
    left_out: Tuple[str, ...]


def fit_sensor(device: Device, devices: Sequence[Device], frame: str) -> SensorFit:
    """Return the pose of a depth sensor, from its next cloud and the models of other devices.

    ``frame`` is the global frame. Blocks for some seconds.

    Raises:
        FitError: the pose cannot be found; the sensor keeps its pose.
    """
    assert device.base is not None, 'a sensor that can be moved has a base'
    connection = ServiceConnection(f'/{SENSOR_FIT}/fit', FitSensor, _TIMEOUT_S)
    try:
        topic = _cloud_topic(device)
        models = models_of(it for it in devices if it.name != device.name)
        if not models:
            raise FitError('no other device that runs has a model; launch robots or machines '
                           'that the sensor sees')
        answer = connection.call(topic, device.base.frame, frame, models)
    except (ServiceUnreachable, rosgraph.MasterException, rospy.ROSException, OSError) as error:
        raise FitError(f'/{SENSOR_FIT} does not answer ({error})') from error
    finally:
        connection.close()
    if not answer.success:
        raise FitError(answer.message + _advice(device, topic))
    return SensorFit(pose_of(answer.pose), answer.before, answer.residual, answer.points,
                     tuple(answer.left_out))


def _advice(device: Device, topic: str) -> str:
    """Return the advice for a sensor with only a cropped cloud; empty for others."""
    if device.roi is None or topic != _points(device):
        return ''
    return ('. Its cloud is cropped to the box of its <roi>: make the box larger (tab Calibration) '
            'until it holds robots or machines, fit, then set the box back')


def _points(device: Device) -> str:
    """Return the topic of depth_proc's cloud of a sensor, which is cropped if it has a box."""
    return f'/{device.name}/points'


def _cloud_topic(device: Device) -> str:
    """Return the topic of a device's cloud, if possible uncropped: it shows more of the models."""
    published = {name for name, kind in rospy.get_published_topics() if kind == _CLOUD}
    shown = device.topic_for(TopicFunction.POINTCLOUD)
    others = [topic.name for topic in device.topics if topic is not shown]
    names = [*others, *([] if shown is None else [shown.name]), _points(device)]
    topic: Optional[str] = next((name for name in names if name in published), None)
    if topic is None:
        raise FitError(f'{device.name} publishes no cloud; launch it first')
    return topic
