# SPDX-License-Identifier: BSD-3-Clause
"""The visible part of a lane's curves, and their scales: by their units."""
from __future__ import annotations

from typing import Dict, List, Mapping, NamedTuple, Optional, Sequence, Tuple

import numpy as np
from PyQt5.QtCore import QRectF

from process_visualizer.curves.value_scale import ValueScale, tidy_scale, with_near_limits
from process_visualizer.gui.views.lanes.lane_look import LaneLook
from process_visualizer.gui.views.lanes.timeline_lanes import Lane

LINE = 1.3  # px: how thick a curve is at least
NUMBER_HEIGHT = 10.0  # px: of a line with a number of the scale

Scales = Mapping[Tuple[str, ...], ValueScale]
"""By the name that curves with a common scale share (``Lane.scale_name``)."""


class VisiblePart(NamedTuple):
    """The extreme values in each column of dots; NaN where there is none."""

    low: np.ndarray
    high: np.ndarray


def visible_part(curve: Lane, look: LaneLook) -> VisiblePart:
    """Return what can be seen of a curve, without holes between its columns."""
    columns = max(int(look.curve_rect.width() * look.dots), 0)
    return _connected(*extremes(curve.low, curve.high, columns, look.shares))


def visible_scales(lane: Lane, parts: Sequence[VisiblePart], before: Scales) -> Scales:
    """Return the scales of what can be seen of each curve; ``before`` are the last ones."""
    sharing: Dict[Tuple[str, ...], List[Tuple[Lane, VisiblePart]]] = {}
    for curve, part in zip(lane.curves, parts):
        sharing.setdefault(curve.scale_name, []).append((curve, part))
    return {name: _scale(seen, before.get(name)) for name, seen in sharing.items()}


def _scale(seen: Sequence[Tuple[Lane, VisiblePart]], before: Optional[ValueScale]) -> ValueScale:
    ends = [with_near_limits(float(np.nanmin(part.low)), float(np.nanmax(part.high)),
                             curve.limit_values)
            for curve, part in seen if not np.isnan(part.low).all()]
    if not ends:
        return tidy_scale(float('nan'), float('nan'), before=before)
    return tidy_scale(min(low for low, _ in ends), max(high for _, high in ends),
                      max(curve.least_span for curve, _ in seen), before)


def range_text(scale: ValueScale, unit: str) -> str:
    """Return the ends of a scale that no numbers at the left tell."""
    return f'[{scale.low:.4g} … {scale.high:.4g} {unit}'.replace('-', '−').rstrip() + ']'


def value_y(value: float, rect: QRectF, scale: ValueScale) -> float:
    """Return the middle of the line at a value [px]."""
    return float(rect.top() + LINE / 2 + (scale.high - value) / scale.span * (rect.height() - LINE))


def number_bottoms(lines: Sequence[float], highest: float, lowest: float) -> Dict[int, float]:
    """Return where numbers beside lines at heights [px] end below, by their places in ``lines``.

    None is above ``highest`` or below ``lowest``. Where there is no room for all, those of the
    first and the last line come first.
    """
    bottoms: Dict[int, float] = {}
    for row in sorted(range(len(lines)), key=lambda it: it not in (0, len(lines) - 1)):
        bottom = min(max(lines[row] + NUMBER_HEIGHT / 2, highest), lowest)
        if all(abs(bottom - other) >= NUMBER_HEIGHT - 1.0 for other in bottoms.values()):
            bottoms[row] = bottom
    return bottoms


def extremes(low: np.ndarray, high: np.ndarray, count: int,
             shares: Tuple[float, float]) -> Tuple[np.ndarray, np.ndarray]:
    """Return the extremes of a part of columns (its ends from 0 to 1) in ``count`` columns."""
    columns = len(low)
    if columns == 0 or count == 0:
        return np.full(count, np.nan), np.full(count, np.nan)
    edges = (np.linspace(*shares, count + 1) * columns + 1e-6).astype(np.int64)
    begins = np.minimum(edges[:-1], columns - 1)
    end = max(int(edges[-1]), int(begins[-1]) + 1)
    return (np.fmin.reduceat(low[:end], begins), np.fmax.reduceat(high[:end], begins))


def _connected(low: np.ndarray, high: np.ndarray) -> VisiblePart:
    """The extremes of columns, each extended to the previous one so that there are no holes."""
    joined_low, joined_high = low.copy(), high.copy()
    joined_low[1:] = np.fmin(low[1:], high[:-1])
    joined_high[1:] = np.fmax(high[1:], low[:-1])
    unknown = np.isnan(low)
    joined_low[unknown] = joined_high[unknown] = np.nan
    return VisiblePart(joined_low, joined_high)
