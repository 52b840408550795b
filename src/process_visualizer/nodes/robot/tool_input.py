# SPDX-License-Identifier: BSD-3-Clause
"""Subscribes to the tool's poses, and decodes recorded messages in the same way."""
from __future__ import annotations

import threading
from abc import ABC, abstractmethod
from dataclasses import replace
from typing import Callable, Collection, Dict, List, Mapping, Optional, Set, Tuple

import rospy
import tf2_ros
from geometry_msgs.msg import Quaternion, TransformStamped, Vector3
from std_msgs.msg import Header

from process_visualizer.nodes.common.complaints import Complaints, Patience
from process_visualizer.nodes.common.node_handle import NodeHandle
from process_visualizer.nodes.robot.message_reader import (
    POSE_DECODERS,
    Decoder,
    StaticFrames,
    ToolPose,
    TopicReader,
    placement_of,
    tf_transforms,
)
from process_visualizer.parameters.robot_parameters import RobotParameters
from process_visualizer.robot.frames import meant_frame, prefix_advice
from process_visualizer.robot.joints import JointHistory
from process_visualizer.robot.kinematics import Kinematics, Placement
from process_visualizer.robot.rotations import Triple, Vector, rotated
from process_visualizer.ros_names import TF_MESSAGE


class FramesNotConnected(ValueError):
    """Raised if frames between a pose and the base are unknown: other nodes send them."""


class PoseDecoder(ABC):
    """Receives messages in order; each may yield a pose in the base frame."""

    @abstractmethod
    def pose(self, message: bytes) -> Optional[ToolPose]:
        """Return the pose in a message of the tool's topic, if there is one.

        Raises:
            FramesNotConnected: the joints, or other frames, are still missing.
            ValueError: the message cannot be used.
        """

    @abstractmethod
    def take_joints(self, positions: Mapping[str, float], stamp: rospy.Time
                    ) -> Optional[ToolPose]:
        """Note the positions [rad or m] of joints by name; return the pose if it is new.

        Raises:
            FramesNotConnected: as above.
        """


PATIENCE_S = 5.0  # from the first transforms, as other nodes are still starting


class FramePoses:
    """The poses of a frame in another one, found from transforms through any number of frames."""

    def __init__(self, base_frame: str, frame: str, links: Collection[str] = (),
                 meant: Callable[[str], str] = str) -> None:
        """Collect transforms between two frames.

        Args:
            base_frame, frame: the pose is that of frame in base_frame.
            links: the links of the robot's model.
            meant: returns the link that a driver means by a name without the model's prefix.
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
        """Add the transforms of one message; return the pose if it is new.

        Raises:
            FramesNotConnected: the two frames are not connected (yet).
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
        """Forget transforms that are not static, so that older ones are accepted again."""
        self._buffer.clear()

    def _as_in_model(self, transform: TransformStamped) -> TransformStamped:
        """Return a transform, with a parent that is a link named as in the model."""
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
    """Finds the poses in recorded transforms and in the recorded joints that move links.

    The transforms of the cell's own robot_state_publisher were not recorded; the model replaces
    them.
    """

    def __init__(self, poses: FramePoses, model: Kinematics) -> None:
        """``poses`` combines the transforms; ``model`` is that of the robot."""
        self._poses, self._model = poses, model
        self._recorded: Set[str] = set()

    def pose(self, message: bytes) -> Optional[ToolPose]:
        """See PoseDecoder."""
        transforms = tf_transforms(message)
        self._recorded.update(it.child_frame_id.lstrip('/') for it in transforms)
        return self._poses.add(transforms)

    def take_joints(self, positions: Mapping[str, float], stamp: rospy.Time
                    ) -> Optional[ToolPose]:
        """See PoseDecoder; links whose transforms were recorded are not moved by joints."""
        return self._poses.add([
            _transform(parent, child, place, stamp)
            for parent, child, place in self._model.moved(positions)
            if child not in self._recorded])


class FrameReader:
    """Passes on each new pose of a frame in the base frame."""

    def __init__(self, node: NodeHandle, complaints: Complaints, topic: str, base_frame: str,
                 frame: str, callback: Callable[[ToolPose], None], static: StaticFrames,
                 on_static: Callable[[], None], model: Kinematics,
                 meant: Callable[[str], str]) -> None:
        """Subscribe to the topic, and follow the static transforms.

        Args:
            node, complaints: those of the robot processor.
            topic: the topic of the transforms, such as /tf.
            base_frame, frame: the pose is that of frame in base_frame.
            callback: called with each new pose; may raise ValueError with a problem.
            static: the static transforms.
            on_static: called when the static transforms have changed.
            model: the robot's model.
            meant: see FramePoses.
        """
        self._node, self._model = node, model
        self._frames = base_frame, frame, model.links, meant
        self._poses = FramePoses(*self._frames)
        self._callback, self._static, self._on_static_change = callback, static, on_static
        self._last_arrival = rospy.Time()
        self._patience = Patience(PATIENCE_S)
        static.follow(self._on_static)
        TopicReader(node, complaints, topic, TF_MESSAGE, {TF_MESSAGE: tf_transforms},
                    self._on_transforms)

    def decoder(self) -> PoseDecoder:
        """Return a decoder of poses in messages of the topic, given in the order of sending."""
        poses = FramePoses(*self._frames)
        poses.add_static(self._static.known())
        return FrameDecoder(poses, self._model)

    def _on_static(self, transforms: List[TransformStamped]) -> None:
        self._poses.add_static(transforms)
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
        """Return the pose if it is new; a missing frame is reported after ``PATIENCE_S``.

        Raises:
            FramesNotConnected: a frame has been missing for that long.
        """
        try:
            pose = self._poses.add(transforms)
        except FramesNotConnected:
            if self._patience.is_over(True, self._node.monotonic_s()):
                raise
            return None
        self._patience.is_over(False, self._node.monotonic_s())
        return pose


def _transform(parent: str, child: str, place: Placement, stamp: rospy.Time) -> TransformStamped:
    found = TransformStamped(child_frame_id=child)
    found.header.frame_id, found.header.stamp = parent, stamp
    found.transform.translation = Vector3(*place.position)
    found.transform.rotation = Quaternion(*place.quaternion)
    return found


def _pose(transform: TransformStamped, frame: str) -> ToolPose:
    return ToolPose(*placement_of(transform), stamp_s=transform.header.stamp.to_sec(),
                    child_frame=frame)


class BaseFrames:
    """Converts poses and forces of messages into a robot's base frame.

    A manufacturer's driver may report the tool in a frame of its own, such as ``base`` beside
    ``base_link``. Any frame that the model or a static transform connects to the base is
    accepted; if a joint is in between, its position at the time of the message is used.
    """

    def __init__(self, parameters: RobotParameters, model: Kinematics,
                 static: StaticFrames, on_change: Callable[[], None]) -> None:
        """Convert poses and forces of one robot.

        Args:
            parameters: those of the robot processor.
            model: the robot's model; static transforms are added to it when they are needed.
            static: the static transforms.
            on_change: called when the meaning of earlier poses has changed.
        """
        self._parameters, self._model = parameters, model
        self._on_change = on_change
        self._joints = JointHistory()
        self._lock = threading.Lock()
        self._static, self._is_following = static, False
        self.follows_joints = False

    def name(self, frame: str) -> str:
        """Return the frame to which a driver refers by a name."""
        return meant_frame(frame, self._model.links, self._parameters.robot_name,
                           self._parameters.link_prefix)

    def take_joints(self, stamp_s: float, positions: Mapping[str, float]) -> None:
        """Note positions [rad or m] of joints, if any frame depends on them."""
        if self.follows_joints:
            with self._lock:
                self._joints.add(stamp_s, positions)

    def in_base(self, pose: ToolPose, joints: Optional[JointHistory] = None) -> ToolPose:
        """Return a pose in the base frame.

        Args:
            pose: in any frame.
            joints: the joints at the time of the pose; default: those received.

        Raises:
            FramesNotConnected: the joints between its frame and the base frame are not known yet.
            ValueError: nothing connects its frame to the base frame.
        """
        given = pose.frame or self._parameters.tool_center_frame.parent_frame
        frame = self.name(given)
        if frame in ('', self._parameters.base_frame):
            return replace(pose, frame='')
        moved = self._place(frame, given, pose.stamp_s, joints or self._joints).then(
            Placement(_triple(pose.position), pose.quaternion))
        return replace(pose, position=moved.position, quaternion=moved.quaternion, frame='')

    def drawn_force(self, frame: str, force: Vector) -> Tuple[str, Vector]:
        """Return the frame in which a force (3,) [N] is drawn, and the force in it.

        A force in a link fixed to the base is rotated into the base frame: such a robot reports the
        force at its tool along the axes of its base.
        """
        base = self._parameters.base_frame
        if frame not in self._model.links or self._model.moves(frame, base):
            return frame, force
        place = self._model.connection(frame, base, {})
        return (frame, force) if place is None else (base, rotated(place.quaternion, force))

    def _place(self, frame: str, given: str, stamp_s: float, joints: JointHistory) -> Placement:
        base = self._parameters.base_frame
        if not self._model.connects(frame, base):
            if not self._is_following:
                self._is_following = True
                self._static.follow(self._on_static)
            raise ValueError(f'its frame is {given}, which neither the model nor a static '
                             f'transform connects with the base frame {base}; name another frame '
                             'in it, or publish the transform')
        self.follows_joints |= self._model.moves(frame, base)
        with self._lock:
            place = self._model.connection(frame, base, joints.at(stamp_s))
        if place is None:
            raise FramesNotConnected(f'its frame is {given}, and the positions of the joints '
                                     f'between that and the base frame {base} are not known yet')
        return place

    def _on_static(self, transforms: List[TransformStamped]) -> None:
        for it in transforms:
            self._model.fix(it.header.frame_id.lstrip('/'), it.child_frame_id.lstrip('/'),
                            placement_of(it))
        self._on_change()


def _triple(vector: Vector) -> Triple:
    x, y, z = vector
    return x, y, z


_EQUAL_M = 0.02  # positions this close count as the same


class ToolInput:
    """The tool's poses in the base frame, from messages with poses or transforms.

    Most drivers send joints only. Then the model gives the pose, and recorded joints are decoded.
    """

    def __init__(self, node: NodeHandle, parameters: RobotParameters, complaints: Complaints,
                 callback: Callable[[ToolPose], None], static: StaticFrames,
                 on_static: Callable[[], None], base_frames: BaseFrames,
                 model: Kinematics) -> None:
        """Subscribe, if there is a topic.

        Args:
            node, parameters, complaints, static, base_frames, model: those of the robot
                processor.
            callback: called with each pose; may raise like the callback of TopicReader.
            on_static: called when static transforms on which the poses depend have changed.
        """
        self._topic, self._callback = parameters.tool_center_frame, callback
        self._parameters, self._base_frames, self._model = parameters, base_frames, model
        self._frames: Optional[FrameReader] = None
        if self._topic.message_type == TF_MESSAGE:
            frame = self._topic.frame or parameters.tool_frame
            self._frames = FrameReader(node, complaints, self._topic.name, parameters.base_frame,
                                       frame, callback, static, on_static, model,
                                       base_frames.name)
        elif self._topic.name:
            TopicReader(node, complaints, self._topic.name, self._topic.message_type,
                        POSE_DECODERS, self._take, lambda pose: pose.position, _EQUAL_M)

    def decoder(self, message_type: str) -> Optional[PoseDecoder]:
        """Return a decoder for messages of a type, in their order; None for an unsupported type.

        Without a type (''), joints that move a tool's frame in tf may be enough.
        """
        if self._frames is not None:
            return self._frames.decoder() if message_type in ('', TF_MESSAGE) else None
        if not self._topic.name:
            return _ModelDecoder(self._parameters, self._model)
        decode = POSE_DECODERS.get(message_type)
        if decode is None or self._topic.message_type not in ('', message_type):
            return None
        return _MessageDecoder(decode, self._base_frames)

    def _take(self, pose: ToolPose) -> None:
        self._callback(self._base_frames.in_base(pose))


def pose_by_model(model: Kinematics, tool: str, base: str, new: Mapping[str, float],
                  positions: Mapping[str, float], stamp_s: float) -> Optional[ToolPose]:
    """Return the pose of the tool by the model; None if the new joints do not move it.

    Joints of a gripper, for example, do not move the tool.

    Args:
        model: the robot's model.
        tool, base: the frame of the tool, and the frame of its pose.
        new: positions [rad or m] that have just arrived.
        positions: the new positions and those of the other joints.
        stamp_s: when the new ones were measured.

    Raises:
        FramesNotConnected: positions of joints between the frames are missing.
    """
    if new.keys().isdisjoint(model.joints_between(tool, base)):
        return None
    place = model.placement(tool, base, positions)
    if place is None:
        raise FramesNotConnected(f'the place of the tool frame {tool} in {base} is not known')
    return ToolPose(place.position, place.quaternion, stamp_s=stamp_s, child_frame=tool)


class _ModelDecoder(PoseDecoder):
    """Finds the tool with the model, from joints alone."""

    def __init__(self, parameters: RobotParameters, model: Kinematics) -> None:
        self._tool, self._base = parameters.tool_frame, parameters.base_frame
        self._model = model
        self._positions: Dict[str, float] = {}

    def pose(self, message: bytes) -> Optional[ToolPose]:
        """See PoseDecoder; there are no messages with a pose."""
        return None

    def take_joints(self, positions: Mapping[str, float], stamp: rospy.Time
                    ) -> Optional[ToolPose]:
        """See PoseDecoder, and pose_by_model."""
        self._positions.update(positions)
        return pose_by_model(self._model, self._tool, self._base, positions, self._positions,
                             stamp.to_sec())


class _MessageDecoder(PoseDecoder):
    """Decodes messages with a pose in any frame; joints may lie between it and the base."""

    def __init__(self, decode: Decoder[ToolPose], base_frames: BaseFrames) -> None:
        self._decode, self._base_frames = decode, base_frames
        self._joints = JointHistory()

    def pose(self, message: bytes) -> Optional[ToolPose]:
        """See PoseDecoder."""
        return self._base_frames.in_base(self._decode(message), self._joints)

    def take_joints(self, positions: Mapping[str, float], stamp: rospy.Time
                    ) -> Optional[ToolPose]:
        """See PoseDecoder."""
        self._joints.add(stamp.to_sec(), positions)
        return None
