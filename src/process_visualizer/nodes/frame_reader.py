"""Reads the pose of a frame from tf, as messages on a tf topic bring it."""
from __future__ import annotations

from typing import Callable, List

import rospy
import tf2_ros
from geometry_msgs.msg import TransformStamped
from tf2_msgs.msg import TFMessage

from process_visualizer.nodes.message_reader import TopicReader
from process_visualizer.nodes.robot_messages import ToolPose, deserialize

TF_MESSAGE = 'tf2_msgs/TFMessage'
TF_TOPIC, STATIC_TOPIC = '/tf', '/tf_static'


class FrameReader:
    """Hands on each new pose of a frame in the base frame, however many frames lie between."""

    def __init__(self, device: str, topic: str, base_frame: str, frame: str,
                 callback: Callable[[ToolPose], None]) -> None:
        """Subscribe the topic and the static transforms.

        Args:
            device: the device's name, for messages to the user.
            topic: what carries the transforms, such as /tf.
            base_frame, frame: the pose is that of frame in base_frame.
            callback: called with each new pose; may raise ValueError with what is wrong.
        """
        self._base_frame, self._frame = base_frame, frame
        self._callback = callback
        self._buffer = tf2_ros.BufferCore(rospy.Duration(10.0))
        self._last_stamp = rospy.Time()
        self._last_arrival = rospy.Time()
        TopicReader(device, STATIC_TOPIC, TF_MESSAGE, {TF_MESSAGE: _transforms}, self._on_static)
        TopicReader(device, topic, TF_MESSAGE, {TF_MESSAGE: _transforms}, self._on_transforms)

    def _on_static(self, transforms: List[TransformStamped]) -> None:
        for transform in transforms:
            self._buffer.set_transform_static(transform, 'static')

    def _on_transforms(self, transforms: List[TransformStamped]) -> None:
        arrival = rospy.Time.now()
        if arrival < self._last_arrival:
            self._buffer.clear()  # what is older than it holds would not be taken
        self._last_arrival = arrival
        for transform in transforms:
            self._buffer.set_transform(transform, 'dynamic')
        try:
            found = self._buffer.lookup_transform_core(self._base_frame, self._frame,
                                                       rospy.Time())
        except tf2_ros.TransformException as error:
            raise ValueError(f'the frame {self._frame} is not known in {self._base_frame}: '
                             f'{error}') from None
        if found.header.stamp != self._last_stamp:
            self._last_stamp = found.header.stamp
            self._callback(_pose(found))


def _transforms(message: bytes) -> List[TransformStamped]:
    transforms: List[TransformStamped] = deserialize(TFMessage, message).transforms
    return transforms


def _pose(transform: TransformStamped) -> ToolPose:
    position, rotation = transform.transform.translation, transform.transform.rotation
    return ToolPose((position.x, position.y, position.z),
                    (rotation.x, rotation.y, rotation.z, rotation.w),
                    stamp_s=transform.header.stamp.to_sec())
