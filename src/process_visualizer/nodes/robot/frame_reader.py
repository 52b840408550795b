# SPDX-License-Identifier: BSD-3-Clause
"""Reads the pose of a frame from the messages of a tf topic."""
from __future__ import annotations

from typing import Callable, Collection, Dict, List, Mapping, Optional, Set

import rospy
import tf2_ros
from geometry_msgs.msg import Quaternion, TransformStamped, Vector3
from std_msgs.msg import Header
from tf2_msgs.msg import TFMessage

from process_visualizer.motion.frame_names import prefix_advice
from process_visualizer.motion.kinematics import Kinematics, Placement
from process_visualizer.motion.patience import Patience
from process_visualizer.nodes.common.complaints import Complaints
from process_visualizer.nodes.common.node_handle import NodeHandle
from process_visualizer.nodes.robot.message_reader import TopicReader
from process_visualizer.nodes.robot.pose_decoder import FramesNotConnected, PoseDecoder
from process_visualizer.nodes.robot.robot_messages import ToolPose, deserialize
from process_visualizer.ros_names import STATIC_TF_TOPIC, TF_MESSAGE

PATIENCE_S = 5.0  # from the first transforms: other nodes start too, and send only then


class FramePoses:
    """The poses of a frame in another one, from transforms, through any number of frames."""

    def __init__(self, base_frame: str, frame: str, links: Collection[str] = (),
                 meant: Callable[[str], str] = str) -> None:
        """Collect transforms between two frames.

        Args:
            base_frame, frame: the pose is that of frame in base_frame.
            links: of the robot's model.
            meant: returns the link that a driver means if it does not know the model's prefix.
        """
        self._base_frame, self._frame = base_frame, frame
        self._links, self._meant = links, meant
        self._parents: Dict[str, str] = {}
        self._buffer = tf2_ros.BufferCore(rospy.Duration(10.0))
        self._last_stamp = rospy.Time()

    def add_static(self, transforms: List[TransformStamped]) -> None:
        """Add static transforms."""
        for transform in transforms:
            self._buffer.set_transform_static(self._as_in_model(transform), 'static')

    def add(self, transforms: List[TransformStamped]) -> Optional[ToolPose]:
        """Add transforms of one message; return the pose if it is a new one.

        Raises:
            FramesNotConnected: the two frames are not (yet).
        """
        for transform in transforms:
            self._buffer.set_transform(self._as_in_model(transform), 'dynamic')
        try:
            found = self._buffer.lookup_transform_core(self._base_frame, self._frame,
                                                       rospy.Time())
        except tf2_ros.TransformException as error:
            raise FramesNotConnected(self._problem(str(error).rstrip('. '))) from None
        if found.header.stamp == self._last_stamp:
            return None
        self._last_stamp = found.header.stamp
        return _pose(found, self._frame)

    def forget(self) -> None:
        """Forget transforms that are not static: older ones would not be accepted."""
        self._buffer.clear()

    def _as_in_model(self, transform: TransformStamped) -> TransformStamped:
        """Return a transform of a frame after the model's links with the link's own name."""
        child, parent = (name.lstrip('/') for name in (transform.child_frame_id,
                                                       transform.header.frame_id))
        link = self._meant(parent)
        self._parents[child] = link
        if link == parent or self._meant(child) in self._links:
            return transform
        return TransformStamped(Header(0, transform.header.stamp, link), child,
                                transform.transform)

    def _problem(self, reason: str) -> str:
        advice = prefix_advice(self._root(), self._links)
        return f'the frame {self._frame} is not known in {self._base_frame}: {advice or reason}'

    def _root(self) -> str:
        """Return the frame relative to which the wanted one is known."""
        frame, passed = self._frame, set()
        while frame in self._parents and frame not in passed and frame not in self._links:
            passed.add(frame)
            frame = self._parents[frame]
        return frame


class FrameDecoder(PoseDecoder):
    """Finds the poses in a recording of transforms, and in that of the joints that move links.

    The transforms of the cell's own robot_state_publisher were not recorded; the model replaces
    them.
    """

    def __init__(self, poses: FramePoses, model: Kinematics) -> None:
        """``poses`` combines the transforms; ``model`` is that of the robot."""
        self._poses, self._model = poses, model
        self._recorded: Set[str] = set()

    def pose(self, message: bytes) -> Optional[ToolPose]:
        """See PoseDecoder."""
        transforms = transforms_in(message)
        self._recorded.update(it.child_frame_id.lstrip('/') for it in transforms)
        return self._poses.add(transforms)

    def take_joints(self, positions: Mapping[str, float], stamp: rospy.Time
                    ) -> Optional[ToolPose]:
        """See PoseDecoder; links that the recording places itself stay."""
        return self._poses.add([
            _transform(parent, child, place, stamp)
            for parent, child, place in self._model.moved(positions)
            if child not in self._recorded])


class FrameReader:
    """Passes on each new pose of a frame in the base frame."""

    def __init__(self, node: NodeHandle, complaints: Complaints, topic: str, base_frame: str,
                 frame: str, callback: Callable[[ToolPose], None], on_static: Callable[[], None],
                 model: Kinematics, meant: Callable[[str], str]) -> None:
        """Subscribe to the topic and the static transforms.

        Args:
            node, complaints: those of the robot processor.
            topic: the topic of the transforms, such as /tf.
            base_frame, frame: the pose is that of frame in base_frame.
            callback: called with each new pose; may raise ValueError with a problem.
            on_static: called when the static transforms have changed.
            model: of the robot.
            meant: see FramePoses.
        """
        self._node, self._model = node, model
        self._frames = base_frame, frame, model.links, meant
        self._poses = FramePoses(*self._frames)
        self._callback, self._on_static_change = callback, on_static
        self._static: Dict[str, TransformStamped] = {}  # by child
        self._last_arrival = rospy.Time()
        self._patience = Patience(PATIENCE_S)
        for name, take in ((STATIC_TF_TOPIC, self._on_static), (topic, self._on_transforms)):
            TopicReader(node, complaints, name, TF_MESSAGE, {TF_MESSAGE: transforms_in},
                        take)

    def decoder(self) -> PoseDecoder:
        """Return a decoder of poses in messages of the topic, given in the order of sending."""
        poses = FramePoses(*self._frames)
        poses.add_static(list(self._static.values()))
        return FrameDecoder(poses, self._model)

    def _on_static(self, transforms: List[TransformStamped]) -> None:
        self._poses.add_static(transforms)
        new = {it.child_frame_id: it for it in transforms}
        changed = [child for child, it in new.items() if child not in self._static
                   or not _is_equal(it, self._static[child])]
        self._static = {**self._static, **new}
        if changed:
            self._on_static_change()

    def _on_transforms(self, transforms: List[TransformStamped]) -> None:
        arrival = self._node.now()
        if arrival < self._last_arrival:
            self._poses.forget()
        self._last_arrival = arrival
        pose = self._pose(transforms)
        if pose is not None:
            self._callback(pose)

    def _pose(self, transforms: List[TransformStamped]) -> Optional[ToolPose]:
        """Return the pose if it is a new one; a missing frame is reported after a time.

        Raises:
            FramesNotConnected: it has been missing for that long.
        """
        try:
            pose = self._poses.add(transforms)
        except FramesNotConnected:
            if self._patience.is_over(True, self._node.monotonic_s()):
                raise
            return None
        self._patience.is_over(False, self._node.monotonic_s())
        return pose


def transforms_in(message: bytes) -> List[TransformStamped]:
    """Return the transforms of a serialised tf2_msgs/TFMessage."""
    transforms: List[TransformStamped] = deserialize(TFMessage, message).transforms
    return transforms


def _transform(parent: str, child: str, place: Placement, stamp: rospy.Time) -> TransformStamped:
    found = TransformStamped(child_frame_id=child)
    found.header.frame_id, found.header.stamp = parent, stamp
    found.transform.translation = Vector3(*place.position)
    found.transform.rotation = Quaternion(*place.quaternion)
    return found


def _is_equal(one: TransformStamped, other: TransformStamped) -> bool:
    """Return whether two transforms to the same frame are equal, ignoring their stamps."""
    return (one.header.frame_id == other.header.frame_id
            and bool(one.transform == other.transform))


def _pose(transform: TransformStamped, frame: str) -> ToolPose:
    position, rotation = transform.transform.translation, transform.transform.rotation
    return ToolPose((position.x, position.y, position.z),
                    (rotation.x, rotation.y, rotation.z, rotation.w),
                    stamp_s=transform.header.stamp.to_sec(), child_frame=frame)
