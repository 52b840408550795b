# SPDX-License-Identifier: BSD-3-Clause
"""Fit: a depth sensor is moved to where its cloud lies on the models; an unsaved change."""
from __future__ import annotations

from typing import Callable, Dict, Optional

from PyQt5.QtCore import QObject, pyqtSignal

from process_visualizer.cell.model import DeviceType, Pose
from process_visualizer.clients.sensor_fit_client import FitError, SensorFit
from process_visualizer.gui.models.cell.calibration_model import CalibrationModel
from process_visualizer.gui.toolkit.tasks import Tasks
from process_visualizer.motion.pose_difference import pose_difference

Find = Callable[[str], SensorFit]
"""Finds where a depth sensor (its name) is; blocks for some seconds; may raise FitError."""
_LINE = 'fit'


class FitModel(QObject):
    """Finds the pose of the device that is chosen for calibration."""

    changed = pyqtSignal()

    def __init__(self, tasks: Tasks, calibration: CalibrationModel, find: Find,
                 parent: Optional[QObject] = None) -> None:
        """``find`` is run as a task."""
        super().__init__(parent)
        self._tasks, self._calibration, self._find = tasks, calibration, find
        self._fitting = ''
        self._results: Dict[str, str] = {}
        self._refused: Dict[str, str] = {}
        calibration.changed.connect(self._follow)

    @property
    def is_offered(self) -> bool:
        """Return whether the chosen device has clouds."""
        device = self._calibration.chosen
        return device is not None and device.type is DeviceType.DEPTH_SENSOR

    @property
    def is_fitting(self) -> bool:
        """Return whether a pose is being found."""
        return bool(self._fitting)

    @property
    def can_fit(self) -> bool:
        """Return whether the pose of the chosen device can be found now."""
        return self.is_offered and not self._fitting and not self._calibration.blocked_reason

    @property
    def text(self) -> str:
        """Return the chosen device's result, or why there is none; '' before and after."""
        name = self._calibration.device
        return self._results.get(name) or self._refused.get(name, '')

    @property
    def is_refused(self) -> bool:
        """Return whether the text says why nothing was found."""
        return self._calibration.device in self._refused

    def fit(self) -> None:
        """Find the pose of the chosen device, and move it there."""
        if not self.can_fit:
            return
        name = self._fitting = self._calibration.device
        self._results.pop(name, None)
        self._refused.pop(name, None)
        self._tasks.run(_LINE, lambda: self._find(name), lambda it: self._take(name, it),
                        lambda error: self._refuse(name, error))
        self.changed.emit()

    def _take(self, name: str, found: SensorFit) -> None:
        self._fitting = ''
        before = self._calibration.value_of(name)
        if before is not None and not self._calibration.blocked_reason:
            self._results[name] = _described(found, before)
            self._calibration.set_pose(name, found.pose)
        self.changed.emit()

    def _refuse(self, name: str, error: Exception) -> None:
        self._fitting = ''
        if not isinstance(error, FitError):
            self.changed.emit()
            raise error
        self._refused[name] = f'{name} stays where it is: {error}.'
        self.changed.emit()

    def _follow(self) -> None:
        """A result holds until the pose is saved or reverted."""
        for name in [it for it in self._results if it not in self._calibration.unsaved]:
            del self._results[name]
        self.changed.emit()


def _described(found: SensorFit, before: Pose) -> str:
    text = (f'Fit: moved by {pose_difference(before, found.pose)}; the cloud is '
            f'{1000.0 * found.residual_m:.1f} mm from the models (before: '
            f'{1000.0 * found.before_m:.1f} mm; {found.points:,} points).')
    if found.left_out:
        text += f' It is not known where {", ".join(found.left_out)} was.'
    return text
