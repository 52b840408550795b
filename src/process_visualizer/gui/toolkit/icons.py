# SPDX-License-Identifier: BSD-3-Clause
"""The launcher's icons, drawn as paths and so crisp at every size and scale."""
from __future__ import annotations

from typing import Dict

from PyQt5.QtCore import QRect, QSize, Qt
from PyQt5.QtGui import QColor, QIcon, QIconEngine, QPainter, QPen, QPixmap

from process_visualizer.gui.toolkit.icon_shapes import GRID, STROKE, Shape, shape
from process_visualizer.gui.toolkit.theme import theme

_SIGNALS: Dict[str, str] = {'record': 'bad', 'died': 'bad', 'warning': 'warning', 'ok': 'good',
                            'waiting': 'waiting'}


def icon(name: str) -> QIcon:
    """Return an icon by its name; grey when disabled, in the accent colour when checked.

    Icons whose colour has a meaning (record, warning, ok, …) keep it when checked.

    Raises:
        KeyError: there is no icon of this name.
    """
    signal = _SIGNALS.get(name)
    return QIcon(_Engine(shape(name), signal or 'shape', signal or 'accent'))


class _Engine(QIconEngine):
    """Draws a shape in any size, in colours of the theme (names of its fields)."""

    def __init__(self, drawn: Shape, colour: str, checked: str) -> None:
        super().__init__()
        self._shape = drawn
        self._colour = colour
        self._checked = checked

    def clone(self) -> QIconEngine:
        return _Engine(self._shape, self._colour, self._checked)

    def pixmap(self, size: QSize, mode: QIcon.Mode, state: QIcon.State) -> QPixmap:
        pixmap = QPixmap(size)
        pixmap.fill(Qt.transparent)
        painter = QPainter(pixmap)
        self.paint(painter, QRect(0, 0, size.width(), size.height()), mode, state)
        painter.end()
        return pixmap

    def paint(self, painter: QPainter, rect: QRect, mode: QIcon.Mode, state: QIcon.State) -> None:
        side = min(rect.width(), rect.height())
        colour = self._colour_in(mode, state)
        painter.save()
        painter.setRenderHint(QPainter.Antialiasing)
        painter.translate(rect.x() + (rect.width() - side) / 2,
                          rect.y() + (rect.height() - side) / 2)
        painter.scale(side / GRID, side / GRID)
        painter.fillPath(self._shape.filled, colour)
        painter.strokePath(self._shape.lines, QPen(colour, STROKE, Qt.SolidLine, Qt.RoundCap,
                                                   Qt.RoundJoin))
        painter.restore()

    def _colour_in(self, mode: QIcon.Mode, state: QIcon.State) -> QColor:
        if mode == QIcon.Disabled:
            return QColor(theme().disabled_shape)
        return QColor(getattr(theme(), self._checked if state == QIcon.On else self._colour))
