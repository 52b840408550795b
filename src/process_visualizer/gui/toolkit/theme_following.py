# SPDX-License-Identifier: BSD-3-Clause
"""Keeps what was coloured once in step with the theme of the application."""
from __future__ import annotations

from dataclasses import asdict
from typing import Callable, Optional

from PyQt5.QtCore import QEvent, QObject
from PyQt5.QtGui import QColor, QPalette
from PyQt5.QtWidgets import QApplication, QWidget

from process_visualizer.gui.toolkit.theme import theme

_COLOUR, _SHEET, _SELECTION = 'theme_colour', 'theme_sheet', 'theme_selection'


def colour(widget: QWidget, name: str) -> None:
    """Set the colour of the widget's text while it is enabled: the name of a field of Theme."""
    widget.setProperty(_COLOUR, name)
    chosen = QColor(getattr(theme(), name))
    if widget.palette().color(QPalette.Active, QPalette.WindowText) != chosen:
        palette = QPalette()  # whose other colours are those of the application, also later
        for group in (QPalette.Active, QPalette.Inactive):
            palette.setColor(group, QPalette.WindowText, chosen)
        widget.setPalette(palette)


def colour_selection(view: QWidget, name: str) -> None:
    """Set the colour behind selected rows: the name of a field of Theme."""
    view.setProperty(_SELECTION, name)
    palette = QPalette()
    palette.setColor(QPalette.Highlight, QColor(getattr(theme(), name)))
    view.setPalette(palette)


def set_sheet(widget: QWidget, sheet: str) -> None:
    """Give a widget a style sheet in which <NAME> stands for the colour of that name in Theme."""
    widget.setProperty(_SHEET, sheet)
    coloured = with_colours(sheet)
    if widget.styleSheet() != coloured:
        widget.setStyleSheet(coloured)


def with_colours(sheet: str) -> str:
    """Return a style sheet in which each <NAME> is replaced by the colour of the theme."""
    for name, value in asdict(theme()).items():
        sheet = sheet.replace(f'<{name}>', value)
    return sheet


def recolour(app: QApplication) -> None:
    """Colour all widgets anew, after the theme has changed."""
    for widget in app.allWidgets():
        for name, renew in ((_COLOUR, colour), (_SHEET, set_sheet), (_SELECTION, colour_selection)):
            if widget.property(name):
                renew(widget, widget.property(name))


class ThemeFollower(QObject):
    """Calls a function when the theme of a widget changes, for what is not painted anew by Qt."""

    def __init__(self, widget: QWidget, show: Callable[[], None]) -> None:
        super().__init__(widget)
        self._show = show
        self._shown = theme()
        widget.installEventFilter(self)

    def eventFilter(self, widget: Optional[QObject], event: Optional[QEvent]) -> bool:
        """Notice that the palette is of another theme."""
        if event is not None and event.type() == QEvent.PaletteChange and theme() != self._shown:
            self._shown = theme()
            self._show()
        return super().eventFilter(widget, event)
