# SPDX-License-Identifier: BSD-3-Clause
"""Copies a bag without an index (of a killed recorder, for example) to one with an index."""
from __future__ import annotations

import os
from typing import BinaryIO, Callable, Dict, List, NamedTuple, Tuple

from process_visualizer.bagio.bag_errors import BagError, Gap, RecordError
from process_visualizer.bagio.bag_file import (
    OP_CHUNK,
    OP_CONNECTION,
    OP_MESSAGE,
    BagFile,
    connection_of,
    number,
    operation,
    record_at,
    time_ns,
)
from process_visualizer.bagio.bag_writer import BagWriter, ConnectionRecord, IndexEntry
from process_visualizer.bagio.catalog import read_catalog
from process_visualizer.bagio.chunk_store import chunk_at, decompressed
from process_visualizer.whole_file import whole_file

Progress = Callable[[float], bool]


class Reindexed(NamedTuple):
    """The path of the copy, its number of messages, and the unreadable parts of the original."""

    path: str
    message_count: int
    gaps: Tuple[Gap, ...]


class ReindexCanceled(Exception):
    """The progress callback asked to stop; no copy is left behind."""


def reindex(path: str, progress: Progress = lambda part: True) -> Reindexed:
    """Copy a bag to `NAME.reindexed.bag` beside it, with an index; the original is only read.

    ``progress`` is called with the completed share (0 to 1) before each record of the file, and
    returns False to cancel. An existing copy is replaced when the new one is complete.

    Raises:
        ReindexCanceled: the callback returned False.
        BagError: the file is not a bag, holds no message, or the copy cannot be written.
    """
    copy = copy_path(path)
    source = BagFile(path)
    try:
        with whole_file(copy) as unfinished, open(unfinished, 'wb') as file:
            count, gaps = _Reindexing(source, file).run(progress)
    except OSError as error:
        raise BagError(copy, f'cannot be written: {error.strerror}') from error
    finally:
        source.close()
    return Reindexed(copy, count, gaps)


def copy_path(path: str) -> str:
    """Return the path of the copy of a bag: a.bag and a.bag.active become a.reindexed.bag."""
    stem = path[:-len('.active')] if path.endswith('.active') else path
    return (stem[:-len('.bag')] if stem.endswith('.bag') else stem) + '.reindexed.bag'


def recovered_text(result: Reindexed) -> str:
    """Return a text that says how much of a bag without an index could be read.

    Raises:
        BagError: the indexed copy cannot be read.
    """
    found = read_catalog([result.path])
    name, duration_s = os.path.basename(result.path), found.duration_s
    if not result.gaps:
        return f'{name}: recovered {duration_s:.1f} s.'
    if all(gap.begin_ns >= found.begin_ns + round(duration_s * 1e9) for gap in result.gaps):
        return f'{name}: recovered the first {duration_s:.1f} s; the rest is unreadable.'
    count = len(result.gaps)
    parts = 'a part is' if count == 1 else f'{count} parts are'
    return f'{name}: recovered {duration_s:.1f} s; {parts} unreadable.'


class _Reindexing:
    """One pass over the records of a bag."""

    def __init__(self, source: BagFile, file: BinaryIO) -> None:
        self._source = source
        self._writer = BagWriter(file)
        self._connections: Dict[int, ConnectionRecord] = {}
        self._gaps: List[Gap] = []
        self._count = 0
        self._last_ns = 0

    def run(self, progress: Progress) -> Tuple[int, Tuple[Gap, ...]]:
        at = self._source.bag_header().end
        while at < self._source.size:
            if not progress(at / self._source.size):
                raise ReindexCanceled(self._source.path)
            at = self._take_record(at)
        if not self._count:
            raise BagError(self._source.path, 'has no message that can be read')
        self._writer.finish([self._connections[it] for it in sorted(self._connections)])
        progress(1.0)
        return self._count, tuple(self._gaps)

    def _take_record(self, at: int) -> int:
        """Copy the record at a byte if it is a chunk; return where the next record begins."""
        try:
            head = self._source.head_at(at)
            kind = operation(head.fields)
        except RecordError as error:
            self._add_gap(at, f'the file cannot be read from here on: {error}')
            return self._source.size
        if kind == OP_CHUNK:
            try:
                self._copy_chunk(at)
            except RecordError as error:
                self._add_gap(at, f'a chunk cannot be read: {error}')
        return head.end

    def _copy_chunk(self, at: int) -> None:
        chunk = chunk_at(self._source, at)
        data = self._source.read(chunk.offset, chunk.size)
        connections = dict(self._connections)
        entries = _scan(memoryview(decompressed(data, chunk)), connections)
        self._connections = connections
        self._writer.write_chunk(data, chunk.compression.encode(), chunk.uncompressed_size,
                                 entries)
        self._count += len(entries)
        self._last_ns = max([self._last_ns, *(entry.time_ns for entry in entries)])

    def _add_gap(self, at: int, reason: str) -> None:
        """Add a gap whose end is unknown and whose time is that of the last message before it."""
        topics = sorted({it.topic.decode('utf-8', 'replace')
                         for it in self._connections.values()})
        self._gaps.append(Gap(self._source.path, at, self._last_ns, self._last_ns, tuple(topics),
                              reason))


def _scan(content: memoryview, connections: Dict[int, ConnectionRecord]) -> List[IndexEntry]:
    """Return the index of a chunk's messages; add the connections that the chunk describes."""
    entries = []
    at = 0
    while at < len(content):
        record = record_at(content, at)
        kind = operation(record.fields)
        if kind == OP_CONNECTION:
            connection_of(record)
            connection_id = number(record.fields, b'conn')
            connections[connection_id] = ConnectionRecord(
                connection_id, record.fields.get(b'topic', b''), bytes(record.data))
        elif kind == OP_MESSAGE:
            connection_id = number(record.fields, b'conn')
            if connection_id not in connections:
                raise RecordError(f'connection {connection_id} is not described')
            entries.append(IndexEntry(connection_id, time_ns(record.fields.get(b'time', b'')), at))
        at = record.end
    return entries
