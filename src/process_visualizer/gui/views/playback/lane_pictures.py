# SPDX-License-Identifier: BSD-3-Clause
"""Keeps a picture of each lane of the timeline, drawn without blocking the window."""
from __future__ import annotations

from typing import Any, Dict, List, Optional, Sequence, Tuple

from PyQt5.QtCore import QObject, QTimer, pyqtSignal
from PyQt5.QtGui import QFont, QPixmap

from process_visualizer.gui.toolkit.time_axis import TimeAxis
from process_visualizer.gui.views.playback.timeline_lanes import Lane, lane_picture


class LanePictures(QObject):
    """One lane is drawn in each turn of the event loop; until then its old picture stays."""

    drawn = pyqtSignal(int)
    """The picture of a lane is ready."""

    def __init__(self, parent: Optional[QObject] = None) -> None:
        super().__init__(parent)
        self._lanes: Tuple[Lane, ...] = ()
        self._look: Tuple[Any, ...] = ()
        self._pictures: Dict[int, QPixmap] = {}
        self._missing: List[int] = []
        self._timer = QTimer(self)
        self._timer.setInterval(0)
        self._timer.timeout.connect(self._draw_next)

    def set_lanes(self, lanes: Sequence[Lane]) -> None:
        """Set new lanes, without pictures yet."""
        self._lanes, self._look, self._pictures = tuple(lanes), (), {}

    def want(self, axis: TimeAxis, width: int, height: int, scale: float, font: QFont,
             length_s: float) -> None:
        """Set the wanted look of each lane: see ``lane_picture``."""
        look = (axis, width, height, scale, font, length_s)
        if look != self._look:
            self._look, self._missing = look, list(range(len(self._lanes)))
            self._timer.start()

    def picture(self, row: int) -> Optional[QPixmap]:
        """Return the picture of a lane, perhaps in another size; None before it is drawn."""
        return self._pictures.get(row)

    def _draw_next(self) -> None:
        if not self._missing or not self._look:
            self._timer.stop()
            return
        row = self._missing.pop(0)
        self._pictures[row] = lane_picture(self._lanes[row], *self._look)
        self.drawn.emit(row)
