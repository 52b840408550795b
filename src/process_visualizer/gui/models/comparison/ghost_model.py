# SPDX-License-Identifier: BSD-3-Clause
"""Whether the reference moves as a ghost beside the robots of the run that is played."""
from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from typing import Callable, Optional, Sequence, Tuple

from PyQt5.QtCore import QObject, pyqtSignal

from process_visualizer.clients.ghost_client import GhostError
from process_visualizer.gui.models.comparison.compare_model import Compared, CompareModel
from process_visualizer.gui.toolkit.tasks import Tasks
from process_visualizer.runs.comparison.ghost_arrows import GhostArrow, ghost_arrows
from process_visualizer.runs.comparison.ghost_tracks import GhostTrack, ghost_tracks

LINE = 'ghost'


class GhostModel(QObject):
    """Shows what was compared last, as long as it is wanted and the player runs."""

    changed = pyqtSignal()
    failed = pyqtSignal(str)

    def __init__(self, tasks: Tasks, compare: CompareModel,
                 show: Callable[[Sequence[GhostTrack], Sequence[GhostArrow]], None],
                 parent: Optional[QObject] = None) -> None:
        """``show`` shows tracks and arrows, or hides the ghost if there are none; it may block."""
        super().__init__(parent)
        self._tasks, self._compare, self._show = tasks, compare, show
        self._is_running, self._is_wanted = False, True
        self._shown: Optional[Compared] = None
        compare.changed.connect(self._follow)

    @property
    def is_wanted(self) -> bool:
        """Whether the operator wants to see it."""
        return self._is_wanted

    def set_wanted(self, is_wanted: bool) -> None:
        """Show it, or do not."""
        self._is_wanted = is_wanted
        self._follow()
        self.changed.emit()

    def set_running(self, is_running: bool) -> None:
        """Tell whether the player runs, and with it the node that draws."""
        if not is_running:
            self._shown = None  # the node ends, too, and what it draws
        self._is_running = is_running
        self._follow()

    def _follow(self) -> None:
        wanted = self._compare.compared if self._is_wanted and self._is_running else None
        if wanted is self._shown or not self._is_running:
            return
        self._shown = wanted
        self._tasks.run(LINE, lambda: self._show(*self._ghost(wanted)), None, self._fail)

    def _ghost(self, compared: Optional[Compared]
               ) -> Tuple[Tuple[GhostTrack, ...], Tuple[GhostArrow, ...]]:
        """In the line of tasks."""
        cell = self._compare.cell
        if compared is None or cell is None:
            return (), ()
        wanted = cell, compared.good.reference, self._compare.of_recording
        with ThreadPoolExecutor(2) as pool:  # most of the time xacro reads models, as processes
            tracks, arrows = pool.submit(ghost_tracks, *wanted), pool.submit(ghost_arrows, *wanted)
            return tracks.result(), arrows.result()

    def _fail(self, error: Exception) -> None:
        if not isinstance(error, GhostError):
            raise error
        self.failed.emit(str(error))
