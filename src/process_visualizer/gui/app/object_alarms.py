# SPDX-License-Identifier: BSD-3-Clause
"""Connects what depth sensors see of objects that nobody modelled with the list of alarms."""
from __future__ import annotations

from typing import Sequence

from PyQt5.QtCore import QObject

from process_visualizer.gui.models.cell.alarms_model import AlarmsModel
from process_visualizer.gui.models.cell.launch_model import LaunchModel, Phase
from process_visualizer.gui.models.cell.objects_model import ObjectsModel
from process_visualizer.gui.ros.object_link import ObjectLink
from process_visualizer.gui.ros.ros_link import RosLinkError
from process_visualizer.gui.toolkit.tasks import Tasks

_LINE = 'objects'


class ObjectAlarms(QObject):
    """Has the model; subscribing is a task."""

    def __init__(self, tasks: Tasks, launch: LaunchModel, alarms: AlarmsModel) -> None:
        super().__init__(alarms)
        self._tasks, self._launch, self._alarms = tasks, launch, alarms
        self._link = ObjectLink(self)
        self.model = ObjectsModel(self)
        self.model.sensors_wanted.connect(self._follow_sensors)
        self.model.changed.connect(self._tell)
        self._link.seen.connect(self.model.take)
        launch.changed.connect(self._follow_launch)

    def _follow_launch(self) -> None:
        is_up = self._launch.phase in (Phase.LAUNCHING, Phase.RUNNING)
        self.model.set_running(self._launch.running if is_up else None)

    def _follow_sensors(self, names: Sequence[str]) -> None:
        self._tasks.run(_LINE, lambda: self._link.follow(names), None, self._refuse)

    def _refuse(self, error: Exception) -> None:
        if not isinstance(error, RosLinkError):
            raise error
        self._alarms.note(str(error))

    def _tell(self) -> None:
        self._alarms.set_objects(self.model.conditions, [
            (it.device, it.text, it.begin_s, it.end_s) for it in self.model.played])
