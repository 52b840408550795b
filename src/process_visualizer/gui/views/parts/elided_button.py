# SPDX-License-Identifier: BSD-3-Clause
"""A button that shortens its text instead of widening the window."""
from __future__ import annotations

from PyQt5.QtCore import QSize, Qt
from PyQt5.QtGui import QPaintEvent
from PyQt5.QtWidgets import QPushButton, QStyle, QStyleOptionButton, QStylePainter

_LEAST_PX, _PADDING_PX = 60, 12


class ElidedButton(QPushButton):
    """Shows as much of its text as fits."""

    def sizeHint(self) -> QSize:
        """Any width will do."""
        return QSize(_LEAST_PX, super().sizeHint().height())

    def minimumSizeHint(self) -> QSize:
        """Any width will do."""
        return self.sizeHint()

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw as much as fits."""
        option = QStyleOptionButton()
        self.initStyleOption(option)
        option.text = self.fontMetrics().elidedText(
            self.text(), Qt.ElideRight, self.width() - _PADDING_PX)
        QStylePainter(self).drawControl(QStyle.CE_PushButton, option)
