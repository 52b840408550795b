# SPDX-License-Identifier: BSD-3-Clause
"""Records of the bag format 2.0: their headers and the values in them.

Source: the format's description, http://wiki.ros.org/Bags/Format/2.0. A record is a header and
data, each behind its length (uint32, little-endian); a header is fields `name=value`, each behind
its length.
"""
from __future__ import annotations

import struct
from typing import Dict, Iterator, List, Mapping, NamedTuple, Tuple, Union

from process_visualizer.bags.bag_errors import RecordError
from process_visualizer.messages.connection import Connection

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
    """Return an unsigned number of so many bytes.

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
