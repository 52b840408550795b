# SPDX-License-Identifier: BSD-3-Clause
"""The values of the process variables at the position, read from the recording."""
from __future__ import annotations

import math
from typing import Callable, Dict, NamedTuple, Optional, Sequence, Tuple

from PyQt5.QtCore import QObject, QTimer, pyqtSignal

from process_visualizer.bagio.bag_errors import BagError
from process_visualizer.cell.model import Device
from process_visualizer.curves.position_values import Key, PositionValues
from process_visualizer.gui.playback.playback_model import PlaybackModel
from process_visualizer.gui.toolkit.tasks import NewestCall, Tasks

LINE = 'values'
PERIOD_MS = 100
"""Time between two readings while the position moves; nobody reads numbers faster."""
_HELD_S = 0.3
"""Maximum age, in real time, of the values shown while playing [s]."""
_SAME_S = 1e-6

Read = Callable[[Sequence[str], Sequence[Device]], PositionValues]


class Played(NamedTuple):
    """The files that are played, and their devices.

    ``copy_number`` distinguishes copies of the same name.
    """

    paths: Tuple[str, ...] = ()
    devices: Tuple[Device, ...] = ()
    copy_number: int = 0


class _Wish(NamedTuple):
    played: Played
    position_s: float


class _Found(NamedTuple):
    wish: _Wish
    values: Dict[Key, Optional[float]]


class ValuesModel(QObject):
    """Reads the values at the position; values of other positions are shown only while playing."""

    changed = pyqtSignal()
    _read = pyqtSignal(object)

    def __init__(self, tasks: Tasks, playback: PlaybackModel, played: Callable[[], Played],
                 line: str = LINE, open_values: Read = PositionValues,
                 parent: Optional[QObject] = None) -> None:
        """Set a function that returns what is played; call ``follow`` when that has changed.

        ``line`` is the line of tasks in which values are read.
        """
        super().__init__(parent)
        self._tasks, self._playback, self._played = tasks, playback, played
        self._open = open_values
        self._found: Optional[_Found] = None
        self._asked: Optional[_Wish] = None
        self._reader: Optional[PositionValues] = None  # used only in the line of tasks
        self._reads_of = Played()
        self._read.connect(self._take)
        self._reads = NewestCall(tasks, line, self._read_values, lambda: None, _raise)
        self._rest = QTimer(self, interval=PERIOD_MS, singleShot=True)
        self._rest.timeout.connect(self.follow)
        playback.moved.connect(self.follow)

    def value(self, key: Key) -> Optional[float]:
        """Return a curve's value at the position; NaN without a value, None if not yet known."""
        found = self._found
        if found is None or found.wish.played != self._played():
            return None
        held_s = _HELD_S * abs(self._playback.rate) if self._playback.state.is_playing else 0.0
        if abs(found.wish.position_s - self._playback.position_s) > held_s + _SAME_S:
            return None
        value = found.values.get(key)
        return math.nan if value is None else value

    def follow(self) -> None:
        """Request the values at the position, after a pause if others were requested just now."""
        wish = _Wish(self._played(), self._playback.position_s)
        if wish != self._asked and not self._rest.isActive() and wish.played.paths:
            self._asked = wish
            self._rest.start()
            self._reads.request(wish)

    def _read_values(self, wish: _Wish) -> None:
        """Read the requested values; runs as a task."""
        try:
            self._read.emit(_Found(wish, self._opened(wish).at(wish.position_s)))
        except (BagError, OSError):
            self._read.emit(_Found(wish, {}))  # the curves show why reading fails

    def _opened(self, wish: _Wish) -> PositionValues:
        played = wish.played
        if self._reader is None or self._reads_of != played:
            if self._reader is not None:
                self._reader.close()
                self._reader = None
            self._reader, self._reads_of = self._open(played.paths, played.devices), played
        return self._reader

    def _take(self, found: _Found) -> None:
        self._found = found
        self.changed.emit()


def _raise(error: Exception) -> None:
    raise error
