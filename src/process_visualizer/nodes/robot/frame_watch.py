# SPDX-License-Identifier: BSD-3-Clause
"""A check that the frames of shown data are connected to a robot."""
from __future__ import annotations

from typing import Any, Collection, Dict, List, Set

import rospy
import tf2_ros
from geometry_msgs.msg import TransformStamped

from process_visualizer.nodes.common.complaints import Complaints
from process_visualizer.nodes.common.node_handle import NodeHandle
from process_visualizer.nodes.robot.message_reader import StaticFrames, tf_transforms
from process_visualizer.ros_names import TF_TOPIC

PATIENCE_S = 5.0  # from the first data to the first check, as other nodes are still starting
LISTENING_S = 1.0
PERIOD_S = 5.0


class FrameWatch:
    """Checks that frames are connected to a robot's base frame; otherwise RViz draws nothing.

    Links of the robot's model, and frames fixed to them, are connected. For other frames, it
    listens to /tf only briefly, because listening is expensive with many robots. A frame that was
    found once is not checked again.
    """

    def __init__(self, node: NodeHandle, complaints: Complaints, static: StaticFrames,
                 base_frame: str, links: Collection[str]) -> None:
        """``links`` are the links of the robot's model."""
        self._node, self._complaints = node, complaints
        self._base_frame = base_frame
        self._found: Set[str] = {base_frame, *links}
        self._wanted: Dict[str, str] = {}  # the topic, by frame
        self._fixed_to: Dict[str, str] = {}
        self._buffer = tf2_ros.BufferCore(rospy.Duration(10.0))
        self._static, self._is_following = static, False
        self._moving: Any = None  # a subscriber
        self._next_s = 0.0

    def want(self, frame: str, topic: str) -> None:
        """Check a frame in which the data of a topic is shown."""
        if frame in self._found or frame in self._wanted:
            return
        self._wanted[frame] = self._node.resolve(topic)
        self._next_s = self._node.monotonic_s() + PATIENCE_S
        if not self._is_following:
            self._is_following = True
            self._static.follow(self._on_static)

    def look(self) -> None:
        """Check the frames, and warn of those that are not found after some time."""
        if not self._wanted or self._node.monotonic_s() < self._next_s:
            return
        for frame in [frame for frame in self._wanted if self._is_fixed(frame)]:
            self._take(frame)
        if self._wanted and self._moving is None:
            # AnyMsg, as in TopicReader: rospy allows one class per topic in a process
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
                self._complaints.state(
                    frame, f'the data of {self._wanted[frame]} is not drawn, as tf does not '
                    f'connect the frame {frame} with {self._base_frame}: {problem}')
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

    def _on_static(self, transforms: List[TransformStamped]) -> None:
        for transform in transforms:
            self._buffer.set_transform_static(transform, 'static')
            self._fixed_to[transform.child_frame_id] = transform.header.frame_id

    def _on_transforms(self, message: Any) -> None:
        for transform in tf_transforms(message._buff):
            self._buffer.set_transform(transform, 'dynamic')
