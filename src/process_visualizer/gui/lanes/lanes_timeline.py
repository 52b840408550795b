# SPDX-License-Identifier: BSD-3-Clause
"""The common base of the two timelines: lanes below a header, and a line at the mouse."""
from __future__ import annotations

from typing import Optional, Tuple

from PyQt5.QtCore import QRect, QSize, pyqtSignal
from PyQt5.QtGui import (
    QFont,
    QPainter,
    QPaintEvent,
    QPalette,
    QResizeEvent,
    QWheelEvent,
)
from PyQt5.QtWidgets import QFrame, QMenu, QSizePolicy, QVBoxLayout, QWidget

from process_visualizer.gui.lanes.lane_choice import LaneChoices
from process_visualizer.gui.lanes.lane_stack import LaneStack
from process_visualizer.gui.lanes.timeline_header import HEADER_HEIGHT
from process_visualizer.gui.lanes.timeline_lanes import LaneTexts
from process_visualizer.gui.toolkit.theme import set_sheet
from process_visualizer.gui.toolkit.time_axis import TimeAxis

_MIN_LANES = 2  # that are always visible, if there are that many
_FONT_PX = 11


class LanesTimeline(QWidget):
    """Curves over time in lanes that scroll, fold and are chosen; subclasses define the time."""

    curves_wanted = pyqtSignal()
    """The operator wants to choose the curves."""

    _below_lanes = 0
    """The height [px] that is kept free below the lanes."""

    def __init__(self, choices: LaneChoices, parent: Optional[QWidget] = None) -> None:
        super().__init__(parent)
        self._choices = choices
        self._hover_x: Optional[float] = None
        self._font = QFont(self.font())
        self._font.setPixelSize(_FONT_PX)
        self.stack = LaneStack(self)
        self.stack.redraw.connect(self.update)
        self.setMouseTracking(True)
        self.setSizePolicy(QSizePolicy.Expanding, QSizePolicy.Preferred)

    @property
    def axis(self) -> TimeAxis:
        """The axis of time."""
        raise NotImplementedError

    @property
    def hover_s(self) -> Optional[float]:
        """The time at the mouse, which changes when the axis moves; None without the mouse."""
        return None if self._hover_x is None else self.axis.time_s(self._hover_x)

    def lane_texts(self, row: int, number: int = 0) -> LaneTexts:
        """Return the texts of one curve of a lane."""
        raise NotImplementedError

    def _lanes_axis(self) -> Tuple[TimeAxis, float]:
        """Return the axis in the time of the curves, which begins at 0, and their length [s]."""
        raise NotImplementedError

    # Size

    def sizeHint(self) -> QSize:
        """Return a size with room for all lanes."""
        return QSize(400, self._height_of(len(self.stack.lanes)))

    def minimumSizeHint(self) -> QSize:
        """Return a size in which some lanes can be seen."""
        return QSize(260, self._height_of(min(len(self.stack.lanes), _MIN_LANES)))

    def _height_of(self, lanes: int) -> int:
        return int(HEADER_HEIGHT) + self.stack.height_of(lanes) + self._below_lanes

    def _fit(self) -> None:
        """Give the lanes their places."""
        self.setMaximumHeight(int(HEADER_HEIGHT) + self.stack.most_height + self._below_lanes)
        self.stack.place(self.rect().adjusted(0, int(HEADER_HEIGHT), 0, -self._below_lanes))

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Give the lanes their height in the new size."""
        self._fit()

    # Drawing

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw the cached pictures of the curves, and everything else over them."""
        painter = QPainter(self)
        painter.setFont(self._font)
        painter.fillRect(event.rect(), self.palette().color(QPalette.Base))
        self.stack.draw(painter, *self._lanes_axis(), event.rect())
        axis = self.axis
        self._draw(painter, axis, float(self.height() - self._below_lanes), event.rect())
        self.stack.draw_texts(painter, axis, event.rect(), self.lane_texts)
        painter.end()

    def _draw(self, painter: QPainter, axis: TimeAxis, bottom: float, area: QRect) -> None:
        """Draw the header, and what lies over the curves down to ``bottom`` [px], in an area."""
        raise NotImplementedError

    def _update_header(self) -> None:
        self.update(0, 0, self.width(), int(HEADER_HEIGHT))

    # The mouse

    def _scrolls_lanes(self, event: QWheelEvent) -> bool:
        """Scroll lanes that do not fit if the wheel turns over them without a modifier key.

        Return whether the wheel was over such lanes.
        """
        if not self.stack.scroll.maximum() or event.modifiers() \
                or event.pos().y() < HEADER_HEIGHT:
            return False
        self.stack.scroll.event(event)
        return True

    def _add_lane_actions(self, menu: QMenu, row: Optional[int]) -> None:
        """Add the actions for a lane, if there is one, and the choice of curves."""
        if row is not None:
            self.stack.add_actions(menu, row, self._choices)
        menu.addAction('Curves…', self.curves_wanted)


def framed(timeline: LanesTimeline, *below: QWidget) -> QFrame:
    """Return a frame on paper around a timeline and the widgets below it; it grows with lanes."""
    frame = QFrame()
    frame.setFrameShape(QFrame.StyledPanel)
    set_sheet(frame, 'QFrame { background: <paper>; }')
    inside = QVBoxLayout(frame)
    inside.setContentsMargins(0, 2, 0, 0)
    inside.setSpacing(0)
    inside.setSizeConstraint(QVBoxLayout.SetMinAndMaxSize)
    inside.addWidget(timeline, 1)
    for widget in below:
        inside.addWidget(widget)
    return frame
