# SPDX-License-Identifier: BSD-3-Clause
"""Connects the calibration tab to the session, and to the window's node for frames and markers."""
from __future__ import annotations

from functools import partial
from typing import Any, Callable, Optional

from PyQt5.QtCore import QObject, pyqtSignal

from process_visualizer.cell.model import Mode, Pose, Vector3
from process_visualizer.clients.player_client import PlayerError
from process_visualizer.clients.sensor_fit_client import FitError, SensorFit, fit_sensor
from process_visualizer.generate.plan import FRAMES_PART
from process_visualizer.gui.cell.calibration_model import (
    CalibrationModel,
    FitModel,
    RecordingCalibrationModel,
    RegionModel,
)
from process_visualizer.gui.ros.ros_link import RegionLink, RosLink, RosLinkError
from process_visualizer.gui.session import Session
from process_visualizer.gui.toolkit.tasks import Tasks
from process_visualizer.launching.part_report import PartState

_MARKER = 'marker'


class CalibrationActions(QObject):
    """The models of the calibration tab, and their connections to the window's node."""

    failed = pyqtSignal(str)

    def __init__(self, tasks: Tasks, link: RosLink, session: Session,
                 parent: Optional[QObject] = None) -> None:
        super().__init__(parent)
        self._tasks, self._link, self._session = tasks, link, session
        self.model = CalibrationModel(tasks, self._move, self)
        self.fit = FitModel(tasks, self.model, self._find, self)
        self.recording = RecordingCalibrationModel(tasks, session, self)
        self._connect()

    def _connect(self) -> None:
        self._session.cell_changed.connect(self._follow_cell)
        self._session.run_changed.connect(self._follow_run)
        self.model.marker_wanted.connect(self._show_marker)
        self.model.moved.connect(lambda frame, pose: self._tasks.run(
            _MARKER, lambda: self._link.move_marker(frame, pose)))
        self._link.pose_dragged.connect(self._take_drag)
        self.recording.changed.connect(self._follow_recording)
        self.model.kept.connect(self.recording.read_again)
        for model in (self.model, self.recording):
            model.failed.connect(self.failed)

    def _follow_cell(self) -> None:
        cell, editor = self._session.cell, self._session.editor
        if cell is not None:
            self.model.set_devices(cell.devices, cell.frame)
        if editor is not None:
            self.model.set_save(editor.save)
        self._follow_recording()

    def _follow_run(self) -> None:
        frames = self._session.reports.get(FRAMES_PART)  # the part may have been restarted
        self._follow_recording()
        self.model.set_running(self._session.running is not None and (
            frames is None or frames.state is PartState.RUNNING))

    def _follow_recording(self) -> None:
        """Apply the poses that were saved for the recording, in playback only."""
        is_played = self._session.mode_in_force is Mode.PLAYBACK
        self.model.set_recording(self.recording.value if is_played else None)

    def _move(self, frame: str, xyz: Vector3, ypr: Vector3) -> None:
        """Move a frame; paused playback publishes the data seen in it again.

        Raises:
            RosLinkError: a node refuses, or does not answer.
        """
        self._link.move_frame(frame, xyz, ypr)
        player = self._session.player
        if player is None or not player.paused:
            return
        try:
            self._link.player.repeat()
        except PlayerError as error:
            raise RosLinkError(f'its picture stays as it was: {error}') from error

    def _find(self, name: str) -> SensorFit:
        """Find the pose of a depth sensor.

        Raises:
            FitError: the pose cannot be found.
        """
        cell, chosen = self._session.cell, self._session.chosen
        if cell is None:
            raise FitError('no configuration is loaded')
        return fit_sensor(cell.device(name), chosen, cell.frame)

    def _show_marker(self, is_shown: bool) -> None:
        cell, base, pose = self._session.cell, self.model.base, self.model.pose
        if is_shown and cell is not None and base is not None:
            self._tasks.run(_MARKER, lambda: self._link.show_marker(cell.frame, base.frame, pose),
                            None, partial(_report, self.failed.emit))
        else:
            self._tasks.run(_MARKER, self._link.hide_marker)

    def _take_drag(self, frame: str, pose: Pose) -> None:
        base = self.model.base
        if base is not None and frame == base.frame:
            self.model.take_pose(pose.xyz, pose.ypr)


class RegionActions(QObject):
    """The model of the boxes to which clouds are cropped, and its marker in RViz."""

    def __init__(self, tasks: Tasks, session: Session, parent: QObject) -> None:
        super().__init__(parent)
        self._tasks, self._session = tasks, session
        self._link = RegionLink(self)
        self.model = RegionModel(tasks, self._link.move, self)
        self._link.dragged.connect(self.model.take_dragged)
        self.model.marker_wanted.connect(self._show_marker)
        self.model.moved.connect(lambda device, region: tasks.run(
            _MARKER, lambda: self._link.move_marker(device, region)))
        session.cell_changed.connect(self._follow_cell)
        session.run_changed.connect(
            lambda: self.model.set_running(session.running is not None))

    def _follow_cell(self) -> None:
        self.model.set_devices(self._session.devices)
        if self._session.editor is not None:
            self.model.set_save(self._session.editor.save_region)

    def _show_marker(self, is_shown: bool) -> None:
        device, region = self.model.device, self.model.region
        if is_shown and region is not None:
            chosen = region
            self._tasks.run(_MARKER, lambda: self._link.show_marker(device, chosen), None,
                            partial(_report, self.model.failed.emit))
        else:
            self._tasks.run(_MARKER, self._link.hide_marker)


def _report(say: Callable[[str], Any], error: Exception) -> None:
    """Report why a marker cannot be shown."""
    if not isinstance(error, RosLinkError):
        raise error
    say(str(error))
