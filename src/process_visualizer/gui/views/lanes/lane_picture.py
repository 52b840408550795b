# SPDX-License-Identifier: BSD-3-Clause
"""Draws the curves of a lane: the values, their scale, and the limits."""
from __future__ import annotations

from typing import List, Sequence

import numpy as np
from PyQt5.QtCore import QRectF, Qt
from PyQt5.QtGui import QColor, QFont, QImage, QPainter, QPixmap

from process_visualizer.cell.model import WarningLimits
from process_visualizer.curves.value_scale import ValueScale, tick_texts
from process_visualizer.gui.toolkit.colours import readable_colour
from process_visualizer.gui.toolkit.theme import theme
from process_visualizer.gui.toolkit.time_axis import TimeAxis
from process_visualizer.gui.views.lanes.covered_dots import (
    MOST_OPAQUE,
    OPACITIES,
    covered_dots,
)
from process_visualizer.gui.views.lanes.lane_band import draw_band, draw_departures
from process_visualizer.gui.views.lanes.lane_look import BELOW, TEXT_HEIGHT, LaneLook
from process_visualizer.gui.views.lanes.lane_scale import (
    LINE,
    NUMBER_HEIGHT,
    Scales,
    VisiblePart,
    number_bottoms,
    value_y,
    visible_part,
    visible_scales,
)
from process_visualizer.gui.views.lanes.timeline_lanes import Lane

_SOFT = 0.18  # opacity of the area between curve and zero
_LIMIT_ALPHA = 150
_NUMBER_PX, _BESIDE = 9, 4.0
_OVERLAP = 3.0  # px: of a number's line with that of the unit, which is higher than its letters


def lane_picture(lane: Lane, look: LaneLook, parts: Sequence[VisiblePart],
                 scales: Scales) -> QPixmap:
    """Return the picture of a lane, without its names and values.

    ``parts`` is what can be seen of each curve.
    """
    picture = _empty_picture(look.width, look.height, look.dots)
    painter = QPainter(picture)
    painter.fillRect(QRectF(0.0, 0.0, look.axis.right, 1.0), QColor(theme().line))
    if not lane.is_folded:
        painter.setFont(look.font)
        _draw_scale(painter, lane, look.curve_rect, scales)
        for curve in lane.curves:
            draw_band(painter, curve, look, scales[curve.scale_name], bool(lane.overlaid))
        for curve, part in zip(lane.curves, parts):
            is_alone = not lane.overlaid and lane.band is None  # a band is not to be hidden
            _draw_curve(painter, curve, look, part, scales[curve.scale_name], is_alone)
            _draw_limits(painter, curve, look.curve_rect, scales[curve.scale_name],
                         bool(lane.overlaid))
        draw_departures(painter, lane, look)
    painter.end()
    return picture


def _empty_picture(width: int, height: int, dots: float) -> QPixmap:
    picture = QPixmap(int(width * dots), int(height * dots))
    picture.setDevicePixelRatio(dots)
    picture.fill(Qt.transparent)
    return picture


def curve_picture(curve: Lane, width: int, height: int, dots: float) -> QPixmap:
    """Return the curve of a whole recording alone, in a size [px]."""
    look = LaneLook(TimeAxis(1.0, 0.0, width), width, height + TEXT_HEIGHT + BELOW, dots, QFont(),
                    1.0)
    part = visible_part(curve, look)
    picture = _empty_picture(width, height, dots)
    painter = QPainter(picture)
    painter.translate(0.0, -TEXT_HEIGHT)
    _draw_curve(painter, curve, look, part,
                visible_scales(curve, [part], {})[curve.scale_name], curve.band is None)
    painter.end()
    return picture


def _draw_scale(painter: QPainter, lane: Lane, rect: QRectF, scales: Scales) -> None:
    """Draw the unit, and below it the numbers with their lines, those of the first curve.

    They have its colour if other curves have another scale.
    """
    right, scale = rect.left() - _BESIDE, scales[lane.scale_name]
    colour = QColor(theme().quiet) if len(scales) == 1 else readable_colour(lane.colour)
    painter.setPen(colour)
    painter.drawText(QRectF(0.0, 1.0, right, TEXT_HEIGHT - 1),
                     Qt.AlignRight | Qt.AlignVCenter, lane.unit)
    font = QFont(painter.font())
    font.setPixelSize(_NUMBER_PX)
    painter.setFont(font)
    lines = [value_y(tick, rect, scale) for tick in scale.ticks]
    bottoms = number_bottoms(lines, rect.top() + NUMBER_HEIGHT - _OVERLAP, rect.bottom() + BELOW)
    for row, (tick, text) in enumerate(zip(scale.ticks, tick_texts(scale))):
        painter.fillRect(QRectF(rect.left(), round(lines[row]), rect.width(), 1.0),
                         QColor(theme().line if tick == 0.0 else theme().grid))
        if row in bottoms:
            painter.drawText(QRectF(0.0, bottoms[row] - NUMBER_HEIGHT, right, NUMBER_HEIGHT),
                             Qt.AlignRight | Qt.AlignVCenter, text)


def _draw_curve(painter: QPainter, curve: Lane, look: LaneLook, part: VisiblePart,
                scale: ValueScale, is_filled: bool) -> None:
    """Draw the values from low to high in full colour; filled: paler between them and 0, too."""
    rect = look.curve_rect
    dots = _opacity(part, scale, int(rect.height() * look.dots), LINE * look.dots,
                    _SOFT if is_filled else 0.0)
    if not dots.size:
        return
    if curve.limits is not None:
        dots += OPACITIES * _beyond(part, curve.limits, scale, len(dots))
    data = dots.tobytes()
    image = QImage(data, dots.shape[1], dots.shape[0], dots.shape[1], QImage.Format_Indexed8)
    image.setColorTable(_colours(curve))
    painter.drawImage(rect, image)


def _beyond(part: VisiblePart, limits: WarningLimits, scale: ValueScale,
            rows: int) -> np.ndarray:
    """Return which dots (rows, columns; 0 or 1) are beyond a limit, where the value is, too."""
    value = scale.high - scale.span * (np.arange(rows)[:, None] + 0.5) / max(rows, 1)
    beyond = np.zeros((rows, len(part.low)), bool)
    if limits.high is not None:
        beyond |= (value > limits.high) & (part.high > limits.high)
    if limits.low is not None:
        beyond |= (value < limits.low) & (part.low < limits.low)
    return beyond.astype(np.uint8)


def _colours(curve: Lane) -> List[int]:
    """The colour of a curve with each opacity, and the one beyond its limits."""
    beyond = curve.colour if curve.limits is None else curve.limits.color
    opacity = np.rint(np.arange(OPACITIES) * (255 / MOST_OPAQUE)).astype(np.uint32) << 24
    colours: List[int] = np.concatenate([
        opacity | (readable_colour(colour).rgb() & 0xffffff) for colour in (curve.colour, beyond)
    ]).tolist()
    return colours


def _draw_limits(painter: QPainter, curve: Lane, rect: QRectF, scale: ValueScale,
                 is_shared: bool) -> None:
    """Draw lines; in a shared lane their colour says of which curve they are."""
    if curve.limits is None:
        return
    line = readable_colour(curve.colour if is_shared else curve.limits.color)
    line.setAlpha(_LIMIT_ALPHA)
    for limit in curve.limit_values:
        if scale.low <= limit <= scale.high:
            painter.fillRect(QRectF(rect.left(), round(value_y(limit, rect, scale)), rect.width(),
                                    1.0), line)


def _opacity(part: VisiblePart, scale: ValueScale, rows: int, line: float,
             soft: float) -> np.ndarray:
    """The opacity (rows, columns) of each dot, in steps; ``line`` is the thickness in dots.

    That between the values and 0 is ``soft`` (0 to 1).
    """
    dots = max(rows - line, 0.0) / scale.span  # per unit of the value
    known = ~np.isnan(part.low)
    high, low = (np.where(known, it, 0.0) for it in (part.high, part.low))
    upper = ((scale.high - high) * dots).clip(-1.0, rows).astype(np.float32)
    lower = ((scale.high - low) * dots + line).clip(0.0, rows + 1.0).astype(np.float32)
    lower[~known] = upper[~known]
    covered = covered_dots(upper, lower, rows)
    if soft:
        zero = np.float32((scale.high - min(max(0.0, scale.low), scale.high)) * dots)
        body = covered_dots(np.where(known, np.minimum(upper, zero), upper),
                        np.where(known, np.maximum(lower, zero), upper), rows)
        body *= np.float32(soft)
        np.maximum(covered, body, out=covered)
    covered *= np.float32(MOST_OPAQUE)
    covered += np.float32(0.5)
    return covered.astype(np.uint8)
