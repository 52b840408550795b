# SPDX-License-Identifier: BSD-3-Clause
"""Draws panels of curves over time as a .png file, with levels for comparison."""
from __future__ import annotations

import math
from typing import NamedTuple, Sequence, Tuple

import numpy as np
from png_painter import GRID_COLOR, TEXT_COLOR, draw_text, png_painter
from PyQt5.QtCore import QPointF, QRectF, Qt
from PyQt5.QtGui import QColor, QPainter, QPen, QPolygonF

_WIDTH, _PANEL_HEIGHT, _HEADER, _FOOTER = 1200, 190, 40, 64
_LEFT, _RIGHT, _TITLE, _AXIS, _LEVEL_NAME = 84, 16, 26, 26, 172
LEVEL_COLOR = QColor('#c92a2a')


class Curve(NamedTuple):
    """Values (n,) at times (n,) [s]; drawn as a line or as points."""

    time_s: np.ndarray
    value: np.ndarray
    name: str = ''
    color: str = '#1864ab'
    points: bool = False


class Level(NamedTuple):
    """A value for comparison, drawn as a dashed line with its name."""

    value: float
    name: str


class Panel(NamedTuple):
    """Curves with one axis. ``ticks`` are the values with a line; the outer two end the axis."""

    title: str
    quantity: str
    curves: Sequence[Curve]
    ticks: Sequence[float]
    levels: Sequence[Level] = ()
    logarithmic: bool = False


def write_panels(path: str, title: str, rows: Sequence[Sequence[Panel]], note: str) -> None:
    """Write rows of panels, with a title above and a note below."""
    with png_painter(path, _WIDTH, _HEADER + len(rows) * _PANEL_HEIGHT + _FOOTER) as painter:
        draw_text(painter, QRectF(8, 4, _WIDTH - 16, 30), title, 12, bold=True)
        for number, row in enumerate(rows):
            width = _WIDTH / len(row)
            for column, panel in enumerate(row):
                rect = QRectF(column * width, _HEADER + number * _PANEL_HEIGHT, width,
                              _PANEL_HEIGHT)
                _PanelPainter(painter, panel, rect).draw()
        bottom = _HEADER + len(rows) * _PANEL_HEIGHT
        draw_text(painter, QRectF(8, bottom + 4, _WIDTH - 16, _FOOTER - 8), note, 9,
                  wrap=True)


class _PanelPainter:
    """Draws one panel into a rectangle."""

    def __init__(self, painter: QPainter, panel: Panel, rect: QRectF) -> None:
        self._painter, self._panel, self._outer = painter, panel, rect
        self._rect = rect.adjusted(_LEFT, _TITLE, -_RIGHT, -_AXIS)
        self._end_s = max((float(it.time_s[-1]) for it in panel.curves if len(it.time_s)),
                          default=1.0)

    def draw(self) -> None:
        self._axes()
        self._painter.setClipRect(self._rect)
        for curve in self._panel.curves:
            self._curve(curve)
        self._painter.setClipping(False)
        for level in self._panel.levels:
            self._level(level)
        self._legend()

    def _axes(self) -> None:
        title = QRectF(self._rect.left(), self._outer.top(), self._rect.width(), _TITLE)
        draw_text(self._painter, title, self._panel.title, 10, bold=True)
        for tick in self._panel.ticks:
            y = self._y(tick)
            self._line(GRID_COLOR, self._rect.left(), y, self._rect.right(), y)
            self._right_text(QRectF(self._outer.left(), y - 9, _LEFT - 6, 18), f'{tick:g}')
        step_s = 5.0 if self._end_s > 9.0 else 1.0
        for tick_s in np.arange(0.0, self._end_s, step_s):
            x = self._x(tick_s)
            self._line(GRID_COLOR, x, self._rect.top(), x, self._rect.bottom())
            draw_text(self._painter, QRectF(x - 30, self._rect.bottom() + 2, 60, 18),
                      f'{tick_s:g} s', 9, align=Qt.AlignHCenter)
        draw_text(self._painter, QRectF(self._outer.left() + 4, self._outer.top(), _LEFT, _TITLE),
                  self._panel.quantity, 9, bold=True)

    def _curve(self, curve: Curve) -> None:
        points = QPolygonF([QPointF(self._x(time_s), self._y(float(value)))
                            for time_s, value in zip(curve.time_s, curve.value)])
        self._painter.setPen(QPen(QColor(curve.color), 2.6 if curve.points else 1.4,
                                  cap=Qt.RoundCap))
        if curve.points:
            self._painter.drawPoints(points)
        else:
            self._painter.drawPolyline(points)

    def _level(self, level: Level) -> None:
        y = self._y(level.value)
        self._line(LEVEL_COLOR, self._rect.left(), y, self._rect.right(), y, Qt.DashLine)
        name = QRectF(self._rect.right() - _LEVEL_NAME, y - 18, _LEVEL_NAME, 17)
        self._painter.fillRect(name, QColor(255, 255, 255, 190))  # readable before the curves
        self._right_text(name, f'{level.name} ', LEVEL_COLOR)

    def _legend(self) -> None:
        names = [curve for curve in self._panel.curves if curve.name]
        for number, curve in enumerate(names):
            right = self._rect.right() - 60 * (len(names) - number)
            draw_text(self._painter, QRectF(right, self._outer.top(), 60, _TITLE), curve.name, 10,
                      QColor(curve.color), bold=True)

    def _line(self, color: QColor, x1: float, y1: float, x2: float, y2: float,
              style: int = Qt.SolidLine) -> None:
        self._painter.setRenderHint(QPainter.Antialiasing, False)  # else thin lines fade away
        self._painter.setPen(QPen(color, 1.0 if style == Qt.SolidLine else 1.6, style))
        self._painter.drawLine(QPointF(x1, y1), QPointF(x2, y2))
        self._painter.setRenderHint(QPainter.Antialiasing)

    def _right_text(self, rect: QRectF, text: str, color: QColor = TEXT_COLOR) -> None:
        draw_text(self._painter, rect, text, 9, color, align=Qt.AlignRight)

    def _x(self, time_s: float) -> float:
        return float(self._rect.left() + time_s / self._end_s * self._rect.width())

    def _y(self, value: float) -> float:
        low, high, here = (self._scaled(it) for it in (*self._limits(), value))
        share = min(max((here - low) / (high - low), 0.0), 1.0)  # at the edge if beyond
        return float(self._rect.bottom() - share * self._rect.height())

    def _limits(self) -> Tuple[float, float]:
        return self._panel.ticks[0], self._panel.ticks[-1]

    def _scaled(self, value: float) -> float:
        return math.log10(max(value, 1e-9)) if self._panel.logarithmic else value
