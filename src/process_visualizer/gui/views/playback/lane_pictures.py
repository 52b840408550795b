# SPDX-License-Identifier: BSD-3-Clause
"""Keeps a picture of each lane of the timeline, drawn without blocking the window."""
from __future__ import annotations

import time
from typing import Dict, List, Optional, Sequence, Tuple

from PyQt5.QtCore import QObject, QTimer, pyqtSignal
from PyQt5.QtGui import QPixmap

from process_visualizer.curves.value_scale import EMPTY_SCALE, ValueScale
from process_visualizer.gui.views.playback.lane_picture import (
    LaneLook,
    lane_picture,
    visible_part,
    visible_scale,
)
from process_visualizer.gui.views.playback.timeline_lanes import Lane

_TURN_S = 0.008  # half a frame of a screen: no longer are lanes drawn without a break


class LanePictures(QObject):
    """In each turn of the event loop some lanes are drawn; until then their old pictures stay."""

    drawn = pyqtSignal(int)
    """The picture of a lane is ready."""

    def __init__(self, parent: Optional[QObject] = None) -> None:
        super().__init__(parent)
        self._lanes: Tuple[Lane, ...] = ()
        self._look: Optional[LaneLook] = None
        self._pictures: Dict[int, QPixmap] = {}
        self._scales: Dict[int, ValueScale] = {}
        self._missing: List[int] = []
        self._timer = QTimer(self)
        self._timer.setInterval(0)
        self._timer.timeout.connect(self._draw_next)

    @property
    def are_ready(self) -> bool:
        """Whether all lanes look as wanted."""
        return not self._missing

    def set_lanes(self, lanes: Sequence[Lane]) -> None:
        """Set new lanes, without pictures yet."""
        self._lanes, self._look, self._missing = tuple(lanes), None, []
        self._pictures, self._scales = {}, {}

    def want(self, look: LaneLook) -> None:
        """Set the wanted look of each lane."""
        if look != self._look:
            self._look, self._missing = look, list(range(len(self._lanes)))
            self._timer.start()

    def picture(self, row: int) -> Optional[QPixmap]:
        """Return the picture of a lane, perhaps in another size; None before it is drawn."""
        return self._pictures.get(row)

    def scale(self, row: int) -> ValueScale:
        """Return the scale in the picture of a lane."""
        return self._scales.get(row, EMPTY_SCALE)

    def draw_some(self) -> Tuple[int, ...]:
        """Draw missing pictures, as many as there is time for, at least one; return which."""
        begin_s = time.perf_counter()
        rows: List[int] = []
        while self._missing and self._look is not None:
            rows.append(self._missing.pop(0))
            self._draw(rows[-1], self._look)
            if time.perf_counter() - begin_s > _TURN_S:
                break
        return tuple(rows)

    def _draw_next(self) -> None:
        for row in self.draw_some():
            self.drawn.emit(row)
        if not self._missing:
            self._timer.stop()

    def _draw(self, row: int, look: LaneLook) -> None:
        lane = self._lanes[row]
        part = visible_part(lane, look)
        self._scales[row] = visible_scale(lane, part, self._scales.get(row))
        self._pictures[row] = lane_picture(lane, look, part, self._scales[row])
