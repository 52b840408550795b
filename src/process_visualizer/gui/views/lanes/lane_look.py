# SPDX-License-Identifier: BSD-3-Clause
"""The sizes of a lane: lines of text above, one for each curve, and the curves below them."""
from __future__ import annotations

import math
from typing import NamedTuple, Sequence, Tuple

from PyQt5.QtCore import QRectF
from PyQt5.QtGui import QFont

from process_visualizer.gui.toolkit.time_axis import TimeAxis
from process_visualizer.gui.views.lanes.timeline_lanes import Lane

SIDE = 12.0  # px right of the axis, for the scroll bar
TEXT_HEIGHT = 15  # of a line of text
BELOW = 5  # px: between a curve and the next lane
LANE_HEIGHT = 46  # of a lane with one curve, at least, if lanes have to be scrolled anyway
SHRINKAGE = 14  # px: by how much each lane can shrink so that all are visible
GROWTH = 26  # px: by how much a lane can grow for each of its curves
_FOLDED_BELOW = 2


class LaneLook(NamedTuple):
    """The appearance of a lane: the axis and the size [px] of the whole lane.

    ``dots`` is how many dots a pixel of the screen has; ``length_s`` is that of the recording, of
    which the axis may show only a part. ``texts`` is the number of lines of text.
    """

    axis: TimeAxis
    width: int
    height: int
    dots: float
    font: QFont
    length_s: float
    texts: int = 1

    @property
    def curve_rect(self) -> QRectF:
        """The place of the curves."""
        top = self.texts * TEXT_HEIGHT
        return QRectF(self.axis.left, top, self.axis.width, max(self.height - top - BELOW, 0))

    @property
    def shares(self) -> Tuple[float, float]:
        """Return which part of the recording is shown, from 0 to 1."""
        if self.length_s <= 0.0:
            return 0.0, 1.0
        return (self.axis.begin_s / self.length_s,
                (self.axis.begin_s + self.axis.duration_s) / self.length_s)


def least_height(lane: Lane) -> int:
    """Return the height [px] that a lane needs."""
    texts = len(lane.curves) * TEXT_HEIGHT
    return texts + (_FOLDED_BELOW if lane.is_folded else LANE_HEIGHT - TEXT_HEIGHT)


def growth(lane: Lane) -> int:
    """Return for how many curves a lane can grow if there is room."""
    return 0 if lane.is_folded else len(lane.curves)


def heights(lanes: Sequence[Lane], room: int) -> Tuple[int, ...]:
    """Return the heights [px] of lanes in a room [px].

    They grow if there is more room than they need, and shrink a little if all are visible then.
    """
    needed = [least_height(lane) for lane in lanes]
    spare = room - sum(needed)
    if spare >= 0:
        more = min(spare // max(sum(map(growth, lanes)), 1), GROWTH)
        return tuple(it + more * growth(lane) for it, lane in zip(needed, lanes))
    less = math.ceil(-spare / max(sum(not lane.is_folded for lane in lanes), 1))
    if less > SHRINKAGE:
        return tuple(needed)
    return tuple(it if lane.is_folded else it - less for it, lane in zip(needed, lanes))
