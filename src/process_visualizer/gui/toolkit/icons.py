# SPDX-License-Identifier: BSD-3-Clause
"""The launcher's icons: SVG files in the folder ``icons``, in colors of the theme."""
from __future__ import annotations

import functools
from pathlib import Path
from typing import Dict, Tuple

from PyQt5.QtCore import QRect, QRectF, QSize, Qt
from PyQt5.QtGui import QColor, QIcon, QIconEngine, QPainter, QPixmap
from PyQt5.QtSvg import QSvgRenderer

from process_visualizer.gui.toolkit.theme import theme

_FOLDER = Path(__file__).with_name('icons')
_SIGNALS: Dict[str, str] = {'record': 'bad', 'died': 'bad', 'warning': 'warning', 'ok': 'good',
                            'waiting': 'waiting'}


def names() -> Tuple[str, ...]:
    """Return the names of all icons."""
    return tuple(sorted(file.stem for file in _FOLDER.glob('*.svg')))


def icon(name: str) -> QIcon:
    """Return an icon by its name; gray when disabled, in the accent color when checked.

    Icons whose color has a meaning (record, warning, ok, …) keep it when checked.

    Raises:
        FileNotFoundError: there is no icon of this name.
    """
    signal = _SIGNALS.get(name)
    return QIcon(_Engine(_text(name), signal or 'shape', signal or 'accent'))


@functools.lru_cache(maxsize=None)
def _text(name: str) -> str:
    return (_FOLDER / f'{name}.svg').read_text(encoding='utf-8')


@functools.lru_cache(maxsize=None)
def _drawing(text: str, color: str) -> QSvgRenderer:
    """Return the drawing in a color; QtSvg does not support ``currentColor``."""
    return QSvgRenderer(text.replace('currentColor', color).encode())


class _Engine(QIconEngine):
    """Draws an SVG text in any size; the colors are names of fields of Theme."""

    def __init__(self, text: str, color: str, checked: str) -> None:
        super().__init__()
        self._text = text
        self._color = color
        self._checked = checked

    def clone(self) -> QIconEngine:
        return _Engine(self._text, self._color, self._checked)

    def pixmap(self, size: QSize, mode: QIcon.Mode, state: QIcon.State) -> QPixmap:
        pixmap = QPixmap(size)
        pixmap.fill(Qt.transparent)
        painter = QPainter(pixmap)
        self.paint(painter, QRect(0, 0, size.width(), size.height()), mode, state)
        painter.end()
        return pixmap

    def paint(self, painter: QPainter, rect: QRect, mode: QIcon.Mode, state: QIcon.State) -> None:
        side = min(rect.width(), rect.height())
        name = 'disabled_shape' if mode == QIcon.Disabled \
            else self._checked if state == QIcon.On else self._color
        painter.save()
        painter.setRenderHint(QPainter.Antialiasing)
        color = QColor(getattr(theme(), name)).name()
        _drawing(self._text, color).render(painter, QRectF(
            rect.x() + (rect.width() - side) / 2, rect.y() + (rect.height() - side) / 2,
            side, side))
        painter.restore()
