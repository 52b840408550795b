# SPDX-License-Identifier: BSD-3-Clause
"""An interactive marker in RViz for dragging the pose of one frame."""
from __future__ import annotations

import threading
from typing import Callable, Optional

from geometry_msgs.msg import Point, Quaternion
from geometry_msgs.msg import Pose as PoseMessage
from interactive_markers.interactive_marker_server import InteractiveMarkerServer
from visualization_msgs.msg import (
    InteractiveMarker,
    InteractiveMarkerControl,
    InteractiveMarkerFeedback,
)

from process_visualizer.cell.model import Pose
from process_visualizer.clients.pose_messages import pose_of
from process_visualizer.generate.rviz_config import CALIBRATION_TOPIC
from process_visualizer.motion.rotations import quaternion_from_ypr

SIZE_M = 0.4
_HALF = 0.5 ** 0.5
AXES = {'x': (_HALF, 0.0, 0.0, _HALF), 'y': (0.0, 0.0, _HALF, _HALF),
         'z': (0.0, _HALF, 0.0, _HALF)}
"""Quaternions (x y z w) that turn the x axis, along which a control works, onto each axis."""


class PoseMarker:
    """A marker for one frame at a time, with arrows and rings for all six degrees of freedom.

    Needs an initialised rospy node. ``on_dragged`` is called repeatedly with the frame and its new
    pose, in rospy's thread, but not for poses set here. Make only one in a process: it keeps its
    topics until the process ends.
    """

    def __init__(self, on_dragged: Callable[[str, Pose], None], topic: str = CALIBRATION_TOPIC,
                 make_server: Callable[[str], InteractiveMarkerServer] = InteractiveMarkerServer
                 ) -> None:
        """The topics are advertised with the first marker."""
        self._on_dragged = on_dragged
        self._topic, self._make_server = topic, make_server
        self._server: Optional[InteractiveMarkerServer] = None
        self._frame = ''
        self._lock = threading.Lock()  # the program's thread and rospy's

    @property
    def frame(self) -> str:
        """The frame that has the marker; '' if there is none."""
        return self._frame

    def show(self, parent: str, frame: str, pose: Pose) -> None:
        """Show the marker for a frame at its pose in a parent frame, instead of another one."""
        with self._lock:
            if self._server is None:
                self._server = self._make_server(self._topic)
            self._server.clear()
            self._frame = frame
            self._server.insert(_marker(parent, frame, pose), self._take_feedback)
            self._server.applyChanges()

    def move(self, pose: Pose) -> None:
        """Move the marker, if there is one."""
        with self._lock:
            if self._server is not None and self._frame:
                self._server.setPose(self._frame, _message(pose))
                self._server.applyChanges()

    def hide(self) -> None:
        """Remove the marker."""
        with self._lock:
            self._frame = ''
            if self._server is not None:
                self._server.clear()
                self._server.applyChanges()

    def _take_feedback(self, feedback: InteractiveMarkerFeedback) -> None:
        """Handle feedback from RViz while the mouse moves the marker; ignore clicks."""
        if feedback.event_type == feedback.POSE_UPDATE and feedback.marker_name == self._frame:
            self._on_dragged(feedback.marker_name, pose_of(feedback.pose))


def _marker(parent: str, frame: str, pose: Pose) -> InteractiveMarker:
    marker = InteractiveMarker(name=frame, description=frame, scale=SIZE_M, pose=_message(pose))
    marker.header.frame_id = parent
    for axis, quaternion in AXES.items():
        for name, mode in (('move', InteractiveMarkerControl.MOVE_AXIS),
                           ('turn', InteractiveMarkerControl.ROTATE_AXIS)):
            marker.controls.append(InteractiveMarkerControl(
                name=f'{name} {axis}', interaction_mode=mode, orientation=Quaternion(*quaternion),
                always_visible=True))  # with RViz's tool Interact they can be dragged
    return marker


def _message(pose: Pose) -> PoseMessage:
    return PoseMessage(Point(*pose.xyz), Quaternion(*quaternion_from_ypr(pose.ypr)))
