# SPDX-License-Identifier: BSD-3-Clause
"""The state of RViz (starting, alive, ended), and the views that the operator has saved."""
from __future__ import annotations

import os
import tempfile
from typing import Any, Callable, Dict, List, NamedTuple, Optional, Tuple

from PyQt5.QtCore import QObject, QTimer, pyqtSignal

from process_visualizer.cell.model import Mode
from process_visualizer.clients.rviz_view import RvizView, RvizViewError
from process_visualizer.generate.plan import RVIZ_FILE, RVIZ_PART
from process_visualizer.gui.cell.launch_model import LaunchModel
from process_visualizer.gui.session import Session
from process_visualizer.gui.toolkit.tasks import Tasks
from process_visualizer.health.alarm_conditions import own_part_conditions
from process_visualizer.launching.part_report import PartState
from process_visualizer.rviz.views import SavedViewError, SavedViews
from process_visualizer.rviz.window_geometry import Rectangle

_LINE = 'view'
_WINDOW_MS = 5000
"""Longest wait for the first picture of an RViz whose node has started [ms]."""


class _Views(NamedTuple):
    names: Tuple[str, ...]
    chosen: Optional[str]
    content: Optional[Dict[str, Any]]


class ViewModel(QObject):
    """The views of the chosen devices; ``content`` is that of the chosen one, None for the default.

    A view is lost unless the operator saves it.
    """

    changed = pyqtSignal()
    failed = pyqtSignal(str)
    ended = pyqtSignal()
    """RViz has been closed or has died, or it is starting: see ``end_text`` and ``is_starting``."""

    def __init__(self, tasks: Tasks, session: Session, launch: LaunchModel) -> None:
        super().__init__(launch)
        self._tasks, self._session, self._launch = tasks, session, launch
        self._rviz = RvizView()
        self._views = _Views((), None, None)
        self._key: Tuple[str, Tuple[str, ...]] = ('', ())
        self._end_text, self._is_starting = '', False
        self.window: Optional[Rectangle] = None
        self._patience = QTimer(self, interval=_WINDOW_MS, singleShot=True)
        self._patience.timeout.connect(lambda: self._set_starting(False))
        session.cell_changed.connect(self._follow_cell)
        launch.changed.connect(self._follow_launch)

    @property
    def names(self) -> Tuple[str, ...]:
        """The names of the saved views."""
        return self._views.names

    @property
    def chosen(self) -> Optional[str]:
        """The view of the next launch; None for the generated one."""
        return self._views.chosen

    @property
    def content(self) -> Optional[Dict[str, Any]]:
        """The content of the chosen view's file."""
        return self._views.content

    @property
    def is_rviz_alive(self) -> bool:
        """Return whether RViz runs, so that it has a view."""
        report = self._launch.reports.get(RVIZ_PART)
        return report is not None and report.state is PartState.RUNNING and not self._end_text

    @property
    def end_text(self) -> str:
        """Return how RViz has ended while the nodes run; '' while RViz runs, or nothing does."""
        return self._end_text

    @property
    def is_starting(self) -> bool:
        """Return whether RViz is starting, alone or with the nodes, and has drawn nothing yet."""
        return self._is_starting

    def take_drawing(self) -> None:
        """Note that RViz has drawn a picture; an RViz that is being stopped may do so, too."""
        if self.is_rviz_alive:
            self._set_starting(False)

    def save(self, name: str) -> None:
        """Save the present view of RViz under a name, for these devices."""
        views = self._saved_views()
        self._run(lambda: self._save(views, name))

    def choose(self, name: Optional[str]) -> None:
        """Choose the view of the next launch (None: the generated one)."""
        views = self._saved_views()
        self._run(lambda: _choose(views, name))

    def restart(self) -> None:
        """Restart RViz; if it is running, with its present view."""
        path = os.path.join(self._launch.folder, RVIZ_FILE)
        is_alive = self.is_rviz_alive

        def restart(_outcome: object) -> None:  # without a new view, with the last one
            self._launch.restart(RVIZ_PART)

        self._tasks.run(_LINE, lambda: self._rviz.save(path) if is_alive else None, restart,
                        restart)

    def _follow_launch(self) -> None:
        report = self._launch.reports.get(RVIZ_PART)
        ends = [] if report is None or not self._launch.is_running else \
            own_part_conditions(Mode.REALTIME, {RVIZ_PART: report})
        text = f'{ends[0].said}.' if ends else ''
        if text != self._end_text:
            self._end_text = text
            self.ended.emit()
        if report is not None and report.state is PartState.STARTING:
            self._patience.stop()
            self._set_starting(True)
        elif not self.is_rviz_alive:
            self._set_starting(False)
        elif self._is_starting and not self._patience.isActive():
            self._patience.start()

    def _set_starting(self, is_starting: bool) -> None:
        if is_starting != self._is_starting:
            self._is_starting = is_starting
            self.ended.emit()

    def _follow_cell(self) -> None:
        key = (self._session.file, tuple(device.name for device in self._session.chosen))
        if key != self._key and key[0] and key[1]:
            self._key = key
            views = self._saved_views()
            self._run(lambda: _read(views))

    def _saved_views(self) -> SavedViews:
        return SavedViews(*self._key)

    def _save(self, views: SavedViews, name: str) -> _Views:
        with tempfile.TemporaryDirectory(prefix='process_visualizer-') as folder:
            path = os.path.join(folder, 'view.rviz')
            self._rviz.save(path)
            views.save(name, path)
        return _read(views)

    def _run(self, work: Callable[[], _Views]) -> None:
        self._tasks.run(_LINE, work, self._take, self._report_failure)

    def _take(self, views: _Views) -> None:
        self._views = views
        self.changed.emit()

    def _report_failure(self, error: Exception) -> None:
        if not isinstance(error, (SavedViewError, RvizViewError, OSError)):
            raise error
        self.failed.emit(str(error))


def _choose(views: SavedViews, name: Optional[str]) -> _Views:
    views.choose(name)
    return _read(views)


def _read(views: SavedViews) -> _Views:
    names: List[str] = views.names()
    chosen = views.chosen()
    return _Views(tuple(names), chosen, None if chosen is None else views.load(chosen))
