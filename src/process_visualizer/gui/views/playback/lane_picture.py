# SPDX-License-Identifier: BSD-3-Clause
"""Draws a curve in its lane: the values, their scale, and the limits."""
from __future__ import annotations

from typing import List, NamedTuple, Optional, Tuple

import numpy as np
from PyQt5.QtCore import QPointF, QRectF, Qt
from PyQt5.QtGui import QColor, QFont, QImage, QPainter, QPixmap, QPolygonF

from process_visualizer.cell.model import WarningLimits
from process_visualizer.curves.value_scale import (
    ValueScale,
    tick_texts,
    tidy_scale,
    with_near_limits,
)
from process_visualizer.gui.toolkit.colours import readable_colour
from process_visualizer.gui.toolkit.theme import theme
from process_visualizer.gui.toolkit.time_axis import TimeAxis
from process_visualizer.gui.views.playback.timeline_lanes import Lane

LANE_HEIGHT, MOST_LANE_HEIGHT = 46, 72
TEXT_HEIGHT = 15  # the part of a lane above its curve
_BELOW = 5  # px: between a curve and the next lane
_LINE = 1.3  # px: how thick a curve is at least
_OPACITIES = 128  # steps of opacity, from transparent to opaque
_MOST_OPAQUE = _OPACITIES - 1
_SOFT = 0.18  # opacity of the area between curve and zero
_LIMIT_ALPHA = 150
_DEPARTED_PX = 2.0
_HALO_PX = 6.0  # a band that is narrower than the curve's line is seen beside it
_NUMBER_PX, _NUMBER_HEIGHT, _BESIDE = 9, 10.0, 4.0


class LaneLook(NamedTuple):
    """What a lane shows: the axis and the size [px] of the whole lane.

    ``dots`` is how many dots a pixel of the screen has; ``length_s`` is that of the recording, of
    which the axis may show only a part.
    """

    axis: TimeAxis
    width: int
    height: int
    dots: float
    font: QFont
    length_s: float

    @property
    def curve_rect(self) -> QRectF:
        """The place of the curve."""
        return QRectF(self.axis.left, TEXT_HEIGHT, self.axis.width,
                      self.height - TEXT_HEIGHT - _BELOW)

    @property
    def shares(self) -> Tuple[float, float]:
        """Which part of the recording is shown, from 0 to 1."""
        if self.length_s <= 0.0:
            return 0.0, 1.0
        return (self.axis.begin_s / self.length_s,
                (self.axis.begin_s + self.axis.duration_s) / self.length_s)


class VisiblePart(NamedTuple):
    """The extreme values in each column of dots; NaN where there is none."""

    low: np.ndarray
    high: np.ndarray


def visible_part(lane: Lane, look: LaneLook) -> VisiblePart:
    """Return what can be seen of a lane, without holes between its columns."""
    columns = max(int(look.curve_rect.width() * look.dots), 0)
    return _connected(*_resampled(lane, columns, look.shares))


def visible_scale(lane: Lane, part: VisiblePart,
                  before: Optional[ValueScale] = None) -> ValueScale:
    """Return the scale of what can be seen; ``before`` is that of the last picture."""
    known = ~np.isnan(part.low)
    if not known.any():
        return tidy_scale(float('nan'), float('nan'), before=before)
    ends = with_near_limits(float(part.low[known].min()), float(part.high[known].max()),
                            lane.limit_values)
    return tidy_scale(*ends, lane.least_span, before)


def lane_picture(lane: Lane, look: LaneLook, part: VisiblePart, scale: ValueScale) -> QPixmap:
    """Return the picture of a lane, without its name and values."""
    picture = QPixmap(int(look.width * look.dots), int(look.height * look.dots))
    picture.setDevicePixelRatio(look.dots)
    picture.fill(Qt.transparent)
    painter = QPainter(picture)
    painter.fillRect(QRectF(0.0, 0.0, look.axis.right, 1.0), QColor(theme().line))
    painter.setFont(look.font)
    _draw_scale(painter, lane.unit, look.curve_rect, scale)
    _draw_band(painter, lane, look, scale)
    _draw_curve(painter, lane, look, part, scale)
    _draw_limits(painter, lane, look.curve_rect, scale)
    painter.end()
    return picture


def curve_picture(lane: Lane, width: int, height: int, dots: float) -> QPixmap:
    """Return the curve of a whole recording alone, in a size [px]."""
    look = LaneLook(TimeAxis(1.0, 0.0, width), width, height + TEXT_HEIGHT + _BELOW, dots, QFont(),
                    1.0)
    part = visible_part(lane, look)
    picture = QPixmap(int(width * dots), int(height * dots))
    picture.setDevicePixelRatio(dots)
    picture.fill(Qt.transparent)
    painter = QPainter(picture)
    painter.translate(0.0, -TEXT_HEIGHT)
    _draw_curve(painter, lane, look, part, visible_scale(lane, part))
    painter.end()
    return picture


def value_y(value: float, rect: QRectF, scale: ValueScale) -> float:
    """Return the middle of the line at a value [px]."""
    return float(rect.top() + _LINE / 2
                 + (scale.high - value) / scale.span * (rect.height() - _LINE))


def _draw_scale(painter: QPainter, unit: str, rect: QRectF, scale: ValueScale) -> None:
    """Draw the unit, and below it the numbers with their lines."""
    right = rect.left() - _BESIDE
    painter.setPen(QColor(theme().quiet))
    painter.drawText(QRectF(0.0, 1.0, right, TEXT_HEIGHT - 1),
                     Qt.AlignRight | Qt.AlignVCenter, unit)
    font = QFont(painter.font())
    font.setPixelSize(_NUMBER_PX)
    painter.setFont(font)
    free_below = rect.bottom() + _BELOW  # the numbers are drawn from the lowest one on
    for tick, text in zip(scale.ticks, tick_texts(scale)):
        y = value_y(tick, rect, scale)
        painter.fillRect(QRectF(rect.left(), round(y), rect.width(), 1.0),
                         QColor(theme().line if tick == 0.0 else theme().grid))
        bottom = min(max(y + _NUMBER_HEIGHT / 2, TEXT_HEIGHT + _NUMBER_HEIGHT), free_below)
        if bottom > y - 1.0:
            painter.setPen(QColor(theme().quiet))
            painter.drawText(QRectF(0.0, bottom - _NUMBER_HEIGHT, right, _NUMBER_HEIGHT),
                             Qt.AlignRight | Qt.AlignVCenter, text)
            free_below = bottom - _NUMBER_HEIGHT


def _draw_band(painter: QPainter, lane: Lane, look: LaneLook, scale: ValueScale) -> None:
    """Draw what good runs do behind the curve, and a red line above where the run departs.

    Their middle is a thin line.
    """
    rect, band = look.curve_rect, lane.band
    count = max(int(rect.width() * look.dots), 0)
    if band is None or not count:
        return
    low, high = _extremes(band.low, band.high, count, look.shares)
    _, departed = _extremes(band.departed, band.departed, count, look.shares)
    step = rect.width() / count
    painter.save()
    painter.setClipRect(rect)
    _draw_band_area(painter, VisiblePart(low, high), rect, scale, look.dots)
    for begin, end in _stretches(~np.isnan(low)):
        x = rect.left() + (np.arange(begin, end) + 0.5) * step
        painter.setPen(QColor(theme().band_line))
        painter.drawPolyline(QPolygonF(_points(x, 0.5 * (low + high)[begin:end], rect, scale)))
    painter.restore()
    for begin, end in _stretches(departed > 0.0):
        painter.fillRect(QRectF(rect.left() + begin * step, rect.top() - _DEPARTED_PX,
                                max((end - begin) * step, 1.0), _DEPARTED_PX),
                         QColor(theme().bad))


def _draw_band_area(painter: QPainter, part: VisiblePart, rect: QRectF, scale: ValueScale,
                    dots: float) -> None:
    """Draw the area of a band with its halo; an image, as a wide pen takes four times as long."""
    rows, halo = int(rect.height() * dots), _HALO_PX / 2
    known = ~np.isnan(part.low)
    upper, lower = (
        ((_LINE / 2 + (scale.high - np.where(known, values, 0.0)) / scale.span
          * (rect.height() - _LINE) + away) * dots).clip(-1.0, rows + 1.0).astype(np.float32)
        for values, away in ((part.high, -halo), (part.low, halo)))
    upper[~known] = lower[~known]
    opaque = (_covered(upper, lower, rows) * _MOST_OPAQUE + 0.5).astype(np.uint8)
    data, colour = opaque.tobytes(), QColor(theme().band)
    image = QImage(data, opaque.shape[1], rows, opaque.shape[1], QImage.Format_Indexed8)
    image.setColorTable([
        QColor(colour.red(), colour.green(), colour.blue(),
               colour.alpha() * step // _MOST_OPAQUE).rgba() for step in range(_OPACITIES)])
    painter.drawImage(rect, image)


def _points(x: np.ndarray, values: np.ndarray, rect: QRectF,
            scale: ValueScale) -> List[QPointF]:
    return [QPointF(at, value_y(value, rect, scale))
            for at, value in zip(x.tolist(), values.tolist())]


def _stretches(is_in: np.ndarray) -> List[Tuple[int, int]]:
    """The rows of each stretch that is true, the end not included."""
    edges = np.flatnonzero(np.diff(np.concatenate(([False], is_in, [False])).astype(np.int8)))
    return [(int(begin), int(end)) for begin, end in edges.reshape(-1, 2)]


def _draw_curve(painter: QPainter, lane: Lane, look: LaneLook, part: VisiblePart,
                scale: ValueScale) -> None:
    """Draw the values from low to high in full colour, and paler the area between them and 0.

    A band is not hidden by the paler area.
    """
    rect = look.curve_rect
    dots = _opacity(part, scale, int(rect.height() * look.dots), _LINE * look.dots,
                    _SOFT if lane.band is None else 0.0)
    if not dots.size:
        return
    if lane.limits is not None:
        dots += _OPACITIES * _beyond(part, lane.limits, scale, len(dots))
    data = dots.tobytes()
    image = QImage(data, dots.shape[1], dots.shape[0], dots.shape[1], QImage.Format_Indexed8)
    image.setColorTable(_colours(lane))
    painter.drawImage(rect, image)


def _beyond(part: VisiblePart, limits: WarningLimits, scale: ValueScale,
            rows: int) -> np.ndarray:
    """Which dots (rows, columns; 0 or 1) are beyond a limit, where the value is, too."""
    value = scale.high - scale.span * (np.arange(rows)[:, None] + 0.5) / max(rows, 1)
    beyond = np.zeros((rows, len(part.low)), bool)
    if limits.high is not None:
        beyond |= (value > limits.high) & (part.high > limits.high)
    if limits.low is not None:
        beyond |= (value < limits.low) & (part.low < limits.low)
    return beyond.astype(np.uint8)


def _colours(lane: Lane) -> List[int]:
    """The colour of a lane with each opacity, and the one beyond its limits."""
    beyond = lane.colour if lane.limits is None else lane.limits.color
    opacity = np.rint(np.arange(_OPACITIES) * (255 / _MOST_OPAQUE)).astype(np.uint32) << 24
    colours: List[int] = np.concatenate([
        opacity | (readable_colour(colour).rgb() & 0xffffff) for colour in (lane.colour, beyond)
    ]).tolist()
    return colours


def _draw_limits(painter: QPainter, lane: Lane, rect: QRectF, scale: ValueScale) -> None:
    if lane.limits is None:
        return
    line = QColor(readable_colour(lane.limits.color))
    line.setAlpha(_LIMIT_ALPHA)
    for limit in lane.limit_values:
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
    zero = np.float32((scale.high - min(max(0.0, scale.low), scale.high)) * dots)
    body = _covered(np.where(known, np.minimum(upper, zero), upper),
                    np.where(known, np.maximum(lower, zero), upper), rows)
    body *= np.float32(soft)
    covered = np.maximum(_covered(upper, lower, rows), body, out=body)
    covered *= np.float32(_MOST_OPAQUE)
    covered += np.float32(0.5)
    return covered.astype(np.uint8)


def _covered(upper: np.ndarray, lower: np.ndarray, rows: int) -> np.ndarray:
    """How much (0 to 1) of each dot (rows, columns) lies between two curves."""
    row = np.arange(rows, dtype=np.float32)[:, None]
    covered = _below(lower, row)
    covered -= _below(upper, row)
    return covered


def _below(ends: np.ndarray, row: np.ndarray) -> np.ndarray:
    """How much (0 to 1) of each dot lies above an end."""
    covered = ends - row
    np.maximum(covered, np.float32(0.0), out=covered)
    return np.minimum(covered, np.float32(1.0), out=covered)


def _resampled(lane: Lane, count: int,
               shares: Tuple[float, float]) -> Tuple[np.ndarray, np.ndarray]:
    """The extremes of a part of the lane, given by its ends (0 to 1), in so many columns."""
    return _extremes(lane.low, lane.high, count, shares)


def _extremes(low: np.ndarray, high: np.ndarray, count: int,
              shares: Tuple[float, float]) -> Tuple[np.ndarray, np.ndarray]:
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
