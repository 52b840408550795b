# SPDX-License-Identifier: BSD-3-Clause
"""The time of playback; drawn by itself, since a label would lay out the window at every frame."""
from __future__ import annotations

from typing import Optional

from PyQt5.QtCore import QRect, QSize, Qt
from PyQt5.QtGui import QColor, QPainter, QPaintEvent, QPalette
from PyQt5.QtWidgets import QLabel, QSizePolicy, QWidget

from process_visualizer.gui.toolkit.style import tabular_font
from process_visualizer.gui.toolkit.theme import theme
from process_visualizer.playback.time_text import format_time

_UNKNOWN = '-:--.---'
_SIZE = 1.25  # of the usual font


class TimeLabel(QLabel):
    """Position and length of the recording, m:ss.mmm."""

    def __init__(self, parent: Optional[QWidget] = None) -> None:
        super().__init__(parent)
        font = tabular_font(self.font())
        font.setPointSizeF(_SIZE * font.pointSizeF())
        self.setFont(font)
        self.setSizePolicy(QSizePolicy.Minimum, QSizePolicy.Fixed)
        self._position = self._end = _UNKNOWN

    def text(self) -> str:
        """Return what is shown."""
        return f'{self._position.rjust(len(self._end))} / {self._end}'

    def show_nothing(self) -> None:
        """Show that there is no time."""
        self._show(_UNKNOWN, _UNKNOWN)

    def show_time(self, position_s: float, duration_s: float) -> None:
        """Show a position and a length [s]."""
        self._show(format_time(position_s), format_time(duration_s))

    def sizeHint(self) -> QSize:
        """Return the size of the text, which only the length of the recording changes."""
        metrics = self.fontMetrics()
        return QSize(metrics.horizontalAdvance(self.text()) + 2, metrics.height())

    def minimumSizeHint(self) -> QSize:
        """Return the size of the text."""
        return self.sizeHint()

    def paintEvent(self, _event: QPaintEvent) -> None:
        """Draw the position in full, the length quietly."""
        painter = QPainter(self)
        colour = self.palette().color(QPalette.WindowText)
        width = self._draw(painter, 0, self._position.rjust(len(self._end)), colour)
        quiet = QColor(theme().quiet) if self.isEnabled() else colour
        self._draw(painter, width, f' / {self._end}', quiet)

    def _draw(self, painter: QPainter, left: int, text: str, colour: QColor) -> int:
        width = self.fontMetrics().horizontalAdvance(text)
        painter.setPen(colour)
        painter.drawText(QRect(left, 0, width + 2, self.height()), Qt.AlignVCenter, text)
        return left + width

    def _show(self, position: str, end: str) -> None:
        if len(end) != len(self._end):
            self.updateGeometry()
        if (position, end) != (self._position, self._end):
            self._position, self._end = position, end
            self.update()
