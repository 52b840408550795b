# SPDX-License-Identifier: BSD-3-Clause
"""Values of the process variables at a position in a recording, as the scene shows them."""
from __future__ import annotations

from functools import partial
from typing import Dict, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from process_visualizer.bagio.bag_errors import BagDamaged
from process_visualizer.bagio.message_layout import Data
from process_visualizer.bagio.number_places import Locator
from process_visualizer.bagio.recording import Recording
from process_visualizer.cell.model import Device
from process_visualizer.curves.curve_sources import CurveSource, Quantity, curve_sources
from process_visualizer.curves.number_columns import Numbers
from process_visualizer.curves.samples import part_numbers
from process_visualizer.curves.source_locators import certain, measured_s, source_locators
from process_visualizer.curves.topic_messages import positions_between, topic_period_s
from process_visualizer.health.staleness import STALE_AFTER_S
from process_visualizer.playback.playback_event import MOMENT_NS
from process_visualizer.robot.kinematics import Joint
from process_visualizer.robot.recorded_velocity import MARGIN_S, RecordedVelocity

_NS_PER_S = 1_000_000_000
_MAX_UNUSABLE = 200  # consecutive unusable messages of a topic that are examined
_SELDOM = 3  # with fewer messages around a position, the angle of a joint is unknown

Key = Tuple[str, str, str]


def key_of(device: str, label: str, topic: str) -> Key:
    """Return the key that identifies both a curve and its value at a position."""
    return device, label, topic


class _Numbers(NamedTuple):
    """The numbers of a message, and its stamp [ns]; 0 without one."""

    values: Tuple[float, ...]
    stamp_ns: int


class _Row(NamedTuple):
    """A message, by its position in the index, and the part of the source for which it is read."""

    part: int
    position: int


class PositionValues:
    """Reader of single messages around a position, which caches the last ones; for one thread.

    A speed is the slope of the poses before and after the position, as for the arrow; a force or a
    number comes from the last message.
    """

    def __init__(self, paths: Sequence[str], devices: Sequence[Device]) -> None:
        """Open the bags of a recording.

        Raises:
            BagError: a file cannot be read as a bag.
        """
        self._recording = Recording(paths)
        holes_s = self._recording.holes(STALE_AFTER_S)
        self._topics = [topic for source in curve_sources(devices)
                        for topic in [_Topic(self._recording, source, devices, holes_s)]
                        if topic.is_there]

    def close(self) -> None:
        """Close the files."""
        self._recording.close()

    def at(self, position_s: float) -> Dict[Key, Optional[float]]:
        """Return the values at a position [s from the beginning]; None for those without one."""
        time_ns = self._recording.begin_ns + round(position_s * _NS_PER_S)
        return {topic.key: topic.value(time_ns) for topic in self._topics}


class _Topic:
    """A source and the numbers in its messages; the numbers read last are cached."""

    def __init__(self, recording: Recording, source: CurveSource, devices: Sequence[Device],
                 holes_s: np.ndarray) -> None:
        self._recording, self._source, self._holes_s = recording, source, holes_s
        self.key = key_of(source.device, source.label, source.topic)
        self._locators = source_locators(recording, source, devices)
        self._positions = recording.index.positions_of(self._locators.connections)
        self._kept: Dict[_Row, Optional[_Numbers]] = {}
        self._whole: Dict[int, Numbers] = {}  # by part, of rarely sent joints
        self._period_s = 0.0
        if source.quantity is Quantity.SPEED:
            self._period_s = topic_period_s(recording, self._locators.connections)

    @property
    def is_there(self) -> bool:
        return len(self._positions) > 0

    def value(self, time_ns: int) -> Optional[float]:
        """Return the value at a bag time [ns]; none in a hole of the recording."""
        at_s = (time_ns - self._recording.begin_ns) / _NS_PER_S
        if ((self._holes_s[:, 0] + STALE_AFTER_S < at_s) & (at_s < self._holes_s[:, 1])).any():
            return None
        time_ns += round(self._source.latency_s * _NS_PER_S)  # such numbers arrive later
        if self._source.quantity is Quantity.SPEED:
            return self._speed(time_ns)
        numbers = self._last(time_ns)
        if numbers is None:
            return None
        if self._source.quantity is Quantity.FORCE:
            return float(np.linalg.norm(numbers.values))
        return numbers.values[0]

    def _last(self, time_ns: int) -> Optional[_Numbers]:
        """Return the numbers that hold at a time."""
        index, begin_ns = self._recording.index, self._recording.begin_ns
        count = int(np.searchsorted(self._positions, index.count_until(time_ns)))
        if count == 0:  # nothing yet, but perhaps shortly after
            count = min(1, int(np.searchsorted(
                self._positions, index.count_until(begin_ns + MOMENT_NS))))
        rows = self._positions[max(count - _MAX_UNUSABLE, 0):count].tolist()
        found = next((numbers for numbers in (self._numbers(_Row(0, row))
                                              for row in reversed(rows))
                      if numbers is not None), None)
        self._keep([_Row(0, row) for row in rows[-1:]])
        return found

    def _speed(self, time_ns: int) -> Optional[float]:
        around = [self._rows(part, time_ns) for part in range(len(self._locators.parts))]
        numbers = self._locators.joined(partial(measured_s, self._recording), self._with_rests([
            self._read(part, rows) for part, rows in enumerate(around)], time_ns))
        self._keep([row for rows in around for row in rows])
        time_s = (time_ns - self._recording.begin_ns) / _NS_PER_S
        numbers = certain(self._recording, numbers, self._period_s, time_s - MARGIN_S)
        if not len(numbers.positions):
            return None
        velocity = RecordedVelocity(measured_s(self._recording, numbers, self._period_s),
                                    numbers.values).velocity(time_s)
        return None if velocity is None else float(np.linalg.norm(velocity))

    def _rows(self, part: int, time_ns: int) -> List[_Row]:
        """Return the messages around a bag time [ns] that contain a part of the source."""
        return [_Row(part, position) for position in positions_between(
            self._recording.index, tuple(self._locators.parts[part]), *_around(time_ns))]

    def _with_rests(self, parts: Sequence[Numbers], time_ns: int) -> Sequence[Numbers]:
        """Return the numbers around a time, with neighboring ones for rarely sent joints.

        Such joints are sent only when they move: they keep their position while other joints
        arrive.
        """
        path = self._locators.path
        if path is None or max(len(it.positions) for it in parts) < _SELDOM:
            return parts
        return [self._with_neighbors(part, time_ns)
                if isinstance(moving, Joint) and len(it.positions) < _SELDOM else it
                for part, (moving, it) in enumerate(zip(path.moving, parts))]

    def _with_neighbors(self, part: int, time_ns: int) -> Numbers:
        if part not in self._whole:
            self._whole[part] = part_numbers(self._recording, self._locators.parts[part])
        whole, index = self._whole[part], self._recording.index
        begin_ns, end_ns = _around(time_ns)
        first, behind = np.searchsorted(
            whole.positions, (index.count_before(begin_ns), index.count_until(end_ns)))
        rows = slice(max(int(first) - 1, 0), int(behind) + 1)
        return Numbers(*(column[rows] for column in whole))

    def _read(self, part: int, rows: Sequence[_Row]) -> Numbers:
        """Return the usable numbers of a part of the source in some messages."""
        width = next(iter(self._locators.parts[part].values())).number_count
        found = [(row.position, numbers) for row in rows
                 for numbers in [self._numbers(row)] if numbers is not None]
        return Numbers(np.array([position for position, _ in found], np.int64),
                       np.array([it.values for _, it in found], float).reshape(-1, width),
                       np.array([it.stamp_ns for _, it in found], np.int64))

    def _numbers(self, row: _Row) -> Optional[_Numbers]:
        """Return the numbers of a part of the source in a message; None if they are not usable."""
        if row not in self._kept:
            try:
                data = self._recording.message(row.position)
                connection = int(self._recording.index.connection[row.position])
                self._kept[row] = _numbers_in(self._locators.parts[row.part][connection], data)
            except BagDamaged:
                self._kept[row] = None
        return self._kept[row]

    def _keep(self, rows: Sequence[_Row]) -> None:
        self._kept = {row: self._kept[row] for row in rows if row in self._kept}


def _around(time_ns: int) -> Tuple[int, int]:
    """Return the bag times [ns] between which messages determine the velocity at a time."""
    margin_ns = round(MARGIN_S * _NS_PER_S)
    return time_ns - margin_ns, time_ns + margin_ns


def _numbers_in(locator: Locator, data: Data) -> Optional[_Numbers]:
    places = locator.places(data)
    if not places.numbers:
        return None
    values = tuple(_number(data, place.offset, place.kind) for place in places.numbers)
    if not np.isfinite(values).all():
        return None
    at = places.stamp
    stamp_ns = 0 if at is None else sum(
        int(_number(data, at + offset, '<u4')) * unit for offset, unit in ((0, _NS_PER_S), (4, 1)))
    return _Numbers(values, stamp_ns)


def _number(data: Data, offset: int, kind: str) -> float:
    return float(np.frombuffer(data, kind, 1, offset)[0])
