# SPDX-License-Identifier: BSD-3-Clause
"""Connects the boxes of depth sensors with the nodes and with RViz."""
from __future__ import annotations

from PyQt5.QtCore import QObject

from process_visualizer.gui.models.cell.region_model import RegionModel
from process_visualizer.gui.ros.region_link import RegionLink
from process_visualizer.gui.ros.ros_link import RosLinkError
from process_visualizer.gui.toolkit.tasks import Tasks

_LINE = 'marker'


class RegionControl(QObject):
    """Has the model; what takes its time is a task."""

    def __init__(self, tasks: Tasks, parent: QObject) -> None:
        super().__init__(parent)
        self._tasks = tasks
        self._link = RegionLink(self)
        self.model = RegionModel(tasks, self._link.move, self)
        self._link.dragged.connect(self.model.take_dragged)
        self.model.marker_wanted.connect(self._show_marker)
        self.model.moved.connect(lambda device, region: tasks.run(
            _LINE, lambda: self._link.move_marker(device, region)))

    def _show_marker(self, is_shown: bool) -> None:
        device, region = self.model.device, self.model.region
        if is_shown and region is not None:
            chosen = region
            self._tasks.run(_LINE, lambda: self._link.show_marker(device, chosen), None, self._tell)
        else:
            self._tasks.run(_LINE, self._link.hide_marker)

    def _tell(self, error: Exception) -> None:
        if not isinstance(error, RosLinkError):
            raise error
        self.model.failed.emit(str(error))
