# SPDX-License-Identifier: BSD-3-Clause
"""Moments of the reference as ticks above the slider's groove, which can be dragged."""
from __future__ import annotations

from typing import Optional, Sequence, Tuple

from PyQt5.QtCore import QPointF, QRect, QRectF, Qt
from PyQt5.QtGui import QColor, QPainter, QPen, QPolygonF

from process_visualizer.gui.toolkit.theme import theme
from process_visualizer.gui.toolkit.time_axis import TimeAxis
from process_visualizer.gui.views.playback.timeline_layout import TRACK_TOP, track_rect
from process_visualizer.playback.time_text import format_time
from process_visualizer.runs.comparison.timeline_moments import Moment, MomentKind

_MIDDLE, _SIZE, _REACH = TRACK_TOP + 5.0, 4.5, 6.0  # px
_TIPS = {
    MomentKind.EVENT: 'where the good run has "{}". If it belongs elsewhere, drag it there.',
    MomentKind.DEPARTURE: '"{}" begins to depart. Drag it if the good run is aligned wrongly.',
    MomentKind.ANCHOR: '"{}" of the good run, where you have put it. "Reset alignment" undoes it.'}


def moment_at(place: QPointF, axis: TimeAxis, moments: Sequence[Moment]) -> int:
    """Return the row of the moment that is nearest to a place; -1 if none is near."""
    if abs(place.y() - _MIDDLE) > _REACH or not moments:
        return -1
    away = [abs(place.x() - axis.x(it.position_s)) for it in moments]
    row = min(range(len(away)), key=lambda it: away[it])
    return row if away[row] <= _REACH else -1


def with_dragged(moments: Tuple[Moment, ...], row: int,
                 time_s: Optional[float]) -> Tuple[Moment, ...]:
    """Return moments as shown while one (-1: none) is dragged: as an anchor at the mouse [s]."""
    if row < 0 or time_s is None:
        return moments
    moved = moments[row]._replace(position_s=time_s, kind=MomentKind.ANCHOR)
    return (*moments[:row], moved, *moments[row + 1:])


def moment_tip(moment: Moment) -> str:
    """Return what a tooltip says of a moment."""
    return f'{format_time(moment.position_s)}  ' + _TIPS[moment.kind].format(moment.label)


def draw_moments(painter: QPainter, axis: TimeAxis, moments: Sequence[Moment], part: QRect) -> None:
    """Draw a diamond for each moment in a part of the timeline."""
    left, right = max(axis.left - 1, part.left() - _SIZE), min(axis.right + 1,
                                                               part.right() + _SIZE)
    for moment in moments:
        x = axis.x(moment.position_s)
        if left <= x <= right:
            _draw(painter, x, moment.kind, track_rect(axis).top())


def _draw(painter: QPainter, x: float, kind: MomentKind, bottom: float) -> None:
    colour = QColor({MomentKind.EVENT: theme().quiet, MomentKind.DEPARTURE: theme().bad,
                     MomentKind.ANCHOR: theme().accent}[kind])
    painter.fillRect(QRectF(round(x), _MIDDLE, 1, bottom - _MIDDLE), colour)
    painter.setPen(QPen(colour, 1.4))
    painter.setBrush(colour if kind is MomentKind.ANCHOR else QColor(theme().paper))
    painter.drawPolygon(QPolygonF([QPointF(x, _MIDDLE - _SIZE), QPointF(x + _SIZE, _MIDDLE),
                                   QPointF(x, _MIDDLE + _SIZE), QPointF(x - _SIZE, _MIDDLE)]))
    painter.setBrush(Qt.NoBrush)
