# SPDX-License-Identifier: BSD-3-Clause
"""The timeline: a slider over the whole recording, with marks, loop, and curves below."""
from __future__ import annotations

from typing import Any, Callable, Optional, Sequence, Tuple

from PyQt5.QtCore import QEvent, QPoint, QPointF, QRect, QRectF, Qt, pyqtSignal
from PyQt5.QtGui import (
    QColor,
    QContextMenuEvent,
    QHelpEvent,
    QKeyEvent,
    QMouseEvent,
    QPainter,
    QPen,
    QPixmap,
    QPolygonF,
    QWheelEvent,
)
from PyQt5.QtWidgets import QApplication, QMenu, QScrollBar, QToolTip, QWidget

from process_visualizer.curves.position_values import Key
from process_visualizer.figures import clock_text
from process_visualizer.gui.lanes import timeline_header as header
from process_visualizer.gui.lanes.lane_choice import LaneChoices
from process_visualizer.gui.lanes.lane_scale import SIDE
from process_visualizer.gui.lanes.lanes_timeline import LanesTimeline
from process_visualizer.gui.lanes.timeline_header import (
    AXIS_TOP,
    LEFT,
    TRACK_TOP,
    Target,
    axis_of,
    target_at,
    track_rect,
)
from process_visualizer.gui.lanes.timeline_lanes import Lane, LaneTexts, lane_texts
from process_visualizer.gui.playback.minimap import BAR_HEIGHT, MapContent, TimelineZoom
from process_visualizer.gui.playback.playback_model import PlaybackModel
from process_visualizer.gui.playback.playback_state import LoopPoints, PlacedMark
from process_visualizer.gui.toolkit.labels import plain_tip
from process_visualizer.gui.toolkit.theme import theme
from process_visualizer.gui.toolkit.time_axis import TimeAxis
from process_visualizer.runs.comparison.timeline_bands import MomentKind, ReferenceMoment


def timeline_menu(parent: QWidget, playback: PlaybackModel, zoom: TimelineZoom, time_s: float,
                  add_mark: Callable[[], None]) -> QMenu:
    """Return the menu for a time [s], not yet open."""
    menu = QMenu(parent)
    menu.setObjectName('timeline_menu')
    menu.addAction(f'Go to {clock_text(time_s, 3)}', lambda: playback.seek(time_s))
    menu.addSeparator()
    menu.addAction('Loop from here (A)', lambda: playback.set_loop_begin(time_s))
    menu.addAction('Loop to here (B)', lambda: playback.set_loop_end(time_s))
    remove = menu.addAction('Remove A and B', playback.clear_loop)
    remove.setEnabled(playback.state.points != LoopPoints() or playback.is_looping)
    menu.addSeparator()
    menu.addAction('Add a mark here…', add_mark)
    menu.addSeparator()
    bounds = playback.state.points.bounds(playback.state.duration_s)
    part = menu.addAction('Show A to B only', lambda: zoom.show_part(*bounds))
    part.setEnabled(bounds != (0.0, playback.state.duration_s))
    everything = menu.addAction('Show the whole recording (double click)', zoom.show_all)
    everything.setEnabled(not zoom.shown.is_all)
    return menu


# Moments of the reference run as diamonds above the slider's groove, which can be dragged.

_MIDDLE, _SIZE, _REACH = TRACK_TOP + 5.0, 4.5, 6.0  # px
_TIPS = {
    MomentKind.EVENT: 'where the good run has "{}". If it belongs elsewhere, drag it there.',
    MomentKind.DEPARTURE: '"{}" begins to differ. Drag it if the good run is aligned wrongly.',
    MomentKind.ANCHOR: '"{}" of the good run, where you have put it. "Reset alignment" undoes it.'}


def moment_at(place: QPointF, axis: TimeAxis, moments: Sequence[ReferenceMoment]) -> int:
    """Return the row of the moment nearest to a place; -1 if none is near."""
    if abs(place.y() - _MIDDLE) > _REACH or not moments:
        return -1
    away = [abs(place.x() - axis.x(it.position_s)) for it in moments]
    row = min(range(len(away)), key=lambda it: away[it])
    return row if away[row] <= _REACH else -1


def with_dragged(moments: Tuple[ReferenceMoment, ...], row: int,
                 time_s: Optional[float]) -> Tuple[ReferenceMoment, ...]:
    """Return moments as shown while one (-1: none) is dragged: as an anchor at ``time_s``."""
    if row < 0 or time_s is None:
        return moments
    moved = moments[row]._replace(position_s=time_s, kind=MomentKind.ANCHOR)
    return (*moments[:row], moved, *moments[row + 1:])


def moment_tip(moment: ReferenceMoment) -> str:
    """Return the text of a moment's tooltip."""
    return f'{clock_text(moment.position_s, 3)}  ' + _TIPS[moment.kind].format(moment.label)


def draw_moments(
    painter: QPainter, axis: TimeAxis, moments: Sequence[ReferenceMoment], part: QRect
) -> None:
    """Draw a diamond for each moment in a part of the timeline."""
    left, right = max(axis.left - 1, part.left() - _SIZE), min(axis.right + 1,
                                                               part.right() + _SIZE)
    for moment in moments:
        x = axis.x(moment.position_s)
        if left <= x <= right:
            _draw(painter, x, moment.kind, track_rect(axis).top())


def _draw(painter: QPainter, x: float, kind: MomentKind, bottom: float) -> None:
    color = QColor({MomentKind.EVENT: theme().quiet, MomentKind.DEPARTURE: theme().bad,
                    MomentKind.ANCHOR: theme().accent}[kind])
    painter.fillRect(QRectF(round(x), _MIDDLE, 1, bottom - _MIDDLE), color)
    painter.setPen(QPen(color, 1.4))
    painter.setBrush(color if kind is MomentKind.ANCHOR else QColor(theme().paper))
    painter.drawPolygon(QPolygonF([QPointF(x, _MIDDLE - _SIZE), QPointF(x + _SIZE, _MIDDLE),
                                   QPointF(x, _MIDDLE + _SIZE), QPointF(x - _SIZE, _MIDDLE)]))
    painter.setBrush(Qt.NoBrush)


_CURSORS = {'A': Qt.SizeHorCursor, 'B': Qt.SizeHorCursor, 'moment': Qt.SizeHorCursor,
            'mark': Qt.PointingHandCursor}
_PLAYHEAD_REACH, _HOVER_REACH = 10, 110  # px to redraw on each side of playhead and mouse
_HINT = ('Click to jump, drag to look around, drag A and B to change the loop.\n'
         'Turn the wheel to zoom in (Shift: move), double-click to see all.\n'
         'Home/End: jump to start/end. Page up/down: jump from mark to mark. A, B, L: the loop.')


class TimelineView(LanesTimeline):
    """The timeline of a recording; playback goes where the operator presses or drags."""

    mark_wanted = pyqtSignal(float)
    """The operator wants to add a mark at this time [s]."""

    anchor_wanted = pyqtSignal(object, float)
    """The operator aligns this ReferenceMoment with this time [s]."""

    _below_lanes = BAR_HEIGHT

    def __init__(self, playback: PlaybackModel, value_of: Callable[[Key], Optional[float]],
                 choices: LaneChoices, parent: Optional[QWidget] = None) -> None:
        """Set ``value_of``: a curve's value at the position (NaN: no value, None: unknown yet)."""
        super().__init__(choices, parent)
        self._playback, self._value_of = playback, value_of
        self._length_s = 0.0
        self._gaps: Tuple[Tuple[float, float], ...] = ()
        self.alarms = header.Alarms()  # alarms in the recording
        self._moments: Tuple[ReferenceMoment, ...] = ()
        self._header: Optional[Tuple[Any, QPixmap]] = None
        self._hover = Target('time')
        self._dragged: Optional[Target] = None
        self._drawn_x = 0
        self.zoom = TimelineZoom(self)
        self.zoom.changed.connect(self.update)
        self.setObjectName('timeline')
        self.setAccessibleName('Timeline of the recording')
        self.setToolTip(_HINT)
        self.setFocusPolicy(Qt.StrongFocus)
        playback.changed.connect(self._take_length)
        playback.moved.connect(self._follow)
        self._fit()

    def set_recording(self, duration_s: float, gaps: Sequence[Tuple[float, float]] = ()) -> None:
        """Set the length of the recording [s] and the parts [s, s] that cannot be read."""
        self._length_s, self._gaps = duration_s, tuple(gaps)
        self._take_length()

    def _take_length(self) -> None:
        self.zoom.set_length(self._length_s or self._playback.state.duration_s)
        self._show_map()
        self.update()

    @property
    def _marks(self) -> Tuple[PlacedMark, ...]:
        return self._playback.state.marks.all

    def _show_map(self) -> None:
        """Show the first curve and the marks of the whole recording."""
        length_s = self.zoom.shown.length_s
        marks = [mark.position_s / length_s for mark in self._marks] if length_s else []
        self.zoom.bar.show_content(MapContent(next(iter(self.stack.lanes), None), tuple(marks)))

    def set_lanes(self, lanes: Sequence[Lane]) -> None:
        """Set the curves, from top to bottom."""
        self.stack.set_lanes(lanes)
        self._show_map()
        self._fit()
        self.updateGeometry()
        self.update()

    def set_moments(self, moments: Sequence[ReferenceMoment]) -> None:
        """Set the moments of the reference run, which are shown and can be dragged."""
        if tuple(moments) != self._moments:
            self._moments = tuple(moments)
            if self._dragged_moment >= 0:  # its row may be that of another moment now
                self._dragged = None
            self._update_header()

    @property
    def axis(self) -> TimeAxis:
        """The time axis."""
        return axis_of(self.zoom.shown, self.width())

    def lane_texts(self, row: int, number: int = 0) -> LaneTexts:
        """Return a curve's value at the position, its value at the mouse, and their difference."""
        curve, length_s = self.stack.lanes[row].curves[number], self.zoom.shown.length_s
        time_s = self.hover_s
        at_mouse = None if time_s is None or not length_s else curve.range_at(
            time_s / length_s)
        good = curve.good_at(self._playback.position_s / length_s) if length_s else None
        return lane_texts(curve, self.stack.pictures.scale(row, number).span,
                          self._value_of(curve.key), at_mouse, good)

    def show_values(self) -> None:
        """Redraw the values at the position."""
        self._update_values()

    # Size

    def _fit(self) -> None:
        """Give the lanes and the scroll bars their places."""
        super()._fit()
        self.zoom.place(QRect(int(LEFT), self.height() - BAR_HEIGHT,
                              self.width() - int(LEFT + SIDE), BAR_HEIGHT))

    # Drawing

    def _lanes_axis(self) -> Tuple[TimeAxis, float]:
        return self.axis, self.zoom.shown.length_s

    def _draw(self, painter: QPainter, axis: TimeAxis, bottom: float, area: QRect) -> None:
        header.draw_gaps(painter, axis, self._gaps, bottom)
        painter.setRenderHint(QPainter.Antialiasing)
        self._draw_header(painter, axis)
        loop = self._loop()
        if loop is not None:
            header.draw_loop(painter, axis, loop, bottom)
        self._draw_position(painter, axis, bottom)
        draw_moments(painter, axis, with_dragged(self._moments, self._dragged_moment,
                                                 self.hover_s), area)

    def _draw_header(self, painter: QPainter, axis: TimeAxis) -> None:
        hovered = self._hover.mark if self._hover.kind == 'mark' else -1
        look = (axis, self._marks, hovered, self.devicePixelRatioF(), self._font,
                self.alarms)
        if self._header is None or self._header[0] != (theme(), look):
            self._header = ((theme(), look), header.header_picture(*look))
        painter.drawPixmap(QPoint(0, 0), self._header[1])

    @property
    def _dragged_moment(self) -> int:
        """The row of the moment that is being dragged; -1 for none."""
        is_moment = self._dragged is not None and self._dragged.kind == 'moment'
        return self._dragged.mark if is_moment and self._dragged is not None else -1

    def _draw_position(self, painter: QPainter, axis: TimeAxis, bottom: float) -> None:
        position_s = self._playback.position_s
        self._drawn_x = round(axis.x(position_s))
        if axis.duration_s > 0.0:
            header.draw_playhead(painter, axis, position_s, bottom,
                                 self._playback.state.is_available)
        hover_s = self.hover_s
        if hover_s is not None:
            away = f'Δ {hover_s - position_s:+.3f} s'.replace('-', '−')  # after or before position
            text = f'{clock_text(hover_s, 3)}  {away}'
            header.draw_hover(painter, axis, hover_s, text, bottom)

    def _loop(self) -> Optional[header.Loop]:
        """Return the loop to show: A to B, or everything while that is repeated; None without."""
        points, length_s = self._playback.state.points, self.zoom.shown.length_s
        if not self._playback.is_looping and points.begin_s is None and points.end_s is None:
            return None
        return header.Loop(*points.bounds(length_s), self._playback.is_looping)

    def _follow(self) -> None:
        """Redraw the playhead when it has moved by a pixel."""
        if self.zoom.shown.length_s > 0.0:
            self.zoom.bar.show_position(self._playback.position_s / self.zoom.shown.length_s)
        self.zoom.follow(self._playback.position_s, self._playback.state.is_playing)
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
        self._update_header()
        self._update_values()

    def _update_values(self) -> None:
        """Redraw only the numbers, as everything drawn is sent to the screen."""
        axis = self.axis
        if self._hover_x is not None:  # the time from the position to the mouse
            self._update_header()
        for row in range(len(self.stack.lanes)):
            self.update(self.stack.texts_rect(row, axis).toAlignedRect())

    # The mouse

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Grab the target under the mouse: a handle, a mark, a moment, or the time."""
        if event.button() != Qt.LeftButton or self.stack.fold(event.pos(), self._choices) \
                or not self._playback.state.is_available:
            return
        self._dragged = self._target_at(event.localPos())
        if self._dragged.kind == 'mark':
            self._playback.seek(self._marks[self._dragged.mark].position_s)
        elif self._dragged.kind == 'time':
            self._playback.seek(self.axis.time_s(event.localPos().x()))

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Drag the grabbed target; otherwise show the target under the mouse."""
        time_s = self.axis.time_s(event.localPos().x())
        if self._dragged is None:
            self._hover = self._target_at(event.localPos())
            self.setCursor(_CURSORS.get(self._hover.kind, Qt.ArrowCursor))
        elif self._dragged.kind == 'time':
            self._playback.begin_scrub()
            self._playback.seek(time_s)
        elif self._dragged.kind in 'AB':
            self._playback.move_loop_point(self._dragged.kind, time_s)
        self._show_hover(event.localPos().x() if self.axis.duration_s > 0.0 else None)

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        """Release the target; play again if it played before."""
        if event.button() == Qt.LeftButton:
            row, self._dragged = self._dragged_moment, None
            if row >= 0:
                self._put(self._moments[row], event.localPos().x())
            self._playback.end_scrub()

    def _put(self, moment: ReferenceMoment, x: float) -> None:
        """Align a moment that was dragged to a place [px]; go to it if it was only pressed."""
        if abs(x - self.axis.x(moment.position_s)) < QApplication.startDragDistance():
            self._playback.seek(moment.position_s)
        else:
            self.anchor_wanted.emit(moment, self.axis.time_s(x))
        self._update_header()

    def leaveEvent(self, event: QEvent) -> None:
        """Hide the line at the mouse."""
        self._hover = Target('time')
        self._show_hover(None)

    def wheelEvent(self, event: QWheelEvent) -> None:
        """Scroll lanes that do not fit if the wheel is over them without Ctrl; otherwise zoom."""
        if not self._scrolls_lanes(event):
            self.zoom.turn_wheel(event.angleDelta(), event.modifiers(),
                                 self.axis.time_s(event.pos().x()))

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        """Show the whole recording."""
        if event.button() == Qt.LeftButton:
            self.zoom.show_all()

    def event(self, event: QEvent) -> bool:
        """Show a tooltip: the whole label of a mark, a moment, or a hint."""
        if event.type() == QEvent.ToolTip:
            self._show_tip(event)
            return True
        return super().event(event)

    def _show_tip(self, event: QHelpEvent) -> None:
        target = self._target_at(event.pos())
        text = ''
        if target.kind == 'mark':
            mark = self._marks[target.mark]
            text = f'{clock_text(mark.position_s, 3)}  {mark.label}'
        elif target.kind == 'moment':
            text = moment_tip(self._moments[target.mark])
        elif TRACK_TOP <= event.pos().y() < AXIS_TOP:
            text = self.toolTip()
        QToolTip.showText(event.globalPos(), plain_tip(text), self)

    def _target_at(self, place: QPoint) -> Target:
        loop, row = self._loop(), moment_at(QPointF(place), self.axis, self._moments)
        return Target('moment', row) if row >= 0 else target_at(
            place, self.axis, self._marks, None if loop is None else loop.bounds)

    # Keys and menu

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Handle the keys that move playback; up and down scroll the lanes."""
        playback, scroll = self._playback, self.stack.scroll
        action = {Qt.Key_Left: lambda: playback.step(-1), Qt.Key_Right: lambda: playback.step(1),
                  Qt.Key_Home: lambda: playback.seek(0.0),
                  Qt.Key_End: lambda: playback.seek(playback.state.duration_s),
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
        """Open the menu for the time under the mouse, or by keyboard, at the playhead."""
        if not self._playback.state.is_available:
            return
        by_mouse = event.reason() == QContextMenuEvent.Mouse
        time_s = self.axis.time_s(event.x()) if by_mouse else self._playback.position_s
        menu = self.menu_at(time_s, self.stack.row_at(event.y()) if by_mouse else None)
        menu.setAttribute(Qt.WA_DeleteOnClose)
        menu.popup(event.globalPos())

    def menu_at(self, time_s: float, row: Optional[int] = None) -> QMenu:
        """Return the menu for a time [s], with actions for a lane if there is one."""
        menu = timeline_menu(self, self._playback, self.zoom, time_s,
                             lambda: self.mark_wanted.emit(time_s))
        menu.addSeparator()
        self._add_lane_actions(menu, row)
        return menu

    def zoom_in(self, steps: float) -> None:
        """Zoom in, or (below 0) out, around the position."""
        self.zoom.step(steps, self._playback.position_s)
