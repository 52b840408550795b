# SPDX-License-Identifier: BSD-3-Clause
"""A flat button with an arrow that folds a part of the window."""
from __future__ import annotations

from typing import Optional

from PyQt5.QtCore import Qt
from PyQt5.QtWidgets import QToolButton, QWidget


class FoldButton(QToolButton):
    """Its arrow points down while it is checked; connect ``toggled`` to the folded part."""

    def __init__(self, name: str, text: str, hint: str, parent: Optional[QWidget] = None) -> None:
        super().__init__(parent)
        self.setObjectName(name)
        self.setText(text)
        self.setToolTip(hint)
        self.setToolButtonStyle(Qt.ToolButtonTextBesideIcon)
        self.setArrowType(Qt.RightArrow)
        self.setAutoRaise(True)
        self.setCheckable(True)
        self.setFocusPolicy(Qt.TabFocus)
        self.toggled.connect(
            lambda is_open: self.setArrowType(Qt.DownArrow if is_open else Qt.RightArrow))
