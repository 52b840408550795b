# SPDX-License-Identifier: BSD-3-Clause
"""The boxes of depth sensors: moved in the running nodes, and dragged in RViz."""
from __future__ import annotations

from typing import Optional

import rosgraph
import rospy
from PyQt5.QtCore import QObject, pyqtSignal

from process_visualizer.cell.model import RegionOfInterest
from process_visualizer.gui.ros.box_marker import BoxMarker
from process_visualizer.gui.ros.ros_link import RosLinkError
from process_visualizer.ros_names import ROI_FILTER


class RegionLink(QObject):
    """Moves boxes while everything runs; all methods but the constructor block."""

    dragged = pyqtSignal(str, object)
    """The box of a device (its name) has been dragged in RViz to this RegionOfInterest."""

    def __init__(self, parent: Optional[QObject] = None) -> None:
        super().__init__(parent)
        self._marker = BoxMarker(self.dragged.emit)

    def move(self, device: str, region: RegionOfInterest) -> None:
        """Give the crop of a device another box, which takes effect with the next cloud.

        Raises:
            RosLinkError: the master does not answer.
        """
        try:
            for name, values in (('center', region.center), ('size', region.size)):
                rospy.set_param(f'/{device}/{ROI_FILTER}/{name}', [float(it) for it in values])
        except (rospy.ROSException, rosgraph.MasterException, OSError) as error:
            raise RosLinkError(f'the ROS master does not answer ({error})') from error

    def show_marker(self, device: str, region: RegionOfInterest) -> None:
        """Let the box of a device be dragged in RViz.

        Raises:
            RosLinkError: the master does not answer.
        """
        try:
            self._marker.show(device, region)
        except (rospy.ROSException, rosgraph.MasterException, OSError) as error:
            raise RosLinkError(f'the box of {device} cannot be dragged: the ROS master does not '
                               f'answer ({error})') from error

    def move_marker(self, device: str, region: RegionOfInterest) -> None:
        """Let the box in RViz follow."""
        self._marker.move(device, region)

    def hide_marker(self) -> None:
        """Remove the box from RViz."""
        self._marker.hide()
