# SPDX-License-Identifier: BSD-3-Clause
"""Layouts that panels share."""
from __future__ import annotations

from typing import Optional, Union

from PyQt5.QtWidgets import QHBoxLayout, QLayout, QVBoxLayout, QWidget


def in_column(parent: QWidget, spacing_px: int, *parts: Union[QWidget, QLayout]) -> QVBoxLayout:
    """Lay out a widget's parts below each other, without margins."""
    layout = QVBoxLayout(parent)
    layout.setContentsMargins(0, 0, 0, 0)
    layout.setSpacing(spacing_px)
    for part in parts:
        layout.addWidget(part) if isinstance(part, QWidget) else layout.addLayout(part)
    return layout


def in_row(*widgets: QWidget, wide: Optional[QWidget] = None) -> QHBoxLayout:
    """Return widgets side by side; the one that is ``wide`` gets the remaining room."""
    layout = QHBoxLayout()
    for widget in widgets:
        layout.addWidget(widget, int(widget is wide))
    return layout
