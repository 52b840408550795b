# SPDX-License-Identifier: BSD-3-Clause
"""Reads what is known of the base frames of the recording that is chosen."""
from __future__ import annotations

from typing import Optional, Sequence, Tuple

from PyQt5.QtCore import QObject, pyqtSignal

from process_visualizer.bags.bag_errors import BagError
from process_visualizer.bags.recording_calibration import (
    RecordingCalibration,
    read_recording_calibration,
)
from process_visualizer.gui.toolkit.tasks import Tasks


class RecordingCalibrationModel(QObject):
    """The poses that were stored in a recording and beside it; None until they are read."""

    changed = pyqtSignal()
    failed = pyqtSignal(str)

    def __init__(self, tasks: Tasks, parent: Optional[QObject] = None) -> None:
        super().__init__(parent)
        self._tasks = tasks
        self._paths: Tuple[str, ...] = ()
        self._value: Optional[RecordingCalibration] = None

    @property
    def value(self) -> Optional[RecordingCalibration]:
        """Return what was read at last."""
        return self._value

    def set_recording(self, paths: Sequence[str]) -> None:
        """Read another recording."""
        if tuple(paths) == self._paths:
            return
        self._paths = tuple(paths)
        self._value = None
        self.changed.emit()
        self.read_again()

    def read_again(self) -> None:
        """Read what has been saved meanwhile."""
        wanted = self._paths
        if wanted:
            self._tasks.run('files', lambda: read_recording_calibration(wanted),
                            lambda it: self._take(wanted, it),
                            lambda error: self._refuse(wanted, error))

    def _take(self, wanted: Tuple[str, ...], value: RecordingCalibration) -> None:
        if wanted == self._paths:
            self._value = value
            self.changed.emit()

    def _refuse(self, wanted: Tuple[str, ...], error: Exception) -> None:
        if not isinstance(error, BagError):
            raise error
        if wanted == self._paths:
            self.failed.emit(f'{error}. The frames are where the configuration says.')
