# SPDX-License-Identifier: BSD-3-Clause
"""The style of the launcher: one accent colour on a light, calm palette."""
from __future__ import annotations

from PyQt5.QtCore import Qt
from PyQt5.QtGui import QColor, QFont, QPalette
from PyQt5.QtWidgets import QApplication, QPushButton, QStyleFactory

ACCENT = '#1f6f9f'
TEXT = '#23292f'
QUIET = '#5c6670'  # text of less weight: units, hints, axes
GRID = '#e9ecef'  # lines behind curves
LINE = '#d3d8dd'  # borders and grids
WINDOW = '#f3f5f6'
GOOD = '#247a4b'
WARNING = '#9a5b00'
BAD = '#c0392b'
SELECTED = '#e6f0f6'  # behind a selected row
PAPER = '#ffffff'  # behind lists, fields and curves
BEHIND_BAD = '#fdf4f3'  # backgrounds of notices
BEHIND_WARNING = '#fdf8ef'
BEHIND_GOOD = '#f2f9f4'
USED = '#93b4c8'  # of a disk: the accent colour, quiet
SHAPE = '#3c454d'  # of an icon without a meaning of its own
WAITING = '#7a8590'
TICK = '#aab2b9'  # marks of a scale
DISABLED_TEXT = '#a3abb2'
DISABLED_SHAPE = '#b4bbc1'

_ROLES = {
    QPalette.Window: WINDOW, QPalette.WindowText: TEXT, QPalette.Base: PAPER,
    QPalette.AlternateBase: '#f7f8f9', QPalette.Text: TEXT, QPalette.Button: '#fafbfb',
    QPalette.ButtonText: TEXT, QPalette.BrightText: '#ffffff', QPalette.Light: '#ffffff',
    QPalette.Midlight: '#eceff1', QPalette.Mid: '#c3c9ce', QPalette.Dark: '#9aa3ab',
    QPalette.Shadow: '#6b747c', QPalette.Highlight: ACCENT, QPalette.HighlightedText: '#ffffff',
    QPalette.Link: ACCENT, QPalette.LinkVisited: ACCENT, QPalette.ToolTipBase: '#ffffff',
    QPalette.ToolTipText: TEXT, QPalette.PlaceholderText: QUIET,
}
_DISABLED_ROLES = (QPalette.WindowText, QPalette.Text, QPalette.ButtonText)
_SHEET = f"""
QGroupBox {{ border: 0; margin-top: 1.6em; padding: 0; font-weight: bold; }}
QGroupBox::title {{ subcontrol-origin: margin; subcontrol-position: top left; padding: 0; }}
QPushButton[primary="true"] {{
  background: {ACCENT}; color: white; border: 0; border-radius: 3px; font-weight: bold; }}
QPushButton[primary="true"]:hover {{ background: #2a7fb3; }}
QPushButton[primary="true"]:pressed {{ background: #185a82; }}
QPushButton[primary="true"]:focus {{ border: 2px solid #8fb8d0; }}
QPushButton[primary="true"]:disabled {{ background: #d9dee2; color: #87919a; }}
QToolTip {{ border: 1px solid {LINE}; padding: 3px; }}
"""


def apply_style(app: QApplication) -> None:
    """Give an application the launcher's style, palette and group boxes."""
    app.setAttribute(Qt.AA_UseHighDpiPixmaps)
    app.setStyle(QStyleFactory.create('Fusion'))
    app.setPalette(palette())
    app.setStyleSheet(_SHEET)


def set_primary(button: QPushButton, is_primary: bool) -> None:
    """Give a button the accent colour, or remove it."""
    if button.property('primary') != is_primary:
        button.setProperty('primary', is_primary)
        button.style().unpolish(button)
        button.style().polish(button)


def palette() -> QPalette:
    """Return the launcher's colours."""
    colours = QPalette()
    for role, colour in _ROLES.items():
        colours.setColor(role, QColor(colour))
    for role in _DISABLED_ROLES:
        colours.setColor(QPalette.Disabled, role, QColor(DISABLED_TEXT))
    colours.setColor(QPalette.Disabled, QPalette.Highlight, QColor('#c3c9ce'))
    return colours


def tabular_font(font: QFont) -> QFont:
    """Return a font of the same size with digits of equal width, so that times do not jump."""
    tabular = QFont(font)
    tabular.setFamily('monospace')
    tabular.setStyleHint(QFont.Monospace)
    return tabular

