# SPDX-License-Identifier: BSD-3-Clause
"""The frames named by messages of a robot: which they are, and where in its base."""
from __future__ import annotations

import threading
from dataclasses import replace
from typing import Any, Callable, Dict, Mapping, Optional, Tuple

import rospy
from tf2_msgs.msg import TFMessage

from process_visualizer.motion.frame_names import meant_frame
from process_visualizer.motion.joint_history import JointHistory
from process_visualizer.motion.kinematics import Kinematics, Placement
from process_visualizer.motion.rotations import Triple, Vector, rotated
from process_visualizer.nodes.common.node_handle import NodeHandle
from process_visualizer.nodes.robot.pose_decoder import FramesNotConnected
from process_visualizer.nodes.robot.robot_messages import ToolPose, deserialize
from process_visualizer.parameters.robot_parameters import RobotParameters
from process_visualizer.ros_names import STATIC_TF_TOPIC, TF_MESSAGE


class BaseFrames:
    """Converts poses and forces of messages into a robot's base frame.

    A maker's driver reports the tool in the maker's own frame, such as ``base`` beside
    ``base_link``. Any frame that the model or a static transform connects with the base is
    accepted; if a joint is in between, its position at the time of the message is used.
    """

    def __init__(self, node: NodeHandle, parameters: RobotParameters, model: Kinematics,
                 on_change: Callable[[], None]) -> None:
        """Convert poses and forces of one robot.

        Args:
            node, parameters: those of the robot processor.
            model: of the robot; static transforms are added to it when they are needed.
            on_change: called when earlier poses now have another meaning.
        """
        self._node, self._parameters = node, parameters
        self._model = model
        self._on_change = on_change
        self._joints = JointHistory()
        self._lock = threading.Lock()
        self._fixed: Dict[str, Tuple[str, Placement]] = {}
        self._static: Any = None  # a subscriber
        self.follows_joints = False

    def name(self, frame: str) -> str:
        """Return the frame that a driver means by a name."""
        return meant_frame(frame, self._model.links, self._parameters.robot_name,
                           self._parameters.link_prefix)

    def take_joints(self, stamp_s: float, positions: Mapping[str, float]) -> None:
        """Note positions [rad or m] of joints, if one matters."""
        if self.follows_joints:
            with self._lock:
                self._joints.add(stamp_s, positions)

    def in_base(self, pose: ToolPose, joints: Optional[JointHistory] = None) -> ToolPose:
        """Return a pose in the base frame.

        Args:
            pose: in any frame.
            joints: those that belong to it; default: those received.

        Raises:
            FramesNotConnected: the joints between its frame and the base frame are not known yet.
            ValueError: nothing connects its frame with the base frame.
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

        A force in a link that is fixed to the base is turned into the base frame: such a robot
        reports the force at its tool along the axes of its base.
        """
        base = self._parameters.base_frame
        if frame not in self._model.links or self._model.moves(frame, base):
            return frame, force
        place = self._model.connection(frame, base, {})
        return (frame, force) if place is None else (base, rotated(place.quaternion, force))

    def _place(self, frame: str, given: str, stamp_s: float, joints: JointHistory) -> Placement:
        base = self._parameters.base_frame
        if not self._model.connects(frame, base):
            self._listen()
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

    def _listen(self) -> None:
        if self._static is None:  # AnyMsg, as FrameReader: a topic has one class in a process
            self._static = self._node.subscribe(STATIC_TF_TOPIC, rospy.AnyMsg, self._on_static)

    def _on_static(self, message: Any) -> None:
        if message._connection_header['type'] != TF_MESSAGE:
            return
        before = dict(self._fixed)
        for found in deserialize(TFMessage, message._buff).transforms:
            place, turn = found.transform.translation, found.transform.rotation
            parent, child = (name.lstrip('/') for name in (found.header.frame_id,
                                                           found.child_frame_id))
            placement = Placement((place.x, place.y, place.z), (turn.x, turn.y, turn.z, turn.w))
            self._fixed[child] = parent, placement
            self._model.fix(parent, child, placement)
        if self._fixed != before:
            self._on_change()


def _triple(vector: Vector) -> Triple:
    x, y, z = vector
    return x, y, z
