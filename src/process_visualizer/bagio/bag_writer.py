# SPDX-License-Identifier: BSD-3-Clause
"""Writes bags of format 2.0 chunk by chunk, for reindexing and cutting."""
from __future__ import annotations

import struct
from typing import BinaryIO, Dict, List, Mapping, NamedTuple, Sequence, Tuple

from process_visualizer.bagio.bag_file import (
    MAGIC,
    OP_BAG_HEADER,
    OP_CHUNK,
    OP_CHUNK_INFO,
    OP_CONNECTION,
    OP_INDEX,
    Buffer,
    header_of,
    packed_record,
    packed_time,
)

# Size of the file's first record, without its two lengths. rosbag's tools rewrite the record in
# this size: if it were smaller here, they would overwrite the beginning of the first chunk.
_BAG_HEADER_BYTES = 4096
_ENTRY = struct.Struct('<III')
_PAIR = struct.Struct('<II')


class ConnectionRecord(NamedTuple):
    """A connection as in the bag: id, topic, and the publisher's header as bytes."""

    id: int
    topic: bytes
    header: bytes


class IndexEntry(NamedTuple):
    """A message of a chunk: its connection's id, its time [ns], its byte in the chunk."""

    connection: int
    time_ns: int
    offset: int


class BagWriter:
    """Writes a bag to a binary file, which is valid once ``finish`` has been called."""

    def __init__(self, file: BinaryIO) -> None:
        self._file = file
        self._chunk_infos: List[bytes] = []
        file.write(MAGIC + _bag_header(0, 0, 0))

    def write_chunk(self, data: Buffer, compression: bytes, uncompressed_size: int,
                    entries: Sequence[IndexEntry]) -> None:
        """Write a chunk, already compressed, and the index of its messages."""
        position = self._file.tell()
        self._file.write(packed_record({b'op': bytes([OP_CHUNK]), b'compression': compression,
                                        b'size': _u32(uncompressed_size)}, data))
        by_connection: Dict[int, List[IndexEntry]] = {}
        for entry in entries:
            by_connection.setdefault(entry.connection, []).append(entry)
        for connection, its_entries in by_connection.items():
            self._file.write(_index_record(connection, its_entries))
        self._chunk_infos.append(_chunk_info(position, entries, by_connection))

    def finish(self, connections: Sequence[ConnectionRecord]) -> None:
        """Write the connections and the list of chunks, and complete the first record."""
        position = self._file.tell()
        for connection in connections:
            self._file.write(packed_record(
                {b'op': bytes([OP_CONNECTION]), b'conn': _u32(connection.id),
                 b'topic': connection.topic}, connection.header))
        self._file.writelines(self._chunk_infos)
        self._file.seek(len(MAGIC))
        self._file.write(_bag_header(position, len(connections), len(self._chunk_infos)))


def _u32(value: int) -> bytes:
    return value.to_bytes(4, 'little')


def _bag_header(index_position: int, connection_count: int, chunk_count: int) -> bytes:
    """Return the first record, padded to its fixed size so that it can be rewritten."""
    fields = {b'op': bytes([OP_BAG_HEADER]), b'index_pos': index_position.to_bytes(8, 'little'),
              b'conn_count': _u32(connection_count), b'chunk_count': _u32(chunk_count)}
    return packed_record(fields, b' ' * (_BAG_HEADER_BYTES - len(header_of(fields))))


def _index_record(connection: int, entries: Sequence[IndexEntry]) -> bytes:
    fields = {b'op': bytes([OP_INDEX]), b'ver': _u32(1), b'conn': _u32(connection),
              b'count': _u32(len(entries))}
    return packed_record(fields, b''.join(
        _ENTRY.pack(*divmod(entry.time_ns, 1_000_000_000), entry.offset) for entry in entries))


def _chunk_info(position: int, entries: Sequence[IndexEntry],
                by_connection: Mapping[int, Sequence[IndexEntry]]) -> bytes:
    begin_ns, end_ns = _span_ns(entries)
    fields = {b'op': bytes([OP_CHUNK_INFO]), b'ver': _u32(1),
              b'chunk_pos': position.to_bytes(8, 'little'), b'start_time': packed_time(begin_ns),
              b'end_time': packed_time(end_ns), b'count': _u32(len(by_connection))}
    return packed_record(fields, b''.join(_PAIR.pack(connection, len(its_entries))
                                          for connection, its_entries in by_connection.items()))


def _span_ns(entries: Sequence[IndexEntry]) -> Tuple[int, int]:
    times = [entry.time_ns for entry in entries]
    return min(times, default=0), max(times, default=0)
