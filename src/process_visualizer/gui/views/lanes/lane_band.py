# SPDX-License-Identifier: BSD-3-Clause
"""Draws what good runs do behind a curve, and where the run departs from it."""
from __future__ import annotations

from typing import List, Tuple

import numpy as np
from PyQt5.QtCore import QPointF, QRectF
from PyQt5.QtGui import QColor, QImage, QPainter, QPolygonF

from process_visualizer.curves.value_scale import ValueScale
from process_visualizer.gui.toolkit.colours import readable_colour
from process_visualizer.gui.toolkit.theme import theme
from process_visualizer.gui.views.lanes.covered_dots import (
    MOST_OPAQUE,
    OPACITIES,
    covered_dots,
)
from process_visualizer.gui.views.lanes.lane_look import LaneLook
from process_visualizer.gui.views.lanes.lane_scale import LINE, VisiblePart, extremes, value_y
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
    painter.drawImage(rect, _area_picture(VisiblePart(low, high), rect, scale, look.dots, area,
                                          0.0 if is_shared else _HALO_PX / 2))
    painter.setPen(line)
    for begin, end in _stretches(~np.isnan(low)):
        x = rect.left() + (np.arange(begin, end) + 0.5) * step
        painter.drawPolyline(QPolygonF(_points(x, 0.5 * (low + high)[begin:end], rect, scale)))
    painter.restore()


def _area_picture(part: VisiblePart, rect: QRectF, scale: ValueScale, dots: float, colour: QColor,
                  halo_px: float) -> QImage:
    """Return the area of a band with its halo; a wide pen would take four times as long."""
    rows = int(rect.height() * dots)
    known = ~np.isnan(part.low)
    upper, lower = (
        ((LINE / 2 + (scale.high - np.where(known, values, 0.0)) / scale.span
          * (rect.height() - LINE) + away) * dots).clip(-1.0, rows + 1.0).astype(np.float32)
        for values, away in ((part.high, -halo_px), (part.low, halo_px)))
    upper[~known] = lower[~known]
    opaque = (covered_dots(upper, lower, rows) * MOST_OPAQUE + 0.5).astype(np.uint8)
    data = opaque.tobytes()
    image = QImage(data, opaque.shape[1], rows, opaque.shape[1],
                   QImage.Format_Indexed8)
    image.setColorTable([
        QColor(colour.red(), colour.green(), colour.blue(),
               colour.alpha() * step // MOST_OPAQUE).rgba() for step in range(OPACITIES)])
    return image.copy()  # the bytes belong to nobody else afterwards


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
