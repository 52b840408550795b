# SPDX-License-Identifier: BSD-3-Clause
"""Places that scroll, so that what comes and goes moves nothing around it."""
from __future__ import annotations

from PyQt5.QtCore import QEvent, QObject, QSize, Qt
from PyQt5.QtWidgets import (
    QApplication,
    QFrame,
    QScrollArea,
    QSizePolicy,
    QStyle,
    QVBoxLayout,
    QWidget,
)


class StillScroll(QScrollArea):
    """Scrolls to what gets the keyboard by the Tab key, as Qt's does.

    Qt also gives the keyboard to another widget when the one that has it cannot be used any more,
    such as a button that was clicked; nothing may move then.
    """

    def focusNextPrevChild(self, is_next: bool) -> bool:
        """See Qt."""
        focused = QApplication.focusWidget()
        if focused is not None and not focused.isEnabled():
            return QWidget.focusNextPrevChild(self, is_next)
        return super().focusNextPrevChild(is_next)


# A column that can be scrolled where the screen is too low for it.

_MIN_HEIGHT_PX = 160


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
        return QSize(self.widget().minimumSizeHint().width() + bar, _MIN_HEIGHT_PX)


# Places for what comes and goes, so that nothing around it moves; they scroll.

_MIN_NOTICE_LINES = 3
_BELOW_PX = 5  # lines are up to a pixel higher than the font says; an underscore is at their end


class _Place(StillScroll):
    """Shows its beginning again whenever one of its widgets appears."""

    def __init__(self, *widgets: QWidget) -> None:
        super().__init__()
        self.setFrameShape(QFrame.NoFrame)
        self.setWidgetResizable(True)
        self.setHorizontalScrollBarPolicy(Qt.ScrollBarAlwaysOff)
        self.setFocusPolicy(Qt.NoFocus)  # the keys are the window's
        body = QWidget()
        self._column = QVBoxLayout(body)
        self._column.setContentsMargins(0, 0, 0, 0)
        self._column.setSpacing(2)
        self._column.setAlignment(Qt.AlignTop)
        self.setWidget(body)
        for widget in reversed(widgets):
            self.put_first(widget)

    def put_first(self, widget: QWidget) -> None:
        """Add a widget above the others."""
        self._column.insertWidget(0, widget)
        widget.installEventFilter(self)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Go back to the beginning when something appears."""
        if event.type() == QEvent.Show:
            self.verticalScrollBar().setValue(0)
        return super().eventFilter(watched, event)

    def _size(self, height: int) -> QSize:
        """A size with room for the width of the content, and the scroll bar."""
        bar = self.style().pixelMetric(QStyle.PM_ScrollBarExtent)
        return QSize(self.widget().minimumSizeHint().width() + bar, height)


class TextPlace(_Place):
    """Always as high as so many lines of text."""

    def __init__(self, lines: int, *widgets: QWidget) -> None:
        super().__init__(*widgets)
        self._lines = lines
        self.setSizePolicy(QSizePolicy.Preferred, QSizePolicy.Fixed)

    def sizeHint(self) -> QSize:
        """Return the height of the lines."""
        return self._size(self._lines * self.fontMetrics().lineSpacing() + _BELOW_PX)

    def minimumSizeHint(self) -> QSize:
        """Return the same: it neither grows nor gives way."""
        return self.sizeHint()


class NoticePlace(_Place):
    """Takes the room of notices from what is above it; hidden while there are none."""

    def __init__(self, *widgets: QWidget) -> None:
        super().__init__(*widgets)
        self.setSizePolicy(QSizePolicy.Preferred, QSizePolicy.Maximum)
        self._follow()

    def sizeHint(self) -> QSize:
        """Return the height that the notices need at this width."""
        height = self.widget().layout().heightForWidth(self.width())
        return self._size(max(height, self.widget().sizeHint().height()))

    def minimumSizeHint(self) -> QSize:
        """Return a height in which something can be read."""
        lines = _MIN_NOTICE_LINES * self.fontMetrics().lineSpacing()
        return self._size(min(lines, self.sizeHint().height()))

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Be there with the notices."""
        if event.type() in (QEvent.ShowToParent, QEvent.HideToParent):
            self._follow()
        return super().eventFilter(watched, event)

    def _follow(self) -> None:
        count = self._column.count()
        self.setVisible(any(not self._column.itemAt(row).widget().isHidden()
                            for row in range(count)))
        self.updateGeometry()
