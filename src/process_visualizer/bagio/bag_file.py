# SPDX-License-Identifier: BSD-3-Clause
"""A bag on disk, readable at any position; keeps its file descriptor open until closed."""
from __future__ import annotations

import os
import stat
import struct
from typing import Dict, Iterator, List, Mapping, NamedTuple, Tuple, Union

from process_visualizer.bagio.bag_errors import BagError, BagUnindexed, RecordError
from process_visualizer.bagio.message_definition import Connection

# Records of the bag format 2.0: their headers and the values in them.
#
# Source: the description of the format, http://wiki.ros.org/Bags/Format/2.0. A record is a header
# and data, each preceded by its length (uint32, little-endian); a header is a sequence of fields
# `name=value`, each preceded by its length.

MAGIC = b'#ROSBAG V2.0\n'
OP_MESSAGE, OP_BAG_HEADER, OP_INDEX, OP_CHUNK, OP_CHUNK_INFO, OP_CONNECTION = 2, 3, 4, 5, 6, 7
INDEX_ENTRY_BYTES = 12

Buffer = Union[bytes, memoryview]
Fields = Dict[bytes, bytes]

_U32 = struct.Struct('<I')
_TIME = struct.Struct('<II')
_PAIR = struct.Struct('<II')


class Record(NamedTuple):
    """A record in a buffer: its fields, its data, and its end in the buffer."""

    fields: Fields
    data: memoryview
    end: int


class ChunkInfo(NamedTuple):
    """A chunk: position in the file [byte], times [ns], message counts by connection id."""

    position: int
    begin_ns: int
    end_ns: int
    counts: Tuple[Tuple[int, int], ...]


def u32_at(buffer: Buffer, offset: int) -> int:
    """Return the uint32 at an offset.

    Raises:
        RecordError: the buffer is too short.
    """
    if offset + 4 > len(buffer):
        raise RecordError('the record is cut off')
    return int(_U32.unpack_from(buffer, offset)[0])


def sized_part(buffer: Buffer, offset: int) -> Tuple[int, int]:
    """Return start and end of the part whose length is at an offset.

    Raises:
        RecordError: the part goes beyond the end of the buffer.
    """
    begin = offset + 4
    end = begin + u32_at(buffer, offset)
    if end > len(buffer):
        raise RecordError('the record is cut off')
    return begin, end


def fields_of(header: Buffer) -> Fields:
    """Return the fields of a header by name.

    Raises:
        RecordError: the bytes are not a header.
    """
    fields: Fields = {}
    at = 0
    while at < len(header):
        begin, at = sized_part(header, at)
        name, equals, value = bytes(header[begin:at]).partition(b'=')
        if not equals:
            raise RecordError('the header has a field without "="')
        fields[name] = value
    return fields


def header_of(fields: Mapping[bytes, bytes]) -> bytes:
    """Return fields as the bytes of a header; the inverse of ``fields_of``."""
    parts = (name + b'=' + value for name, value in fields.items())
    return b''.join(_U32.pack(len(part)) + part for part in parts)


def packed_record(fields: Mapping[bytes, bytes], data: Buffer) -> bytes:
    """Return a whole record as bytes."""
    header = header_of(fields)
    return b''.join((_U32.pack(len(header)), header, _U32.pack(len(data)), data))


def record_at(buffer: memoryview, offset: int) -> Record:
    """Return the record that begins at an offset of a buffer.

    Raises:
        RecordError: there is no record, or it goes beyond the end of the buffer.
    """
    begin, end = sized_part(buffer, offset)
    data_begin, data_end = sized_part(buffer, end)
    return Record(fields_of(buffer[begin:end]), buffer[data_begin:data_end], data_end)


def records_in(buffer: memoryview, offset: int = 0) -> Iterator[Record]:
    """Yield the records that fill a buffer.

    Raises:
        RecordError: a part of the buffer is not a record, or is cut off.
    """
    while offset < len(buffer):
        record = record_at(buffer, offset)
        yield record
        offset = record.end


def number(fields: Fields, name: bytes, size: int = 4) -> int:
    """Return a field that is an unsigned number of a given size [bytes].

    Raises:
        RecordError: the field is missing or has another length.
    """
    value = fields.get(name)
    if value is None or len(value) != size:
        raise RecordError(f'the field "{name.decode()}" is missing or is not {size} bytes long')
    return int.from_bytes(value, 'little')


def operation(fields: Fields) -> int:
    """Return the kind of a record (OP_…).

    Raises:
        RecordError: the field `op` is missing or has another length.
    """
    return number(fields, b'op', 1)


def time_ns(value: bytes) -> int:
    """Return a time [ns] from its 8 bytes (seconds, nanoseconds).

    Raises:
        RecordError: the value is not 8 bytes long.
    """
    if len(value) != _TIME.size:
        raise RecordError('a time is not 8 bytes long')
    seconds, nanoseconds = _TIME.unpack(value)
    return int(seconds * 1_000_000_000 + nanoseconds)


def packed_time(value_ns: int) -> bytes:
    """Return the 8 bytes of a time [ns]; the inverse of ``time_ns``."""
    return _TIME.pack(*divmod(value_ns, 1_000_000_000))


def connection_of(record: Record) -> Connection:
    """Return the connection that a connection record describes.

    Raises:
        RecordError: the type, its MD5 sum or the topic is missing.
    """
    fields = fields_of(record.data)
    texts = {name: value.decode('utf-8', 'replace') for name, value in fields.items()}
    topic = record.fields.get(b'topic', b'').decode('utf-8', 'replace')
    topic = topic or texts.get(b'topic', '')
    if not (topic and texts.get(b'type') and texts.get(b'md5sum')):
        raise RecordError('a connection has no topic, type or md5sum')
    return Connection(topic, texts[b'type'], texts[b'md5sum'],
                      texts.get(b'message_definition', ''), texts.get(b'latching') == '1',
                      texts.get(b'callerid', ''))


def chunk_info_of(record: Record) -> ChunkInfo:
    """Return the content of a chunk info record.

    Raises:
        RecordError: the record has another version, or a list of the wrong length.
    """
    fields, data = record.fields, record.data
    if number(fields, b'ver') != 1 or len(data) != _PAIR.size * number(fields, b'count'):
        raise RecordError('a chunk info record has an unknown version or a wrong length')
    counts: List[Tuple[int, int]] = list(_PAIR.iter_unpack(data))
    return ChunkInfo(number(fields, b'chunk_pos', 8), time_ns(fields.get(b'start_time', b'')),
                     time_ns(fields.get(b'end_time', b'')), tuple(counts))


_USUAL_HEAD_BYTES = 256
_MAX_HEADER_BYTES = 1 << 20
# Reads are split: on a kernel without preemption, a long read keeps a processor from threads that
# have to send.
_PIECE_BYTES = 128 << 10


class RecordHead(NamedTuple):
    """A record in the file without its data: its fields, and start and size of the data [bytes]."""

    fields: Fields
    data_offset: int
    data_size: int

    @property
    def end(self) -> int:
        """The byte where the next record begins."""
        return self.data_offset + self.data_size


class BagHeader(NamedTuple):
    """The first record of a bag: position of the index [byte; 0: no index], and its counts."""

    index_position: int
    connection_count: int
    chunk_count: int
    end: int


class BagFile:
    """An open bag, readable even if the file is deleted; data appended later is ignored."""

    def __init__(self, path: str) -> None:
        """Open the file.

        Raises:
            BagError: the file cannot be opened, or is not a regular file.
        """
        self.path = path
        try:
            # O_NONBLOCK: do not wait for a writer if the path is a pipe
            self._descriptor = os.open(path, os.O_RDONLY | os.O_CLOEXEC | os.O_NONBLOCK)
        except (OSError, ValueError) as error:
            reason = getattr(error, 'strerror', None) or error
            raise BagError(path, f'cannot be opened: {reason}') from error
        status = os.fstat(self._descriptor)
        self.size = status.st_size
        if not stat.S_ISREG(status.st_mode):
            self.close()
            raise BagError(path, 'is not a file')

    def close(self) -> None:
        """Close the file; a repeated call does nothing."""
        if self._descriptor >= 0:
            os.close(self._descriptor)
            self._descriptor = -1

    def read(self, offset: int, size: int) -> bytearray:
        """Return a number of bytes from an offset.

        Raises:
            RecordError: the file is too short, or cannot be read there.
        """
        if offset + size > self.size:
            raise RecordError('the record goes beyond the end of the file')
        buffer = bytearray(size)
        view = memoryview(buffer)
        done = 0
        while done < size:
            done += self._read_into(view[done:done + _PIECE_BYTES], offset + done)
        return buffer

    def _read_into(self, part: memoryview, offset: int) -> int:
        try:
            count = os.preadv(self._descriptor, [part], offset)
        except OSError as error:
            raise RecordError(f'the file cannot be read: {error.strerror}') from error
        if not count:
            raise RecordError('the file has become shorter')
        return count

    def head_at(self, offset: int) -> RecordHead:
        """Return the head of the record at an offset.

        Raises:
            RecordError: there is no record, or it goes beyond the end of the file.
        """
        block = self.read(offset, min(_USUAL_HEAD_BYTES, max(0, self.size - offset)))
        length = u32_at(block, 0)
        if length > _MAX_HEADER_BYTES:
            raise RecordError(f'no record begins here (a header of {length} bytes)')
        if length + 8 > len(block):
            block = self.read(offset, length + 8)
        head = RecordHead(fields_of(block[4:4 + length]), offset + 8 + length,
                          u32_at(block, 4 + length))
        if head.end > self.size:
            raise RecordError('the record goes beyond the end of the file')
        return head

    def bag_header(self) -> BagHeader:
        """Return the first record of the bag.

        Raises:
            BagError: the file is not a bag, or cannot be read.
        """
        self._check_magic()
        try:
            head = self.head_at(len(MAGIC))
            if operation(head.fields) != OP_BAG_HEADER:
                raise RecordError('another record is in its place')
            self._check_encryption(head.fields)
            return BagHeader(number(head.fields, b'index_pos', 8),
                             number(head.fields, b'conn_count'),
                             number(head.fields, b'chunk_count'), head.end)
        except RecordError as error:
            raise BagError(self.path, f'the header of the bag cannot be read: {error}') from error

    def indexed_header(self) -> BagHeader:
        """Return the header of a bag that has its index.

        Raises:
            BagUnindexed: the index is missing or cut off.
            BagError: the file is not a bag, or cannot be read.
        """
        header = self.bag_header()
        if header.index_position == 0:
            raise BagUnindexed(self.path, 'has no index (its recorder was not stopped properly); '
                                          'it has to be reindexed')
        if header.index_position < header.end or header.index_position > self.size:
            raise BagUnindexed(self.path, 'has lost its index (the file is cut off or damaged); '
                                          'it has to be reindexed')
        return header

    def _check_magic(self) -> None:
        if self.size == 0:
            raise BagError(self.path, 'is empty')
        try:
            magic = self.read(0, min(len(MAGIC), self.size))
        except RecordError as error:
            raise BagError(self.path, str(error)) from error
        if magic == MAGIC:
            return
        if magic.startswith(b'#ROSBAG V') or magic.startswith(b'#ROSRECORD V'):
            version = magic.split(b' V')[1].split(b'\n')[0].decode('ascii', 'replace')
            raise BagError(self.path, f'is a bag of version {version}; only version 2.0 can be '
                                      'read (rosbag fix converts old bags)')
        raise BagError(self.path, 'is not a bag (it does not begin with "#ROSBAG V2.0")')

    def _check_encryption(self, fields: Fields) -> None:
        encryptor = fields.get(b'encryptor', b'').decode('utf-8', 'replace')
        if encryptor:
            raise BagError(self.path, f'is encrypted ({encryptor}); decrypt it first '
                                      '(rosbag decrypt)')
