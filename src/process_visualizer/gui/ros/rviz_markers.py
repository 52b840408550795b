# SPDX-License-Identifier: BSD-3-Clause
"""Interactive markers in RViz, for the pose of a frame and for a box."""
from __future__ import annotations

import threading
from dataclasses import replace
from typing import Callable, Dict, List, Optional, Tuple

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

from process_visualizer.cell.model import Pose, RegionOfInterest, Vector3
from process_visualizer.clients.sensor_fit_client import pose_of
from process_visualizer.generate.rviz_config import CALIBRATION_TOPIC
from process_visualizer.robot.rotations import quaternion_from_ypr

SIZE_M = 0.4
_HALF = 0.5 ** 0.5
AXES = {'x': (_HALF, 0.0, 0.0, _HALF), 'y': (0.0, 0.0, _HALF, _HALF),
         'z': (0.0, _HALF, 0.0, _HALF)}
"""Quaternions (x y z w) that turn the x axis, the direction of a control, onto each axis."""


class PoseMarker:
    """A marker for one frame at a time, with arrows and rings for all six degrees of freedom.

    Needs an initialized rospy node. ``on_dragged`` is called repeatedly with the frame and its new
    pose, in rospy's thread, but not for poses set here. Create only one per process: its topics
    stay until the process ends.
    """

    def __init__(self, on_dragged: Callable[[str, Pose], None], topic: str = CALIBRATION_TOPIC,
                 make_server: Callable[[str], InteractiveMarkerServer] = InteractiveMarkerServer
                 ) -> None:
        """Set the parameters; the topics are advertised with the first marker."""
        self._on_dragged = on_dragged
        self._topic, self._make_server = topic, make_server
        self._server: Optional[InteractiveMarkerServer] = None
        self._frame = ''
        self._lock = threading.Lock()  # between the program's threads and rospy's

    @property
    def frame(self) -> str:
        """The frame that has the marker; '' if there is none."""
        return self._frame

    def show(self, parent: str, frame: str, pose: Pose) -> None:
        """Show the marker for a frame at its pose in a parent frame, instead of the last one."""
        with self._lock:
            if self._server is None:
                self._server = self._make_server(self._topic)
            self._server.clear()
            self._frame = frame
            self._server.insert(_pose_marker(parent, frame, pose), self._take_feedback)
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


def _pose_marker(parent: str, frame: str, pose: Pose) -> InteractiveMarker:
    marker = InteractiveMarker(name=frame, description=frame, scale=SIZE_M, pose=_message(pose))
    marker.header.frame_id = parent
    for axis, quaternion in AXES.items():
        for name, mode in (('move', InteractiveMarkerControl.MOVE_AXIS),
                           ('turn', InteractiveMarkerControl.ROTATE_AXIS)):
            marker.controls.append(InteractiveMarkerControl(
                name=f'{name} {axis}', interaction_mode=mode, orientation=Quaternion(*quaternion),
                always_visible=True))  # can be dragged with RViz's tool Interact
    return marker


def _message(pose: Pose) -> PoseMessage:
    return PoseMessage(Point(*pose.xyz), Quaternion(*quaternion_from_ypr(pose.ypr)))


# A box that is dragged by its middle, or by one of its faces while the opposite face stays.

MIDDLE = 'middle'
FACES: Dict[str, Tuple[int, float]] = {
    f'{"+" if side > 0 else "-"}{axis}': (number, side)
    for number, axis in enumerate('xyz') for side in (1.0, -1.0)}
"""For each face the axis (0 to 2) orthogonal to it, and its side of the middle (+1 or -1)."""
MIN_M = 0.01


def handle_places(region: RegionOfInterest) -> Dict[str, Vector3]:
    """Return the places of the middle and of the middles of the faces [m], in the box's frame."""
    places = {MIDDLE: region.center}
    for name, (axis, side) in FACES.items():
        place = list(region.center)
        place[axis] += side * region.size[axis] / 2
        places[name] = _vector(place)
    return places


def dragged(region: RegionOfInterest, handle: str, place: Vector3) -> RegionOfInterest:
    """Return the box after its handle was dragged to a place [m]; edges keep a minimum length.

    Raises:
        KeyError: there is no such handle.
    """
    if handle == MIDDLE:
        return replace(region, center=place)
    axis, side = FACES[handle]
    fixed_m = region.center[axis] - side * region.size[axis] / 2
    length_m = max(side * (place[axis] - fixed_m), MIN_M)
    center, size = list(region.center), list(region.size)
    center[axis], size[axis] = fixed_m + side * length_m / 2, length_m
    return replace(region, center=_vector(center), size=_vector(size))


def _vector(values: List[float]) -> Vector3:
    x, y, z = values
    return x, y, z


_SIZE_M = 0.25
_CUBE_M = 0.03
_COLOR = ColorRGBA(0.95, 0.75, 0.2, 0.9)


class BoxMarker:
    """A box for one device at a time, with arrows at its middle and a small cube on each face.

    Needs an initialized rospy node. ``on_dragged`` is called repeatedly with the device and its new
    box, in rospy's thread. Create only one per process: its topics stay until the process ends.
    """

    def __init__(self, on_dragged: Callable[[str, RegionOfInterest], None],
                 make_server: Callable[..., InteractiveMarkerServer] = InteractiveMarkerServer
                 ) -> None:
        """Set the parameters; the topics, shared with `PoseMarker`, appear with the first box."""
        self._on_dragged, self._make_server = on_dragged, make_server
        self._server: Optional[InteractiveMarkerServer] = None
        self._shown: Optional[Tuple[str, RegionOfInterest]] = None
        self._lock = threading.RLock()  # between the program's threads and rospy's

    def show(self, device: str, region: RegionOfInterest) -> None:
        """Show the box of a device; it replaces the last box."""
        with self._lock:
            if self._server is None:
                self._server = self._make_server(CALIBRATION_TOPIC, '/box')
            self._server.clear()
            self._shown = device, region
            for handle, place in handle_places(region).items():
                self._server.insert(_handle_marker(device, handle, region.frame, place),
                                    self._take_feedback)
            self._server.applyChanges()

    def move(self, device: str, region: RegionOfInterest) -> None:
        """Change the box if it is that of the shown device."""
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


def _handle_marker(device: str, handle: str, frame: str, place: Vector3) -> InteractiveMarker:
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
    cube = Marker(type=Marker.CUBE, color=_COLOR)
    cube.pose.orientation.w = 1.0
    cube.scale.x = cube.scale.y = cube.scale.z = _CUBE_M
    control.markers = [cube]
    return control


def _pose(place: Vector3) -> PoseMessage:
    return PoseMessage(Point(*place), Quaternion(0.0, 0.0, 0.0, 1.0))
