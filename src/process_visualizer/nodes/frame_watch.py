"""Warns of frames in which something is shown but which are not in tf."""
from __future__ import annotations

import time
from typing import Any, Dict, List, Set

import rospy
import tf2_ros
from tf2_msgs.msg import TFMessage

from process_visualizer.nodes.frame_reader import STATIC_TOPIC, TF_TOPIC
from process_visualizer.nodes.message_reader import WARNING_PERIOD_S
from process_visualizer.nodes.robot_messages import deserialize

PATIENCE_S = 5.0  # from the first data to the first warning: the other nodes start too


class FrameWatch:
    """Looks whether frames are connected with a robot's base frame.

    RViz draws nothing in a frame that is not. A frame that was found once is not looked for any
    more, and without one to look for there is no subscription of /tf, which would cost much.
    """

    def __init__(self, device: str, base_frame: str) -> None:
        """Take the device's name, for messages to the user, and its base frame."""
        self._device = device
        self._base_frame = base_frame
        self._buffer = tf2_ros.BufferCore(rospy.Duration(10.0))
        self._subscribers: List[rospy.Subscriber] = []
        self._found: Set[str] = set()
        self._wanted: Dict[str, str] = {}  # the topic by the frame
        self._next_warning_s = 0.0

    def want(self, frame: str, topic: str) -> None:
        """Look for a frame in which the data of a topic are shown."""
        if frame in self._found or frame in self._wanted:
            return
        if not self._wanted:
            self._next_warning_s = time.monotonic() + PATIENCE_S
        self._wanted[frame] = rospy.resolve_name(topic)
        if not self._subscribers:
            # AnyMsg, as FrameReader: a topic has one class in a process.
            self._subscribers = [
                rospy.Subscriber(STATIC_TOPIC, rospy.AnyMsg, self._on_static),
                rospy.Subscriber(TF_TOPIC, rospy.AnyMsg, self._on_transforms)]

    def look(self) -> None:
        """Look now, and warn of what is not found after some time."""
        if not self._wanted:
            return
        missing = {frame: problem for frame in list(self._wanted)
                   if (problem := self._problem(frame))}
        self._found.update(frame for frame in self._wanted if frame not in missing)
        self._wanted = {frame: self._wanted[frame] for frame in missing}
        if not missing:
            for subscriber in self._subscribers:
                subscriber.unregister()
            self._subscribers = []
        elif time.monotonic() >= self._next_warning_s:
            self._next_warning_s = time.monotonic() + WARNING_PERIOD_S
            self._warn(missing)

    def _on_static(self, message: Any) -> None:
        for transform in deserialize(TFMessage, message._buff).transforms:
            self._buffer.set_transform_static(transform, 'static')

    def _on_transforms(self, message: Any) -> None:
        for transform in deserialize(TFMessage, message._buff).transforms:
            self._buffer.set_transform(transform, 'dynamic')

    def _problem(self, frame: str) -> str:
        known = self._buffer._frameExists(frame)
        if not self._buffer._frameExists(self._base_frame):  # a robot may be a force sensor only
            return '' if known else f'there is no frame {frame}'
        connected, problem = self._buffer.can_transform_core(self._base_frame, frame, rospy.Time())
        return '' if connected else str(problem)

    def _warn(self, missing: Dict[str, str]) -> None:
        for frame, problem in missing.items():
            rospy.logwarn('%s: what %s brings is not drawn, as tf does not connect the frame %s '
                          'with %s: %s', self._device, self._wanted[frame], frame,
                          self._base_frame, problem)
