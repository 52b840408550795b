# SPDX-License-Identifier: BSD-3-Clause
"""The timeline: the whole recording as a slider, with marks, loop, and curves below it."""
from __future__ import annotations

from typing import Any, Callable, Optional, Sequence, Tuple

from PyQt5.QtCore import QEvent, QPoint, QRect, QRectF, QSize, Qt, pyqtSignal
from PyQt5.QtGui import (
    QContextMenuEvent,
    QFont,
    QHelpEvent,
    QKeyEvent,
    QMouseEvent,
    QPainter,
    QPaintEvent,
    QPalette,
    QPixmap,
    QResizeEvent,
    QWheelEvent,
)
from PyQt5.QtWidgets import QMenu, QScrollBar, QSizePolicy, QToolTip, QWidget

from process_visualizer.curves.position_values import Key
from process_visualizer.gui.models.playback.playback_model import PlaybackModel
from process_visualizer.gui.toolkit.time_axis import TimeAxis
from process_visualizer.gui.views.playback import timeline_header as header
from process_visualizer.gui.views.playback.lane_pictures import LanePictures
from process_visualizer.gui.views.playback.timeline_lanes import (
    LANE_HEIGHT,
    MOST_LANE_HEIGHT,
    TEXT_HEIGHT,
    VALUES_WIDTH,
    Lane,
    number_text,
)
from process_visualizer.gui.views.playback.timeline_layout import (
    AXIS_TOP,
    HEADER_HEIGHT,
    SIDE,
    TRACK_TOP,
    Target,
    axis_of,
    target_at,
)
from process_visualizer.gui.views.playback.timeline_menu import timeline_menu
from process_visualizer.gui.views.playback.timeline_zoom import BAR_HEIGHT, TimelineZoom
from process_visualizer.playback.time_text import format_time

_FEWEST_LANES = 2  # that are visible, if there are so many
_FONT_PX = 11
_PLAYHEAD_REACH, _HOVER_REACH = 10, 110  # px to each side of them that are redrawn
_HINT = ('Press to go there, drag to look around, drag A and B to change the loop.\n'
         'Turn the wheel to zoom in (Shift: move), double-click to see all.\n'
         'Home and End: to the ends. Page up and down: from mark to mark. A, B, L: the loop.')


class TimelineView(QWidget):
    """Shows the position in the recording, and goes where the operator presses or drags."""

    mark_wanted = pyqtSignal(float)
    """A mark should be added at this time [s]."""

    def __init__(self, playback: PlaybackModel, value_of: Callable[[Key], Optional[float]],
                 parent: Optional[QWidget] = None) -> None:
        """``value_of`` returns a lane's value at the position: NaN: none, None: unknown yet."""
        super().__init__(parent)
        self._playback, self._value_of = playback, value_of
        self._length_s = 0.0
        self._gaps: Tuple[Tuple[float, float], ...] = ()
        self.alarms: Tuple[Tuple[float, float], ...] = ()  # [s, s], shown when lanes are set
        self._lanes: Tuple[Lane, ...] = ()
        self._header: Optional[Tuple[Any, QPixmap]] = None
        self._font = QFont(self.font())
        self._font.setPixelSize(_FONT_PX)
        self._hover_x: Optional[float] = None
        self._hover = Target('time')
        self._dragged: Optional[Target] = None
        self._drawn_x = 0
        self._pictures = LanePictures(self)
        self._pictures.drawn.connect(self._update_lane)
        self._lane_height = LANE_HEIGHT
        self._scroll = QScrollBar(Qt.Vertical, self)
        self._scroll.setObjectName('timeline_scroll')
        self._scroll.valueChanged.connect(lambda _value: self.update())
        self.zoom = TimelineZoom(self)
        self.zoom.changed.connect(self.update)
        self.setObjectName('timeline')
        self.setAccessibleName('Timeline of the recording')
        self.setToolTip(_HINT)
        self.setMouseTracking(True)
        self.setFocusPolicy(Qt.StrongFocus)
        self.setSizePolicy(QSizePolicy.Expanding, QSizePolicy.Preferred)
        playback.changed.connect(self._take_length)
        playback.moved.connect(self._follow)
        self._fit()

    def set_recording(self, duration_s: float, gaps: Sequence[Tuple[float, float]] = ()) -> None:
        """Set the length of the recording [s] and the parts [s, s] that cannot be read."""
        self._length_s, self._gaps = duration_s, tuple(gaps)
        self._take_length()

    def _take_length(self) -> None:
        self.zoom.set_length(self._playback.duration_s or self._length_s)
        self.update()

    def set_lanes(self, lanes: Sequence[Lane]) -> None:
        """Set the curves, from top to bottom."""
        self._lanes = tuple(lanes)
        self._pictures.set_lanes(lanes)
        self._fit()
        self.updateGeometry()
        self.update()

    @property
    def axis(self) -> TimeAxis:
        """The time axis."""
        return axis_of(self.zoom.shown, self.width())

    def lane_values(self, row: int) -> Tuple[str, str]:
        """Return a lane's value at the position, and its largest one."""
        lane = self._lanes[row]
        value, largest = self._value_of(lane.key), lane.largest
        return ('…' if value is None else _with_unit(lane, value),
                f'max {number_text(largest, largest)}')

    def hover_value(self, row: int) -> str:
        """Return the value of a lane's curve at the mouse; empty without a mouse."""
        lane, length_s, time_s = self._lanes[row], self.zoom.shown.length_s, self._hover_s
        if time_s is None or not length_s:
            return ''
        return _with_unit(lane, lane.at(time_s / length_s))

    @property
    def _hover_s(self) -> Optional[float]:
        """The time at the mouse, which changes when the axis moves below it."""
        return None if self._hover_x is None else self.axis.time_s(self._hover_x)

    def show_values(self) -> None:
        """Redraw the values at the position."""
        self._update_values()

    # Size

    def sizeHint(self) -> QSize:
        """Return a size with room for all lanes."""
        return QSize(400, self._height_of(len(self._lanes)))

    def minimumSizeHint(self) -> QSize:
        """Return a size in which the slider and some lanes can be used."""
        return QSize(220, self._height_of(min(len(self._lanes), _FEWEST_LANES)))

    def _height_of(self, lanes: int) -> int:
        return int(HEADER_HEIGHT) + lanes * LANE_HEIGHT + 2 + BAR_HEIGHT

    def _fit(self) -> None:
        """Give the scroll bars their place and range."""
        count = len(self._lanes)
        self.setMaximumHeight(self._height_of(count) + count * (MOST_LANE_HEIGHT - LANE_HEIGHT))
        visible = self.height() - int(HEADER_HEIGHT) - BAR_HEIGHT
        self.zoom.place(QRect(int(SIDE), self.height() - BAR_HEIGHT,
                              self.width() - 2 * int(SIDE), BAR_HEIGHT))
        self._lane_height = min(max((visible - 2) // max(count, 1), LANE_HEIGHT), MOST_LANE_HEIGHT)
        hidden = max(count * self._lane_height + 2 - visible, 0)
        self._scroll.setRange(0, hidden)
        self._scroll.setPageStep(max(visible, 1))
        self._scroll.setSingleStep(LANE_HEIGHT // 2)
        self._scroll.setVisible(hidden > 0)
        self._scroll.setGeometry(self.width() - int(SIDE) + 2, int(HEADER_HEIGHT),
                                 int(SIDE) - 2, max(visible, 0))

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Give the lanes their height in the new size."""
        self._fit()

    # Drawing

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw the changes; curves and header are drawn once and kept."""
        painter = QPainter(self)
        painter.setFont(self._font)
        axis, bottom = self.axis, float(self.height() - BAR_HEIGHT)
        painter.fillRect(event.rect(), self.palette().color(QPalette.Base))
        self._draw_lanes(painter, axis, event.rect())
        header.draw_gaps(painter, axis, self._gaps, bottom)
        painter.setRenderHint(QPainter.Antialiasing)
        self._draw_header(painter, axis)
        loop = self._loop()
        if loop is not None:
            header.draw_loop(painter, axis, loop, bottom)
        self._draw_position(painter, axis, bottom)
        if event.rect().right() >= self.width() - SIDE - VALUES_WIDTH:
            self._draw_values(painter, axis)
        painter.end()

    def _draw_header(self, painter: QPainter, axis: TimeAxis) -> None:
        hovered = self._hover.mark if self._hover.kind == 'mark' else -1
        look = (axis, self._playback.marks, hovered, self.devicePixelRatioF(), self._font,
                self.alarms)
        if self._header is None or self._header[0] != look:
            self._header = (look, header.header_picture(*look))
        painter.drawPixmap(QPoint(0, 0), self._header[1])

    def _draw_position(self, painter: QPainter, axis: TimeAxis, bottom: float) -> None:
        position_s = self._playback.position_s
        self._drawn_x = round(axis.x(position_s))
        if axis.duration_s > 0.0:
            header.draw_playhead(painter, axis, position_s, bottom, self._playback.is_available)
        hover_s = self._hover_s
        if hover_s is not None:
            header.draw_hover(painter, axis, hover_s, format_time(hover_s), bottom)
            self._draw_hover_values(painter, axis, hover_s)

    def _draw_hover_values(self, painter: QPainter, axis: TimeAxis, time_s: float) -> None:
        painter.save()
        painter.setClipRect(self._lanes_rect())
        for row in range(len(self._lanes)):
            top = self._lane_rect(row).bottom() - TEXT_HEIGHT - 2.0  # below the other numbers
            header.draw_hover_value(painter, axis, time_s, self.hover_value(row), top, TEXT_HEIGHT)
        painter.restore()

    def _draw_lanes(self, painter: QPainter, axis: TimeAxis, area: QRect) -> None:
        if not self._lanes:
            return
        self._pictures.want(axis, self.width(), self._lane_height, self.devicePixelRatioF(),
                            self._font, self.zoom.shown.length_s)
        painter.setClipRect(area.intersected(self._lanes_rect()))
        for row in range(len(self._lanes)):
            picture, place = self._pictures.picture(row), self._lane_rect(row)
            if picture is not None and place.intersects(area):
                painter.drawPixmap(place, picture)
        painter.setClipRect(area)

    def _lane_rect(self, row: int) -> QRect:
        top = int(HEADER_HEIGHT) + row * self._lane_height - self._scroll.value()
        return QRect(0, top, self.width(), self._lane_height)

    def _update_lane(self, row: int) -> None:
        self.update(self._lane_rect(row))

    def _draw_values(self, painter: QPainter, axis: TimeAxis) -> None:
        painter.setClipRect(self._lanes_rect())
        for row in range(len(self._lanes)):
            rect = self._values_rect(row, axis)
            if HEADER_HEIGHT - self._lane_height < rect.top() < self.height() - BAR_HEIGHT:
                header.draw_values(painter, rect, *self.lane_values(row))

    def _values_rect(self, row: int, axis: TimeAxis) -> QRectF:
        return QRectF(axis.right - VALUES_WIDTH, self._lane_rect(row).top() + 1, VALUES_WIDTH,
                      TEXT_HEIGHT)

    def _lanes_rect(self) -> QRect:
        return self.rect().adjusted(0, int(HEADER_HEIGHT), 0, -BAR_HEIGHT)

    def _loop(self) -> Optional[header.Loop]:
        """The loop to show: A and B, or everything while that is repeated."""
        points, length_s = self._playback.loop_points, self.zoom.shown.length_s
        if not self._playback.is_looping and points.begin_s is None and points.end_s is None:
            return None
        return header.Loop(*points.bounds(length_s), self._playback.is_looping)

    def _follow(self) -> None:
        """Redraw the playhead when it has moved by a pixel."""
        self.zoom.follow(self._playback.position_s, self._playback.is_playing)
        x = round(self.axis.x(self._playback.position_s))
        if x == self._drawn_x:
            return
        left, right = sorted((x, self._drawn_x))
        self.update(left - _PLAYHEAD_REACH, 0, right - left + 2 * _PLAYHEAD_REACH, self.height())

    def _show_hover(self, x: Optional[float]) -> None:
        """Redraw the line at the mouse with its numbers, and the flags."""
        for shown_x in (self._hover_x, x):
            if shown_x is not None:
                self.update(round(shown_x) - _HOVER_REACH, 0, 2 * _HOVER_REACH, self.height())
        self._hover_x = x
        self.update(0, 0, self.width(), int(HEADER_HEIGHT))

    def _update_values(self) -> None:
        """Redraw only the numbers: everything that is drawn is sent to the screen."""
        axis = self.axis
        for row in range(len(self._lanes)):
            self.update(self._values_rect(row, axis).toAlignedRect())

    # The mouse

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Grab what is under the mouse: a handle, a mark, or the time."""
        if event.button() != Qt.LeftButton or not self._playback.is_available:
            return
        self._dragged = self._target(event)
        if self._dragged.kind == 'mark':
            self._playback.seek(self._playback.marks[self._dragged.mark].position_s)
        elif self._dragged.kind == 'time':
            self._playback.seek(self.axis.time_s(event.localPos().x()))

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Drag what was grabbed; otherwise show what is under the mouse."""
        time_s = self.axis.time_s(event.localPos().x())
        if self._dragged is None:
            self._hover = self._target(event)
            self.setCursor({'A': Qt.SizeHorCursor, 'B': Qt.SizeHorCursor,
                            'mark': Qt.PointingHandCursor}.get(self._hover.kind, Qt.ArrowCursor))
        elif self._dragged.kind == 'time':
            self._playback.begin_scrub()
            self._playback.seek(time_s)
        elif self._dragged.kind in 'AB':
            self._playback.move_loop_point(self._dragged.kind, time_s)
        self._show_hover(event.localPos().x() if self.axis.duration_s > 0.0 else None)

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        """Release; continue to play if it played before."""
        if event.button() == Qt.LeftButton:
            self._dragged = None
            self._playback.end_scrub()

    def leaveEvent(self, event: QEvent) -> None:
        """Hide the line at the mouse."""
        self._hover = Target('time')
        self._show_hover(None)

    def wheelEvent(self, event: QWheelEvent) -> None:
        """Zoom in or out; over lanes that do not fit, without Ctrl, scroll them."""
        is_over_lanes = event.pos().y() >= HEADER_HEIGHT
        modifiers = event.modifiers()
        if self._scroll.maximum() and is_over_lanes and modifiers == Qt.NoModifier:
            self._scroll.event(event)
        else:
            self.zoom.turn_wheel(event.angleDelta(), modifiers,
                                 self.axis.time_s(event.pos().x()))

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        """Show the whole recording."""
        if event.button() == Qt.LeftButton:
            self.zoom.show_all()

    def event(self, event: QEvent) -> bool:
        """Show a mark's whole label, or a hint, in a tooltip."""
        if event.type() == QEvent.ToolTip:
            self._show_tip(event)
            return True
        return super().event(event)

    def _show_tip(self, event: QHelpEvent) -> None:
        target = self._target_at(event.pos())
        text = ''
        if target.kind == 'mark':
            mark = self._playback.marks[target.mark]
            text = f'{format_time(mark.position_s)}  {mark.label}'
        elif TRACK_TOP <= event.pos().y() < AXIS_TOP:
            text = self.toolTip()
        QToolTip.showText(event.globalPos(), text, self)

    def _target(self, event: QMouseEvent) -> Target:
        return self._target_at(event.localPos())

    def _target_at(self, place: QPoint) -> Target:
        loop = self._loop()
        return target_at(place, self.axis, self._playback.marks,
                         None if loop is None else loop.bounds)

    # Keys and menu

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Move with the keys of the window; up and down scroll."""
        playback, scroll = self._playback, self._scroll
        action = {Qt.Key_Left: lambda: playback.step(-1), Qt.Key_Right: lambda: playback.step(1),
                  Qt.Key_Home: playback.to_start, Qt.Key_End: playback.to_end,
                  Qt.Key_PageUp: playback.to_previous_mark,
                  Qt.Key_PageDown: playback.to_next_mark,
                  Qt.Key_Up: lambda: scroll.triggerAction(QScrollBar.SliderSingleStepSub),
                  Qt.Key_Down: lambda: scroll.triggerAction(QScrollBar.SliderSingleStepAdd),
                  }.get(event.key())
        if action is None:
            super().keyPressEvent(event)
        else:
            action()

    def contextMenuEvent(self, event: QContextMenuEvent) -> None:
        """Offer what can be done with the time under the mouse, or at the playhead."""
        if not self._playback.is_available:
            return
        by_mouse = event.reason() == QContextMenuEvent.Mouse
        time_s = self.axis.time_s(event.x()) if by_mouse else self._playback.position_s
        menu = self.menu_at(time_s)
        menu.setAttribute(Qt.WA_DeleteOnClose)
        menu.popup(event.globalPos())

    def menu_at(self, time_s: float) -> QMenu:
        """Return the menu for a time [s]."""
        return timeline_menu(self, self._playback, self.zoom, time_s,
                             lambda: self.mark_wanted.emit(time_s))

    def zoom_in(self, steps: float) -> None:
        """Zoom in, or (below 0) out, around the position."""
        self.zoom.step(steps, self._playback.position_s)


def _with_unit(lane: Lane, value: float) -> str:
    return f'{number_text(value, lane.largest)} {lane.unit}'.rstrip()
