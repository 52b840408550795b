# SPDX-License-Identifier: BSD-3-Clause
"""A slider for the speed: logarithmic, with detents at the usual speeds."""
from __future__ import annotations

import math
from typing import Optional

from PyQt5.QtCore import QPointF, QRectF, QSize, Qt, pyqtSignal
from PyQt5.QtGui import QColor, QMouseEvent, QPainter, QPaintEvent, QPen
from PyQt5.QtWidgets import QAbstractSlider, QSizePolicy, QWidget

from process_visualizer.gui.toolkit.theme import theme
from process_visualizer.playback.rate_ladder import RATES
from process_visualizer.playback.timeline import MAX_RATE, MIN_RATE

LABELLED = (0.01, 0.1, 0.25, 0.5, 1.0, 2.0, 4.0, 16.0)
_UNITS = 1000  # of the value, per factor of ten
_DETENT_PX = 5.0
_SIDE, _GROOVE_Y, _KNOB = 13.0, 10.0, 6.5


class SpeedSlider(QAbstractSlider):
    """From 0.01 to 16; a double click is 1."""

    speed_chosen = pyqtSignal(float)

    def __init__(self, parent: Optional[QWidget] = None) -> None:
        super().__init__(parent)
        self.setRange(_value(MIN_RATE), _value(MAX_RATE))
        self.setSingleStep(50)
        self.setPageStep(300)
        self.setOrientation(Qt.Horizontal)
        self.setFocusPolicy(Qt.TabFocus)
        self.setSizePolicy(QSizePolicy.Expanding, QSizePolicy.Fixed)
        self.actionTriggered.connect(lambda _action: self._choose(_speed(self.sliderPosition())))

    @property
    def speed(self) -> float:
        """The speed that is shown."""
        return _speed(self.value())

    def show_speed(self, speed: float) -> None:
        """Show a speed, without reporting it as chosen."""
        self.setValue(_value(speed))

    def sizeHint(self) -> QSize:
        """Return a size in which all labels can be read."""
        return QSize(260, 32)

    def minimumSizeHint(self) -> QSize:
        """Return a size in which the slider can be used."""
        return QSize(170, 32)

    def x_of(self, speed: float) -> float:
        """Return the place of a speed [px]."""
        share = (_value(speed) - self.minimum()) / (self.maximum() - self.minimum())
        return _SIDE + share * (self.width() - 2 * _SIDE)

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Go where the mouse is."""
        if event.button() == Qt.LeftButton:
            self._choose(self._speed_at(event.localPos().x()))

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Follow the mouse, held a little at the detents."""
        if event.buttons() & Qt.LeftButton:
            self._choose(self._speed_at(event.localPos().x()))

    def mouseDoubleClickEvent(self, _event: QMouseEvent) -> None:
        """Return to the speed of the recording."""
        self._choose(1.0)

    def paintEvent(self, _event: QPaintEvent) -> None:
        """Draw the groove, from 1 to the speed in colour, ticks with labels, and the knob."""
        painter = QPainter(self)
        painter.setRenderHint(QPainter.Antialiasing)
        colour = QColor(theme().accent if self.isEnabled() else theme().disabled_shape)
        left, right = sorted((self.x_of(1.0), self.x_of(self.speed)))
        painter.setPen(Qt.NoPen)
        painter.setBrush(QColor(theme().groove))
        painter.drawRoundedRect(QRectF(_SIDE - 2, _GROOVE_Y - 2, self.width() - 2 * _SIDE + 4, 4),
                                2, 2)
        painter.fillRect(QRectF(left, _GROOVE_Y - 2, right - left, 4), colour)
        self._draw_ticks(painter)
        painter.setPen(QPen(QColor(theme().on_signal), 1.5))
        painter.setBrush(colour)
        painter.drawEllipse(QPointF(self.x_of(self.speed), _GROOVE_Y), _KNOB, _KNOB)
        if self.hasFocus():
            painter.setPen(QPen(colour, 1, Qt.DotLine))
            painter.setBrush(Qt.NoBrush)
            painter.drawRoundedRect(QRectF(self.rect()).adjusted(0.5, 0.5, -0.5, -0.5), 3, 3)

    def _draw_ticks(self, painter: QPainter) -> None:
        font = painter.font()
        font.setPixelSize(10)
        painter.setFont(font)
        for speed in RATES:
            x = self.x_of(speed)
            painter.setPen(QColor(theme().tick))
            painter.drawLine(QPointF(x, _GROOVE_Y + 6), QPointF(x, _GROOVE_Y + 9))
            if speed in LABELLED:
                painter.setPen(QColor(theme().quiet if self.isEnabled() else theme().disabled_text))
                painter.drawText(QRectF(x - 20, _GROOVE_Y + 9, 40, 13), Qt.AlignCenter,
                                 f'{speed:g}')

    def _speed_at(self, x: float) -> float:
        """The speed at a place [px]; that of a detent near it."""
        nearest = min(RATES, key=lambda speed: abs(self.x_of(speed) - x))
        if abs(self.x_of(nearest) - x) <= _DETENT_PX:
            return nearest
        share = (x - _SIDE) / max(self.width() - 2 * _SIDE, 1.0)
        value = self.minimum() + share * (self.maximum() - self.minimum())
        return _speed(round(min(max(value, self.minimum()), self.maximum())))

    def _choose(self, speed: float) -> None:
        self.show_speed(speed)
        self.speed_chosen.emit(speed)


def _value(speed: float) -> int:
    return round(_UNITS * math.log10(speed))


def _speed(value: int) -> float:
    """The speed of a value, with three digits."""
    detent = next((it for it in RATES if _value(it) == value), None)
    return float(f'{10 ** (value / _UNITS):.3g}') if detent is None else detent
