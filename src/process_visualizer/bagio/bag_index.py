# SPDX-License-Identifier: BSD-3-Clause
"""The index of a recording: the position of every message, as arrays in the order of time."""
from __future__ import annotations

from datetime import datetime, timezone
from functools import cached_property
from typing import Dict, Iterable, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from process_visualizer.bagio.bag_errors import Gap
from process_visualizer.bagio.message_definition import Connection

MAX_UNSET_NS = 2_000_000
"""Times up to this mean "no time": some writers use the smallest ROS time (1 ns) or 1 ms more."""


class Columns(NamedTuple):
    """One row per message: time [ns], connection number, chunk number, byte in the chunk."""

    time_ns: np.ndarray
    connection: np.ndarray
    chunk: np.ndarray
    offset: np.ndarray


class ChunkPlaces(NamedTuple):
    """One row per chunk: the number of its file, and its first byte in that file."""

    file: np.ndarray
    position: np.ndarray


class Strays(NamedTuple):
    """Messages of a topic without a time, or with times [ns] far from those of all others.

    Such messages are left out, or count from the beginning if they hold until replaced.
    """

    topic: str
    message_count: int
    first_ns: int
    last_ns: int
    are_kept: bool

    def __str__(self) -> str:
        is_one = self.message_count == 1
        some = 'one message has' if is_one else f'{self.message_count} messages have'
        times = ' to '.join(dict.fromkeys(map(_date, (self.first_ns, self.last_ns))))
        time = f'a time far from that of all others ({times})' if self.last_ns > MAX_UNSET_NS \
            else 'no time (0)'
        kept = 'from the beginning on' if self.are_kept else 'left out'
        return (f'{self.topic}: {some} {time} and {"is" if is_one else "are"} '
                f'{"there " if self.are_kept else ""}{kept}')


class BagIndex:
    """The messages of a recording by position, 0 for the earliest; read-only.

    Messages of the same time are in the order in which they were recorded (file, chunk, byte). The
    columns ``connection`` and ``chunk`` are indices of ``connections`` and ``chunks``; ``gaps`` are
    the parts of the files that could not be read; ``strays`` are the messages with impossible
    times.
    """

    def __init__(self, connections: Sequence[Connection], columns: Columns, chunks: ChunkPlaces,
                 gaps: Iterable[Gap] = (), strays: Iterable[Strays] = ()) -> None:
        """Sort the columns by time, unless they are sorted already."""
        self.connections = tuple(connections)
        self._numbers: Dict[str, List[int]] = {}
        for number, connection in enumerate(self.connections):
            self._numbers.setdefault(connection.topic, []).append(number)
        self.time_ns, self.connection, self.chunk, self.offset = _in_order(columns)
        self.chunks = chunks
        self.gaps, self.strays = tuple(gaps), tuple(strays)
        # numpy sorts 16-bit numbers stably by radix sort, in a time independent of their range
        self._grouped = np.argsort(self.connection, kind='stable').astype(np.int32)
        counts = np.bincount(self.connection, minlength=len(self.connections))
        self._bounds = np.concatenate(([0], np.cumsum(counts))).tolist()
        for array in (self.time_ns, self.connection, self.chunk, self.offset, self._grouped,
                      *chunks):
            array.setflags(write=False)

    def __len__(self) -> int:
        """Return the number of messages."""
        return len(self.time_ns)

    @property
    def columns(self) -> Columns:
        """The rows, sorted by time."""
        return Columns(self.time_ns, self.connection, self.chunk, self.offset)

    @property
    def left_out(self) -> int:
        """The number of messages left out because of impossible times."""
        return sum(it.message_count for it in self.strays if not it.are_kept)

    @property
    def begin_ns(self) -> int:
        """Time of the first message [ns since the epoch]; 0 without messages."""
        return int(self.time_ns[0]) if len(self) else 0

    @property
    def end_ns(self) -> int:
        """Time of the last message [ns since the epoch]; 0 without messages."""
        return int(self.time_ns[-1]) if len(self) else 0

    def chosen(self, connections: Iterable[int]) -> BagIndex:
        """Return the index reduced to some connections, which keep their numbers."""
        wanted = np.zeros(len(self.connections), bool)
        wanted[list(connections)] = True
        if wanted.all():
            return self
        rows = wanted[self.connection]
        columns = Columns(*(column[rows] for column in self.columns))
        topics = {self.connections[number].topic for number in np.flatnonzero(wanted)}
        return BagIndex(self.connections, columns, self.chunks, self.gaps,
                        [it for it in self.strays if it.topic in topics])

    def count_until(self, time_ns: int) -> int:
        """Return the number of messages at or before a time: the position of the next message."""
        return int(np.searchsorted(self.time_ns, time_ns, side='right'))

    def count_before(self, time_ns: int) -> int:
        """Return the number of messages before a time: the position of the first at or after it."""
        return int(np.searchsorted(self.time_ns, time_ns, side='left'))

    def positions(self, connection: int) -> np.ndarray:
        """Return the positions (int32, ascending) of a connection's messages."""
        return self._grouped[self._bounds[connection]:self._bounds[connection + 1]]

    def positions_of(self, connections: Sequence[int]) -> np.ndarray:
        """Return the positions (int32, ascending) of the messages of several connections."""
        parts = [self.positions(connection) for connection in connections]
        if len(parts) == 1:
            return parts[0]
        return np.sort(np.concatenate(parts)) if parts else np.empty(0, np.int32)

    def connections_of(self, topic: str) -> Tuple[int, ...]:
        """Return the numbers of a topic's connections."""
        return tuple(self._numbers.get(topic, ()))

    def last_before(self, position: int, connection: int) -> Optional[int]:
        """Return the position of a connection's last message before a position, or None."""
        positions = self.positions(connection)
        # with a number of another type, numpy would convert all positions first
        count = int(positions.searchsorted(positions.dtype.type(position)))
        return int(positions[count - 1]) if count else None

    def last_at(self, time_ns: int, connection: int) -> Optional[int]:
        """Return the position of a connection's last message at or before a time, or None."""
        return self.last_before(self.count_until(time_ns), connection)

    def topics_of_chunk(self, chunk: int) -> Tuple[Tuple[str, ...], int, int]:
        """Return the topics, and the first and last time [ns], of a chunk's messages."""
        order, sorted_chunks = self._by_chunk
        begin, end = np.searchsorted(sorted_chunks, [chunk, chunk + 1])
        rows = order[begin:end]
        if not len(rows):
            return (), 0, 0
        numbers = np.unique(self.connection[rows])
        topics = tuple(sorted({self.connections[number].topic for number in numbers}))
        return topics, int(self.time_ns[rows[0]]), int(self.time_ns[rows[-1]])

    @cached_property
    def _by_chunk(self) -> Tuple[np.ndarray, np.ndarray]:
        """The rows by chunk, and the chunk of each row; needed only for damaged recordings."""
        order = np.argsort(self.chunk, kind='stable').astype(np.int32)
        return order, self.chunk[order]


def is_rising(values: np.ndarray) -> bool:
    """Return whether no value is less than its predecessor."""
    return bool(np.all(values[1:] >= values[:-1]))


def connection_dtype(count: int) -> np.dtype:
    """Return the smallest type that can number the connections."""
    return np.dtype(np.int16 if count <= np.iinfo(np.int16).max else np.int32)


def _in_order(columns: Columns) -> Columns:
    if is_rising(columns.time_ns):
        return columns
    order = np.argsort(columns.time_ns, kind='stable')
    return Columns(*(column[order] for column in columns))


def _date(time_ns: int) -> str:
    return datetime.fromtimestamp(time_ns // 1_000_000_000, timezone.utc).strftime('%Y-%m-%d')
