# SPDX-License-Identifier: BSD-3-Clause
"""Keeps a picture of each lane of the timeline, drawn without blocking the window."""
from __future__ import annotations

import time
from typing import Dict, List, Optional, Sequence, Set, Tuple

from PyQt5.QtGui import QPixmap

from process_visualizer.curves.value_scale import EMPTY_SCALE, ValueScale
from process_visualizer.gui.toolkit.theme import theme
from process_visualizer.gui.views.playback.lane_picture import (
    LaneLook,
    lane_picture,
    visible_part,
    visible_scale,
)
from process_visualizer.gui.views.playback.timeline_lanes import Lane

_TURN_S = 0.008  # half a frame of a screen: no longer are lanes drawn without a break


class LanePictures:
    """Each time some lanes are drawn; until its turn comes, a lane has its old picture."""

    def __init__(self) -> None:
        self._lanes: Tuple[Lane, ...] = ()
        self._look: Optional[LaneLook] = None
        self._theme = theme()
        self._pictures: Dict[int, QPixmap] = {}
        self._scales: Dict[int, ValueScale] = {}
        self._drawn: Set[int] = set()
        self._turns: Dict[int, int] = {}  # when each was drawn last, as a count of all

    def set_lanes(self, lanes: Sequence[Lane]) -> None:
        """Set new lanes, without pictures yet."""
        self._lanes, self._look = tuple(lanes), None
        self._pictures, self._scales = {}, {}

    def update_lanes(self, lanes: Sequence[Lane]) -> None:
        """Set newer values; if the lanes are the same, they keep their scales and pictures."""
        if [it.key for it in lanes] != [it.key for it in self._lanes]:
            self.set_lanes(lanes)
        self._lanes = tuple(lanes)
        self._drawn.clear()

    def want(self, look: LaneLook) -> None:
        """Set the wanted look of each lane."""
        if (look, theme()) != (self._look, self._theme):
            self._look, self._theme = look, theme()
            self._drawn.clear()

    def missing(self, rows: Sequence[int]) -> List[int]:
        """Return those lanes that do not look as wanted, the one drawn longest ago at first."""
        return sorted((row for row in rows if self._look is None or row not in self._drawn),
                      key=lambda row: self._turns.get(row, 0))

    def draw(self, rows: Sequence[int]) -> List[int]:
        """Draw missing lanes, as many as there is time for, at least one; return which."""
        begin_s = time.perf_counter()
        drawn: List[int] = []
        for row in self.missing(rows):
            if self._look is None or (drawn and time.perf_counter() - begin_s > _TURN_S):
                break
            self._draw(row, self._look)
            drawn.append(row)
        return drawn

    def picture(self, row: int) -> Optional[QPixmap]:
        """Return the picture of a lane, perhaps in another size; None before it is drawn."""
        return self._pictures.get(row)

    def scale(self, row: int) -> ValueScale:
        """Return the scale in the picture of a lane."""
        return self._scales.get(row, EMPTY_SCALE)

    def _draw(self, row: int, look: LaneLook) -> None:
        lane = self._lanes[row]
        part = visible_part(lane, look)
        self._scales[row] = visible_scale(lane, part, self._scales.get(row))
        self._pictures[row] = lane_picture(lane, look, part, self._scales[row])
        self._drawn.add(row)
        self._turns[row] = max(self._turns.values(), default=0) + 1
