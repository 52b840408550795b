# SPDX-License-Identifier: BSD-3-Clause
"""Numbers from many messages at once, by their places in one of the messages."""
from __future__ import annotations

from typing import List, NamedTuple, Optional, Tuple

import numpy as np

from process_visualizer.bagio.bag_errors import RecordError
from process_visualizer.bagio.bag_file import OP_MESSAGE, fields_of, operation, sized_part, u32_at
from process_visualizer.bagio.number_places import Locator, NumberPlaces, Place
from process_visualizer.bagio.recording import RecordBatch

_MAX_PATTERNS = 200
"""Maximum record layouts of one connection; messages of any other layout are skipped."""


class Numbers(NamedTuple):
    """Numbers of messages: positions in the index (n,), values (n, k), stamps [ns] (n,) or 0."""

    positions: np.ndarray
    values: np.ndarray
    stamps_ns: np.ndarray


class NumberColumns:
    """Collector of the numbers in the messages of one connection, batch by batch.

    Only one message of each layout is parsed; numpy reads all others with that layout at once.
    """

    def __init__(self, locator: Locator) -> None:
        """Initialize with the locator for the message type."""
        self._locator = locator
        self._patterns: List[_Pattern] = []
        self._found: List[Numbers] = []

    def add(self, batch: RecordBatch, rows: np.ndarray) -> None:
        """Add rows (int) of a batch, which are records of the connection."""
        for pattern in self._patterns:
            rows = self._take(pattern, batch, rows)
        while len(rows) and len(self._patterns) < _MAX_PATTERNS:
            pattern_of_first = self._pattern(batch, int(rows[0]))
            if pattern_of_first is None:
                rows = rows[1:]
            else:
                self._patterns.append(pattern_of_first)
                rows = self._take(pattern_of_first, batch, rows)

    def numbers(self) -> Numbers:
        """Return the numbers found, finite values only, in no particular order."""
        if not self._found:
            return Numbers(np.empty(0, np.int64), np.empty((0, self._locator.number_count)),
                           np.empty(0, np.int64))
        joined = Numbers(*(np.concatenate(column) for column in zip(*self._found)))
        good = np.isfinite(joined.values).all(axis=1)
        return Numbers(*(column[good] for column in joined))

    def taken(self) -> Numbers:
        """Return the numbers found since the last call."""
        numbers = self.numbers()
        self._found = []
        return numbers

    def _take(self, pattern: '_Pattern', batch: RecordBatch, rows: np.ndarray) -> np.ndarray:
        """Read the rows that fit a pattern; return the others."""
        if not len(rows):
            return rows
        fits = pattern.fits(batch, rows)
        if pattern.places.numbers and fits.any():
            self._found.append(pattern.numbers(batch, rows[fits]))
        return rows[~fits]

    def _pattern(self, batch: RecordBatch, row: int) -> Optional['_Pattern']:
        record = memoryview(batch.buffer[int(batch.begin[row]):int(batch.end[row])].tobytes())
        try:
            begin, end = sized_part(record, 0)
            if operation(fields_of(record[begin:end])) != OP_MESSAGE:
                return None
            size = u32_at(record, end)
        except RecordError:
            return None
        data = record[end + 4:end + 4 + size]
        return _Pattern(record, end + 4, self._locator.places(data))


class _Pattern:
    """The layout of a record, for comparison: lengths, and the bytes that its places depend on."""

    def __init__(self, record: memoryview, data_begin: int, places: NumberPlaces) -> None:
        fixed = [(0, 4), (data_begin - 4, data_begin)]
        fixed += [(data_begin + begin, data_begin + end) for begin, end in places.fixed]
        columns = np.concatenate([np.arange(begin, end) for begin, end in fixed])
        self._columns = columns[columns < len(record)]
        self._bytes = np.frombuffer(record, np.uint8)[self._columns]
        self._data_begin = data_begin
        self.places = places
        ends = [place.offset + np.dtype(place.kind).itemsize for place in places.numbers]
        self._size = max([int(self._columns.max()) + 1, *(data_begin + end for end in ends)])

    def fits(self, batch: RecordBatch, rows: np.ndarray) -> np.ndarray:
        """Return which rows (bool) have this layout."""
        begin = batch.begin[rows]
        fits: np.ndarray = batch.end[rows] - begin >= self._size
        found = batch.buffer[begin[fits][:, np.newaxis] + self._columns]
        fits[fits] = (found == self._bytes).all(axis=1)
        return fits

    def numbers(self, batch: RecordBatch, rows: np.ndarray) -> Numbers:
        """Return the numbers in rows that have this layout."""
        begin = batch.begin[rows] + self._data_begin
        values = [_column(batch.buffer, begin, place) for place in self.places.numbers]
        return Numbers(batch.positions[rows], np.stack(values, axis=1), self._stamps(batch, begin))

    def _stamps(self, batch: RecordBatch, begin: np.ndarray) -> np.ndarray:
        at = self.places.stamp
        if at is None:
            return np.zeros(len(begin), np.int64)
        seconds, nanoseconds = (_column(batch.buffer, begin, Place(at + part, '<u4'))
                                for part in (0, 4))
        return seconds.astype(np.int64) * 1_000_000_000 + nanoseconds.astype(np.int64)


def _column(buffer: np.ndarray, begin: np.ndarray, place: Place) -> np.ndarray:
    """Return the numbers (n,) float64 at a place after each of some positions in a buffer."""
    kind = np.dtype(place.kind)
    found = buffer[begin[:, np.newaxis] + np.arange(place.offset, place.offset + kind.itemsize)]
    return found.view(kind)[:, 0].astype(float)


def joined_numbers(parts: Tuple[Numbers, ...]) -> Numbers:
    """Return the numbers of several connections, in the order of the index."""
    joined = Numbers(*(np.concatenate(column) for column in zip(*parts)))
    order = np.argsort(joined.positions, kind='stable')
    return Numbers(*(column[order] for column in joined))
