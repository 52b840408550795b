# SPDX-License-Identifier: BSD-3-Clause
"""A label that shortens its text instead of widening the window."""
from __future__ import annotations

from typing import Optional

from PyQt5.QtCore import QSize, Qt
from PyQt5.QtGui import QPainter, QPaintEvent
from PyQt5.QtWidgets import QLabel, QWidget


class ElidedLabel(QLabel):
    """Shows as much of one line as fits; the tooltip has all of it."""

    def __init__(self, mode: Qt.TextElideMode = Qt.ElideMiddle,
                 parent: Optional[QWidget] = None) -> None:
        super().__init__(parent)
        self._mode = mode

    def setText(self, text: str) -> None:
        """Show a text."""
        if text != self.text():
            super().setText(text)
            self.setToolTip(text)

    def minimumSizeHint(self) -> QSize:
        """Any width will do."""
        return QSize(20, super().minimumSizeHint().height())

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw as much as fits."""
        painter = QPainter(self)
        area = self.contentsRect()
        text = self.fontMetrics().elidedText(self.text(), self._mode, area.width())
        self.style().drawItemText(painter, area, int(self.alignment()), self.palette(),
                                  self.isEnabled(), text, self.foregroundRole())
