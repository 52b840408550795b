# SPDX-License-Identifier: BSD-3-Clause
"""Keeps a picture of each lane of the timeline, drawn without blocking the window."""
from __future__ import annotations

import time
from typing import Callable, Dict, List, Optional, Sequence, Set, Tuple

from PyQt5.QtGui import QPixmap

from process_visualizer.curves.value_scale import EMPTY_SCALE, ValueScale
from process_visualizer.gui.toolkit.theme import theme
from process_visualizer.gui.views.lanes.lane_look import LaneLook
from process_visualizer.gui.views.lanes.lane_picture import lane_picture
from process_visualizer.gui.views.lanes.lane_scale import Scales, visible_part, visible_scales
from process_visualizer.gui.views.lanes.timeline_lanes import Lane

_TURN_S = 0.008  # half a frame of a screen: no longer are lanes drawn without a break


class LanePictures:
    """Each time some lanes are drawn; until its turn comes, a lane has its old picture."""

    def __init__(self, clock_s: Callable[[], float] = time.perf_counter) -> None:
        self._clock_s = clock_s
        self._lanes: Tuple[Lane, ...] = ()
        self._looks: Tuple[LaneLook, ...] = ()
        self._theme = theme()
        self._pictures: Dict[int, QPixmap] = {}
        self._scales: Dict[int, Scales] = {}
        self._drawn: Set[int] = set()
        self._turns: Dict[int, int] = {}  # when each was drawn last, as a count of all

    def set_lanes(self, lanes: Sequence[Lane]) -> None:
        """Set new lanes, without pictures yet."""
        self._lanes, self._looks = tuple(lanes), ()
        self._pictures, self._scales = {}, {}

    def update_lanes(self, lanes: Sequence[Lane]) -> None:
        """Set newer values; if the lanes are the same, they keep their scales and pictures."""
        if [it.arrangement for it in lanes] != [it.arrangement for it in self._lanes]:
            self.set_lanes(lanes)
        self._lanes = tuple(lanes)
        self._drawn.clear()

    def want(self, looks: Sequence[LaneLook]) -> None:
        """Set the wanted look of each lane."""
        if (tuple(looks), theme()) != (self._looks, self._theme):
            self._looks, self._theme = tuple(looks), theme()
            self._drawn.clear()

    def missing(self, rows: Sequence[int]) -> List[int]:
        """Return those lanes that do not look as wanted, the one drawn longest ago at first."""
        return sorted((row for row in rows if not self._looks or row not in self._drawn),
                      key=lambda row: self._turns.get(row, 0))

    def draw(self, rows: Sequence[int]) -> List[int]:
        """Draw missing lanes, as many as there is time for, at least one; return which."""
        begin_s = self._clock_s()
        drawn: List[int] = []
        for row in self.missing(rows):
            if not self._looks or (drawn and self._clock_s() - begin_s > _TURN_S):
                break
            self._draw(row, self._looks[row])
            drawn.append(row)
        return drawn

    def picture(self, row: int) -> Optional[QPixmap]:
        """Return the picture of a lane, perhaps in another size; None before it is drawn."""
        return self._pictures.get(row)

    def scale(self, row: int, curve: int = 0) -> ValueScale:
        """Return the scale of a curve in the picture of a lane."""
        name = self._lanes[row].curves[curve].scale_name if row < len(self._lanes) else ()
        return self._scales.get(row, {}).get(name, EMPTY_SCALE)

    def _draw(self, row: int, look: LaneLook) -> None:
        lane = self._lanes[row]
        parts = [visible_part(curve, look) for curve in lane.curves]
        self._scales[row] = visible_scales(lane, parts, self._scales.get(row, {}))
        self._pictures[row] = lane_picture(lane, look, parts, self._scales[row])
        self._drawn.add(row)
        self._turns[row] = max(self._turns.values(), default=0) + 1
