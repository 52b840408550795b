# SPDX-License-Identifier: BSD-3-Clause
"""The window below RViz, as wide as the screen, with the buttons and the timeline."""
from __future__ import annotations

from PyQt5.QtCore import Qt, pyqtSignal
from PyQt5.QtGui import QCloseEvent, QColor, QMouseEvent, QPainter, QPaintEvent
from PyQt5.QtWidgets import QVBoxLayout, QWidget

from process_visualizer.gui.toolkit.theme import theme
from process_visualizer.gui.views.parts.layouts import in_column

_SIDE = 10
_GRIP_PX, _MARK_PX = 9, 36


class TimelineDock(QWidget):
    """Belongs to the launcher's window: its keys work here too, and only that window closes it.

    It has no title bar. Its upper edge is dragged for its height; who owns it places it.
    """

    height_wanted = pyqtSignal(int)
    """The operator has dragged the upper edge: the height [px]."""
    close_refused = pyqtSignal()
    """The operator, or the window manager, wanted to close it."""

    def __init__(self, content: QWidget, window: QWidget) -> None:
        """``window`` is the launcher's."""
        # Of its kinds of windows, Qt gives the keys of the parent only to tools. The window
        # manager is told that it is a dialog: some hide the tools of a program while RViz is used.
        super().__init__(window, Qt.Tool | Qt.FramelessWindowHint)
        self.setAttribute(Qt.WA_X11NetWmWindowTypeDialog)
        self.setAttribute(Qt.WA_ShowWithoutActivating)
        self.setObjectName('timeline_dock')
        self.setWindowTitle('Timeline')
        self.grip = Grip()
        self.grip.dragged.connect(
            lambda y: self.height_wanted.emit(self.frameGeometry().bottom() + 1 - y))
        inside = QVBoxLayout()
        inside.setContentsMargins(_SIDE, 0, _SIDE, _SIDE)
        inside.addWidget(content)
        column = in_column(self, 0, self.grip, inside)
        column.setSizeConstraint(QVBoxLayout.SetNoConstraint)  # it may not outgrow the screen

    def closeEvent(self, event: QCloseEvent) -> None:
        """Stay: a request to close the timeline is none to end the cell."""
        event.ignore()
        self.close_refused.emit()


class Grip(QWidget):
    """The upper edge of the dock."""

    dragged = pyqtSignal(int)
    """Where on the screen the edge should be: y [px]."""

    def __init__(self) -> None:
        super().__init__()
        self._offset = 0
        self.setObjectName('timeline_grip')
        self.setFixedHeight(_GRIP_PX)
        self.setCursor(Qt.SplitVCursor)
        self.setToolTip('Drag to resize the timeline')

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw the border, and a mark that says that it can be dragged."""
        painter = QPainter(self)
        painter.fillRect(0, 0, self.width(), 1, self.palette().mid())
        painter.setPen(Qt.NoPen)
        painter.setBrush(QColor(theme().tick))
        painter.drawRoundedRect((self.width() - _MARK_PX) // 2, 4, _MARK_PX, 3, 1.5, 1.5)
        painter.end()

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Remember where the edge was grabbed."""
        self._offset = event.y()

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Drag the edge."""
        if event.buttons() & Qt.LeftButton:
            self.dragged.emit(event.globalY() - self._offset)
