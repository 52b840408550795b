# SPDX-License-Identifier: BSD-3-Clause
"""Drawing of the part above the lanes: flags, the slider's groove, the loop, the time axis."""
from __future__ import annotations

from typing import NamedTuple, Optional, Sequence, Tuple

from PyQt5.QtCore import QPointF, QRectF, Qt
from PyQt5.QtGui import (
    QColor,
    QFont,
    QFontMetricsF,
    QPainter,
    QPainterPath,
    QPen,
    QPixmap,
    QPolygonF,
)

from process_visualizer.gui.lanes.lane_scale import SIDE
from process_visualizer.gui.playback.playback_state import PlacedMark
from process_visualizer.gui.toolkit.theme import theme, translucent
from process_visualizer.gui.toolkit.time_axis import ShownTime, TimeAxis, tick_label

# The places of the parts of the timeline, and the target under the mouse.

LEFT = 46.0  # px to the left of the axis, for the scales of the curves
FLAGS_TOP, FLAGS_HEIGHT = 2.0, 18.0
TRACK_TOP, TRACK_HEIGHT = 22.0, 26.0
AXIS_TOP, AXIS_HEIGHT = 49.0, 17.0
HEADER_HEIGHT = 68.0
FLAG_WIDTH = 9.0
_TAB = 12.0  # px: size of the tabs with the letters A and B
_REACH = 7.0  # px: maximum distance of the mouse from a handle


class Target(NamedTuple):
    """The target under the mouse: 'A', 'B', 'mark' or 'moment' (with its number), or 'time'."""

    kind: str
    mark: int = -1


def axis_of(shown: ShownTime, width: float) -> TimeAxis:
    """Return the axis of a timeline of a width [px]."""
    return TimeAxis(shown.duration_s, LEFT, max(width - LEFT - SIDE, 0.0), shown.begin_s)


def track_rect(axis: TimeAxis) -> QRectF:
    """Return the place of the groove in which the knob runs."""
    return QRectF(axis.left, TRACK_TOP + 14, axis.width, 6)


def target_at(place: QPointF, axis: TimeAxis, marks: Sequence[PlacedMark],
              loop: Optional[Tuple[float, float]]) -> Target:
    """Return the target at a place: preferably a handle of the loop [s], then a mark, then time."""
    on_track = TRACK_TOP - 4 <= place.y() < AXIS_TOP
    if loop is not None and on_track:
        near = [(_beside(place.x() - axis.x(time_s), outward), kind)
                for kind, time_s, outward in zip('AB', loop, (-1, 1))]
        distance, kind = min(near)
        if distance <= _REACH:
            return Target(kind)
    if place.y() < TRACK_TOP - 2:
        hits = [row for row, mark in enumerate(marks)
                if -4.0 <= place.x() - axis.x(mark.position_s) <= FLAG_WIDTH + 3.0]
        if hits:
            middle = place.x() - FLAG_WIDTH / 2
            return Target('mark', min(hits, key=lambda row: abs(
                middle - axis.x(marks[row].position_s))))
    return Target('time')


def _beside(x: float, outward: int) -> float:
    """Return the distance [px] from A or B; 0 on its line and its tab."""
    return max(x * outward - _TAB, -x * outward, 0.0)


_MIN_LABEL = 34.0  # px: a label with less room is not shown
_KNOB = 6.5
_MIN_ALARM = 3.0  # px


class Loop(NamedTuple):
    """A and B [s], and whether they are active."""

    begin_s: float
    end_s: float
    is_on: bool

    @property
    def bounds(self) -> Tuple[float, float]:
        """Both times [s]."""
        return self.begin_s, self.end_s


class Alarms(NamedTuple):
    """Alarms as (begin, end) [s]: ``bad`` ones in red, ``warnings`` in amber."""

    bad: Tuple[Tuple[float, float], ...] = ()
    warnings: Tuple[Tuple[float, float], ...] = ()


def header_picture(axis: TimeAxis, marks: Sequence[PlacedMark], hovered: int, scale: float,
                   font: QFont, alarms: Alarms) -> QPixmap:
    """Return a picture of groove, ticks, flags and alarms.

    ``scale`` is the number of dots per logical pixel.
    """
    picture = QPixmap(int((axis.right + SIDE) * scale), int(HEADER_HEIGHT * scale))
    picture.setDevicePixelRatio(scale)
    picture.fill(Qt.transparent)
    painter = QPainter(picture)
    painter.setRenderHint(QPainter.Antialiasing)
    painter.setFont(font)
    draw_groove(painter, axis)
    draw_axis(painter, axis)
    draw_alarms(painter, axis, alarms)
    draw_flags(painter, axis, marks, hovered)
    painter.end()
    return picture


def draw_axis(painter: QPainter, axis: TimeAxis) -> None:
    """Draw ticks and their times."""
    metrics = painter.fontMetrics()
    least_px = metrics.horizontalAdvance('00:00.00') + 14.0
    step_s = axis.tick_step_s(least_px)
    for time_s in axis.ticks(least_px):
        x = axis.x(time_s)
        painter.setPen(QColor(theme().tick))
        painter.drawLine(QPointF(x, AXIS_TOP - 1), QPointF(x, AXIS_TOP + 3))
        painter.setPen(QColor(theme().quiet))
        label = tick_label(time_s, step_s)
        width = metrics.horizontalAdvance(label) + 2
        left = min(max(x - width / 2, 1.0), axis.right + SIDE - width - 1)
        painter.drawText(QRectF(left, AXIS_TOP + 2, width, AXIS_HEIGHT - 2), Qt.AlignCenter, label)


def draw_groove(painter: QPainter, axis: TimeAxis) -> None:
    """Draw the groove of the slider."""
    painter.setPen(Qt.NoPen)
    painter.setBrush(QColor(theme().groove))
    painter.drawRoundedRect(track_rect(axis), 3, 3)


def draw_alarms(painter: QPainter, axis: TimeAxis, alarms: Alarms) -> None:
    """Draw bars for alarms below the groove."""
    _draw_bars(painter, axis, alarms.warnings, theme().warning)
    _draw_bars(painter, axis, alarms.bad, theme().bad)


def _draw_bars(painter: QPainter, axis: TimeAxis, bars: Sequence[Tuple[float, float]],
               shade: str) -> None:
    top = track_rect(axis).bottom() + 3
    for begin_s, end_s in bars:
        left, right = _on_line(axis, begin_s), _on_line(axis, end_s)
        if right > left or axis.left < left < axis.right:
            painter.fillRect(QRectF(left, top, max(right - left, _MIN_ALARM), 4),
                             QColor(shade))


def draw_gaps(painter: QPainter, axis: TimeAxis, gaps: Sequence[Tuple[float, float]],
              bottom: float) -> None:
    """Hatch unreadable parts of the recording, down to the bottom [px]."""
    painter.setPen(Qt.NoPen)
    for begin_s, end_s in gaps:
        left, right = _on_line(axis, begin_s), _on_line(axis, end_s)
        if right == left and not axis.left < left < axis.right:
            continue
        rect = QRectF(QPointF(left, TRACK_TOP), QPointF(max(right, left + 3), bottom))
        painter.fillRect(rect, translucent(theme().paper, 190))
        hatched = QColor(theme().warning)
        hatched.setAlpha(130)
        painter.setBrush(hatched)
        brush = painter.brush()
        brush.setStyle(Qt.BDiagPattern)
        painter.fillRect(rect, brush)


def draw_loop(painter: QPainter, axis: TimeAxis, loop: Loop, bottom: float) -> None:
    """Shade the repeated part; draw tabs with the letters A and B."""
    color = QColor(theme().loop if loop.is_on else theme().loop_off)
    shade = QColor(color)
    shade.setAlpha(34 if loop.is_on else 22)
    left, right = _on_line(axis, loop.begin_s), _on_line(axis, loop.end_s)
    painter.fillRect(QRectF(QPointF(left, TRACK_TOP), QPointF(right, bottom)), shade)
    band = QRectF(QPointF(left, track_rect(axis).top()), QPointF(right, track_rect(axis).bottom()))
    shade.setAlpha(110)
    painter.fillRect(band, shade)
    for time_s, letter, outward in ((loop.begin_s, 'A', -1), (loop.end_s, 'B', 1)):
        x = axis.x(time_s)
        if axis.left - 1 <= x <= axis.right + 1:
            painter.fillRect(QRectF(round(x), TRACK_TOP + 4, 1, bottom - TRACK_TOP - 4), color)
            _draw_tab(painter, x, letter, outward, color)


def _on_line(axis: TimeAxis, time_s: float) -> float:
    """Return the place of a time [px], limited to the ends of the axis."""
    return min(max(axis.x(time_s), axis.left), axis.right)


def _draw_tab(painter: QPainter, x: float, letter: str, outward: int, color: QColor) -> None:
    rect = QRectF(x if outward > 0 else x - _TAB, TRACK_TOP - 1, _TAB, _TAB)
    painter.setPen(Qt.NoPen)
    painter.setBrush(color)
    painter.drawRoundedRect(rect, 2, 2)
    font = painter.font()
    small = painter.font()
    small.setPixelSize(9)
    small.setBold(True)
    painter.setFont(small)
    painter.setPen(QColor(theme().on_signal))
    painter.drawText(rect, Qt.AlignCenter, letter)
    painter.setFont(font)


def draw_flags(painter: QPainter, axis: TimeAxis, marks: Sequence[PlacedMark],
               hovered: int) -> None:
    """Draw the marks as flags, with as much of each label as fits."""
    metrics = QFontMetricsF(painter.font())
    for row, mark in enumerate(marks):
        x = axis.x(mark.position_s)
        if not axis.left - 1 <= x <= axis.right + 1:
            continue
        end = axis.x(marks[row + 1].position_s) if row + 1 < len(marks) \
            else axis.right + SIDE
        color = QColor(theme().accent if row == hovered else theme().warning)
        painter.fillRect(QRectF(round(x), FLAGS_TOP + 2, 1, TRACK_TOP + 10 - FLAGS_TOP), color)
        painter.setPen(Qt.NoPen)
        painter.setBrush(color)
        painter.drawPolygon(QPolygonF([QPointF(x, FLAGS_TOP + 2),
                                       QPointF(x + FLAG_WIDTH, FLAGS_TOP + 6),
                                       QPointF(x, FLAGS_TOP + 10)]))
        room = end - x - FLAG_WIDTH - 8
        if room >= _MIN_LABEL:
            painter.setPen(QColor(theme().text))
            painter.drawText(QRectF(x + FLAG_WIDTH + 3, FLAGS_TOP - 1, room, FLAGS_HEIGHT - 3),
                             Qt.AlignLeft | Qt.AlignVCenter,
                             metrics.elidedText(mark.label, Qt.ElideRight, room))


def draw_playhead(painter: QPainter, axis: TimeAxis, position_s: float, bottom: float,
                  is_enabled: bool) -> None:
    """Draw the played part, the knob, and a line through all lanes."""
    groove, x = track_rect(axis), _on_line(axis, position_s)
    color = QColor(theme().accent if is_enabled else theme().disabled_text)
    painter.setPen(Qt.NoPen)
    painter.setBrush(color)
    path = QPainterPath()
    path.addRoundedRect(QRectF(groove.left(), groove.top(), max(x - groove.left(), 0.0),
                               groove.height()), 3, 3)
    painter.fillPath(path, color)
    if abs(axis.x(position_s) - x) > 1.0:
        return  # the playhead is out of view
    painter.fillRect(QRectF(round(x) - 1, groove.bottom(), 2, bottom - groove.bottom()), color)
    painter.setPen(QPen(QColor(theme().on_signal), 1.5))
    painter.drawEllipse(QPointF(x, groove.center().y()), _KNOB, _KNOB)


def draw_hover(painter: QPainter, axis: TimeAxis, time_s: float, text: str, bottom: float) -> None:
    """Draw a line at the mouse, with its time over the times of the ticks."""
    x = round(axis.x(time_s)) + 0.5
    painter.setPen(QPen(QColor(theme().text), 1, Qt.DotLine))
    painter.drawLine(QPointF(x, TRACK_TOP), QPointF(x, bottom))
    width = painter.fontMetrics().horizontalAdvance(text) + 10.0
    left = min(max(x - width / 2, 1.0), axis.right + SIDE - width - 1)
    rect = QRectF(left, AXIS_TOP + 1, width, AXIS_HEIGHT - 1)
    painter.setPen(Qt.NoPen)
    painter.setBrush(QColor(theme().text))
    painter.drawRoundedRect(rect, 3, 3)
    painter.setPen(QColor(theme().on_signal))
    painter.drawText(rect, Qt.AlignCenter, text)
