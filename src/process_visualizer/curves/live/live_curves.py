# SPDX-License-Identifier: BSD-3-Clause
"""The curves of a running cell over its last minutes."""
from __future__ import annotations

import math
from typing import Dict, List, NamedTuple, Sequence, Set, Tuple

import numpy as np

from process_visualizer.bags.recorder_topics import MARKS
from process_visualizer.cell.model import Device, TopicFunction
from process_visualizer.curves.curve_sources import (
    CurveSource,
    Quantity,
    curve_sources,
    plain_color,
    tool_from_joints,
)
from process_visualizer.curves.live.live_series import LiveSeries
from process_visualizer.curves.live.recent_part import RecentPart
from process_visualizer.curves.live.rolling_columns import COLUMN_S, RollingColumns
from process_visualizer.curves.live.seen_messages import SeenMessages
from process_visualizer.curves.source_locators import source_locators
from process_visualizer.ros_names import STATIC_TF_TOPIC, TF_MESSAGE

LONGEST_S = 600.0
"""So much is kept."""
_MOST_COLUMNS = 1500  # of a curve that is shown: what a screen has pixels for


class LiveCurve(NamedTuple):
    """A process variable over the last seconds: the extremes of its columns (n,), NaN for none."""

    source: CurveSource
    low: np.ndarray
    high: np.ndarray
    value: float  # the newest one; NaN if there is none yet


class LiveMark(NamedTuple):
    """A labelled moment [s from the beginning]."""

    time_s: float
    label: str


class LiveWindow(NamedTuple):
    """All curves from ``begin_s`` on [s from the beginning]; it may begin before that, below 0.

    ``epoch_s`` is the recorder's time of the beginning [s].
    """

    begin_s: float
    duration_s: float
    curves: Tuple[LiveCurve, ...] = ()
    marks: Tuple[LiveMark, ...] = ()
    epoch_s: float = 0.0


class LiveCurves:
    """Takes messages as they come; the first one is the beginning of time."""

    def __init__(self, devices: Sequence[Device]) -> None:
        self._devices = tuple(devices)
        self._sources = curve_sources(devices)
        self._clear()

    def _clear(self) -> None:
        self._seen = SeenMessages()
        self._known = 0  # connections that have been looked at
        self._begin_ns, self._now_ns = 0, 0
        self._series: Dict[CurveSource, LiveSeries] = {}
        self._useless: Set[CurveSource] = set()  # not asked for, and no plain numbers
        self._columns: Dict[CurveSource, RollingColumns] = {}
        self._values: Dict[CurveSource, Tuple[float, float]] = {}  # time and newest value
        self._marks: List[LiveMark] = []

    @property
    def topics(self) -> Tuple[str, ...]:
        """The topics whose messages are needed."""
        names = {topic for source in self._sources if source not in self._useless
                 for topic in self._topics_of(source)}
        return tuple(sorted(names | {MARKS}))

    def add(self, part: RecentPart) -> None:
        """Take messages that have come."""
        if part.is_anew or part.now_ns < self._now_ns:  # a simulated time can begin anew, too
            self._clear()
        self._now_ns = part.now_ns
        if not self._begin_ns and len(part.times_ns):
            self._begin_ns = int(part.times_ns.min())
        self._seen.add(part)
        self._locate(part)
        for source, series in self._series.items():
            self._take(source, *series.new(part))
        self._take_marks(part)

    def window(self, duration_s: float) -> LiveWindow:
        """Return the curves of the last seconds, which end now."""
        joined = max(1, math.ceil(duration_s / (_MOST_COLUMNS * COLUMN_S) - 1e-9))
        count = int(round(duration_s / (joined * COLUMN_S)))
        now_s = (self._now_ns - self._begin_ns) / 1e9 if self._begin_ns else 0.0
        # a whole number of columns, which stay the same while they move
        end = joined * (int(now_s / COLUMN_S) // joined + 1)
        curves = tuple(LiveCurve(source, *columns.window(end, count, joined),
                                 self._values.get(source, (0.0, math.nan))[1])
                       for source, columns in self._in_order())
        length_s = count * joined * COLUMN_S
        return LiveWindow(end * COLUMN_S - length_s, length_s, curves, tuple(self._marks),
                          self._begin_ns / 1e9)

    def _in_order(self) -> List[Tuple[CurveSource, RollingColumns]]:
        """Return what has been seen, in the order of the devices; plain ones with a colour each."""
        found, plain = [], 0
        for source in self._sources:
            if source in self._columns:
                shown = source
                if source.plain:
                    shown, plain = source._replace(color=plain_color(plain)), plain + 1
                found.append((shown, self._columns[source]))
        return found

    def _topics_of(self, source: CurveSource) -> Set[str]:
        """Its own, and for a tool that may be found by transforms what else moves it."""
        topics = {source.topic}
        device = next((it for it in self._devices if it.name == source.device), None)
        if source.quantity is Quantity.SPEED and device is not None and (
                source.message_type in ('', TF_MESSAGE) or tool_from_joints(device)):
            topics |= {STATIC_TF_TOPIC, *(it.name for it in
                                          device.topics_for(TopicFunction.JOINT_STATES))}
        return topics

    def _locate(self, part: RecentPart) -> None:
        """Look for sources in connections that are new."""
        new = {it.topic for it in part.connections[self._known:]}
        self._known = len(part.connections)
        if not new or not self._begin_ns:
            return
        self._seen.look()
        for source in self._sources:
            if new & self._topics_of(source):
                locators = source_locators(self._seen, source, self._devices)
                if locators.connections:
                    self._series[source] = LiveSeries(source, locators, self._begin_ns)
                elif source.plain:
                    self._useless.add(source)

    def _take(self, source: CurveSource, times_s: np.ndarray, values: np.ndarray) -> None:
        if not len(times_s):
            return
        if source not in self._columns:
            self._columns[source] = RollingColumns(LONGEST_S)
        self._columns[source].add(times_s, values)
        newest = int(times_s.argmax())
        before_s, _ = self._values.get(source, (-math.inf, math.nan))
        if times_s[newest] >= before_s:
            self._values[source] = float(times_s[newest]), float(values[newest])

    def _take_marks(self, part: RecentPart) -> None:
        of_marks = [number for number, it in enumerate(part.connections) if it.topic == MARKS]
        for row in np.flatnonzero(np.isin(part.numbers, of_marks)).tolist():
            self._marks.append(LiveMark((int(part.times_ns[row]) - self._begin_ns) / 1e9,
                                        _label(part.message(row))))
        oldest_s = (self._now_ns - self._begin_ns) / 1e9 - LONGEST_S
        self._marks = [it for it in self._marks if it.time_s >= oldest_s]


def _label(data: bytes) -> str:
    """The text in a std_msgs/String."""
    return data[4:4 + int.from_bytes(data[:4], 'little')].decode('utf-8', 'replace')
