# SPDX-License-Identifier: BSD-3-Clause
"""Reads many small messages at once: only the parts of the files that hold them."""
from __future__ import annotations

from typing import Iterator, List, NamedTuple, Sequence, Tuple, Union

import numpy as np

from process_visualizer.bags.bag_errors import RecordError
from process_visualizer.bags.bag_file import BagFile
from process_visualizer.bags.bag_index import BagIndex
from process_visualizer.bags.chunk_store import Chunk, chunk_at, decompressed
from process_visualizer.bags.recording import Recording

_CLOSE_BYTES = 16 << 10  # what lies between two records is read with them
_LARGEST_RECORD_BYTES = 1 << 20  # of the wanted ones; of a larger one, the beginning is read
_BATCH_BYTES = 8 << 20
_BATCH_RECORDS = 1 << 15


class RecordBatch(NamedTuple):
    """Records of messages, header and all, as they stand in a buffer (uint8).

    One row per record: the message's position in the index, where the record begins in the
    buffer, and where what was read of it ends.
    """

    buffer: np.ndarray
    positions: np.ndarray
    begin: np.ndarray
    end: np.ndarray


def record_batches(recording: Recording, positions: np.ndarray,
                   most_bytes: int = _LARGEST_RECORD_BYTES) -> Iterator[RecordBatch]:
    """Yield the records of messages, given by their positions in the index (int).

    They come in the order of the files; of records of more than ``most_bytes`` the beginning.
    Chunks that cannot be read are left out.
    """
    rows, spans = _Rows(recording.index, positions, most_bytes), _Spans(recording)
    batch: List[RecordBatch] = []
    size = count = 0
    for first, last in rows.spans():
        try:
            part = spans.read(rows, slice(first, last))
        except RecordError:
            continue
        batch.append(part)
        size, count = size + len(part.buffer), count + last - first
        if size >= _BATCH_BYTES or count >= _BATCH_RECORDS:
            yield _joined(batch)
            batch, size, count = [], 0, 0
    if batch:
        yield _joined(batch)


class _Rows:
    """Places of the wanted records: chunk, first byte and end in it, in the order of the files."""

    def __init__(self, index: BagIndex, positions: np.ndarray, most_bytes: int) -> None:
        order = np.argsort(_places(index), kind='stable')
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
        """Yield the rows (first, behind the last) that are read together."""
        if not len(self.positions):
            return
        apart = ((self.chunk[1:] != self.chunk[:-1])
                 | (self.begin[1:] > self.end[:-1] + _CLOSE_BYTES))
        bounds = [0, *(np.flatnonzero(apart) + 1).tolist(), len(self.positions)]
        yield from zip(bounds, bounds[1:])


def _places(index: BagIndex) -> np.ndarray:
    return (index.chunk.astype(np.int64) << 32) | index.offset


class _Spans:
    """Reads parts of chunks; the last chunk is kept, for its next part."""

    def __init__(self, recording: Recording) -> None:
        self._files, self._chunks = recording.files, recording.index.chunks
        self._number = -1
        self._chunk = Chunk(0, 0, 'none', 0)
        self._content = b''  # of a compressed chunk

    def read(self, rows: _Rows, span: slice) -> RecordBatch:
        """Return the records of some rows of one chunk.

        Raises:
            RecordError: they cannot be read.
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
