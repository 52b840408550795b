# SPDX-License-Identifier: BSD-3-Clause
"""Decides the heights of lanes, and the scales of their curves, one per unit."""
from __future__ import annotations

import math
from typing import Dict, List, Mapping, NamedTuple, Optional, Sequence, Tuple

import numpy as np
from PyQt5.QtCore import QRectF
from PyQt5.QtGui import QFont

from process_visualizer.curves.value_scale import ValueScale, tidy_scale, with_near_limits
from process_visualizer.gui.lanes.timeline_lanes import Lane
from process_visualizer.gui.toolkit.time_axis import TimeAxis

# The sizes of a lane: one line of text for each curve, and the curves below the texts.

SIDE = 12.0  # px to the right of the axis, for the scroll bar
TEXT_HEIGHT = 15  # of a line of text
BELOW = 5  # px: between a curve and the next lane
LANE_HEIGHT = 46  # minimum height of a lane with one curve if lanes have to be scrolled anyway
SHRINKAGE = 14  # px by which each lane may shrink to make all lanes visible
GROWTH = 26  # px by which a lane may grow for each of its curves
_FOLDED_BELOW = 2


class LaneLook(NamedTuple):
    """The appearance of a lane: its time axis and its whole size [px].

    ``dots`` is the number of dots per logical pixel. ``length_s`` is the length of the recording;
    the axis may show only a part of it. ``texts`` is the number of lines of text.
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
        """Return begin and end of the shown part of the recording, from 0 to 1."""
        if self.length_s <= 0.0:
            return 0.0, 1.0
        return (self.axis.begin_s / self.length_s,
                (self.axis.begin_s + self.axis.duration_s) / self.length_s)


def least_height(lane: Lane) -> int:
    """Return the height [px] that a lane needs."""
    texts = len(lane.curves) * TEXT_HEIGHT
    return texts + (_FOLDED_BELOW if lane.is_folded else LANE_HEIGHT - TEXT_HEIGHT)


def growth(lane: Lane) -> int:
    """Return the number of curves for which a lane can grow if there is room."""
    return 0 if lane.is_folded else len(lane.curves)


def heights(lanes: Sequence[Lane], room: int) -> Tuple[int, ...]:
    """Return the heights [px] of lanes that share a height ``room`` [px].

    Lanes grow if there is more room than they need. They shrink a little if all become visible.
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


LINE = 1.3  # px: minimum thickness of a curve
NUMBER_HEIGHT = 10.0  # px: height of a number of the scale

Scales = Mapping[Tuple[str, ...], ValueScale]
"""Scales by the name that curves with a common scale share (``Lane.scale_name``)."""


class VisiblePart(NamedTuple):
    """The extreme values in each column of dots, and those of the band; NaN without a value."""

    low: np.ndarray
    high: np.ndarray
    band: Optional[Tuple[np.ndarray, np.ndarray]] = None

    def extent(self) -> Optional[Tuple[float, float]]:
        """Return the least and the greatest value, with the band; None without values."""
        if np.isnan(self.low).all():
            return None
        low, high = self.band or (self.low, self.high)
        return (float(np.nanmin(np.concatenate((self.low, low)))),
                float(np.nanmax(np.concatenate((self.high, high)))))


def visible_part(curve: Lane, look: LaneLook) -> VisiblePart:
    """Return the visible part of a curve, without holes between its columns."""
    columns = max(int(look.curve_rect.width() * look.dots), 0)
    part = _connected(*extremes(curve.low, curve.high, columns, look.shares))
    return part if curve.band is None else part._replace(
        band=extremes(curve.band.low, curve.band.high, columns, look.shares))


def visible_scales(lane: Lane, parts: Sequence[VisiblePart], before: Scales) -> Scales:
    """Return the scales for the visible part of each curve; ``before`` are the last scales."""
    sharing: Dict[Tuple[str, ...], List[Tuple[Lane, VisiblePart]]] = {}
    for curve, part in zip(lane.curves, parts):
        sharing.setdefault(curve.scale_name, []).append((curve, part))
    return {name: _scale(seen, before.get(name)) for name, seen in sharing.items()}


def _scale(seen: Sequence[Tuple[Lane, VisiblePart]], before: Optional[ValueScale]) -> ValueScale:
    ends = [with_near_limits(*extent, curve.limit_values) for curve, extent in
            ((curve, part.extent()) for curve, part in seen) if extent is not None]
    if not ends:
        return tidy_scale(float('nan'), float('nan'), before=before)
    return tidy_scale(min(low for low, _ in ends), max(high for _, high in ends),
                      max(curve.least_span for curve, _ in seen), before)


def range_text(scale: ValueScale, unit: str) -> str:
    """Return the ends of a scale as a text, for scales without numbers at the left."""
    return f'[{scale.low:.4g} … {scale.high:.4g} {unit}'.replace('-', '−').rstrip() + ']'


def value_y(value: float, rect: QRectF, scale: ValueScale) -> float:
    """Return the y coordinate [px] of the middle of the line at a value."""
    return float(rect.top() + LINE / 2 + (scale.high - value) / scale.span * (rect.height() - LINE))


def number_bottoms(lines: Sequence[float], highest: float, lowest: float) -> Dict[int, float]:
    """Return the lower edges [px] of the numbers beside lines, by their index in ``lines``.

    Edges lie between ``highest`` and ``lowest``. If there is no room for all numbers, those of the
    first and the last line take precedence.
    """
    bottoms: Dict[int, float] = {}
    for row in sorted(range(len(lines)), key=lambda it: it not in (0, len(lines) - 1)):
        bottom = min(max(lines[row] + NUMBER_HEIGHT / 2, highest), lowest)
        if all(abs(bottom - other) >= NUMBER_HEIGHT - 1.0 for other in bottoms.values()):
            bottoms[row] = bottom
    return bottoms


def extremes(low: np.ndarray, high: np.ndarray, count: int,
             shares: Tuple[float, float]) -> Tuple[np.ndarray, np.ndarray]:
    """Return the extremes in ``count`` columns of a part (its ends, 0 to 1) of all columns."""
    columns = len(low)
    if columns == 0 or count == 0:
        return np.full(count, np.nan), np.full(count, np.nan)
    edges = (np.linspace(*shares, count + 1) * columns + 1e-6).astype(np.int64)
    begins = np.minimum(edges[:-1], columns - 1)
    end = max(int(edges[-1]), int(begins[-1]) + 1)
    return (np.fmin.reduceat(low[:end], begins), np.fmax.reduceat(high[:end], begins))


def _connected(low: np.ndarray, high: np.ndarray) -> VisiblePart:
    """Return the extremes of columns, each extended to the previous one to leave no holes."""
    joined_low, joined_high = low.copy(), high.copy()
    joined_low[1:] = np.fmin(low[1:], high[:-1])
    joined_high[1:] = np.fmax(high[1:], low[:-1])
    unknown = np.isnan(low)
    joined_low[unknown] = joined_high[unknown] = np.nan
    return VisiblePart(joined_low, joined_high)
