# SPDX-License-Identifier: BSD-3-Clause
"""The calibration's use of other models: frames and marker of the node, the recording."""
from __future__ import annotations

from typing import Optional, Sequence

from PyQt5.QtCore import QObject, pyqtSignal

from process_visualizer.cell.model import Cell, Mode, Pose, Vector3
from process_visualizer.clients.player_client import PlayerError
from process_visualizer.clients.sensor_fit_client import FitError, SensorFit, fit_sensor
from process_visualizer.gui.cell.calibration_model import (
    CalibrationModel,
    FitModel,
    RecordingCalibrationModel,
)
from process_visualizer.gui.ros.ros_link import RosLink, RosLinkError
from process_visualizer.gui.ros.snapshots import PlayerSnapshot
from process_visualizer.gui.toolkit.tasks import Tasks

_MARKER = 'marker'


class CalibrationActions(QObject):
    """The models of the calibration tab, and their connections to the window's node."""

    failed = pyqtSignal(str)

    def __init__(self, tasks: Tasks, link: RosLink, parent: Optional[QObject] = None) -> None:
        super().__init__(parent)
        self._tasks, self._link = tasks, link
        self._cell: Optional[Cell] = None
        self._chosen: Sequence[str] = ()
        self._player: Optional[PlayerSnapshot] = None
        self._mode: Optional[Mode] = None
        self.model = CalibrationModel(tasks, self._move, self)
        self.fit = FitModel(tasks, self.model, self._find, self)
        self.recording = RecordingCalibrationModel(tasks, self)
        self._connect()

    def set_cell(self, cell: Optional[Cell], chosen: Sequence[str]) -> None:
        """Take the configuration, and the names of the devices that are ticked."""
        self._cell, self._chosen = cell, tuple(chosen)
        devices = () if cell is None else cell.devices
        self.model.set_devices(devices, '' if cell is None else cell.frame)

    def set_mode(self, mode: Mode) -> None:
        """Take the mode that runs, or would be launched: a recording counts in playback only."""
        self._mode = mode
        self._follow_recording()

    def take_player(self, player: Optional[PlayerSnapshot]) -> None:
        """Take the state of the player, None without one."""
        self._player = player

    def _connect(self) -> None:
        self.model.marker_wanted.connect(self._show_marker)
        self.model.moved.connect(lambda frame, pose: self._tasks.run(
            _MARKER, lambda: self._link.move_marker(frame, pose)))
        self._link.pose_dragged.connect(self._take_drag)
        self.recording.changed.connect(self._follow_recording)
        self.model.kept.connect(self.recording.read_again)
        for model in (self.model, self.recording):
            model.failed.connect(self.failed)

    def _follow_recording(self) -> None:
        self.model.set_recording(self.recording.value if self._mode is Mode.PLAYBACK else None)

    def _move(self, frame: str, xyz: Vector3, ypr: Vector3) -> None:
        """Move a frame; what is seen by it is published again where playback stands still.

        Raises:
            RosLinkError: a node refuses, or does not answer.
        """
        self._link.move_frame(frame, xyz, ypr)
        player = self._player
        if player is None or not player.paused:
            return
        try:
            self._link.player.repeat()
        except PlayerError as error:
            raise RosLinkError(f'its picture stays as it was: {error}') from error

    def _find(self, name: str) -> SensorFit:
        """Find where a depth sensor is.

        Raises:
            FitError: it cannot be found.
        """
        cell = self._cell
        if cell is None:
            raise FitError('no configuration is loaded')
        return fit_sensor(cell.device(name),
                          [it for it in cell.devices if it.name in self._chosen], cell.frame)

    def _show_marker(self, is_shown: bool) -> None:
        cell, base, pose = self._cell, self.model.base, self.model.pose
        if is_shown and cell is not None and base is not None:
            self._tasks.run(_MARKER, lambda: self._link.show_marker(cell.frame, base.frame, pose),
                            None, self._tell_marker)
        else:
            self._tasks.run(_MARKER, self._link.hide_marker)

    def _tell_marker(self, error: Exception) -> None:
        if not isinstance(error, RosLinkError):
            raise error
        self.failed.emit(str(error))

    def _take_drag(self, frame: str, pose: Pose) -> None:
        base = self.model.base
        if base is not None and frame == base.frame:
            self.model.take_pose(pose.xyz, pose.ypr)
