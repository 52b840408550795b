# SPDX-License-Identifier: BSD-3-Clause
"""The style of the launcher: one accent colour on a calm palette, light or dark."""
from __future__ import annotations

import gc
from contextlib import contextmanager
from typing import Iterator

from PyQt5.QtCore import Qt
from PyQt5.QtGui import QColor, QFont, QPalette
from PyQt5.QtWidgets import QApplication, QPushButton, QRadioButton, QStyleFactory

from process_visualizer.gui.toolkit.theme import LIGHT, Theme
from process_visualizer.gui.toolkit.theme_following import recolour, set_sheet

_ROLES = {
    QPalette.Window: 'window', QPalette.WindowText: 'text', QPalette.Base: 'paper',
    QPalette.AlternateBase: 'row', QPalette.Text: 'text', QPalette.Button: 'button',
    QPalette.ButtonText: 'text', QPalette.Light: 'light', QPalette.Midlight: 'midlight',
    QPalette.Mid: 'mid', QPalette.Dark: 'dark', QPalette.Shadow: 'shadow',
    QPalette.Highlight: 'primary', QPalette.Link: 'accent', QPalette.LinkVisited: 'accent',
    QPalette.ToolTipBase: 'paper', QPalette.ToolTipText: 'text',
    QPalette.PlaceholderText: 'quiet',
}
_ON_PRIMARY = (QPalette.BrightText, QPalette.HighlightedText)
_DISABLED_ROLES = (QPalette.WindowText, QPalette.Text, QPalette.ButtonText)
_SHEET = """
QGroupBox { border: 0; margin-top: 1.6em; padding: 0; font-weight: bold; }
QGroupBox::title { subcontrol-origin: margin; subcontrol-position: top left; padding: 0; }
QRadioButton::indicator { width: 12px; height: 12px; border-radius: 7px;
  border: 1px solid palette(window-text); background: palette(base); }
QRadioButton::indicator:focus, QRadioButton::indicator:hover { border-color: palette(link); }
QRadioButton::indicator:checked { background: qradialgradient(cx: 0.5, cy: 0.5, radius: 0.5,
  fx: 0.5, fy: 0.5, stop: 0 palette(text), stop: 0.55 palette(text), stop: 0.65 palette(base),
  stop: 1 palette(base)); }
QToolTip { border: 1px solid palette(mid); padding: 3px; }
"""
"""For all widgets, whatever the theme: another sheet would mean to polish all of them again."""
_PRIMARY = """
QPushButton { background: <primary>; color: white; border: 0; border-radius: 3px;
  font-weight: bold; }
QPushButton:hover { background: <primary_hovered>; }
QPushButton:pressed { background: <primary_pressed>; }
QPushButton:focus { border: 2px solid <primary_focus>; }
QPushButton:disabled { background: <primary_off>; color: <primary_off_text>; }
"""


def apply_style(app: QApplication, wanted: Theme = LIGHT) -> None:
    """Give an application the launcher's style, palette and group boxes."""
    app.setAttribute(Qt.AA_UseHighDpiPixmaps)
    with _no_widget_collected():
        app.setStyle(QStyleFactory.create('Fusion'))
        app.setStyleSheet(_SHEET)
    apply_theme(app, wanted)


def apply_theme(app: QApplication, wanted: Theme) -> None:
    """Give an application, and all of its widgets, the colours of a theme."""
    with _no_widget_collected():
        app.setPalette(palette(wanted))
        app.setPalette(_check_box_palette(wanted), 'QCheckBox')
        recolour(app)
        for widget in app.allWidgets():
            if isinstance(widget, QRadioButton):  # the sheet keeps the colours of the last theme
                widget.style().unpolish(widget)
                widget.style().polish(widget)


@contextmanager
def _no_widget_collected() -> Iterator[None]:
    """Keep unreachable widgets, which Python's collector would delete, for as long as it takes.

    Qt goes through a list of all widgets and tells each of its style, palette or sheet; what hears
    of it in Python makes objects, and so may call the collector. Qt would then go on with a widget
    that is no more: the end of the program, by SIGSEGV.
    """
    is_on = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if is_on:
            gc.enable()


def set_primary(button: QPushButton, is_primary: bool) -> None:
    """Give a button the accent colour, or remove it."""
    set_sheet(button, _PRIMARY if is_primary else '')


def palette(wanted: Theme) -> QPalette:
    """Return the colours of a theme."""
    colours = QPalette()
    for role, name in _ROLES.items():
        colours.setColor(role, QColor(getattr(wanted, name)))
    for role in _ON_PRIMARY:
        colours.setColor(role, QColor(Qt.white))
    for role in _DISABLED_ROLES:
        colours.setColor(QPalette.Disabled, role, QColor(wanted.disabled_text))
    colours.setColor(QPalette.Disabled, QPalette.Highlight, QColor(wanted.mid))
    return colours


def _check_box_palette(wanted: Theme) -> QPalette:
    colours = palette(wanted)
    colour_indicators(colours, wanted)
    return colours


def colour_indicators(colours: QPalette, wanted: Theme) -> None:
    """Let boxes, ticks and dots be seen: Fusion's outline is darker than the window.

    What is written beside the box of a QCheckBox has another role than the tick.
    """
    colours.setColor(QPalette.Base, QColor(wanted.indicator))
    colours.setColor(QPalette.Text, QColor(wanted.indicator_tick))
    colours.setColor(QPalette.Disabled, QPalette.Base, QColor(wanted.indicator_off))
    colours.setColor(QPalette.Disabled, QPalette.Text, QColor(wanted.indicator_off_tick))


def tabular_font(font: QFont) -> QFont:
    """Return a font of the same size with digits of equal width, so that times do not jump."""
    tabular = QFont(font)
    tabular.setFamily('monospace')
    tabular.setStyleHint(QFont.Monospace)
    return tabular

