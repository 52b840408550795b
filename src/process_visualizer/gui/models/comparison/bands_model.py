# SPDX-License-Identifier: BSD-3-Clause
"""Bands of good runs, for the curves of the open recording."""
from __future__ import annotations

from typing import Mapping, Optional, Tuple

from PyQt5.QtCore import QObject, pyqtSignal

from process_visualizer.gui.models.comparison.compare_model import Compared, CompareModel
from process_visualizer.gui.toolkit.tasks import Tasks
from process_visualizer.runs.comparison.timeline_bands import TimelineBand, timeline_bands
from process_visualizer.runs.run import Key

LINE = 'bands'
_Wanted = Tuple[Optional[Compared], float, int]


class BandsModel(QObject):
    """Computes the bands in the background: an hour of curves has very many columns."""

    changed = pyqtSignal()

    def __init__(self, tasks: Tasks, compare: CompareModel,
                 parent: Optional[QObject] = None) -> None:
        super().__init__(parent)
        self._tasks, self._compare = tasks, compare
        self._bands: Mapping[Key, TimelineBand] = {}
        self._wanted: _Wanted = (None, 0.0, 0)
        compare.changed.connect(self._follow)

    @property
    def bands(self) -> Mapping[Key, TimelineBand]:
        """The bands by device and label; none until they have been computed."""
        return self._bands

    def set_columns(self, duration_s: float, columns: int) -> None:
        """Take into how many columns of equal time the curves cut the recording; 0: no curves."""
        self._want((self._wanted[0], duration_s, columns))

    def _follow(self) -> None:
        self._want((self._compare.compared, *self._wanted[1:]))

    def _want(self, wanted: _Wanted) -> None:
        compared, duration_s, columns = wanted
        if compared is self._wanted[0] and (duration_s, columns) == self._wanted[1:]:
            return
        self._wanted = wanted
        self._take(wanted, {})  # those of before tell about other runs, or have other columns
        if compared is not None and columns:
            runs = self._compare.of_recording
            self._tasks.run(LINE, lambda: timeline_bands(compared.good.times_s, runs, duration_s,
                                                         columns),
                            lambda bands: self._take(wanted, bands))

    def _take(self, wanted: _Wanted, bands: Mapping[Key, TimelineBand]) -> None:
        if wanted is self._wanted and (bands or self._bands):
            self._bands = bands
            self.changed.emit()
