# SPDX-License-Identifier: BSD-3-Clause
"""Reads the index of a bag: its messages and their positions, without reading the messages."""
from __future__ import annotations

from functools import lru_cache
from typing import Callable, Dict, Iterator, List, NamedTuple, Sequence, Tuple

import numpy as np

from process_visualizer.bagio.bag_errors import BagDamaged, BagError, BagUnindexed, Gap, RecordError
from process_visualizer.bagio.bag_file import (
    INDEX_ENTRY_BYTES,
    OP_CHUNK,
    OP_CHUNK_INFO,
    OP_CONNECTION,
    OP_INDEX,
    BagFile,
    BagHeader,
    ChunkInfo,
    Record,
    chunk_info_of,
    connection_of,
    fields_of,
    number,
    operation,
    records_in,
    sized_part,
)
from process_visualizer.bagio.bag_index import (
    MAX_UNSET_NS,
    BagIndex,
    ChunkPlaces,
    Columns,
    Strays,
    connection_dtype,
    is_rising,
)
from process_visualizer.bagio.chunk_store import ChunkStore
from process_visualizer.bagio.message_definition import Connection, with_definition
from process_visualizer.ros_names import STATIC_TF_TOPIC

# Finds impossible times and leaves out their messages.
#
# A message has time 0 if its writer knew no time, and a time in 1970 or 2106 if its clock was
# wrong. Such a message would stretch the recording over decades, nearly all of them empty.

_MAX_PAUSE_NS = 7 * 24 * 3600 * 1_000_000_000
"""Maximum pause within a recording."""
_MAX_FROM_ZERO_NS = 10 * 1_000_000_000
"""Limit of the first nonzero time: below it, time 0 is simulated time; above it, a missing time."""
_MAX_LOOKS = 100_000


def with_usable_times(index: BagIndex, own_time_ns: Callable[[int], int]) -> BagIndex:
    """Return the index of a file without messages whose times are far from most others.

    If the index and a message's record differ, the time in the record counts: ``own_time_ns`` reads
    it for the message at a position (raising BagDamaged if it is unreadable). Latched messages and
    /tf_static hold regardless of their time, and count from the beginning. Gaps with impossible
    times get an unknown time (0).
    """
    first_ns, last_ns = _span(index.time_ns)
    doubtful = np.flatnonzero((index.time_ns <= MAX_UNSET_NS)
                              | ~_inside(index.time_ns, first_ns, last_ns))
    if len(doubtful):
        index = _corrected(index, doubtful[:_MAX_LOOKS], own_time_ns)
        first_ns, last_ns = _span(index.time_ns)
    rows = _inside(index.time_ns, first_ns, last_ns)
    gaps = [it if not len(index) or _inside(np.array([it.begin_ns, it.end_ns]),
                                            first_ns - _MAX_PAUSE_NS, last_ns + _MAX_PAUSE_NS).all()
            else it._replace(begin_ns=0, end_ns=0) for it in index.gaps]
    if rows.all() and gaps == list(index.gaps):
        return index
    holds = np.array([_holds(it) for it in index.connections], bool)[index.connection] & ~rows
    columns = Columns(*(np.concatenate((column[holds], column[rows])) for column in index.columns))
    columns.time_ns[:np.count_nonzero(holds)] = first_ns
    return BagIndex(index.connections, columns, index.chunks, gaps, _strays(index, ~rows))


def _span(time_ns: np.ndarray) -> Tuple[int, int]:
    """Return the first and last of the ascending times: of a group with most of them, or of all."""
    if not len(time_ns):
        return 0, 0
    zeros = int(np.searchsorted(time_ns, MAX_UNSET_NS, side='right'))
    if zeros == len(time_ns) or time_ns[zeros] <= _MAX_FROM_ZERO_NS:
        zeros = 0
    known = time_ns[zeros:]
    bounds = [0, *(np.flatnonzero(np.diff(known) > _MAX_PAUSE_NS) + 1).tolist(), len(known)]
    count, begin = max((end - begin, begin) for begin, end in zip(bounds, bounds[1:]))
    if 2 * count <= len(known):
        return int(time_ns[0]), int(time_ns[-1])
    return int(known[begin]), int(known[begin + count - 1])


def _inside(time_ns: np.ndarray, first_ns: int, last_ns: int) -> np.ndarray:
    inside: np.ndarray = (time_ns >= first_ns) & (time_ns <= last_ns)
    return inside


def _corrected(index: BagIndex, positions: np.ndarray,
               own_time_ns: Callable[[int], int]) -> BagIndex:
    """Return the index with the times in the records of some messages."""
    time_ns = index.time_ns.copy()
    for position in positions.tolist():
        try:
            time_ns[position] = own_time_ns(position)
        except BagDamaged:
            continue  # reading the message reports it
    if np.array_equal(time_ns, index.time_ns):
        return index
    return BagIndex(index.connections, index.columns._replace(time_ns=time_ns), index.chunks,
                    index.gaps)


def _holds(connection: Connection) -> bool:
    return connection.latching or connection.topic.endswith(STATIC_TF_TOPIC)


def _strays(index: BagIndex, rows: np.ndarray) -> Iterator[Strays]:
    for topic in sorted({it.topic for it in index.connections}):
        numbers = index.connections_of(topic)
        positions = index.positions_of(numbers)
        times_ns = index.time_ns[positions[rows[positions]]]
        unset = int(np.searchsorted(times_ns, MAX_UNSET_NS, side='right'))
        for part in filter(len, (times_ns[:unset], times_ns[unset:])):
            yield Strays(topic, len(part), int(part[0]), int(part[-1]),
                         any(_holds(index.connections[number]) for number in numbers))


_MAX_SUMMARY_BYTES = 1 << 30
_INDEX_HEAD_BYTES = 128
# small enough for a batch's arrays to reuse memory, which is three times as fast
_BATCH_BYTES = INDEX_ENTRY_BYTES << 13
_ENTRY = np.dtype([('seconds', '<u4'), ('nanoseconds', '<u4'), ('offset', '<u4')])

Connections = Dict[int, Connection]


class IndexPart(NamedTuple):
    """The index entries of one connection in one chunk, as bytes."""

    chunk: int
    connection: int
    entries: memoryview


def read_index(file: BagFile) -> BagIndex:
    """Return the index of one bag.

    Damaged parts of the index become gaps. If a publisher did not send the definition of its
    messages, the installed one is used, provided that its MD5 sum is the same.

    Raises:
        BagUnindexed: the bag has no index, or only a part of one.
        BagError: the file is not a bag, or cannot be read.
    """
    header = file.indexed_header()
    by_id, infos = _read_summary(file, header)
    numbers = {connection_id: number_ for number_, connection_id in enumerate(sorted(by_id))}
    ends = [*(info.position for info in infos[1:]), header.index_position]
    entries = IndexEntries(len(numbers), _capacity(infos, ends))
    gaps: List[Gap] = []
    for chunk, (info, end) in enumerate(zip(infos, ends)):
        try:
            entries.add([IndexPart(chunk, _numbered(numbers, connection_id), data)
                         for connection_id, data in _index_of_chunk(file, info, end)])
        except RecordError as error:
            gaps.append(_gap(file, info, by_id, f'a part of the index cannot be read: {error}'))
    places = ChunkPlaces(np.zeros(len(infos), np.int32),
                         np.array([info.position for info in infos], np.uint64))
    index = BagIndex([by_id[it] for it in sorted(by_id)], entries.columns(), places, gaps)
    return with_usable_times(index, ChunkStore([file], index).own_time_ns)


class IndexEntries:
    """Converts index entries to columns, a batch of chunks at a time to save memory."""

    def __init__(self, connection_count: int, capacity: int) -> None:
        """Reserve room for a number of entries; memory is used only for actual entries."""
        self._columns = Columns(np.empty(capacity, np.int64),
                                np.empty(capacity, connection_dtype(connection_count)),
                                np.empty(capacity, np.int32), np.empty(capacity, np.uint32))
        self._count = 0
        self._parts: List[IndexPart] = []
        self._waiting_bytes = 0

    def add(self, parts: Sequence[IndexPart]) -> None:
        """Add the parts of a chunk; chunks must be added in file order.

        Raises:
            RecordError: there is no room for the entries; none is added.
        """
        size = sum(len(part.entries) for part in parts)
        if (self._count + (self._waiting_bytes + size) // INDEX_ENTRY_BYTES
                > len(self._columns.time_ns)):
            raise RecordError('the index lists more messages than the file can hold')
        self._parts.extend(parts)
        self._waiting_bytes += size
        if self._waiting_bytes >= _BATCH_BYTES:
            self._convert()

    def columns(self) -> Columns:
        """Return all rows, in the order of time within each batch."""
        self._convert()
        return Columns(*(column[:self._count] for column in self._columns))

    def _convert(self) -> None:
        parts, self._parts, self._waiting_bytes = self._parts, [], 0
        entries = np.frombuffer(b''.join(part.entries for part in parts), _ENTRY)
        counts = [len(part.entries) // INDEX_ENTRY_BYTES for part in parts]
        chunk = np.repeat(np.array([part.chunk for part in parts], np.int32), counts)
        connection = np.repeat(np.array([part.connection for part in parts],
                                        self._columns.connection.dtype), counts)
        time_ns = entries['seconds'].astype(np.int64) * 1_000_000_000 + entries['nanoseconds']
        order = _order(chunk, entries['offset'], time_ns)
        rows = slice(self._count, self._count + len(order))
        self._count = rows.stop
        batch = Columns(time_ns, connection, chunk, entries['offset'])
        for column, values in zip(self._columns, batch):
            column[rows] = values[order]


def _order(chunk: np.ndarray, offset: np.ndarray, time_ns: np.ndarray) -> np.ndarray:
    """Return the order by time; messages with the same time are in recorded order."""
    recorded = np.argsort((chunk.astype(np.int64) << 32) | offset, kind='stable')
    if is_rising(time_ns[recorded]):
        return recorded
    return recorded[np.argsort(time_ns[recorded], kind='stable')]


def _read_summary(file: BagFile, header: BagHeader) -> Tuple[Connections, List[ChunkInfo]]:
    """Read the end of the bag; return the connections by id, and the chunks in file order."""
    size = file.size - header.index_position
    if size > _MAX_SUMMARY_BYTES:
        raise BagError(file.path, f'the list of its chunks would be {size} bytes long; '
                                  'the file is damaged')
    connections: Connections = {}
    infos: List[ChunkInfo] = []
    try:
        _check_summary(file, header.index_position)
        for record in records_in(memoryview(file.read(header.index_position, size))):
            _take(record, connections, infos)
    except RecordError as error:
        raise BagUnindexed(file.path, f'its index cannot be read to the end ({error}); '
                                      'it has to be reindexed') from error
    if len(connections) < header.connection_count or len(infos) < header.chunk_count:
        raise BagUnindexed(file.path, 'a part of its index is missing (the file is cut off); '
                                      'it has to be reindexed')
    return connections, sorted({info.position: info for info in infos}.values())


def _check_summary(file: BagFile, position: int) -> None:
    """Check the first record of the summary, before the rest of the file is read into memory.

    Raises:
        RecordError: the record does not belong to a summary.
    """
    if (position < file.size
            and operation(file.head_at(position).fields) not in (OP_CONNECTION, OP_CHUNK_INFO)):
        raise RecordError('something else is in its place')


def _take(record: Record, connections: Connections, infos: List[ChunkInfo]) -> None:
    kind = operation(record.fields)
    if kind == OP_CONNECTION:
        connections[number(record.fields, b'conn')] = with_definition(connection_of(record))
    elif kind == OP_CHUNK_INFO:
        infos.append(chunk_info_of(record))


def _index_of_chunk(file: BagFile, info: ChunkInfo, end: int) -> List[Tuple[int, memoryview]]:
    """Return connection id and entries of each index record after a chunk, up to byte ``end``."""
    head = file.head_at(info.position)
    if operation(head.fields) != OP_CHUNK:
        raise RecordError('no chunk begins here')
    messages = sum(count for _, count in info.counts)
    size = messages * INDEX_ENTRY_BYTES + len(info.counts) * _INDEX_HEAD_BYTES
    if head.end > end:
        raise RecordError('the chunk overlaps the next one')
    if messages * INDEX_ENTRY_BYTES > end - head.end:
        raise RecordError('it lists more messages than there is room for')
    block = memoryview(file.read(head.end, min(size, end - head.end)))
    found, at = [], 0
    for _ in info.counts:
        begin, end = sized_part(block, at)
        connection, count = _index_head(bytes(block[begin:end]))
        begin, at = sized_part(block, end)
        if at - begin != count * INDEX_ENTRY_BYTES:
            raise RecordError('an index record has a wrong length')
        found.append((connection, block[begin:at]))
    if sum(len(data) for _, data in found) != messages * INDEX_ENTRY_BYTES:
        raise RecordError('it lists another number of messages')
    return found


@lru_cache(4096)
def _index_head(header: bytes) -> Tuple[int, int]:
    """Return connection id and number of entries of an index record; most headers are repeated."""
    fields = fields_of(header)
    if operation(fields) != OP_INDEX or number(fields, b'ver') != 1:
        raise RecordError('there is no index record of version 1 here')
    return number(fields, b'conn'), number(fields, b'count')


def _capacity(infos: Sequence[ChunkInfo], ends: Sequence[int]) -> int:
    """Return an upper bound on the number of messages: those listed, if the file has room."""
    return sum(min(sum(count for _, count in info.counts),
                   max(0, end - info.position) // INDEX_ENTRY_BYTES)
               for info, end in zip(infos, ends))


def _numbered(numbers: Dict[int, int], connection_id: int) -> int:
    if connection_id not in numbers:
        raise RecordError(f'connection {connection_id} is not described')
    return numbers[connection_id]


def _gap(file: BagFile, info: ChunkInfo, connections: Connections, reason: str) -> Gap:
    topics = {connections[it].topic for it, _ in info.counts if it in connections}
    return Gap(file.path, info.position, info.begin_ns, info.end_ns, tuple(sorted(topics)), reason)
