# SPDX-License-Identifier: BSD-3-Clause
"""The places of the parts of the timeline, and what is under the mouse."""
from __future__ import annotations

from typing import NamedTuple, Optional, Sequence, Tuple

from PyQt5.QtCore import QPointF, QRectF

from process_visualizer.gui.models.playback.marks import PlacedMark
from process_visualizer.gui.toolkit.shown_time import ShownTime
from process_visualizer.gui.toolkit.time_axis import TimeAxis
from process_visualizer.gui.views.lanes.lane_look import SIDE

LEFT = 46.0  # left of the line, for the scales of the curves
FLAGS_TOP, FLAGS_HEIGHT = 2.0, 18.0
TRACK_TOP, TRACK_HEIGHT = 22.0, 26.0
AXIS_TOP, AXIS_HEIGHT = 49.0, 17.0
HEADER_HEIGHT = 68.0
FLAG_WIDTH = 9.0
_REACH = 7.0  # px: how near the mouse has to be to a handle


class Target(NamedTuple):
    """The target under the mouse: 'A', 'B', 'mark' or 'moment' (with its number), or 'time'."""

    kind: str
    mark: int = -1


def axis_of(shown: ShownTime, width: float) -> TimeAxis:
    """Return the axis of a timeline of a width [px]."""
    return TimeAxis(shown.duration_s, LEFT, max(width - LEFT - SIDE, 0.0), shown.begin_s)


def track_rect(axis: TimeAxis) -> QRectF:
    """Return the groove in which the knob runs."""
    return QRectF(axis.left, TRACK_TOP + 14, axis.width, 6)


def target_at(place: QPointF, axis: TimeAxis, marks: Sequence[PlacedMark],
              loop: Optional[Tuple[float, float]]) -> Target:
    """Return the target at a place; handles of the loop [s] before marks, marks before the time."""
    on_track = TRACK_TOP - 4 <= place.y() < AXIS_TOP
    if loop is not None and on_track:
        near = [(abs(place.x() - axis.x(time_s)), kind) for kind, time_s in zip('AB', loop)]
        distance, kind = min(near)
        if distance <= _REACH:
            return Target(kind)
    if place.y() < TRACK_TOP - 2:
        hits = [row for row, mark in enumerate(marks)
                if -4.0 <= place.x() - axis.x(mark.position_s) <= FLAG_WIDTH + 3.0]
        if hits:
            return Target('mark', min(hits, key=lambda row: _distance(place, axis, marks[row])))
    return Target('time')


def _distance(place: QPointF, axis: TimeAxis, mark: PlacedMark) -> float:
    return abs(place.x() - axis.x(mark.position_s) - FLAG_WIDTH / 2)
