# SPDX-License-Identifier: BSD-3-Clause
"""The curves of process variables, each drawn as a picture in its own lane."""
from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Tuple

import numpy as np
from PyQt5.QtCore import QPointF, QRectF, Qt
from PyQt5.QtGui import QColor, QFont, QFontMetricsF, QImage, QPainter, QPen, QPixmap

from process_visualizer.curves.position_values import Key
from process_visualizer.gui.toolkit.colours import readable_colour
from process_visualizer.gui.toolkit.style import LINE
from process_visualizer.gui.toolkit.time_axis import TimeAxis

LANE_HEIGHT, MOST_LANE_HEIGHT = 42, 72
TEXT_HEIGHT = 15  # the part of a lane above its curve
VALUES_WIDTH = 150  # px: for the numbers at the right
_LINE = 1.3  # px: how thick a curve is at least
_SOFT = 0.18
_HELD_INTERVALS, _HELD_S = 4, 0.3  # a value holds for so many usual intervals, or so long
_FAR_FROM_ZERO = 0.7  # of the largest value: if all are beyond it, zero is not shown


@dataclass(frozen=True, eq=False)
class Lane:
    """A process variable over the whole recording, which is divided into columns of equal time.

    ``low`` and ``high`` are the extreme values in each column, NaN where there is none; ``key`` is
    used to find the value at the position.
    """

    label: str
    unit: str
    colour: Tuple[float, float, float]
    low: np.ndarray
    high: np.ndarray
    key: Key = ('', '', '')

    def at(self, share: float) -> float:
        """Return the value at a part (0 to 1) of the recording; NaN where there is none."""
        column = min(int(share * len(self.low)), len(self.low) - 1)
        return float(self.low[column] + self.high[column]) / 2 if column >= 0 else float('nan')

    @property
    def largest(self) -> float:
        """Return the value that is farthest from zero; NaN if there is none."""
        low, high = self.extent
        return low if abs(low) > abs(high) else high

    @cached_property
    def extent(self) -> Tuple[float, float]:
        """The least and the greatest value; NaN if there is none."""
        known = ~np.isnan(self.low)
        if not known.any():
            return float('nan'), float('nan')
        return float(self.low[known].min()), float(self.high[known].max())


def lane_of(label: str, unit: str, colour: Tuple[float, float, float], low: np.ndarray,
            high: np.ndarray, column_s: float) -> Lane:
    """Return a lane; between messages of a slow topic the last value holds.

    Only gaps much longer than usual stay empty. ``column_s`` is the duration of a column [s].
    """
    known = np.flatnonzero(~np.isnan(low))
    if len(known) < 2:
        return Lane(label, unit, colour, low, high)
    longest = max(_HELD_INTERVALS * float(np.median(np.diff(known))), _HELD_S / column_s)
    held = np.maximum.accumulate(np.where(np.isnan(low), -1, np.arange(len(low))))
    holds = (held >= 0) & (np.arange(len(low)) - held <= longest)
    return Lane(label, unit, colour, np.where(holds, low[held], np.nan),
                np.where(holds, high[held], np.nan))


def number_text(value: float, largest: float) -> str:
    """Return a value with the decimals that the largest one of its lane needs; a dash for NaN."""
    if np.isnan(value):
        return '–'
    size = max(abs(largest), 1e-3)
    decimals = min(max(2 - math.floor(math.log10(size)), 0), 4)
    return f'{round(value, decimals) + 0.0:.{decimals}f}'.replace('-', '−')


def lane_picture(lane: Lane, axis: TimeAxis, width: int, height: int, scale: float,
                 font: QFont, length_s: float) -> QPixmap:
    """Return a lane in a size [px]; ``scale`` is how many dots a pixel of the screen has.

    ``length_s`` is that of the recording; the axis may show only a part.
    """
    picture = QPixmap(int(width * scale), int(height * scale))
    picture.setDevicePixelRatio(scale)
    picture.fill(Qt.transparent)
    painter = QPainter(picture)
    painter.setFont(font)
    painter.setPen(QPen(QColor(LINE), 1))
    painter.drawLine(QPointF(axis.left, 0.5), QPointF(axis.left + axis.width, 0.5))
    shares = _shares(axis, length_s)
    _draw_curve(painter, lane, QRectF(axis.left, TEXT_HEIGHT, axis.width,
                                      height - TEXT_HEIGHT - 3), scale, shares)
    _draw_label(painter, lane, QRectF(axis.left, 1, max(axis.width - VALUES_WIDTH, 40.0),
                                      TEXT_HEIGHT))
    painter.end()
    return picture


def _draw_label(painter: QPainter, lane: Lane, rect: QRectF) -> None:
    painter.setPen(readable_colour(lane.colour))
    text = QFontMetricsF(painter.font()).elidedText(lane.label, Qt.ElideMiddle, rect.width())
    painter.drawText(rect, Qt.AlignLeft | Qt.AlignVCenter, text)


def _shares(axis: TimeAxis, length_s: float) -> Tuple[float, float]:
    """Which part of the recording an axis shows, from 0 to 1."""
    if length_s <= 0.0:
        return 0.0, 1.0
    return axis.begin_s / length_s, (axis.begin_s + axis.duration_s) / length_s


def _draw_curve(painter: QPainter, lane: Lane, rect: QRectF, scale: float,
                shares: Tuple[float, float]) -> None:
    """Draw the values from low to high in full colour, and paler the area between them and 0."""
    columns, rows = int(rect.width() * scale), int(rect.height() * scale)
    if columns <= 0:
        return
    low, high = _connected(*_resampled(lane, columns, shares))
    if np.isnan(low).all():
        return
    bottom, top = value_range(*lane.extent)
    dots = (rows - _LINE * scale) / (top - bottom)  # per unit of the value
    y_high, y_low = (top - high) * dots, (top - low) * dots + _LINE * scale
    zero = np.full(columns, (top - min(max(0.0, bottom), top)) * dots)
    body = _covered(np.fmin(y_high, zero), np.fmax(y_low, zero), rows)
    alpha = np.maximum(_covered(y_high, y_low, rows), _SOFT * body)
    painter.drawImage(rect, _image(alpha, readable_colour(lane.colour)))


def _covered(upper: np.ndarray, lower: np.ndarray, rows: int) -> np.ndarray:
    """How much (0 to 1) of each dot (rows, columns) lies between two curves; 0 where one is NaN."""
    row = np.arange(rows)[:, None]
    covered = np.minimum(row + 1, lower) - np.maximum(row, upper)
    return np.nan_to_num(np.clip(covered, 0.0, 1.0))


def _image(alpha: np.ndarray, colour: QColor) -> QImage:
    """An image of one colour with an alpha (0 to 1) for each dot."""
    rows, columns = alpha.shape
    parts = np.array([colour.blueF(), colour.greenF(), colour.redF(), 1.0])
    dots = np.rint(255.0 * alpha[:, :, None] * parts).astype(np.uint8).tobytes()
    return QImage(dots, columns, rows, 4 * columns, QImage.Format_ARGB32_Premultiplied).copy()


def value_range(low: float, high: float) -> Tuple[float, float]:
    """Return the values at the bottom and the top of a lane whose curve reaches from low to high.

    The range includes zero, unless all values are far from it.
    """
    if np.isnan(low):
        return 0.0, 1.0
    if low > 0.0 and low < _FAR_FROM_ZERO * high:
        low = 0.0
    if high < 0.0 and high > _FAR_FROM_ZERO * low:
        high = 0.0
    if low == high:
        low, high = (min(low, 0.0), max(high, 0.0)) if low else (0.0, 1.0)
    return low, high


def _resampled(lane: Lane, count: int,
               shares: Tuple[float, float]) -> Tuple[np.ndarray, np.ndarray]:
    """The extremes of a part of the lane, given by its ends (0 to 1), in so many columns."""
    columns = len(lane.low)
    if columns == 0:
        return np.full(count, np.nan), np.full(count, np.nan)
    edges = (np.linspace(*shares, count + 1) * columns + 1e-6).astype(np.int64)
    begins = np.minimum(edges[:-1], columns - 1)
    end = max(int(edges[-1]), int(begins[-1]) + 1)
    return (np.fmin.reduceat(lane.low[:end], begins), np.fmax.reduceat(lane.high[:end], begins))


def _connected(low: np.ndarray, high: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
    """The extremes of columns, each extended to the previous one so that there are no holes."""
    joined_low, joined_high = low.copy(), high.copy()
    joined_low[1:] = np.fmin(low[1:], high[:-1])
    joined_high[1:] = np.fmax(high[1:], low[:-1])
    unknown = np.isnan(low)
    joined_low[unknown] = joined_high[unknown] = np.nan
    return joined_low, joined_high
