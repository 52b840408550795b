# SPDX-License-Identifier: BSD-3-Clause
"""One or several bags as one recording, with access to single messages and in batches."""
from __future__ import annotations

import os
import re
from types import TracebackType
from typing import (
    Dict,
    Iterable,
    Iterator,
    List,
    NamedTuple,
    Optional,
    Sequence,
    Set,
    Tuple,
    Type,
    Union,
)

import numpy as np

from process_visualizer.bagio.bag_errors import BagDamaged, Gap, RecordError
from process_visualizer.bagio.bag_file import OP_MESSAGE, BagFile
from process_visualizer.bagio.bag_index import BagIndex, ChunkPlaces, Columns, connection_dtype
from process_visualizer.bagio.chunk_store import Chunk, ChunkStore, chunk_at, decompressed
from process_visualizer.bagio.index_reader import read_index
from process_visualizer.bagio.message_definition import Connection, definition_problem

_EVER_SILENT = 0.5
"""Maximum duration of any other silence of all topics, as a share of the shortest hole."""
_MAX_HOLES = 0.02  # of all intervals
_REMARKED_S, _BEGUN_S = 2.0, 1.0  # before that, a latched message may be all there is


class Recording:
    """Bags (as from `rosbag record --split`) on one timeline: their index and their messages.

    ``index`` lists the messages, ``message`` reads them. Close a recording, or use it in a
    ``with``.
    """

    def __init__(self, paths: Sequence[str], cache_bytes: int = 64 << 20) -> None:
        """Open the files and read their indexes.

        ``begin_ns`` and ``end_ns`` are the bag times of the first and the last message.

        Raises:
            BagUnindexed: one of the files has to be reindexed first.
            BagError: one of the files is not a bag, or cannot be read.
            ValueError: no file is given.
        """
        if not paths:
            raise ValueError('a recording needs at least one bag')
        self._files: List[BagFile] = []
        try:
            for path in paths:
                self._files.append(BagFile(path))
            self.index = joined([read_index(file) for file in self._files])
        except BaseException:
            self.close()
            raise
        self.begin_ns, self.end_ns = self.index.begin_ns, self.index.end_ns
        self._cache_bytes = cache_bytes
        self._store = ChunkStore(self._files, self.index, cache_bytes)

    def choose(self, connections: Iterable[int]) -> None:
        """Keep only the messages of some connections; ``begin_ns`` and ``end_ns`` stay the same."""
        self.index = self.index.chosen(connections)
        self._store = ChunkStore(self._files, self.index, self._cache_bytes)

    def __enter__(self) -> Recording:
        """Return itself."""
        return self

    def __exit__(self, kind: Optional[Type[BaseException]], error: Optional[BaseException],
                 traceback: Optional[TracebackType]) -> None:
        """Close the files."""
        self.close()

    def close(self) -> None:
        """Close the files; messages can no longer be read."""
        for file in self._files:
            file.close()

    @property
    def paths(self) -> Tuple[str, ...]:
        """The files in the order in which they were given."""
        return tuple(file.path for file in self._files)

    @property
    def files(self) -> Tuple[BagFile, ...]:
        """The open files, in the order in which the index numbers them."""
        return tuple(self._files)

    @property
    def remarks(self) -> Tuple[str, ...]:
        """Notes for the user: messages without a usable time, or without a definition."""
        used = [it for number, it in enumerate(self.index.connections)
                if len(self.index.positions(number))]
        lacking = dict.fromkeys(map(definition_problem, used))
        return (*map(str, self.index.strays), *filter(None, lacking), *_stood_still(
            self.holes(_REMARKED_S)))

    def holes(self, shortest_s: float) -> np.ndarray:
        """Return the holes (m, 2) [s from the beginning] that last longer than ``shortest_s``.

        A hole extends from the last message before it to the first one after it. Nothing was
        recorded in it because the recorder or its computer had stopped, so no value holds there,
        not even one that is sent only when it changes. A recording has no holes if all of its
        topics are silent now and then, or if it has a single topic, whose sender may be silent.
        """
        if len({it.topic for it in self.index.connections}) < 2:
            return np.empty((0, 2))
        times_s = (self.index.time_ns - self.begin_ns) / 1e9
        intervals_s = np.diff(times_s)
        begins = np.flatnonzero(intervals_s > shortest_s)
        others_s = intervals_s[intervals_s <= shortest_s]
        if len(begins) > _MAX_HOLES * len(others_s) \
                or others_s.max(initial=0.0) > _EVER_SILENT * shortest_s:
            return np.empty((0, 2))
        return np.stack([times_s[begins], times_s[begins + 1]], axis=1)

    @property
    def size_bytes(self) -> int:
        """The total size of the files."""
        return sum(file.size for file in self._files)

    @property
    def gaps(self) -> Tuple[Gap, ...]:
        """The parts that could not be read so far, in the indexes and the chunks."""
        return self.index.gaps + self._store.gaps

    @property
    def cached_bytes(self) -> int:
        """The number of bytes of decompressed chunks in memory."""
        return self._store.cached_bytes

    def message(self, position: int) -> memoryview:
        """Return the serialized bytes of the message at a position of the index.

        Raises:
            BagDamaged: the message cannot be read (see `gap`); others still can.
        """
        return self._store.message(position)

    @property
    def damage(self) -> Tuple[Gap, ...]:
        """The messages and chunks that the index lists but that could not be read so far."""
        return self._store.gaps

    def note(self, position: int, reason: str) -> None:
        """Add a message that cannot be decoded to the ``gaps``."""
        self._store.note(position, reason)

    def check_chunks(self) -> None:
        """Try to decompress every chunk; ``gaps`` then has those that fail."""
        self._store.check()

    def is_readable(self, position: int) -> bool:
        """Return whether the chunk of a message is not known to be unreadable."""
        return self._store.is_readable(position)


def joined(indexes: Sequence[BagIndex]) -> BagIndex:
    """Return the indexes of several files as one, with equal connections merged."""
    if len(indexes) == 1:
        return indexes[0]
    numbers: Dict[Connection, int] = {}
    parts: List[Columns] = []
    chunk_count = 0
    for index in indexes:
        renumbered = [numbers.setdefault(it, len(numbers)) for it in index.connections]
        parts.append(Columns(index.time_ns, np.array(renumbered, np.int32)[index.connection],
                             index.chunk + np.int32(chunk_count), index.offset))
        chunk_count += len(index.chunks.position)
    columns = Columns(*map(np.concatenate, zip(*parts)))
    columns = columns._replace(connection=columns.connection.astype(connection_dtype(len(numbers))))
    return BagIndex(tuple(numbers), columns, _joined_places(indexes),
                    [gap for index in indexes for gap in index.gaps],
                    [it for index in indexes for it in index.strays])


def _joined_places(indexes: Sequence[BagIndex]) -> ChunkPlaces:
    files = [np.full(len(index.chunks.position), number, np.int32)
             for number, index in enumerate(indexes)]
    return ChunkPlaces(np.concatenate(files),
                       np.concatenate([index.chunks.position for index in indexes]))


_PART = re.compile(r'(.*_)(\d+)(\.bag)\Z')
_MAX_PAUSE_NS = 2_000_000_000
"""Maximum pause between two parts; slow topics may send nothing for this long."""


def recording_parts(path: str) -> Tuple[str, ...]:
    """Return a bag and the parts that follow it, each beginning where the previous one ends.

    Raises:
        BagError: a file cannot be read as a bag.
    """
    found: List[str] = [path]
    following = _following(path)
    while os.path.exists(following) and _goes_on(found[-1], following):
        found.append(following)
        following = _following(following)
    return tuple(found)


def _following(path: str) -> str:
    """Return the name of the next part; empty if the name has no number."""
    match = _PART.match(path)
    if match is None:
        return ''
    stem, number, suffix = match.groups()
    return f'{stem}{int(number) + 1:0{len(number)}}{suffix}'


def _goes_on(path: str, following: str) -> bool:
    with Recording([path]) as first, Recording([following]) as second:
        return abs(second.begin_ns - first.end_ns) <= _MAX_PAUSE_NS


# Reads many small messages at once, and only the parts of the files that hold them.

_CLOSE_BYTES = 16 << 10  # a gap up to this size is read with the records around it
_MAX_RECORD_BYTES = 1 << 20  # of a larger record, only the beginning is read
_BATCH_BYTES = 8 << 20
_BATCH_RECORDS = 1 << 15
U32_BYTES = 4
_IS_MESSAGE = b'op=' + bytes([OP_MESSAGE])
_IS_MESSAGE_U32 = int.from_bytes(_IS_MESSAGE, 'little')


class RecordBatch(NamedTuple):
    """Records of messages, including their headers, in a buffer (uint8).

    One row per record: the message's position in the index, and start and end in the buffer of the
    part of the record that was read.
    """

    buffer: np.ndarray
    positions: np.ndarray
    begin: np.ndarray
    end: np.ndarray

    def u32_at(self, begin: np.ndarray, end: np.ndarray) -> np.ndarray:
        """Return the numbers (int64) at some bytes of the buffer; -1 for those beyond an end."""
        fits = begin + U32_BYTES <= end
        if not fits.any():
            return np.full(len(begin), -1, np.int64)
        at = np.where(fits, begin, 0)[:, np.newaxis] + np.arange(U32_BYTES)
        values = self.buffer[at].view('<u4')[:, 0].astype(np.int64)
        return np.where(fits, values, -1)


def record_batches(recording: Recording, positions: np.ndarray,
                   most_bytes: int = _MAX_RECORD_BYTES) -> Iterator[RecordBatch]:
    """Yield the records of messages, given by their positions in the index (int).

    The records come in file order; records of more than ``most_bytes`` are cut off there.
    Unreadable chunks and records other than messages are left out and added to
    ``recording.gaps``, with the first such message of each connection.
    """
    rows, spans = _Rows(recording.index, positions, most_bytes), _Spans(recording)
    readable = _SingleReader(recording)
    batch: List[RecordBatch] = []
    size = count = 0
    for first, last in rows.spans():
        try:
            part = spans.read(rows, slice(first, last))
        except RecordError:
            readable.among(rows.positions[first:last])
            continue
        batch.append(part)
        size, count = size + len(part.buffer), count + last - first
        if size >= _BATCH_BYTES or count >= _BATCH_RECORDS:
            yield _of_messages(_joined(batch), readable)
            batch, size, count = [], 0, 0
    if batch:
        yield _of_messages(_joined(batch), readable)


class _SingleReader:
    """Reads doubtful messages one by one, so that the unreadable ones are noted."""

    def __init__(self, recording: Recording) -> None:
        self._recording = recording
        self._failed: Set[int] = set()  # connections; the report needs one message of each

    def among(self, positions: np.ndarray) -> List[int]:
        """Return the positions whose messages can be read."""
        return [it for it in positions.tolist() if self._is_readable(it)]

    def _is_readable(self, position: int) -> bool:
        connection = int(self._recording.index.connection[position])
        if connection in self._failed or not self._recording.is_readable(position):
            return False
        try:
            self._recording.message(position)
        except BagDamaged:
            self._failed.add(connection)
            return False
        return True


def _of_messages(batch: RecordBatch, readable: _SingleReader) -> RecordBatch:
    """Return the records of a batch that are messages."""
    are_messages = _are_messages(batch)
    if are_messages.all():
        return batch
    # the header of a message may be longer than the part that was read
    are_messages |= np.isin(batch.positions, readable.among(batch.positions[~are_messages]))
    return RecordBatch(batch.buffer, *(column[are_messages] for column in batch[1:]))


def _are_messages(batch: RecordBatch) -> np.ndarray:
    """Return for each record whether its header is that of a message."""
    at = batch.begin + U32_BYTES
    end = np.minimum(at + batch.u32_at(batch.begin, batch.end), batch.end)
    found = np.zeros(len(at), bool)
    rows = np.arange(len(at))
    while len(rows):  # check the next field of each undecided header
        size = batch.u32_at(at[rows], end[rows])
        found[rows] = ((size == len(_IS_MESSAGE))
                       & (batch.u32_at(at[rows] + U32_BYTES, end[rows]) == _IS_MESSAGE_U32))
        at[rows] += U32_BYTES + size
        rows = rows[~found[rows] & (size >= 0) & (at[rows] < end[rows])]
    return found


class _Rows:
    """The requested records in file order: chunk, and start and end in the chunk."""

    def __init__(self, index: BagIndex, positions: np.ndarray, most_bytes: int) -> None:
        order = np.argsort((index.chunk.astype(np.int64) << 32) | index.offset, kind='stable')
        follower = np.full(len(index), np.iinfo(np.int64).max)
        same_chunk = index.chunk[order[1:]] == index.chunk[order[:-1]]
        follower[order[:-1][same_chunk]] = index.offset[order[1:][same_chunk]]
        wanted = np.zeros(len(index), bool)
        wanted[positions] = True
        self.positions = order[wanted[order]]
        self.chunk = index.chunk[self.positions]
        self.begin = index.offset[self.positions].astype(np.int64)
        self.end = np.minimum(follower[self.positions], self.begin + most_bytes)

    def spans(self) -> Iterator[Tuple[int, int]]:
        """Yield the ranges of rows (begin, end) that are read together."""
        if not len(self.positions):
            return
        apart = ((self.chunk[1:] != self.chunk[:-1])
                 | (self.begin[1:] > self.end[:-1] + _CLOSE_BYTES))
        bounds = [0, *(np.flatnonzero(apart) + 1).tolist(), len(self.positions)]
        yield from zip(bounds, bounds[1:])


class _Spans:
    """Reads parts of chunks, keeping the last chunk for its next part."""

    def __init__(self, recording: Recording) -> None:
        self._files, self._chunks = recording.files, recording.index.chunks
        self._number = -1
        self._chunk = Chunk(0, 0, 'none', 0)
        self._content = b''  # of a compressed chunk

    def read(self, rows: _Rows, span: slice) -> RecordBatch:
        """Return the records of some rows of one chunk.

        Raises:
            RecordError: the records cannot be read.
        """
        number = int(rows.chunk[span.start])
        file = self._files[int(self._chunks.file[number])]
        if number != self._number:
            self._number = -1
            self._open(file, int(self._chunks.position[number]))
            self._number = number
        begin, end = int(rows.begin[span.start]), int(rows.end[span.stop - 1])
        content = self._part(file, begin, end)
        first = rows.begin[span] - begin
        return RecordBatch(np.frombuffer(content, np.uint8), rows.positions[span], first,
                           np.minimum(rows.end[span] - begin, len(content)))

    def _open(self, file: BagFile, position: int) -> None:
        self._chunk = chunk_at(file, position)
        if self._chunk.compression != 'none':
            data = file.read(self._chunk.offset, self._chunk.size)
            self._content = decompressed(data, self._chunk)

    def _part(self, file: BagFile, begin: int, end: int) -> Union[bytes, bytearray]:
        if self._chunk.compression != 'none':
            return self._content[begin:end]
        return file.read(self._chunk.offset + begin, max(0, min(end, self._chunk.size) - begin))


def _joined(parts: Sequence[RecordBatch]) -> RecordBatch:
    sizes = np.array([len(part.buffer) for part in parts])
    offsets = (np.cumsum(sizes) - sizes).tolist()
    return RecordBatch(np.concatenate([part.buffer for part in parts]),
                       np.concatenate([part.positions for part in parts]),
                       np.concatenate([part.begin + at for part, at in zip(parts, offsets)]),
                       np.concatenate([part.end + at for part, at in zip(parts, offsets)]))


def _stood_still(holes_s: np.ndarray) -> Iterator[str]:
    """Yield a remark on holes (m, 2) [s from the beginning], if there are any."""
    holes_s = holes_s[holes_s[:, 0] > _BEGUN_S]
    if len(holes_s):
        begin_s, end_s = holes_s[np.diff(holes_s)[:, 0].argmax()].tolist()
        minutes, seconds = divmod(begin_s, 60.0)
        longest = '' if len(holes_s) == 1 else f'{len(holes_s)} times, the longest time '
        yield (f'nothing was recorded {longest}for {end_s - begin_s:.1f} s from '
               f'{minutes:.0f}:{seconds:04.1f} on; if the recorder or its computer had stopped, '
               'messages that arrived just afterwards are late')
