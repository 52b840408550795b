# SPDX-License-Identifier: BSD-3-Clause
"""Small helpers that all panels share."""
from __future__ import annotations

from typing import Callable, Optional

from PyQt5.QtWidgets import QLabel, QToolButton

from process_visualizer.gui.toolkit.icons import icon
from process_visualizer.gui.toolkit.theme_following import colour


def small(label: QLabel) -> QLabel:
    """Return the label in a slightly smaller size."""
    font = label.font()
    font.setPointSizeF(font.pointSizeF() * 0.9)
    label.setFont(font)
    return label


def note(name: str) -> QLabel:
    """Return a quiet label of one or more lines, hidden until ``show_note`` gives it a text."""
    label = QLabel()
    label.setObjectName(name)
    label.setWordWrap(True)
    label.hide()
    colour(label, 'quiet')
    return label


def show_note(label: QLabel, text: str) -> None:
    """Show a text, or nothing where there is none."""
    label.setText(text)
    label.setVisible(bool(text))


def title(text: str) -> QLabel:
    """Return a bold label, for the head of a group."""
    label = QLabel(text)
    font = label.font()
    font.setBold(True)
    label.setFont(font)
    return label


def tool_button(name: str, icon_name: str, hint: str, action: Callable[[], object],
                text: Optional[str] = None) -> QToolButton:
    """Return a flat button with an icon."""
    button = QToolButton()
    button.setObjectName(name)
    button.setIcon(icon(icon_name))
    button.setToolTip(hint)
    button.setAccessibleName(hint.split(' (')[0])  # without the key
    button.setAutoRaise(True)
    if text is not None:
        button.setText(text)
    button.clicked.connect(lambda: action())
    return button
