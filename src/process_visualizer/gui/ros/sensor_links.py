# SPDX-License-Identifier: BSD-3-Clause
"""The depth sensors of the running cell: their boxes, and the objects that they see."""
from __future__ import annotations

import math
import time
from typing import Callable, Dict, Iterable, Optional

import rosgraph
import rospy
from PyQt5.QtCore import QObject, pyqtSignal

from process_visualizer.cell.model import RegionOfInterest
from process_visualizer.gui.ros.ros_link import RosLinkError
from process_visualizer.gui.ros.rviz_markers import BoxMarker
from process_visualizer.gui.ros.snapshots import ObjectsSnapshot
from process_visualizer.health.near_objects import seen_objects
from process_visualizer.msg import DetectedObject, DetectedObjects
from process_visualizer.ros_names import OBJECTS, ROI_FILTER


class RegionLink(QObject):
    """Moves boxes while everything runs; all methods but the constructor block."""

    dragged = pyqtSignal(str, object)
    """The box of a device (by name) has been dragged in RViz to this RegionOfInterest."""

    def __init__(self, parent: Optional[QObject] = None) -> None:
        super().__init__(parent)
        self._marker = BoxMarker(self.dragged.emit)

    def move(self, device: str, region: RegionOfInterest) -> None:
        """Set the box to which a device's cloud is cropped; it takes effect with the next cloud.

        Raises:
            RosLinkError: the master does not answer.
        """
        try:
            for name, values in (('center', region.center), ('size', region.size)):
                rospy.set_param(f'/{device}/{ROI_FILTER}/{name}', [float(it) for it in values])
        except (rospy.ROSException, rosgraph.MasterException, OSError) as error:
            raise RosLinkError(f'the ROS master does not answer ({error})') from error

    def show_marker(self, device: str, region: RegionOfInterest) -> None:
        """Show the box of a device for dragging in RViz.

        Raises:
            RosLinkError: the master does not answer.
        """
        try:
            self._marker.show(device, region)
        except (rospy.ROSException, rosgraph.MasterException, OSError) as error:
            raise RosLinkError(f'the box of {device} cannot be dragged: the ROS master does not '
                               f'answer ({error})') from error

    def move_marker(self, device: str, region: RegionOfInterest) -> None:
        """Move the box in RViz."""
        self._marker.move(device, region)

    def hide_marker(self) -> None:
        """Remove the box from RViz."""
        self._marker.hide()


_BEAT_S = 1.0


class ObjectLink(QObject):
    """Follows the objects of depth sensors; while the cell is clear, this costs little time."""

    seen = pyqtSignal(object)
    """An ObjectsSnapshot: each one with a near object, the first without, and one per second."""

    def __init__(self, parent: Optional[QObject] = None,
                 monotonic_s: Callable[[], float] = time.monotonic) -> None:
        super().__init__(parent)
        self._monotonic_s = monotonic_s
        self._subscribers: Dict[str, rospy.Subscriber] = {}
        self._was_near: Dict[str, bool] = {}  # each entry is written by its subscriber's thread
        self._reported_s: Dict[str, float] = {}

    def follow(self, devices: Iterable[str]) -> None:
        """Follow these depth sensors (by name) and no others; blocks for a moment.

        Raises:
            RosLinkError: the master does not answer.
        """
        try:
            self._follow(devices)
        except (rospy.ROSException, rosgraph.MasterException, OSError) as error:
            raise RosLinkError('objects near robots are no alarms: the ROS master does not answer '
                               f'({error})') from error

    def _follow(self, devices: Iterable[str]) -> None:
        wanted = set(devices)
        for device in set(self._subscribers) - wanted:
            self._subscribers.pop(device).unregister()
        for device in wanted - set(self._subscribers):
            self._subscribers[device] = rospy.Subscriber(
                f'/{device}/{OBJECTS}', DetectedObjects, self._take, device, queue_size=2)

    def _take(self, message: DetectedObjects, device: str) -> None:
        is_near = any(it.level != DetectedObject.CLEAR for it in message.objects)
        now_s = self._monotonic_s()
        is_due = now_s >= self._reported_s.get(device, -math.inf) + _BEAT_S
        if is_near or is_due or self._was_near.get(device, False):
            self._reported_s[device] = now_s
            self.seen.emit(ObjectsSnapshot(device, message.header.stamp.to_sec(),
                                           seen_objects(message)))
        self._was_near[device] = is_near

