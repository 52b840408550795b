# SPDX-License-Identifier: BSD-3-Clause
"""The ghost: the reference run moves beside the robots, recorded or live."""
from __future__ import annotations

from dataclasses import replace
from typing import Callable, Optional, Protocol, Sequence, Tuple

from PyQt5.QtCore import QObject, pyqtSignal

from process_visualizer.cell.model import Cell, Device, Mode
from process_visualizer.clients.ghost_client import GhostError
from process_visualizer.generate.plan import BAG_PART, FRAMES_PART
from process_visualizer.gui.compare.compare_model import Compared, CompareModel
from process_visualizer.gui.session import Session
from process_visualizer.gui.toolkit.tasks import Tasks
from process_visualizer.runs.comparison.ghost import (
    GhostTrack,
    LiveReference,
    ReferenceArrow,
    ghost_arrows,
    ghost_tracks,
    live_reference,
    robot_models,
)
from process_visualizer.runs.comparison.good_runs import GoodRuns

LINE = 'ghost'
_NO_ROBOT = ('The live run is not compared: {} has no robot that can be followed. That takes its '
             'recorded joints, and a model in the configuration.')


class Follow(Protocol):
    """Follows live robots along a reference run, which is drawn or hidden; may block."""

    def __call__(self, reference: LiveReference, is_visible: bool) -> None:
        """Follow a reference run; one without tracks ends following."""


class GhostModel(QObject):
    """Shows the reference run of the last comparison while it is wanted and its node runs.

    Live robots are followed even while the reference run is hidden: live values are judged by
    their moment in the reference run.
    """

    changed = pyqtSignal()
    failed = pyqtSignal(str)

    def __init__(self, tasks: Tasks, compare: CompareModel, session: Session,
                 show: Callable[[Sequence[GhostTrack], Sequence[ReferenceArrow]], None],
                 follow: Follow,
                 parent: Optional[QObject] = None) -> None:
        """Set functions that may block; ``show`` without tracks and arrows hides the ghost."""
        super().__init__(parent)
        self._tasks, self._compare, self._session = tasks, compare, session
        self._show, self._follow_live = show, follow
        self._mode: Optional[Mode] = None
        self._devices: Tuple[Device, ...] = ()  # running ones; others have no frames
        self._is_wanted = True
        self._shown: Tuple[Optional[Compared], bool] = (None, True)
        self._node_may_draw = self._must_clear = False
        compare.changed.connect(self._follow)
        session.run_changed.connect(self._follow_run)

    @property
    def is_wanted(self) -> bool:
        """Return whether the operator wants to see the ghost."""
        return self._is_wanted

    def set_wanted(self, is_wanted: bool) -> None:
        """Show or hide the ghost."""
        self._is_wanted = is_wanted
        self._follow()
        self.changed.emit()

    def _follow_run(self) -> None:
        """Follow the mode of the node that draws; in playback, it runs beside the player."""
        mode = self._session.running_mode
        if not self._session.runs(BAG_PART if mode is Mode.PLAYBACK else FRAMES_PART):
            mode = None
        running = self._session.running
        devices = () if running is None else running.devices
        if mode is not self._mode or devices != self._devices:
            # The node may have ended, or may still show earlier tracks, which must be cleared.
            self._shown, self._must_clear = (None, True), self._node_may_draw
        self._mode, self._devices = mode, devices
        self._follow()

    def _follow(self) -> None:
        wanted = self._compare.compared, self._is_wanted
        if self._mode is None:
            return
        if not _is_same(wanted, self._shown, self._mode):
            self._send(wanted, self._fail)
        elif self._must_clear:
            self._send((None, True), _ignore_ghost_error)

    def _send(self, wanted: Tuple[Optional[Compared], bool],
              on_error: Callable[[Exception], None]) -> None:
        self._shown, self._node_may_draw, self._must_clear = wanted, wanted[0] is not None, False
        task = self._show_recorded if self._mode is Mode.PLAYBACK else self._show_live
        self._tasks.run(LINE, lambda: task(*wanted), None, on_error)

    def _show_recorded(self, compared: Optional[Compared], is_wanted: bool) -> None:
        """Show or hide the ghost in a recording; runs as a task."""
        self._show(*self._ghost(compared if is_wanted else None))

    def _ghost(self, compared: Optional[Compared]
               ) -> Tuple[Tuple[GhostTrack, ...], Tuple[ReferenceArrow, ...]]:
        cell = self._running_cell()
        if compared is None or cell is None:
            return (), ()
        wanted = cell, compared.good.reference, self._compare.of_recording, robot_models(cell)
        return ghost_tracks(*wanted), ghost_arrows(*wanted)

    def _running_cell(self) -> Optional[Cell]:
        cell = self._session.cell
        return None if cell is None else replace(cell, devices=self._devices)

    def _show_live(self, compared: Optional[Compared], is_wanted: bool) -> None:
        """Follow live robots along the reference run; runs as a task."""
        cell, reference = self._running_cell(), LiveReference(())
        if compared is not None and cell is not None:
            reference = live_reference(cell, compared.good.reference)
            if not reference.tracks:
                raise GhostError(_NO_ROBOT.format(compared.good.reference.name))
        self._follow_live(reference, is_wanted)

    def _fail(self, error: Exception) -> None:
        if not isinstance(error, GhostError):
            raise error
        self.failed.emit(str(error))


def _ignore_ghost_error(error: Exception) -> None:
    """Ignore a GhostError: a node that has ended, or is only starting, draws nothing."""
    if not isinstance(error, GhostError):
        raise error


def _is_same(one: Tuple[Optional[Compared], bool], other: Tuple[Optional[Compared], bool],
             mode: Mode) -> bool:
    """Return whether the node shows the same for both."""
    if one[0] is None and other[0] is None:
        return True
    if mode is Mode.PLAYBACK and not one[1] and not other[1]:
        return True
    is_same = one[0] is other[0] if mode is Mode.PLAYBACK else _good_of(one) is _good_of(other)
    return is_same and one[1] == other[1]


def _good_of(wanted: Tuple[Optional[Compared], bool]) -> Optional[GoodRuns]:
    """Return the good runs; live robots do not depend on the runs that are judged."""
    return None if wanted[0] is None else wanted[0].good
