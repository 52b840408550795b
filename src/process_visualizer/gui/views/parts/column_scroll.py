# SPDX-License-Identifier: BSD-3-Clause
"""A column that can be scrolled where the screen is too low for it."""
from __future__ import annotations

from PyQt5.QtCore import QSize, Qt
from PyQt5.QtWidgets import QFrame, QStyle, QVBoxLayout, QWidget

from process_visualizer.gui.views.parts.still_scroll import StillScroll

_LEAST_HEIGHT_PX = 160


class Column(QWidget):
    """The content of a ColumnScroll: it gives way before anything has to be scrolled to."""

    def heightForWidth(self, width: int) -> int:
        """Return the least height; Qt's scroll area would scroll as soon as it likes more."""
        return self.layout().minimumHeightForWidth(width)


class ColumnOf(Column):
    """A column with nothing but a widget, which gets all of the height."""

    def __init__(self, widget: QWidget) -> None:
        super().__init__()
        self._only = widget
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.addWidget(widget)

    def minimumSizeHint(self) -> QSize:
        """Return that of the widget; the layout of a hidden page keeps an old one."""
        return self._only.minimumSizeHint()


class ColumnScroll(StillScroll):
    """Scrolls up and down only; it is never narrower than its content."""

    def __init__(self, content: QWidget) -> None:
        super().__init__()
        self.setFrameShape(QFrame.NoFrame)
        self.setWidgetResizable(True)
        self.setHorizontalScrollBarPolicy(Qt.ScrollBarAlwaysOff)
        self.setFocusPolicy(Qt.NoFocus)  # the keys are the window's
        self.setWidget(content)

    def minimumSizeHint(self) -> QSize:
        """Return a size with room for the content's width and the scroll bar."""
        bar = self.style().pixelMetric(QStyle.PM_ScrollBarExtent)
        return QSize(self.widget().minimumSizeHint().width() + bar, _LEAST_HEIGHT_PX)
