# SPDX-License-Identifier: BSD-3-Clause
"""An interactive box in RViz: its middle and its faces can be dragged."""
from __future__ import annotations

import threading
from typing import Callable, Optional, Tuple

from geometry_msgs.msg import Point, Quaternion
from geometry_msgs.msg import Pose as PoseMessage
from interactive_markers.interactive_marker_server import InteractiveMarkerServer
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import (
    InteractiveMarker,
    InteractiveMarkerControl,
    InteractiveMarkerFeedback,
    Marker,
)

from process_visualizer.cell.model import RegionOfInterest, Vector3
from process_visualizer.generate.rviz_config import CALIBRATION_TOPIC
from process_visualizer.gui.ros.pose_marker import AXES
from process_visualizer.motion.box_handles import FACES, MIDDLE, dragged, handle_places

_SIZE_M = 0.25
_CUBE_M = 0.03
_COLOUR = ColorRGBA(0.95, 0.75, 0.2, 0.9)


class BoxMarker:
    """A box for one device at a time: arrows at its middle, a small cube on each face.

    Needs an initialised rospy node. ``on_dragged`` is called repeatedly with the device and its new
    box, in rospy's thread. Make only one in a process: it keeps its topics until the process ends.
    """

    def __init__(self, on_dragged: Callable[[str, RegionOfInterest], None],
                 make_server: Callable[..., InteractiveMarkerServer] = InteractiveMarkerServer
                 ) -> None:
        """The topics, which `PoseMarker` has too, are advertised with the first box."""
        self._on_dragged, self._make_server = on_dragged, make_server
        self._server: Optional[InteractiveMarkerServer] = None
        self._shown: Optional[Tuple[str, RegionOfInterest]] = None
        self._lock = threading.RLock()  # the program's thread and rospy's

    def show(self, device: str, region: RegionOfInterest) -> None:
        """Show the box of a device, instead of another one."""
        with self._lock:
            if self._server is None:
                self._server = self._make_server(CALIBRATION_TOPIC, '/box')
            self._server.clear()
            self._shown = device, region
            for handle, place in handle_places(region).items():
                self._server.insert(_marker(device, handle, region.frame, place),
                                    self._take_feedback)
            self._server.applyChanges()

    def move(self, device: str, region: RegionOfInterest) -> None:
        """Change the box, if it is that of the device which is shown."""
        with self._lock:
            if self._server is None or self._shown is None or self._shown[0] != device:
                return
            self._shown = device, region
            for handle, place in handle_places(region).items():
                self._server.setPose(_name(device, handle), _pose(place))
            self._server.applyChanges()

    def hide(self) -> None:
        """Remove the box."""
        with self._lock:
            self._shown = None
            if self._server is not None:
                self._server.clear()
                self._server.applyChanges()

    def _take_feedback(self, feedback: InteractiveMarkerFeedback) -> None:
        """Handle feedback from RViz while the mouse moves a handle; ignore clicks."""
        with self._lock:
            if self._shown is None or feedback.event_type != feedback.POSE_UPDATE:
                return
            device, region = self._shown
            handle = feedback.marker_name.rpartition(' ')[2]
            position = feedback.pose.position
            if feedback.marker_name != _name(device, handle):
                return
            moved = dragged(region, handle, (position.x, position.y, position.z))
            self.move(device, moved)
        self._on_dragged(device, moved)


def _name(device: str, handle: str) -> str:
    return f'{device} {handle}'


def _marker(device: str, handle: str, frame: str, place: Vector3) -> InteractiveMarker:
    is_middle = handle == MIDDLE
    marker = InteractiveMarker(name=_name(device, handle), pose=_pose(place),
                               scale=_SIZE_M if is_middle else 2 * _CUBE_M,
                               description=f'{device}: box' if is_middle else '')
    marker.header.frame_id = frame
    marker.controls = [_control(axis) for axis in AXES] if is_middle else [_face_control(handle)]
    return marker


def _control(axis: str) -> InteractiveMarkerControl:
    return InteractiveMarkerControl(
        name=f'move {axis}', interaction_mode=InteractiveMarkerControl.MOVE_AXIS,
        orientation=Quaternion(*AXES[axis]), always_visible=True)


def _face_control(face: str) -> InteractiveMarkerControl:
    control = _control('xyz'[FACES[face][0]])
    cube = Marker(type=Marker.CUBE, color=_COLOUR)
    cube.pose.orientation.w = 1.0
    cube.scale.x = cube.scale.y = cube.scale.z = _CUBE_M
    control.markers = [cube]
    return control


def _pose(place: Vector3) -> PoseMessage:
    return PoseMessage(Point(*place), Quaternion(0.0, 0.0, 0.0, 1.0))
