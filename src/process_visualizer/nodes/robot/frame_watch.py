# SPDX-License-Identifier: BSD-3-Clause
"""Warns of frames in which something is shown but which are not in tf."""
from __future__ import annotations

from typing import Any, Collection, Dict, Set

import rospy
import tf2_ros
from tf2_msgs.msg import TFMessage

from process_visualizer.nodes.common.complaints import Complaints
from process_visualizer.nodes.common.node_handle import NodeHandle
from process_visualizer.nodes.robot.robot_messages import deserialize
from process_visualizer.ros_names import STATIC_TF_TOPIC, TF_TOPIC

PATIENCE_S = 5.0  # from the first data to the first look: the other nodes start too
LISTENING_S = 1.0
PERIOD_S = 5.0


class FrameWatch:
    """Checks that frames are connected with a robot's base frame; otherwise RViz draws nothing.

    Links of the robot's model, and frames fixed to them, are connected. For others it listens to
    /tf for a moment, as with many robots listening is expensive. A frame that was found once is
    not checked again.
    """

    def __init__(self, node: NodeHandle, complaints: Complaints, base_frame: str,
                 links: Collection[str]) -> None:
        """``links`` are those of the robot's model."""
        self._node, self._complaints = node, complaints
        self._base_frame = base_frame
        self._found: Set[str] = {base_frame, *links}
        self._wanted: Dict[str, str] = {}  # the topic by the frame
        self._fixed_to: Dict[str, str] = {}
        self._buffer = tf2_ros.BufferCore(rospy.Duration(10.0))
        self._static: Any = None  # subscribers
        self._moving: Any = None
        self._next_s = 0.0

    def want(self, frame: str, topic: str) -> None:
        """Look for a frame in which the data of a topic is shown."""
        if frame in self._found or frame in self._wanted:
            return
        self._wanted[frame] = self._node.resolve(topic)
        self._next_s = self._node.monotonic_s() + PATIENCE_S
        if self._static is None:  # AnyMsg, as FrameReader: a topic has one class in a process
            self._static = self._node.subscribe(STATIC_TF_TOPIC, rospy.AnyMsg, self._on_static)

    def look(self) -> None:
        """Look now, and warn of frames that are not found after some time."""
        if not self._wanted or self._node.monotonic_s() < self._next_s:
            return
        for frame in [frame for frame in self._wanted if self._is_fixed(frame)]:
            self._take(frame)
        if self._wanted and self._moving is None:
            self._moving = self._node.subscribe(TF_TOPIC, rospy.AnyMsg, self._on_transforms)
            self._next_s += LISTENING_S
        elif self._wanted:
            self._judge()

    def _judge(self) -> None:
        self._moving.unregister()
        self._moving = None
        self._next_s = self._node.monotonic_s() + PERIOD_S
        for frame in list(self._wanted):
            problem = self._problem(frame)
            if problem:
                self._warn(frame, problem)
            else:
                self._take(frame)

    def _take(self, frame: str) -> None:
        self._found.add(frame)
        del self._wanted[frame]
        self._complaints.end(frame)

    def _is_fixed(self, frame: str) -> bool:
        """Return whether a frame is fixed to one that was found."""
        passed: Set[str] = set()
        while frame in self._fixed_to and frame not in passed | self._found:
            passed.add(frame)
            frame = self._fixed_to[frame]
        return frame in self._found

    def _problem(self, frame: str) -> str:
        known = self._buffer._frameExists(frame)
        if not self._buffer._frameExists(self._base_frame):  # a robot may be a force sensor only
            return '' if known else f'there is no frame {frame}'
        connected, problem = self._buffer.can_transform_core(self._base_frame, frame, rospy.Time())
        return '' if connected else str(problem)

    def _warn(self, frame: str, problem: str) -> None:
        self._complaints.state(frame, f'the data of {self._wanted[frame]} is not drawn, as tf does '
                               f'not connect the frame {frame} with {self._base_frame}: {problem}')

    def _on_static(self, message: Any) -> None:
        for transform in deserialize(TFMessage, message._buff).transforms:
            self._buffer.set_transform_static(transform, 'static')
            self._fixed_to[transform.child_frame_id] = transform.header.frame_id

    def _on_transforms(self, message: Any) -> None:
        for transform in deserialize(TFMessage, message._buff).transforms:
            self._buffer.set_transform(transform, 'dynamic')
