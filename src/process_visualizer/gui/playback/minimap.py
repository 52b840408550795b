# SPDX-License-Identifier: BSD-3-Clause
"""Zoom of the timeline: the shown part as a frame on a strip of the whole recording."""
from __future__ import annotations

from typing import NamedTuple, Optional, Tuple

from PyQt5.QtCore import QObject, QPoint, QRect, QRectF, Qt, pyqtSignal
from PyQt5.QtGui import QColor, QMouseEvent, QPainter, QPaintEvent, QPen, QPixmap
from PyQt5.QtWidgets import QScrollBar, QWidget

from process_visualizer.gui.lanes.lane_picture import curve_picture
from process_visualizer.gui.lanes.timeline_lanes import Lane
from process_visualizer.gui.toolkit.theme import theme, translucent
from process_visualizer.gui.toolkit.time_axis import ShownTime, whole

HEIGHT = 18
_MIN_FRAME = 8.0  # px: minimum width of the frame, so that it can be grabbed
_OUTSIDE_ALPHA = 190  # opacity over the parts outside the frame


class MapContent(NamedTuple):
    """The content of the strip: a curve, and the marks as shares (0 to 1) of the recording."""

    lane: Optional[Lane] = None
    marks: Tuple[float, ...] = ()


class Minimap(QScrollBar):
    """A scroll bar with the frame as its slider; keys and wheel work as in other scroll bars."""

    def __init__(self, parent: QWidget) -> None:
        super().__init__(Qt.Horizontal, parent)
        self._content = MapContent()
        self._picture: Optional[QPixmap] = None
        self._position = 0.0
        self._grabbed: Optional[float] = None
        self.setToolTip('The whole recording. Drag the frame, or press where you want to look.')
        self.setContextMenuPolicy(Qt.PreventContextMenu)
        self.setCursor(Qt.OpenHandCursor)

    def show_content(self, content: MapContent) -> None:
        """Show another curve or other marks."""
        if content.lane is not self._content.lane:
            self._picture = None
        self._content = content
        self.update()

    def show_position(self, share: float) -> None:
        """Show the position as a share (0 to 1) of the recording."""
        moved = round(share * self.width()) != round(self._position * self.width())
        self._position = share
        if moved:
            self.update()

    @property
    def frame(self) -> QRectF:
        """The place of the frame around the shown part."""
        scale = self.width() / self._total
        width = max(self.pageStep() * scale, _MIN_FRAME)
        middle = (self.value() + self.pageStep() / 2) * scale
        left = min(max(middle - width / 2, 0.0), self.width() - width)
        return QRectF(left, 0.0, width, self.height())

    @property
    def _total(self) -> int:
        return max(self.maximum() + self.pageStep(), 1)

    def paintEvent(self, _event: QPaintEvent) -> None:
        """Draw the strip, pale outside the frame."""
        painter = QPainter(self)
        painter.fillRect(self.rect(), QColor(theme().paper))
        self._draw_curve(painter)
        for share in self._content.marks:
            painter.fillRect(QRectF(round(share * self.width()), 0.0, 1.0, self.height()),
                             QColor(theme().warning))
        frame, outside = self.frame, translucent(theme().window, _OUTSIDE_ALPHA)
        painter.fillRect(QRectF(0.0, 0.0, frame.left(), self.height()), outside)
        painter.fillRect(QRectF(frame.right(), 0.0, self.width() - frame.right(), self.height()),
                         outside)
        painter.fillRect(QRectF(round(self._position * self.width()) - 1, 0.0, 2.0,
                                self.height()), QColor(theme().accent))
        painter.setPen(QPen(QColor(theme().line), 1))
        painter.drawRect(QRectF(self.rect()).adjusted(0.5, 0.5, -0.5, -0.5))
        painter.setPen(QPen(QColor(theme().accent), 2))
        painter.drawRect(frame.adjusted(1.0, 1.0, -1.0, -1.0))
        painter.end()

    def _draw_curve(self, painter: QPainter) -> None:
        lane, dots = self._content.lane, self.devicePixelRatioF()
        if lane is None:
            return
        if self._picture is None or self._picture.width() != int(self.width() * dots):
            self._picture = curve_picture(lane, self.width(), self.height(), dots)
        painter.drawPixmap(QPoint(0, 0), self._picture)

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Grab the frame; outside the frame, move its middle to the mouse first."""
        if event.button() != Qt.LeftButton:
            return
        is_inside = self.frame.contains(event.localPos())
        place = self._value_at(event)
        self._grabbed = place - self.value() if is_inside else self.pageStep() / 2
        self.setCursor(Qt.ClosedHandCursor)
        self._drag(event)

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Drag the frame."""
        self._drag(event)

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        """Release the frame."""
        self._grabbed = None
        self.setCursor(Qt.OpenHandCursor)

    def _drag(self, event: QMouseEvent) -> None:
        if self._grabbed is not None:
            self.setValue(round(self._value_at(event) - self._grabbed))

    def _value_at(self, event: QMouseEvent) -> float:
        return event.localPos().x() / max(self.width(), 1) * self._total


BAR_HEIGHT = HEIGHT + 2
_STEP = 1.25
"""Zoom factor for one notch of the wheel or one press of a key."""
_NOTCH = 120  # eighths of a degree, as Qt reports one notch
_MOVED_SHARE = 0.15  # movement for a notch, as a share of the shown time
_PARTS = 1_000_000  # steps of the scroll bar over the whole recording


class TimelineZoom(QObject):
    """The part of the recording that is shown; everything until the operator zooms in."""

    changed = pyqtSignal()

    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent)
        self._shown = whole(0.0)
        self._position_s = 0.0
        self.bar = Minimap(parent)
        self.bar.setObjectName('timeline_part')
        self.bar.setAccessibleName('Part of the recording that is shown')
        self.bar.valueChanged.connect(lambda value: self._take(
            self._shown.beginning_at(value / _PARTS * self._shown.length_s)))
        self._show_bar()

    @property
    def shown(self) -> ShownTime:
        """The part that is shown."""
        return self._shown

    def set_length(self, length_s: float) -> None:
        """Set the length of the recording [s]; a recording of another length is shown whole."""
        if abs(length_s - self._shown.length_s) > 1e-6:
            self._take(whole(length_s))

    def show_all(self) -> None:
        """Show the whole recording."""
        self._take(whole(self._shown.length_s))

    def show_part(self, begin_s: float, end_s: float) -> None:
        """Show a part."""
        self._take(self._shown.part(begin_s, end_s - begin_s))

    def step(self, steps: float, around_s: float) -> None:
        """Zoom in, or (below 0) out; the moment ``around_s`` stays at its place."""
        self._take(self._shown.zoomed(_STEP ** -steps, around_s))

    def turn_wheel(self, turned: QPoint, modifiers: Qt.KeyboardModifiers, at_s: float) -> None:
        """Zoom around the time at the mouse; move with Shift or if the wheel turns sideways."""
        sideways = turned.x() or (turned.y() if modifiers & Qt.ShiftModifier else 0)
        if sideways:
            by_s = -_MOVED_SHARE * sideways / _NOTCH * self._shown.duration_s
            self._take(self._shown.beginning_at(self._shown.begin_s + by_s))
        else:
            self.step(turned.y() / _NOTCH, at_s)

    def follow(self, position_s: float, is_playing: bool) -> None:
        """Keep the position in view; while playing, only if it was in view before."""
        before_s, self._position_s = self._position_s, position_s
        if position_s != before_s and (not is_playing or self._shown.contains(before_s)):
            self._take(self._shown.showing(position_s))

    def place(self, rect: QRect) -> None:
        """Set the place of the strip."""
        self.bar.setGeometry(rect.adjusted(0, 0, 0, HEIGHT - BAR_HEIGHT))

    def _take(self, shown: ShownTime) -> None:
        if shown != self._shown:
            self._shown = shown
            self._show_bar()
            self.changed.emit()

    def _show_bar(self) -> None:
        shown = self._shown
        parts = _PARTS / shown.length_s if shown.length_s > 0.0 else 0.0
        page = round(shown.duration_s * parts)
        self.bar.blockSignals(True)
        self.bar.setRange(0, max(_PARTS - page, 0))
        self.bar.setPageStep(page)
        self.bar.setSingleStep(max(round(_MOVED_SHARE * page), 1))
        self.bar.setValue(round(shown.begin_s * parts))
        self.bar.blockSignals(False)
        self.bar.setVisible(not shown.is_all)
