# SPDX-License-Identifier: BSD-3-Clause
"""The curves of a running cell over its last minutes."""
from __future__ import annotations

import math
from collections import deque
from typing import Deque, Dict, List, NamedTuple, Optional, Sequence, Set, Tuple

import numpy as np

from process_visualizer.bagio.bag_index import BagIndex, ChunkPlaces, Columns
from process_visualizer.bagio.message_definition import Connection
from process_visualizer.bagio.recorder_topics import MARKS
from process_visualizer.bagio.recording import RecordBatch
from process_visualizer.cell.model import Device, TopicFunction
from process_visualizer.curves.curve_sources import (
    CurveSource,
    Quantity,
    curve_sources,
    plain_color,
    tool_from_joints,
)
from process_visualizer.curves.number_columns import NumberColumns, Numbers, joined_numbers
from process_visualizer.curves.samples import Samples, sampled
from process_visualizer.curves.source_locators import SourceLocators, source_locators
from process_visualizer.health.staleness import CommonSilences, SendingHabit
from process_visualizer.robot.late_arrivals import LateConnections, is_even, undated
from process_visualizer.robot.measuring_time import measuring_times, sending_period_s
from process_visualizer.robot.recorded_velocity import WINDOW_S
from process_visualizer.ros_names import STATIC_TF_TOPIC, TF_MESSAGE

COLUMN_S = 0.02
"""Duration of a column [s]: about one pixel when a screen shows half a minute."""


class RollingColumns:
    """Minimum and maximum of each column; values before the oldest column are dropped."""

    def __init__(self, duration_s: float) -> None:
        """Keep at least this duration [s], and at most twice as much."""
        self._count = int(round(duration_s / COLUMN_S))
        self._begin = 0  # the number of the first column since time 0
        self._low = np.full(2 * self._count, np.nan)
        self._high = self._low.copy()

    def add(self, times_s: np.ndarray, values: np.ndarray) -> None:
        """Add finite values (n,) at times (n,) [s], in any order."""
        if not len(times_s):
            return
        columns = np.floor(times_s / COLUMN_S).astype(np.int64)
        self._make_room(int(columns.max()))
        rows = columns - self._begin
        is_kept = rows >= 0
        np.fmin.at(self._low, rows[is_kept], values[is_kept])
        np.fmax.at(self._high, rows[is_kept], values[is_kept])

    def window(self, end: int, count: int, joined: int) -> Tuple[np.ndarray, np.ndarray]:
        """Return minima and maxima (count,) of columns, each joined from ``joined`` stored columns.

        The last column ends before the stored column number ``end``, counted from time 0.
        """
        rows = np.arange(end - count * joined, end) - self._begin
        is_kept = (rows >= 0) & (rows < len(self._low))
        low, high = np.full(len(rows), np.nan), np.full(len(rows), np.nan)
        low[is_kept], high[is_kept] = self._low[rows[is_kept]], self._high[rows[is_kept]]
        if joined == 1:
            return low, high
        return (np.fmin.reduce(low.reshape(count, joined), axis=1),
                np.fmax.reduce(high.reshape(count, joined), axis=1))

    def _make_room(self, column: int) -> None:
        """Shift the columns until there is room for a new one."""
        over = column - self._begin - len(self._low) + 1
        if over <= 0:
            return
        step = max(over, self._count)
        for values in (self._low, self._high):
            kept = values[step:].copy()
            values[:] = np.nan
            values[:len(kept)] = kept
        self._begin += step


HEADER_BYTES = 16
"""Size of the part of a record that precedes the message."""


class RecentPart(NamedTuple):
    """Messages as the recorder provides them, in the order of their arrival.

    One row per message: the number of its connection, its arrival time [ns since the epoch], and
    the start and end of its record in the buffer (uint8).
    """

    is_anew: bool  # the recorder has restarted: earlier messages are obsolete
    connections: Tuple[Connection, ...]  # all, by number
    now_ns: int  # the recorder's time [ns since the epoch]
    numbers: np.ndarray
    times_ns: np.ndarray
    begin: np.ndarray
    end: np.ndarray
    buffer: np.ndarray

    def message(self, row: int) -> bytes:
        """Return the bytes of a message."""
        data: bytes = self.buffer[int(self.begin[row]) + HEADER_BYTES:int(self.end[row])].tobytes()
        return data


_MAX_ARRIVALS = 10_000
"""Number of messages by which a driver's period is known: of two busy seconds, many are lost."""
_CONTEXT_S = 2.0  # kept history, for a driver's period and for joining the parts of a tool


class LiveSeries:
    """Numbers of a source with their times [s from a beginning].

    Numbers from delayed messages have the times of their stamps; without stamps their times are
    unknown, and they are left out.
    """

    def __init__(self, source: CurveSource, locators: SourceLocators, begin_ns: int) -> None:
        self._source, self._locators, self._begin_ns = source, locators, begin_ns
        self._columns = [{number: NumberColumns(locator) for number, locator in part.items()}
                         for part in locators.parts]
        self._context: List[Numbers] = []  # of each part
        self._known_s = -np.inf  # numbers up to this time have been returned
        self._arrivals_s = np.empty(0)  # of the newest messages
        self._delay_ns: Optional[int] = None  # usual delay from stamp to arrival
        self._motion_s = np.empty(0)  # when positions were measured

    def motion_s(self, since_s: float) -> np.ndarray:
        """Return when the positions were measured (m,) [s] from which speeds are known."""
        return self._motion_s[np.searchsorted(self._motion_s, since_s):]

    def new(self, part: RecentPart, late: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
        """Return times (m,) and finite numbers (m,) from newly arrived messages.

        ``late`` marks (bool) the delayed messages of the part.
        """
        # positions are arrival times here
        batch = RecordBatch(part.buffer, part.times_ns, part.begin, part.end)
        found = []
        for columns in self._columns:
            for number, of_connection in columns.items():
                of_connection.add(batch, np.flatnonzero(part.numbers == number))
            numbers = joined_numbers(tuple(it.taken() for it in columns.values()))
            found.append(self._placed(numbers, np.isin(numbers.positions, part.times_ns[late])))
        with np.errstate(over='ignore', invalid='ignore'):  # bogus numbers may overflow
            if self._source.quantity is not Quantity.SPEED:
                return _finite(*sampled(self._samples(found[0])))
            return self._speeds(found)

    def _placed(self, numbers: Numbers, is_late: np.ndarray) -> Numbers:
        """Return the numbers, in order, with the arrival times expected without delay."""
        has_stamp = numbers.stamps_ns > 0
        usual = np.flatnonzero(has_stamp & ~is_late)
        if len(usual):
            self._delay_ns = int(numbers.positions[usual[-1]] - numbers.stamps_ns[usual[-1]])
        if not is_late.any():
            return numbers
        if self._delay_ns is None:
            has_stamp[:] = False
        positions = np.where(is_late, numbers.stamps_ns + (self._delay_ns or 0), numbers.positions)
        is_kept = has_stamp | ~is_late
        return Numbers(positions[is_kept], numbers.values[is_kept], numbers.stamps_ns[is_kept])

    def _speeds(self, found: List[Numbers]) -> Tuple[np.ndarray, np.ndarray]:
        self._context = [_with_context(old, new)
                         for old, new in zip(self._context or found, found)]
        numbers = self._locators.joined(self._measured_s, self._context)
        if len(numbers.positions) < 2:
            return np.empty(0), np.empty(0)
        numbers = self._certain(numbers)
        if len(numbers.positions) < 2:
            return np.empty(0), np.empty(0)
        period_s = sending_period_s(self._arrivals_s) or None
        times_s = self._measured_s(numbers, period_s) - self._source.latency_s
        last_s = self._motion_s[-1] if len(self._motion_s) else -np.inf
        self._motion_s = np.concatenate((self._motion_s, times_s[times_s > last_s]))
        self._motion_s = self.motion_s(times_s[-1] - MAX_S)
        middle_s, values = sampled(Samples(self._source, times_s, numbers.values))
        is_new = (middle_s > self._known_s) & (middle_s <= times_s[-1] - 0.45 * WINDOW_S)
        if is_new.any():
            self._known_s = float(middle_s[is_new].max())
        return _finite(middle_s[is_new], values[is_new])

    def _certain(self, numbers: Numbers) -> Numbers:
        """Return the numbers with known times, up to the first of the latest irregular arrivals."""
        if (numbers.stamps_ns > 0).any():
            return numbers
        arrival_s = (numbers.positions - self._begin_ns) / 1e9
        since = np.searchsorted(arrival_s, self._arrivals_s[-1], 'right') \
            if len(self._arrivals_s) else 0
        self._arrivals_s = np.concatenate((self._arrivals_s, arrival_s[since:]))[-_MAX_ARRIVALS:]
        period_s = sending_period_s(self._arrivals_s)
        if not is_even(np.diff(self._arrivals_s), period_s):
            return numbers
        found = undated(arrival_s, self._measured_s(numbers, period_s), period_s)
        is_known = ~found.rows
        is_known[found.open_from:] = False
        return Numbers(*(column[is_known] for column in numbers))

    def _samples(self, numbers: Numbers) -> Samples:
        times_s = (numbers.positions - self._begin_ns) / 1e9 - self._source.latency_s
        return Samples(self._source, times_s, numbers.values)

    def _measured_s(self, numbers: Numbers, period_s: Optional[float] = None) -> np.ndarray:
        stamps_s = np.where(numbers.stamps_ns > 0, (numbers.stamps_ns - self._begin_ns) / 1e9,
                            np.nan)
        return measuring_times((numbers.positions - self._begin_ns) / 1e9, stamps_s, period_s)


def _with_context(old: Numbers, new: Numbers) -> Numbers:
    """Return the new numbers, preceded by those of the last seconds."""
    joined = new if old is new else joined_numbers((old, new))
    if not len(joined.positions):
        return joined
    is_recent = joined.positions >= joined.positions[-1] - int(_CONTEXT_S * 1e9)
    recent = Numbers(*(column[is_recent] for column in joined))
    return recent if len(new.positions) <= len(recent.positions) else joined


def _finite(times_s: np.ndarray, values: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
    is_finite = np.isfinite(values)
    return times_s[is_finite], values[is_finite]


_MAX_MESSAGES = 100  # kept of each publisher of frames


class _Seen(NamedTuple):
    time_ns: int
    number: int
    data: bytes


class SeenMessages:
    """All connections, and the newest messages of those that carry frames.

    These are the ``Messages`` that ``tool_on_tf`` needs.
    """

    def __init__(self) -> None:
        self._connections: Tuple[Connection, ...] = ()
        self._kept: Dict[int, Deque[_Seen]] = {}
        self._in_order: List[_Seen] = []
        self.index = _index((), [])

    def add(self, part: RecentPart) -> None:
        """Add newly arrived messages."""
        if part.is_anew:
            self._kept.clear()
        self._connections = part.connections
        for number, connection in enumerate(part.connections):
            if connection.type == TF_MESSAGE:
                self._keep(part, number)

    def _keep(self, part: RecentPart, number: int) -> None:
        kept = self._kept.setdefault(number, deque(maxlen=_MAX_MESSAGES))
        for row in np.flatnonzero(part.numbers == number)[-_MAX_MESSAGES:].tolist():
            kept.append(_Seen(int(part.times_ns[row]), number, part.message(row)))

    def look(self) -> None:
        """Bring ``index`` up to date."""
        self._in_order = sorted(it for kept in self._kept.values() for it in kept)
        self.index = _index(self._connections, self._in_order)

    def message(self, position: int) -> memoryview:
        """Return the bytes of a message, by its position in the index."""
        return memoryview(self._in_order[position].data)


def _index(connections: Tuple[Connection, ...], messages: List[_Seen]) -> BagIndex:
    nothing = np.zeros(len(messages), np.int32)
    return BagIndex(connections, Columns(
        np.array([it.time_ns for it in messages], np.int64),
        np.array([it.number for it in messages], np.int32), nothing,
        np.arange(len(messages), dtype=np.int32)),
        ChunkPlaces(np.zeros(0, np.int32), np.zeros(0, np.int64)))


MAX_S = 600.0
"""Time that is kept [s]."""
_QUICK_S = 1.5
"""Time [s] after which a value is stale if it usually arrives within that time."""
_MAX_COLUMNS = 1500  # of a drawn curve: about the number of pixels of a screen


_NO_TIMES = np.empty(0)


class LiveCurve(NamedTuple):
    """A process variable over the last seconds: minimum and maximum per column (n,), or NaN.

    ``value`` is the present one; NaN before the first one, or if the newest one is stale. ``age_s``
    is that of the newest one, and infinite before the first one. Of a speed, ``motion_s`` (m,) is
    when its positions were measured [s from the beginning], where that is known.
    """

    source: CurveSource
    low: np.ndarray
    high: np.ndarray
    value: float
    age_s: float = math.inf
    motion_s: np.ndarray = _NO_TIMES


class LiveMark(NamedTuple):
    """A labeled moment [s from the beginning]."""

    time_s: float
    label: str


class LiveWindow(NamedTuple):
    """All curves from ``begin_s`` on [s from the beginning], which may be negative.

    ``epoch_s`` is the recorder's time at the beginning [s since the epoch].
    """

    begin_s: float
    duration_s: float
    curves: Tuple[LiveCurve, ...] = ()
    marks: Tuple[LiveMark, ...] = ()
    epoch_s: float = 0.0


class LiveCurves:
    """Collector of curves from messages as they arrive; the first message defines time 0."""

    def __init__(self, devices: Sequence[Device]) -> None:
        self._devices = tuple(devices)
        self._sources = curve_sources(devices)
        self._clear()

    def _clear(self) -> None:
        self._seen = SeenMessages()
        self._known = 0  # number of connections examined
        self._begin_ns, self._now_ns = 0, 0
        self._series: Dict[CurveSource, LiveSeries] = {}
        self._useless: Set[CurveSource] = set()  # not configured, and no plain numbers
        self._columns: Dict[CurveSource, RollingColumns] = {}
        self._values: Dict[CurveSource, Tuple[float, float]] = {}  # time and newest value
        self._habits: Dict[CurveSource, SendingHabit] = {}
        self._silences = CommonSilences(_QUICK_S)
        self._marks: List[LiveMark] = []
        self._late = LateConnections()

    @property
    def topics(self) -> Tuple[str, ...]:
        """The topics whose messages are needed."""
        names = {topic for source in self._sources if source not in self._useless
                 for topic in self._topics_of(source)}
        return tuple(sorted(names | {MARKS}))

    def add(self, part: RecentPart) -> None:
        """Add newly arrived messages."""
        if part.is_anew or part.now_ns < self._now_ns:  # simulated time can restart, too
            self._clear()
        self._now_ns = part.now_ns
        if not self._begin_ns and len(part.times_ns):
            self._begin_ns = int(part.times_ns.min())
        self._silences.add((part.times_ns - self._begin_ns) / 1e9)
        self._seen.add(part)
        self._locate(part)
        late = self._late.find(part.numbers, part.times_ns)
        for source, series in self._series.items():
            self._take(source, *series.new(part, late))
        self._take_marks(part)

    def window(self, duration_s: float) -> LiveWindow:
        """Return the curves of the last seconds until now."""
        joined = max(1, math.ceil(duration_s / (_MAX_COLUMNS * COLUMN_S) - 1e-9))
        count = int(round(duration_s / (joined * COLUMN_S)))
        now_s = (self._now_ns - self._begin_ns) / 1e9 if self._begin_ns else 0.0
        # whole columns, so that their contents stay the same while they scroll
        end = joined * (int(now_s / COLUMN_S) // joined + 1)
        length_s = count * joined * COLUMN_S
        since_s = end * COLUMN_S - length_s
        curves = tuple(LiveCurve(shown, *self._columns[source].window(end, count, joined),
                                 *self._value(source, now_s),
                                 self._series[source].motion_s(since_s))
                       for source, shown in self._in_order())
        return LiveWindow(end * COLUMN_S - length_s, length_s, curves, tuple(self._marks),
                          self._begin_ns / 1e9)

    def _value(self, source: CurveSource, now_s: float) -> Tuple[float, float]:
        """Return the value that holds now (NaN if it is stale), and its age [s]."""
        time_s, value = self._values.get(source, (-math.inf, math.nan))
        age_s = now_s - time_s
        holds = age_s <= _QUICK_S or age_s <= self._habits[source].holds_for_s(_QUICK_S)
        return value if holds else math.nan, age_s

    def _in_order(self) -> List[Tuple[CurveSource, CurveSource]]:
        """Return the sources with data, in the order of the devices, each with its shown version.

        A plain source gets a color of its own.
        """
        found, plain = [], 0
        for source in self._sources:
            if source in self._columns:
                shown = source
                if source.plain:
                    shown, plain = source._replace(color=plain_color(plain)), plain + 1
                found.append((source, shown))
        return found

    def _topics_of(self, source: CurveSource) -> Set[str]:
        """Return the topic of a source, and for a tool on tf the topics that may move it."""
        topics = {source.topic}
        device = next((it for it in self._devices if it.name == source.device), None)
        if source.quantity is Quantity.SPEED and device is not None and (
                source.message_type in ('', TF_MESSAGE) or tool_from_joints(device)):
            topics |= {STATIC_TF_TOPIC, *(it.name for it in
                                          device.topics_for(TopicFunction.JOINT_STATES))}
        return topics

    def _locate(self, part: RecentPart) -> None:
        """Search new connections for sources."""
        new = {it.topic for it in part.connections[self._known:]}
        if not new or not self._begin_ns:  # without a message there is no time 0 yet
            return
        self._known = len(part.connections)
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
            self._columns[source] = RollingColumns(MAX_S)
            self._habits[source] = SendingHabit()
        self._columns[source].add(times_s, values)
        for column in np.unique(np.floor(times_s / COLUMN_S)).tolist():
            self._habits[source].add(column * COLUMN_S, self._silences.before(column * COLUMN_S))
        newest = int(times_s.argmax())
        before_s, _ = self._values.get(source, (-math.inf, math.nan))
        if times_s[newest] >= before_s:
            self._values[source] = float(times_s[newest]), float(values[newest])

    def _take_marks(self, part: RecentPart) -> None:
        of_marks = [number for number, it in enumerate(part.connections) if it.topic == MARKS]
        for row in np.flatnonzero(np.isin(part.numbers, of_marks)).tolist():
            self._marks.append(LiveMark((int(part.times_ns[row]) - self._begin_ns) / 1e9,
                                        _label(part.message(row))))
        oldest_s = (self._now_ns - self._begin_ns) / 1e9 - MAX_S
        self._marks = [it for it in self._marks if it.time_s >= oldest_s]


def _label(data: bytes) -> str:
    """Return the text in a std_msgs/String."""
    return data[4:4 + int.from_bytes(data[:4], 'little')].decode('utf-8', 'replace')
