# SPDX-License-Identifier: BSD-3-Clause
"""The curves of the process variables of a recording, read in the background."""
from __future__ import annotations

from typing import Optional, Sequence, Tuple

from PyQt5.QtCore import QObject, pyqtSignal

from process_visualizer.bags.bag_errors import BagError
from process_visualizer.cell.model import Device
from process_visualizer.curves.curve_sources import CurveSource, curve_sources
from process_visualizer.curves.curves import Curve, read_curves
from process_visualizer.curves.recorded_alarms import RecordedAlarm, recorded_alarms
from process_visualizer.curves.samples import ReadingCancelled
from process_visualizer.gui.models.playback.bag_reading import in_steps
from process_visualizer.gui.models.playback.lane_choices import LaneChoices
from process_visualizer.gui.toolkit.progress import Progress
from process_visualizer.gui.toolkit.tasks import Tasks

LINE = 'curves'


class CurvesModel(QObject):
    """Reads again whenever there is another recording, or devices have other variables."""

    changed = pyqtSignal()
    failed = pyqtSignal(str)

    def __init__(self, tasks: Tasks, parent: Optional[QObject] = None) -> None:
        super().__init__(parent)
        self._tasks = tasks
        self.choices = LaneChoices(self)
        self._paths: Tuple[str, ...] = ()
        self._devices: Tuple[Device, ...] = ()
        self._sources: Tuple[CurveSource, ...] = ()
        self._curves: Tuple[Curve, ...] = ()
        self._alarms: Tuple[RecordedAlarm, ...] = ()
        self._reading: Optional[Progress] = None
        self._is_cancelled = False

    @property
    def curves(self) -> Tuple[Curve, ...]:
        """The curves, in the order of the devices."""
        return self._curves

    @property
    def alarms(self) -> Tuple[RecordedAlarm, ...]:
        """Return when variables were beyond their limits, in the order of time."""
        return self._alarms

    @property
    def reading(self) -> Optional[Progress]:
        """Return how far reading is; None while nothing is being read."""
        return self._reading

    @property
    def is_cancelled(self) -> bool:
        """Return whether the operator did not want the curves; ``read`` reads them after all."""
        return self._is_cancelled

    def set_recording(self, paths: Sequence[str]) -> None:
        """Read the curves of another recording."""
        self._paths = tuple(paths)
        self.read()

    def set_devices(self, devices: Sequence[Device]) -> None:
        """Take the devices whose variables are drawn."""
        sources = curve_sources(devices)
        self._devices = tuple(devices)
        if sources != self._sources:
            self._sources = sources
            self.read()
        elif self._judge():
            self.changed.emit()

    def read(self) -> None:
        """Read all curves anew."""
        self._stop()
        self._curves, self._alarms, self._is_cancelled = (), (), False
        if self._paths and self._sources:
            self._reading = progress = Progress(self)
            paths, devices = self._paths, self._devices
            self._tasks.run(
                LINE, lambda: read_curves(paths, devices, None, in_steps(progress),
                                          progress.is_cancelled),
                lambda curves: self._take(progress, curves),
                lambda error: self._refuse(progress, error))
        self.changed.emit()

    def cancel(self) -> None:
        """Read no further."""
        if self._reading is not None:
            self._stop()
            self._is_cancelled = True
            self.changed.emit()

    def _judge(self) -> bool:
        """Find the alarms, and tell whether there are others: limits may have changed."""
        before, self._alarms = self._alarms, recorded_alarms(self._devices, self._curves)
        return self._alarms != before

    def _stop(self) -> None:
        if self._reading is not None:
            self._reading.cancel()
            self._reading = None

    def _take(self, progress: Progress, curves: Tuple[Curve, ...]) -> None:
        if progress is self._reading:
            self._reading, self._curves = None, curves
            self._judge()
            self.changed.emit()

    def _refuse(self, progress: Progress, error: Exception) -> None:
        if isinstance(error, ReadingCancelled) or progress is not self._reading:
            return
        self._reading = None
        self.changed.emit()
        if not isinstance(error, BagError):
            raise error
        self.failed.emit(f'The curves cannot be shown: {error}')
