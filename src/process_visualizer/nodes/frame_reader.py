"""Reads the pose of a frame from tf, as messages on a tf topic bring it."""
from __future__ import annotations

from typing import Callable, Dict, List, Optional

import rospy
import tf2_ros
from geometry_msgs.msg import TransformStamped
from tf2_msgs.msg import TFMessage

from process_visualizer.nodes.complaints import Complaints
from process_visualizer.nodes.message_reader import TopicReader
from process_visualizer.nodes.robot_messages import ToolPose, deserialize

PoseDecoder = Callable[[bytes], Optional[ToolPose]]
"""Returns the pose that comes with a message, if one does; raises ValueError for a wrong one."""

TF_MESSAGE = 'tf2_msgs/TFMessage'
TF_TOPIC, STATIC_TOPIC = '/tf', '/tf_static'


class FramesNotConnected(ValueError):
    """The frame has come, but not all between it and the base frame: somebody else sends those."""


class FramePoses:
    """The poses of a frame in another one, as transforms come, however many frames lie between."""

    def __init__(self, base_frame: str, frame: str) -> None:
        """Take the frames: the pose is that of ``frame`` in ``base_frame``."""
        self._base_frame, self._frame = base_frame, frame
        self._buffer = tf2_ros.BufferCore(rospy.Duration(10.0))
        self._last_stamp = rospy.Time()
        self._has_come = False

    def add_static(self, transforms: List[TransformStamped]) -> None:
        """Take transforms that hold for ever."""
        for transform in transforms:
            self._buffer.set_transform_static(transform, 'static')

    def add(self, transforms: List[TransformStamped]) -> Optional[ToolPose]:
        """Take transforms that have come together; return the pose if it is a new one.

        Raises:
            FramesNotConnected: the two frames are not, although the frame has come.
            ValueError: neither has it.
        """
        for transform in transforms:
            self._buffer.set_transform(transform, 'dynamic')
        try:
            found = self._buffer.lookup_transform_core(self._base_frame, self._frame,
                                                       rospy.Time())
        except tf2_ros.TransformException as error:
            self._has_come |= any(it.child_frame_id.lstrip('/') == self._frame
                                  for it in transforms)
            problem = FramesNotConnected if self._has_come else ValueError
            raise problem(f'the frame {self._frame} is not known in {self._base_frame}: '
                          f'{error}') from None
        if found.header.stamp == self._last_stamp:
            return None
        self._last_stamp = found.header.stamp
        return _pose(found, self._frame)

    def forget(self) -> None:
        """Forget transforms that do not hold for ever: what is older would not be taken."""
        self._buffer.clear()


class FrameReader:
    """Hands on each new pose of a frame in the base frame."""

    def __init__(self, complaints: Complaints, topic: str, base_frame: str, frame: str,
                 callback: Callable[[ToolPose], None],
                 on_static: Callable[[], None] = lambda: None) -> None:
        """Subscribe the topic and the static transforms.

        Args:
            complaints: those of the node.
            topic: what carries the transforms, such as /tf.
            base_frame, frame: the pose is that of frame in base_frame.
            callback: called with each new pose; may raise ValueError with what is wrong.
            on_static: called when the static transforms are others than before.
        """
        self._frames = base_frame, frame
        self._poses = FramePoses(base_frame, frame)
        self._callback, self._on_static_change = callback, on_static
        self._static: Dict[str, TransformStamped] = {}  # by child
        self._last_arrival = rospy.Time()
        TopicReader(complaints, STATIC_TOPIC, TF_MESSAGE, {TF_MESSAGE: transforms_in},
                    self._on_static)
        TopicReader(complaints, topic, TF_MESSAGE, {TF_MESSAGE: transforms_in}, self._on_transforms)

    def decoder(self) -> PoseDecoder:
        """Return what finds the poses in messages of the topic, given in the order of sending."""
        poses = FramePoses(*self._frames)
        poses.add_static(list(self._static.values()))
        return lambda message: poses.add(transforms_in(message))

    def _on_static(self, transforms: List[TransformStamped]) -> None:
        self._poses.add_static(transforms)
        new = {it.child_frame_id: it for it in transforms}
        changed = [child for child, it in new.items() if child not in self._static
                   or not _is_equal(it, self._static[child])]
        self._static = {**self._static, **new}
        if changed:
            self._on_static_change()

    def _on_transforms(self, transforms: List[TransformStamped]) -> None:
        arrival = rospy.Time.now()
        if arrival < self._last_arrival:
            self._poses.forget()
        self._last_arrival = arrival
        pose = self._poses.add(transforms)
        if pose is not None:
            self._callback(pose)


def transforms_in(message: bytes) -> List[TransformStamped]:
    """Return the transforms of a serialised tf2_msgs/TFMessage."""
    transforms: List[TransformStamped] = deserialize(TFMessage, message).transforms
    return transforms


def _is_equal(one: TransformStamped, other: TransformStamped) -> bool:
    """Tell whether two transforms to the same frame are equal, whatever their stamps."""
    return (one.header.frame_id == other.header.frame_id
            and bool(one.transform == other.transform))


def _pose(transform: TransformStamped, frame: str) -> ToolPose:
    position, rotation = transform.transform.translation, transform.transform.rotation
    return ToolPose((position.x, position.y, position.z),
                    (rotation.x, rotation.y, rotation.z, rotation.w),
                    stamp_s=transform.header.stamp.to_sec(), child_frame=frame)
