# SPDX-License-Identifier: BSD-3-Clause
"""Draws what good runs do behind a curve, and where the run departs from it."""
from __future__ import annotations

from typing import List, Tuple

import numpy as np
from PyQt5.QtCore import QPointF, QRectF
from PyQt5.QtGui import QColor, QPainter, QPen, QPolygonF

from process_visualizer.curves.value_scale import ValueScale
from process_visualizer.gui.toolkit.colours import readable_colour
from process_visualizer.gui.toolkit.theme import theme
from process_visualizer.gui.views.lanes.lane_look import LaneLook
from process_visualizer.gui.views.lanes.lane_scale import extremes, value_y
from process_visualizer.gui.views.lanes.timeline_lanes import Lane

_DEPARTED_PX = 2.0
_HALO_PX = 6.0  # a band that is narrower than the curve's line is seen beside it
_SHARED_ALPHA, _SHARED_LINE_ALPHA = 45, 120  # of a band in the colour of its curve


def draw_band(painter: QPainter, curve: Lane, look: LaneLook, scale: ValueScale,
              is_shared: bool) -> None:
    """Draw what good runs do behind the curve, and their middle as a thin line.

    In a shared lane it has the colour of its curve.
    """
    rect, band = look.curve_rect, curve.band
    count = max(int(rect.width() * look.dots), 0)
    if band is None or not count:
        return
    low, high = extremes(band.low, band.high, count, look.shares)
    step = rect.width() / count
    area, line = _colours(curve, is_shared)
    painter.save()
    painter.setClipRect(rect)
    for begin, end in _stretches(~np.isnan(low)):
        x = rect.left() + (np.arange(begin, end) + 0.5) * step
        ends = [_points(x, values[begin:end], rect, scale) for values in (low, high)]
        painter.setPen(QPen(area, 0.0 if is_shared else _HALO_PX))
        painter.setBrush(area)
        painter.drawPolygon(QPolygonF(ends[0] + ends[1][::-1]))
        painter.setPen(line)
        painter.drawPolyline(QPolygonF(_points(x, 0.5 * (low + high)[begin:end], rect, scale)))
    painter.restore()


def draw_departures(painter: QPainter, lane: Lane, look: LaneLook) -> None:
    """Draw a red line above the curves where one departs; in a shared lane its colour is below."""
    rect = look.curve_rect
    count, is_shared = max(int(rect.width() * look.dots), 0), bool(lane.overlaid)
    for row, curve in enumerate(lane.curves):
        if curve.band is None or not count:
            continue
        _, departed = extremes(curve.band.departed, curve.band.departed, count, look.shares)
        step = rect.width() / count
        for begin, end in _stretches(departed > 0.0):
            place = QRectF(rect.left() + begin * step, rect.top() - _DEPARTED_PX,
                           max((end - begin) * step, 1.0), _DEPARTED_PX)
            painter.fillRect(place, QColor(theme().bad))
            if is_shared:
                painter.fillRect(place.translated(0.0, (row + 1) * _DEPARTED_PX),
                                 readable_colour(curve.colour))


def _colours(curve: Lane, is_shared: bool) -> Tuple[QColor, QColor]:
    """Those of the band and of its middle."""
    if not is_shared:
        return QColor(theme().band), QColor(theme().band_line)
    area, line = readable_colour(curve.colour), readable_colour(curve.colour)
    area.setAlpha(_SHARED_ALPHA)
    line.setAlpha(_SHARED_LINE_ALPHA)
    return area, line


def _points(x: np.ndarray, values: np.ndarray, rect: QRectF,
            scale: ValueScale) -> List[QPointF]:
    return [QPointF(at, value_y(value, rect, scale))
            for at, value in zip(x.tolist(), values.tolist())]


def _stretches(is_in: np.ndarray) -> List[Tuple[int, int]]:
    """The rows of each stretch that is true, the end not included."""
    edges = np.flatnonzero(np.diff(np.concatenate(([False], is_in, [False])).astype(np.int8)))
    return [(int(begin), int(end)) for begin, end in edges.reshape(-1, 2)]
