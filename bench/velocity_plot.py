# SPDX-License-Identifier: BSD-3-Clause
"""Draws velocities over time as a .png file: the difference of two samples beside the estimate."""
from __future__ import annotations

from typing import Any, Dict

import numpy as np
from png_painter import GRID_COLOR, TEXT_COLOR, draw_text, png_painter
from PyQt5.QtCore import QPointF, QRectF, Qt
from PyQt5.QtGui import QColor, QPainter, QPen, QPolygonF

AXIS, AXIS_NAME = 1, 'y'  # along the table, where the tool moves most
WIDTH, ROW_HEIGHT, HEADER, FOOTER = 1200, 130, 70, 34
_LEFT, _GAP, _SPACE = 110, 24, 10
_LIMIT_M_PER_S = 0.6
_TICKS_M_PER_S = (-0.4, 0.0, 0.4)
_TWO_COLOR, _ESTIMATE_COLOR = QColor('#c92a2a'), QColor('#2b8a3e')
_TRUTH_COLOR = QColor('#1c1c1c')


def write_plot(path: str, rows: Dict[str, Any]) -> None:
    """Write the plot: for each name the estimate and the difference of two samples."""
    with png_painter(path, WIDTH, HEADER + len(rows) * ROW_HEIGHT + FOOTER) as painter:
        _Plot(painter).draw(rows)


class _Plot:
    """Two columns of panels with one time axis for all."""

    def __init__(self, painter: QPainter) -> None:
        self._painter = painter
        self._panel_width = (WIDTH - _LEFT - 2 * _GAP) / 2
        self._begin_s, self._end_s = 0.0, 1.0

    def draw(self, rows: Dict[str, Any]) -> None:
        known = np.concatenate([estimate.time_s for estimate, _ in rows.values()])
        self._begin_s, self._end_s = float(known.min()), float(known.max())
        self._header()
        for number, (name, (estimate, two)) in enumerate(rows.items()):
            top = HEADER + number * ROW_HEIGHT
            self._text(QRectF(8, top, _LEFT - 62, ROW_HEIGHT - _SPACE), name, 13, bold=True)
            self._panel(self._rect(0, top), two, _TWO_COLOR)
            self._panel(self._rect(1, top), estimate, _ESTIMATE_COLOR)
        self._time_axis(HEADER + len(rows) * ROW_HEIGHT)

    def _rect(self, column: int, top: float) -> QRectF:
        return QRectF(_LEFT + column * (self._panel_width + _GAP), top, self._panel_width,
                      ROW_HEIGHT - _SPACE)

    def _header(self) -> None:
        self._text(QRectF(8, 4, WIDTH - 16, 28), f'Velocity v{AXIS_NAME} of the lower tool in m/s, '
                   'live and played; the thin black line is the truth', 13, bold=True)
        titles = ('difference of two positions (thesis, equation 5.1)', 'this package')
        for column, title in enumerate(titles):
            rect = self._rect(column, 36)
            self._text(QRectF(rect.left(), 36, rect.width(), 30), title, 13,
                       (_TWO_COLOR, _ESTIMATE_COLOR)[column], bold=True)

    def _panel(self, rect: QRectF, series: Any, color: QColor) -> None:
        painter = self._painter
        painter.setPen(QPen(GRID_COLOR, 1))
        painter.drawRect(rect)
        for tick in _TICKS_M_PER_S:
            y = self._y(rect, tick)
            painter.setPen(QPen(GRID_COLOR, 1))
            painter.drawLine(QPointF(rect.left(), y), QPointF(rect.right(), y))
            if rect.left() == _LEFT:
                self._text(QRectF(_LEFT - 54, y - 10, 48, 20), f'{tick:+.1f}' if tick else '0', 10,
                           align=Qt.AlignRight)
        painter.setClipRect(rect)
        order = np.argsort(series.time_s, kind='stable')
        times_s = series.time_s[order]
        self._line(rect, times_s, series.value[order, AXIS], color, 1.6)
        self._line(rect, times_s, series.truth[order, AXIS], _TRUTH_COLOR, 0.7)
        painter.setClipping(False)

    def _line(self, rect: QRectF, times_s: np.ndarray, values: np.ndarray, color: QColor,
              width: float) -> None:
        self._painter.setPen(QPen(color, width))
        points = [QPointF(self._x(rect, time_s), self._y(rect, float(value)))
                  for time_s, value in zip(times_s, np.clip(values, -9.0, 9.0))]
        self._painter.drawPolyline(QPolygonF(points))

    def _time_axis(self, top: float) -> None:
        for column in (0, 1):
            rect = self._rect(column, top)
            for tick_s in range(int(np.ceil(self._begin_s / 5) * 5), int(self._end_s) + 1, 5):
                x = self._x(rect, tick_s)
                self._text(QRectF(x - 40, top - _SPACE, 80, 20), f'{tick_s} s', 10,
                           align=Qt.AlignHCenter)

    def _x(self, rect: QRectF, time_s: float) -> float:
        share = (time_s - self._begin_s) / (self._end_s - self._begin_s)
        return float(rect.left() + share * rect.width())

    def _y(self, rect: QRectF, value: float) -> float:
        return float(rect.center().y() - 0.5 * rect.height() * value / _LIMIT_M_PER_S)

    def _text(self, rect: QRectF, text: str, points: int, color: QColor = TEXT_COLOR,
              bold: bool = False, align: int = Qt.AlignLeft) -> None:
        draw_text(self._painter, rect, text, points - 2, color, bold, align)
