# SPDX-License-Identifier: BSD-3-Clause
"""A bag on the disk, read at any place; its descriptor is held while it is open."""
from __future__ import annotations

import os
import stat
import struct
from typing import Dict, Iterator, List, Mapping, NamedTuple, Tuple, Union

from process_visualizer.bagio.bag_errors import BagError, BagUnindexed, RecordError
from process_visualizer.bagio.message_definition import Connection

# Records of the bag format 2.0: their headers and the values in them.
#
# Source: the format's description, http://wiki.ros.org/Bags/Format/2.0. A record is a header and
# data, each behind its length (uint32, little-endian); a header is fields `name=value`, each behind
# its length.

MAGIC = b'#ROSBAG V2.0\n'
OP_MESSAGE, OP_BAG_HEADER, OP_INDEX, OP_CHUNK, OP_CHUNK_INFO, OP_CONNECTION = 2, 3, 4, 5, 6, 7
INDEX_ENTRY_BYTES = 12

Buffer = Union[bytes, memoryview]
Fields = Dict[bytes, bytes]

_U32 = struct.Struct('<I')
_TIME = struct.Struct('<II')
_PAIR = struct.Struct('<II')


class Record(NamedTuple):
    """A record inside a buffer: its fields, its data, and where in the buffer it ends."""

    fields: Fields
    data: memoryview
    end: int


class ChunkInfo(NamedTuple):
    """A chunk's place in the file [byte], its times [ns], and its messages per connection id."""

    position: int
    begin_ns: int
    end_ns: int
    counts: Tuple[Tuple[int, int], ...]


def u32_at(buffer: Buffer, offset: int) -> int:
    """Return the uint32 at an offset.

    Raises:
        RecordError: the buffer ends before.
    """
    if offset + 4 > len(buffer):
        raise RecordError('the record is cut off')
    return int(_U32.unpack_from(buffer, offset)[0])


def sized_part(buffer: Buffer, offset: int) -> Tuple[int, int]:
    """Return begin and end of the part that stands behind its length at an offset.

    Raises:
        RecordError: it does not end inside the buffer.
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
    """Return fields as the bytes of a header; the opposite of fields_of."""
    parts = (name + b'=' + value for name, value in fields.items())
    return b''.join(_U32.pack(len(part)) + part for part in parts)


def packed_record(fields: Mapping[bytes, bytes], data: Buffer) -> bytes:
    """Return a whole record as bytes."""
    header = header_of(fields)
    return b''.join((_U32.pack(len(header)), header, _U32.pack(len(data)), data))


def record_at(buffer: memoryview, offset: int) -> Record:
    """Return the record that begins at an offset of a buffer.

    Raises:
        RecordError: there is none, or the buffer ends before it.
    """
    begin, end = sized_part(buffer, offset)
    data_begin, data_end = sized_part(buffer, end)
    return Record(fields_of(buffer[begin:end]), buffer[data_begin:data_end], data_end)


def records_in(buffer: memoryview, offset: int = 0) -> Iterator[Record]:
    """Yield the records that fill a buffer.

    Raises:
        RecordError: what follows is not a record, or is cut off.
    """
    while offset < len(buffer):
        record = record_at(buffer, offset)
        yield record
        offset = record.end


def number(fields: Fields, name: bytes, size: int = 4) -> int:
    """Return an unsigned number of a size [bytes].

    Raises:
        RecordError: the field is missing or of another length.
    """
    value = fields.get(name)
    if value is None or len(value) != size:
        raise RecordError(f'the field "{name.decode()}" is missing or is not {size} bytes long')
    return int.from_bytes(value, 'little')


def operation(fields: Fields) -> int:
    """Return what kind of record it is (OP_…).

    Raises:
        RecordError: the field `op` is missing or of another length.
    """
    return number(fields, b'op', 1)


def time_ns(value: bytes) -> int:
    """Return a time [ns] from its 8 bytes (seconds, nanoseconds).

    Raises:
        RecordError: it is not 8 bytes long.
    """
    if len(value) != _TIME.size:
        raise RecordError('a time is not 8 bytes long')
    seconds, nanoseconds = _TIME.unpack(value)
    return int(seconds * 1_000_000_000 + nanoseconds)


def packed_time(value_ns: int) -> bytes:
    """Return a time [ns] as its 8 bytes; the opposite of time_ns."""
    return _TIME.pack(*divmod(value_ns, 1_000_000_000))


def connection_of(record: Record) -> Connection:
    """Return what a connection record says.

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
    """Return what a chunk info record says.

    Raises:
        RecordError: it is of another version, or its list is not as long as it says.
    """
    fields, data = record.fields, record.data
    if number(fields, b'ver') != 1 or len(data) != _PAIR.size * number(fields, b'count'):
        raise RecordError('a chunk info record has an unknown version or a wrong length')
    counts: List[Tuple[int, int]] = list(_PAIR.iter_unpack(data))
    return ChunkInfo(number(fields, b'chunk_pos', 8), time_ns(fields.get(b'start_time', b'')),
                     time_ns(fields.get(b'end_time', b'')), tuple(counts))


_USUAL_HEAD_BYTES = 256
_MAX_HEADER_BYTES = 1 << 20
# A long read keeps a processor from threads that must send something, where the kernel cannot be
# interrupted.
_PIECE_BYTES = 128 << 10


class RecordHead(NamedTuple):
    """A record in the file without its data: fields, begin and size of the data [byte]."""

    fields: Fields
    data_offset: int
    data_size: int

    @property
    def end(self) -> int:
        """The byte where the next record begins."""
        return self.data_offset + self.data_size


class BagHeader(NamedTuple):
    """The place of the index [byte; 0: there is none], and the number of its entries."""

    index_position: int
    connection_count: int
    chunk_count: int
    end: int


class BagFile:
    """An open bag. A file that is deleted meanwhile stays readable; what grows is not looked at."""

    def __init__(self, path: str) -> None:
        """Open the file.

        Raises:
            BagError: it cannot be opened, or is no regular file.
        """
        self.path = path
        try:
            # not to wait for a writer where the name is that of a pipe
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
        """Close the file; a second time does nothing."""
        if self._descriptor >= 0:
            os.close(self._descriptor)
            self._descriptor = -1

    def read(self, offset: int, size: int) -> bytearray:
        """Return a number of bytes from an offset.

        Raises:
            RecordError: the file ends before, or cannot be read there.
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
            RecordError: there is no record, or the file ends before its end.
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
        """Return what stands at the beginning of the bag.

        Raises:
            BagError: the file is not a bag, or one that cannot be read.
        """
        self._check_magic()
        try:
            head = self.head_at(len(MAGIC))
            if operation(head.fields) != OP_BAG_HEADER:
                raise RecordError('another record stands in its place')
            self._check_encryption(head.fields)
            return BagHeader(number(head.fields, b'index_pos', 8),
                             number(head.fields, b'conn_count'),
                             number(head.fields, b'chunk_count'), head.end)
        except RecordError as error:
            raise BagError(self.path, f'the header of the bag cannot be read: {error}') from error

    def indexed_header(self) -> BagHeader:
        """Return the header of a bag whose index is in the file.

        Raises:
            BagUnindexed: there is no index, or it has been cut off.
            BagError: the file is not a bag, or one that cannot be read.
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
