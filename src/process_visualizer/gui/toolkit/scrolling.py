# SPDX-License-Identifier: BSD-3-Clause
"""Scroll areas in which widgets that appear and disappear do not move others."""
from __future__ import annotations

from PyQt5.QtCore import QEvent, QObject, QSize, Qt
from PyQt5.QtGui import QPaintEvent
from PyQt5.QtWidgets import (
    QApplication,
    QFrame,
    QScrollArea,
    QScrollBar,
    QSizePolicy,
    QStyle,
    QVBoxLayout,
    QWidget,
)


class StillScroll(QScrollArea):
    """Scrolls to the widget that gets the keyboard focus by the Tab key, like Qt's scroll area.

    Qt also moves the focus when the focused widget is disabled, such as a button that was clicked.
    Then this area does not scroll.
    """

    def focusNextPrevChild(self, is_next: bool) -> bool:
        """Move the focus; do not scroll if the focused widget has been disabled."""
        focused = QApplication.focusWidget()
        if focused is not None and not focused.isEnabled():
            return QWidget.focusNextPrevChild(self, is_next)
        return super().focusNextPrevChild(is_next)


class _QuietBar(QScrollBar):
    """A scroll bar that is invisible without use, but keeps its room."""

    def paintEvent(self, event: QPaintEvent) -> None:
        """Paint the bar if there is anything to scroll."""
        if self.maximum() > self.minimum():
            super().paintEvent(event)


def keep_room_for_bar(area: QScrollArea) -> None:
    """Reserve the width of the vertical scroll bar, so that the bar moves no button."""
    area.setVerticalScrollBar(_QuietBar(Qt.Vertical))
    area.setVerticalScrollBarPolicy(Qt.ScrollBarAlwaysOn)


# A column that scrolls on screens that are too low for it.

_MIN_HEIGHT_PX = 160


class Column(QWidget):
    """The content of a ColumnScroll: it shrinks to its minimum height before it scrolls."""

    def heightForWidth(self, width: int) -> int:
        """Return the minimum height, as Qt's scroll area scrolls below the preferred height."""
        return self.layout().minimumHeightForWidth(width)


class ColumnOf(Column):
    """A column with a single widget, which gets all of the height."""

    def __init__(self, widget: QWidget) -> None:
        super().__init__()
        self._only = widget
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.addWidget(widget)

    def minimumSizeHint(self) -> QSize:
        """Return the widget's hint; the layout of a hidden page keeps an outdated one."""
        return self._only.minimumSizeHint()


class ColumnScroll(StillScroll):
    """Scrolls only vertically, and is never narrower than its content.

    Its scroll bar has a place of its own, so that the content keeps its width.
    """

    def __init__(self, content: QWidget) -> None:
        super().__init__()
        self.setFrameShape(QFrame.NoFrame)
        self.setWidgetResizable(True)
        self.setHorizontalScrollBarPolicy(Qt.ScrollBarAlwaysOff)
        keep_room_for_bar(self)
        self.setFocusPolicy(Qt.NoFocus)  # keys go to the window
        self.setWidget(content)

    def minimumSizeHint(self) -> QSize:
        """Return a size with room for the content's width and the scroll bar."""
        return self._size(_MIN_HEIGHT_PX)

    def _size(self, height: int) -> QSize:
        return QSize(self.widget().minimumSizeHint().width() + self._bar_px, height)

    @property
    def _bar_px(self) -> int:
        return self.style().pixelMetric(QStyle.PM_ScrollBarExtent)


# Scroll areas for widgets that appear and disappear, so that nothing around them moves.

_MIN_NOTICE_LINES = 3
_BELOW_PX = 5  # lines are up to a pixel higher than the font reports, with underscores at the end


class _Place(ColumnScroll):
    """Scrolls back to its beginning whenever one of its widgets appears."""

    def __init__(self, *widgets: QWidget) -> None:
        body = QWidget()
        self._column = QVBoxLayout(body)  # first: a scroll area asks for sizes with its widget
        self._column.setContentsMargins(0, 0, 0, 0)
        self._column.setSpacing(2)
        self._column.setAlignment(Qt.AlignTop)
        super().__init__(body)
        for widget in reversed(widgets):
            self.put_first(widget)

    def put_first(self, widget: QWidget) -> None:
        """Add a widget above the others."""
        self._column.insertWidget(0, widget)
        widget.installEventFilter(self)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Scroll back to the beginning when a widget appears."""
        if event.type() == QEvent.Show:
            self.verticalScrollBar().setValue(0)
        return super().eventFilter(watched, event)


class TextPlace(_Place):
    """A place with the fixed height of a number of lines of text."""

    def __init__(self, lines: int, *widgets: QWidget) -> None:
        super().__init__(*widgets)
        self._lines = lines
        self.setSizePolicy(QSizePolicy.Preferred, QSizePolicy.Fixed)

    def sizeHint(self) -> QSize:
        """Return the height of the lines."""
        return self._size(self._lines * self.fontMetrics().lineSpacing() + _BELOW_PX)

    def minimumSizeHint(self) -> QSize:
        """Return the same size, as the height is fixed."""
        return self.sizeHint()


class NoticePlace(_Place):
    """A place for notices, which takes its room from widgets above; hidden without notices."""

    def __init__(self, *widgets: QWidget) -> None:
        super().__init__(*widgets)
        self.setSizePolicy(QSizePolicy.Preferred, QSizePolicy.Maximum)
        self._follow()

    def sizeHint(self) -> QSize:
        """Return the height that the notices need at this width."""
        height = self.widget().layout().heightForWidth(self.width() - self._bar_px)
        return self._size(max(height, self.widget().sizeHint().height()))

    def minimumSizeHint(self) -> QSize:
        """Return a height in which some lines can be read."""
        lines = _MIN_NOTICE_LINES * self.fontMetrics().lineSpacing()
        return self._size(min(lines, self.sizeHint().height()))

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Show or hide the place with its notices."""
        if event.type() in (QEvent.ShowToParent, QEvent.HideToParent):
            self._follow()
        return super().eventFilter(watched, event)

    def _follow(self) -> None:
        count = self._column.count()
        self.setVisible(any(not self._column.itemAt(row).widget().isHidden()
                            for row in range(count)))
        self.updateGeometry()
