# SPDX-License-Identifier: BSD-3-Clause
"""The timeline of the last seconds: live curves, with the present at the right."""
from __future__ import annotations

from typing import Callable, List, Mapping, NamedTuple, Optional, Sequence, Tuple

import numpy as np
from PyQt5.QtCore import QEvent, QRect, QRectF, Qt, pyqtSignal
from PyQt5.QtGui import (
    QColor,
    QContextMenuEvent,
    QMouseEvent,
    QPainter,
    QWheelEvent,
)
from PyQt5.QtWidgets import QMenu, QWidget

from process_visualizer.curves.live_curves import LiveMark
from process_visualizer.curves.position_values import Key
from process_visualizer.gui.lanes import timeline_header as header
from process_visualizer.gui.lanes.lane_choice import LaneChoices
from process_visualizer.gui.lanes.lane_scale import SIDE
from process_visualizer.gui.lanes.lanes_timeline import LanesTimeline
from process_visualizer.gui.lanes.timeline_header import (
    AXIS_HEIGHT,
    AXIS_TOP,
    LEFT,
)
from process_visualizer.gui.lanes.timeline_lanes import Lane, LaneTexts, lane_texts
from process_visualizer.gui.playback.playback_state import PlacedMark
from process_visualizer.gui.toolkit.theme import theme
from process_visualizer.gui.toolkit.time_axis import TimeAxis
from process_visualizer.health.device_state import Level
from process_visualizer.health.near_objects import NearSpan, times

_LABEL_PX = 80.0
_TICK_PX = 110.0  # the last label is left of its tick and needs room for one and a half labels
_NEWEST_S = 0.5  # maximum age of the newest moment of a band


class LiveValue(NamedTuple):
    """The value at the right end, NaN without one; age of the newest value at the right end."""

    value: float
    age_s: float


class LiveTimeline(LanesTimeline):
    """Lanes with a common time axis, with the values at the mouse."""

    longer_wanted = pyqtSignal(int)
    """The operator wants to see this number of steps more of the past, or (below 0) less."""

    replay_wanted = pyqtSignal(float)
    """The operator wants to see this time [s, below 0: before the right end] in the scene."""

    def __init__(self, choices: LaneChoices, replayed: Callable[[Key], Optional[float]],
                 parent: Optional[QWidget] = None) -> None:
        """``replayed`` returns a curve's value at the position of a replay; None if not known."""
        super().__init__(choices, parent)
        self._replayed = replayed
        self._duration_s = 0.0
        self._replay_s: Optional[float] = None
        self.near: Tuple[NearSpan, ...] = ()  # [s, below 0] with objects near robots
        self._age_s, self._is_held = 0.0, False
        self._values: Mapping[Key, LiveValue] = {}
        self._marks: Tuple[PlacedMark, ...] = ()
        self._is_dragged = False
        self.setFocusPolicy(Qt.StrongFocus)  # keys after a click are not for the list above
        self.setObjectName('live_timeline')
        self.setAccessibleName('Curves of the last seconds')

    def show_lanes(self, duration_s: float, lanes: Sequence[Lane],
                   values: Mapping[Key, LiveValue], marks: Sequence[LiveMark],
                   now_s: float) -> None:
        """Show lanes of the last seconds, with the newest value of each curve.

        ``now_s`` is the end, on the clock of the marks.
        """
        is_other = [it.arrangement for it in lanes] != [it.arrangement for it in self.stack.lanes]
        self._duration_s, self._values = duration_s, values
        self._marks = tuple(PlacedMark(it.time_s - now_s, it.label) for it in marks)
        self.stack.update_lanes(lanes, now_s)
        if is_other:
            self._fit()
            self.updateGeometry()
        self.update()

    def show_near(self, spans: Sequence[NearSpan]) -> None:
        """Show the spans [s, below 0] in which objects were near robots."""
        if tuple(spans) != self.near:
            self.near = tuple(spans)
            self._update_header()

    def show_replay(self, time_s: Optional[float]) -> None:
        """Mark the moment that the scene shows [s, below 0]; None: the present."""
        if time_s != self._replay_s:
            self._replay_s = time_s
            self.update()

    def show_age(self, age_s: float, is_held: bool = False) -> None:
        """Set how long ago the right end was [s]; above 0 while the curves do not move.

        While they are on hold, new data may come: a silence is that of the right end.
        """
        if (age_s, is_held) != (self._age_s, self._is_held):
            self._age_s, self._is_held = age_s, is_held
            self.update()

    @property
    def axis(self) -> TimeAxis:
        """The time axis, whose right end is 0 s."""
        return TimeAxis(self._duration_s, LEFT, max(self.width() - LEFT - SIDE, 0.0),
                        -self._duration_s)

    def _lanes_axis(self) -> Tuple[TimeAxis, float]:
        return self.axis._replace(begin_s=0.0), self._duration_s

    # Drawing

    def _draw(self, painter: QPainter, axis: TimeAxis, bottom: float, area: QRect) -> None:
        painter.setRenderHint(QPainter.Antialiasing)
        self._draw_header(painter, axis)
        if self._duration_s > 0.0:
            header.draw_flags(painter, axis, self._marks, -1)
            self._draw_moment(painter, axis, bottom)
        hover_s = self.hover_s
        if hover_s is not None:
            header.draw_hover(painter, axis, hover_s, self.time_text(hover_s, 2), bottom)

    def _draw_moment(self, painter: QPainter, axis: TimeAxis, bottom: float) -> None:
        """Draw the moment of the scene: the present at the right, or the replayed moment."""
        x, color = axis.right - 1.0, theme().accent
        if self._replay_s is not None:
            x, color = axis.x(self._replay_s), theme().warning
            if not -self._duration_s <= self._replay_s <= 0.0:
                self._draw_away(painter, axis, self._replay_s)
                return
        painter.fillRect(QRectF(round(x) - 1.0, AXIS_TOP, 3.0, bottom - AXIS_TOP), QColor(color))

    def _draw_away(self, painter: QPainter, axis: TimeAxis, time_s: float) -> None:
        """Draw at the edge how far from the shown curves the replayed moment is."""
        is_before = time_s < 0.0
        painter.setPen(QColor(theme().warning))
        text = self.time_text(time_s, 1)
        painter.drawText(QRectF(axis.left, header.TRACK_TOP - 3.0, axis.width, 16.0),
                         (Qt.AlignLeft if is_before else Qt.AlignRight) | Qt.AlignVCenter,
                         f'◀ scene at {text}' if is_before else f'scene at {text} ▶')

    def _draw_header(self, painter: QPainter, axis: TimeAxis) -> None:
        header.draw_groove(painter, axis)
        header.draw_alarms(painter, axis, header.Alarms(
            (*self.alarms(), *times(self.near, Level.BAD)), times(self.near, Level.WARNING)))
        for time_s in axis.ticks(_TICK_PX):
            x = axis.x(time_s)
            painter.setPen(QColor(theme().tick))
            painter.drawLine(round(x), int(AXIS_TOP) - 1, round(x), int(AXIS_TOP) + 3)
            painter.setPen(QColor(theme().quiet))
            is_last = x > axis.right - 1.0
            left = max(x - (_LABEL_PX + 5.0 if is_last else _LABEL_PX / 2), 1.0)
            place = Qt.AlignRight if is_last else Qt.AlignHCenter
            painter.drawText(QRectF(left, AXIS_TOP + 2, _LABEL_PX, AXIS_HEIGHT - 2),
                             place | Qt.AlignVCenter, self.time_text(time_s, 0))

    def time_text(self, time_s: float, decimals: int) -> str:
        """Return a time on the axis in words, relative to the present."""
        return _before_now(time_s - self._age_s, decimals)

    def alarms(self) -> List[Tuple[float, float]]:
        """Return the spans (begin, end) [s] with a value beyond its limits; the present is 0."""
        beyond = [rows for lane in self.stack.lanes for rows in map(_beyond, lane.curves)
                  if rows is not None]
        if not beyond:
            return []
        edges = np.flatnonzero(np.diff(np.concatenate(
            ([False], np.any(beyond, axis=0), [False])).astype(np.int8)))
        at_s = edges / len(beyond[0]) * self._duration_s - self._duration_s
        return [(float(begin), float(end)) for begin, end in at_s.reshape(-1, 2)]

    def lane_texts(self, row: int, number: int = 0) -> LaneTexts:
        """Return a curve's value in the scene, its value at the mouse, and their difference."""
        curve, at_mouse, hover_s = self.stack.lanes[row].curves[number], None, self.hover_s
        value, silent_s = self._values[curve.key]
        span = self.stack.pictures.scale(row, number).span
        good = curve.good_at(_newest_share(curve, self._duration_s))
        if self._duration_s > 0.0:
            if hover_s is not None:
                at_mouse = curve.range_at(1.0 + hover_s / self._duration_s)
            if self._replay_s is not None:
                share = min(1.0 + self._replay_s / self._duration_s, 1.0)
                good = None if share < 0.0 else curve.good_at(share)
                return lane_texts(curve, span, self._replayed(curve.key), at_mouse, good)
        silent_s += 0.0 if self._is_held else self._age_s
        return lane_texts(curve, span, value, at_mouse, good, silent_s)

    # The mouse

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Show the moment under the mouse in the scene."""
        if event.button() == Qt.LeftButton and not self.stack.fold(event.pos(), self._choices):
            self._is_dragged = True
            self._want_replay(event.localPos().x())

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Show the values under the mouse; with the button pressed, also in the scene."""
        self._hover_x = event.localPos().x()
        if self._is_dragged:
            self._want_replay(event.localPos().x())
        self.update()

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        """End dragging; the scene stays at its moment."""
        if event.button() == Qt.LeftButton:
            self._is_dragged = False

    def _want_replay(self, x: float) -> None:
        if self._duration_s > 0.0:
            time_s = self.axis.time_s(x)
            self.replay_wanted.emit(min(max(time_s, -self._duration_s), 0.0))

    def leaveEvent(self, event: QEvent) -> None:
        """Hide the line at the mouse."""
        self._hover_x = None
        self.update()

    def wheelEvent(self, event: QWheelEvent) -> None:
        """Scroll lanes that do not fit if the wheel is over them, else show more or less past."""
        if not self._scrolls_lanes(event) and event.angleDelta().y():
            self.longer_wanted.emit(-1 if event.angleDelta().y() > 0 else 1)

    def contextMenuEvent(self, event: QContextMenuEvent) -> None:
        """Open a menu for the lane under the mouse and the choice of curves."""
        menu = self.menu_at(self.stack.row_at(event.y()))
        menu.setAttribute(Qt.WA_DeleteOnClose)
        menu.popup(event.globalPos())

    def menu_at(self, row: Optional[int]) -> QMenu:
        """Return the menu, with actions for a lane if there is one."""
        menu = QMenu(self)
        self._add_lane_actions(menu, row)
        return menu

    def lane_rect(self, row: int) -> QRect:
        """Return the place of a lane."""
        return self.stack.lane_rect(row)


def _beyond(lane: Lane) -> Optional[np.ndarray]:
    """Return whether a curve is beyond its limits, for each column; None without limits."""
    limits = lane.limits
    if limits is None:
        return None
    beyond: np.ndarray = np.zeros(len(lane.low), bool)
    with np.errstate(invalid='ignore'):
        if limits.high is not None:
            beyond |= lane.high > limits.high
        if limits.low is not None:
            beyond |= lane.low < limits.low
    return beyond


def _newest_share(lane: Lane, duration_s: float) -> float:
    """Return the share (0 to 1) of the newest moment of the band, which lags behind the values."""
    if lane.band is None or duration_s <= 0.0:
        return 1.0
    known = np.flatnonzero(np.isfinite(lane.band.low))
    newest = (float(known[-1]) + 0.5) / len(lane.low) if len(known) else -np.inf
    return newest if (1.0 - newest) * duration_s < _NEWEST_S else 1.0


def _before_now(time_s: float, decimals: int) -> str:
    """Return a time below 0 in words, relative to the present."""
    if time_s > -0.5 * 10.0 ** -decimals:
        return 'now'
    minutes, seconds = divmod(round(-time_s, decimals), 60.0)
    if not minutes:
        return f'−{seconds:.{decimals}f} s'
    return f'−{minutes:.0f}:{"0" * (seconds < 10.0)}{seconds:.{decimals}f} min'
