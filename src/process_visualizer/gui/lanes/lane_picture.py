# SPDX-License-Identifier: BSD-3-Clause
"""Drawing of the curves of a lane: the values, their scale, and the limits."""
from __future__ import annotations

import time
from typing import Callable, Dict, List, Optional, Sequence, Set, Tuple

import numpy as np
from PyQt5.QtCore import QPointF, QRectF, Qt
from PyQt5.QtGui import QColor, QFont, QImage, QPainter, QPixmap, QPolygonF

from process_visualizer.cell.model import WarningLimits
from process_visualizer.curves.value_scale import EMPTY_SCALE, ValueScale, tick_texts
from process_visualizer.gui.lanes.lane_scale import (
    BELOW,
    LINE,
    NUMBER_HEIGHT,
    TEXT_HEIGHT,
    LaneLook,
    Scales,
    VisiblePart,
    extremes,
    number_bottoms,
    value_y,
    visible_part,
    visible_scales,
)
from process_visualizer.gui.lanes.timeline_lanes import Lane
from process_visualizer.gui.toolkit.theme import readable_color, theme
from process_visualizer.gui.toolkit.time_axis import TimeAxis

OPACITIES = 128  # steps of opacity, from transparent to opaque
MAX_OPAQUE = OPACITIES - 1


def covered_dots(upper: np.ndarray, lower: np.ndarray, rows: int) -> np.ndarray:
    """Return the part (0 to 1) of each dot (rows, columns) that lies between two curves.

    The curves, (columns,) each, are in dots from the top.
    """
    row = np.arange(rows, dtype=np.float32)[:, None]
    covered = _below(lower, row)
    covered -= _below(upper, row)
    return covered


def _below(ends: np.ndarray, row: np.ndarray) -> np.ndarray:
    """Return the part (0 to 1) of each dot that lies above a curve."""
    covered = ends - row
    np.maximum(covered, np.float32(0.0), out=covered)
    return np.minimum(covered, np.float32(1.0), out=covered)


_DEPARTED_PX = 2.0
_HALO_PX = 6.0  # makes a band visible that is narrower than the curve's line
_SHARED_ALPHA, _SHARED_LINE_ALPHA = 45, 120  # of a band in the color of its curve


def draw_band(painter: QPainter, curve: Lane, look: LaneLook, part: VisiblePart,
              scale: ValueScale, is_shared: bool) -> None:
    """Draw the band of good runs behind a curve, and the middle of the band as a thin line.

    In a shared lane the band has the color of its curve.
    """
    rect = look.curve_rect
    if part.band is None or not len(part.low):
        return
    low, high = part.band
    step = rect.width() / len(low)
    area, line = _band_colors(curve, is_shared)
    painter.save()
    painter.setClipRect(rect)
    painter.drawImage(rect, _area_picture(VisiblePart(low, high), rect, scale, look.dots, area,
                                          0.0 if is_shared else _HALO_PX / 2))
    painter.setPen(line)
    for begin, end in _stretches(~np.isnan(low)):
        x = rect.left() + (np.arange(begin, end) + 0.5) * step
        middle = 0.5 * (low + high)[begin:end]
        painter.drawPolyline(QPolygonF([QPointF(at, value_y(value, rect, scale))
                                        for at, value in zip(x.tolist(), middle.tolist())]))
    painter.restore()


def _area_picture(part: VisiblePart, rect: QRectF, scale: ValueScale, dots: float, color: QColor,
                  halo_px: float) -> QImage:
    """Return a picture of a band with its halo; a wide pen would take four times as long."""
    rows = int(rect.height() * dots)
    known = ~np.isnan(part.low)
    upper, lower = (
        ((LINE / 2 + (scale.high - np.where(known, values, 0.0)) / scale.span
          * (rect.height() - LINE) + away) * dots).clip(-1.0, rows + 1.0).astype(np.float32)
        for values, away in ((part.high, -halo_px), (part.low, halo_px)))
    upper[~known] = lower[~known]
    opaque = (covered_dots(upper, lower, rows) * MAX_OPAQUE + 0.5).astype(np.uint8)
    data = opaque.tobytes()
    image = QImage(data, opaque.shape[1], rows, opaque.shape[1],
                   QImage.Format_Indexed8)
    image.setColorTable([
        QColor(color.red(), color.green(), color.blue(),
               color.alpha() * step // MAX_OPAQUE).rgba() for step in range(OPACITIES)])
    return image.copy()  # QImage does not keep ``data`` alive


def draw_departures(painter: QPainter, lane: Lane, look: LaneLook) -> None:
    """Draw a red line above departures; in a shared lane also one in the curve's color below.

    They are below the names, which would cover them.
    """
    rect = look.curve_rect
    count, is_shared = max(int(rect.width() * look.dots), 0), bool(lane.overlaid)
    for row, curve in enumerate(lane.curves):
        if curve.band is None or not count:
            continue
        _, departed = extremes(curve.band.departed, curve.band.departed, count, look.shares)
        step = rect.width() / count
        for begin, end in _stretches(departed > 0.0):
            place = QRectF(rect.left() + begin * step, rect.top(),
                           max((end - begin) * step, 1.0), _DEPARTED_PX)
            painter.fillRect(place, QColor(theme().bad))
            if is_shared:
                painter.fillRect(place.translated(0.0, (row + 1) * _DEPARTED_PX),
                                 readable_color(curve.color))


def _band_colors(curve: Lane, is_shared: bool) -> Tuple[QColor, QColor]:
    """Return the colors of a band and of its middle line."""
    if not is_shared:
        return QColor(theme().band), QColor(theme().band_line)
    area, line = readable_color(curve.color), readable_color(curve.color)
    area.setAlpha(_SHARED_ALPHA)
    line.setAlpha(_SHARED_LINE_ALPHA)
    return area, line


def _stretches(is_in: np.ndarray) -> List[Tuple[int, int]]:
    """Return begin and end (exclusive) of each stretch of true values."""
    edges = np.flatnonzero(np.diff(np.concatenate(([False], is_in, [False])).astype(np.int8)))
    return [(int(begin), int(end)) for begin, end in edges.reshape(-1, 2)]


_SOFT = 0.18  # opacity of the area between curve and zero
_LIMIT_ALPHA = 150
_NUMBER_PX, _BESIDE = 9, 4.0
_OVERLAP = 3.0  # px by which a number may overlap the unit's line, which is higher than its text


def lane_picture(lane: Lane, look: LaneLook, parts: Sequence[VisiblePart],
                 scales: Scales) -> QPixmap:
    """Return the picture of a lane, without its names and values.

    ``parts`` are the visible parts of its curves.
    """
    picture = _empty_picture(look.width, look.height, look.dots)
    painter = QPainter(picture)
    painter.fillRect(QRectF(0.0, 0.0, look.axis.right, 1.0), QColor(theme().line))
    if not lane.is_folded:
        painter.setFont(look.font)
        _draw_scale(painter, lane, look.curve_rect, scales)
        for curve, part in zip(lane.curves, parts):
            draw_band(painter, curve, look, part, scales[curve.scale_name], bool(lane.overlaid))
        for curve, part in zip(lane.curves, parts):
            is_alone = not lane.overlaid and lane.band is None  # a filled area would hide the band
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
    """Return a picture of a given size [px] with only the curve of a whole recording."""
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
    """Draw the unit of the first curve, and below it the numbers of its scale with their lines.

    Unit and numbers have the curve's color if other curves have another scale.
    """
    right, scale = rect.left() - _BESIDE, scales[lane.scale_name]
    color = QColor(theme().quiet) if len(scales) == 1 else readable_color(lane.color)
    painter.setPen(color)
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
    """Draw the values from low to high; if filled, also a paler area between them and 0."""
    rect = look.curve_rect
    dots = _opacity(part, scale, int(rect.height() * look.dots), LINE * look.dots,
                    _SOFT if is_filled else 0.0)
    if not dots.size:
        return
    if curve.limits is not None:
        dots += OPACITIES * _beyond(part, curve.limits, scale, len(dots))
    data = dots.tobytes()
    image = QImage(data, dots.shape[1], dots.shape[0], dots.shape[1], QImage.Format_Indexed8)
    image.setColorTable(_colors(curve))
    painter.drawImage(rect, image)


def _beyond(part: VisiblePart, limits: WarningLimits, scale: ValueScale,
            rows: int) -> np.ndarray:
    """Return 1 for each dot (rows, columns) beyond a limit in a column whose value is beyond it."""
    value = scale.high - scale.span * (np.arange(rows)[:, None] + 0.5) / max(rows, 1)
    beyond = np.zeros((rows, len(part.low)), bool)
    if limits.high is not None:
        beyond |= (value > limits.high) & (part.high > limits.high)
    if limits.low is not None:
        beyond |= (value < limits.low) & (part.low < limits.low)
    return beyond.astype(np.uint8)


def _colors(curve: Lane) -> List[int]:
    """Return a curve's color, then the color beyond its limits, each in all opacities."""
    beyond = curve.color if curve.limits is None else curve.limits.color
    opacity = np.rint(np.arange(OPACITIES) * (255 / MAX_OPAQUE)).astype(np.uint32) << 24
    colors: List[int] = np.concatenate([
        opacity | (readable_color(color).rgb() & 0xffffff) for color in (curve.color, beyond)
    ]).tolist()
    return colors


def _draw_limits(painter: QPainter, curve: Lane, rect: QRectF, scale: ValueScale,
                 is_shared: bool) -> None:
    """Draw lines at the limits; in a shared lane they have the color of the curve."""
    if curve.limits is None:
        return
    line = readable_color(curve.color if is_shared else curve.limits.color)
    line.setAlpha(_LIMIT_ALPHA)
    for limit in curve.limit_values:
        if scale.low <= limit <= scale.high:
            painter.fillRect(QRectF(rect.left(), round(value_y(limit, rect, scale)), rect.width(),
                                    1.0), line)


def _opacity(part: VisiblePart, scale: ValueScale, rows: int, line: float,
             soft: float) -> np.ndarray:
    """Return the opacity (rows, columns) of each dot, in steps; ``line`` is the thickness in dots.

    ``soft`` (0 to 1) is the opacity between the values and 0.
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
    covered *= np.float32(MAX_OPAQUE)
    covered += np.float32(0.5)
    return covered.astype(np.uint8)


_TURN_S = 0.008  # maximum time for drawing lanes without a break: half a frame of a screen


class LanePictures:
    """Pictures of lanes; a few are drawn at a time, and the others keep their old picture."""

    def __init__(self, clock_s: Callable[[], float] = time.perf_counter) -> None:
        self._clock_s = clock_s
        self._lanes: Tuple[Lane, ...] = ()
        self._looks: Tuple[LaneLook, ...] = ()
        self._theme = theme()
        self._pictures: Dict[int, QPixmap] = {}
        self._scales: Dict[int, Scales] = {}
        self._drawn: Set[int] = set()
        self._turns: Dict[int, int] = {}  # when each lane was drawn last, as a running number
        self._end_s = 0.0
        self._ends_s: Dict[int, float] = {}  # the end of the values in each picture

    def set_lanes(self, lanes: Sequence[Lane]) -> None:
        """Set new lanes, which have no pictures yet."""
        self._lanes, self._looks = tuple(lanes), ()
        self._pictures, self._scales = {}, {}

    def update_lanes(self, lanes: Sequence[Lane], end_s: float = 0.0) -> None:
        """Set newer values up to ``end_s``; if the arrangement is the same, pictures are kept."""
        self._end_s = end_s
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
        """Return the lanes that do not look as wanted, the one drawn longest ago first."""
        return sorted((row for row in rows if not self._looks or row not in self._drawn),
                      key=lambda row: self._turns.get(row, 0))

    def draw(self, rows: Sequence[int]) -> List[int]:
        """Draw missing lanes while there is time, but at least one; return their rows."""
        begin_s = self._clock_s()
        drawn: List[int] = []
        for row in self.missing(rows):
            if not self._looks or (drawn and self._clock_s() - begin_s > _TURN_S):
                break
            self._draw(row, self._looks[row])
            drawn.append(row)
        return drawn

    def picture(self, row: int) -> Optional[QPixmap]:
        """Return the picture of a lane, possibly in another size; None before it is drawn."""
        return self._pictures.get(row)

    def age_s(self, row: int) -> float:
        """Return how much earlier the values in the picture of a lane end than the newest [s]."""
        return self._end_s - self._ends_s.get(row, self._end_s)

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
        self._ends_s[row] = self._end_s
        self._turns[row] = max(self._turns.values(), default=0) + 1
