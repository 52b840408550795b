# SPDX-License-Identifier: BSD-3-Clause
"""Reads messages from chunks, which are decompressed and cached within a memory limit."""
from __future__ import annotations

import bz2
import threading
from collections import OrderedDict
from functools import lru_cache
from typing import Any, Dict, Iterator, NamedTuple, Optional, Sequence, Tuple, Union

import lz4.frame

from process_visualizer.bagio.bag_errors import BagDamaged, Gap, RecordError
from process_visualizer.bagio.bag_file import (
    OP_CHUNK,
    OP_MESSAGE,
    BagFile,
    Fields,
    fields_of,
    number,
    operation,
    sized_part,
    time_ns,
    u32_at,
)
from process_visualizer.bagio.bag_index import BagIndex

_FIRST_READ_BYTES = 4096
_MAX_CHUNK_BYTES = 256 << 20
"""Maximum uncompressed size of a compressed chunk, held whole in memory; rosbag writes 768 KB."""
_STEP_BYTES = 1 << 20
_MORE_BYTES = 64 << 20
"""Tolerated excess of a chunk's compressed size over its uncompressed size. Above it, the length is
considered wrong, and the chunk is not read into memory."""
_HEADS_KEPT = 4096
_MAX_NOTES = 100


Content = Union[bytes, bytearray]
"""Content of a chunk; never modified."""


class Chunk(NamedTuple):
    """The position and size [bytes] of a chunk's data in its file, and its compression."""

    offset: int
    size: int
    compression: str
    uncompressed_size: int


class ChunkStore:
    """Reads messages by their position in the index; may be used by several threads.

    Decompressed chunks are cached up to ``cache_bytes``, but at least the last one. Uncompressed
    chunks are not cached; their messages are read one by one.
    """

    def __init__(self, files: Sequence[BagFile], index: BagIndex,
                 cache_bytes: int = 64 << 20) -> None:
        self._files = files
        self._index = index
        self._cache = ChunkCache(cache_bytes)
        self._damaged: Dict[int, Gap] = {}
        self._noted: Dict[Tuple[int, str], Gap] = {}
        self._chunk = lru_cache(_HEADS_KEPT)(self._chunk_at)

    @property
    def gaps(self) -> Tuple[Gap, ...]:
        """The chunks and messages that could not be read so far, and the noted messages."""
        return (*self._damaged.values(), *self._noted.values())

    def note(self, position: int, reason: str) -> None:
        """Note a message that cannot be used; only the first per topic and reason is kept."""
        topic = int(self._index.connection[position])
        if (topic, reason) not in self._noted and len(self._noted) < _MAX_NOTES:
            self._noted[topic, reason] = self._gap_of_message(position, reason)

    @property
    def cached_bytes(self) -> int:
        """The number of bytes of decompressed chunks in the cache."""
        return self._cache.size

    def check(self) -> None:
        """Try to decompress every chunk; ``gaps`` then includes those that fail."""
        for number_ in range(len(self._index.chunks.position)):
            if number_ not in self._damaged:
                try:
                    self._open_chunk(number_)
                except BagDamaged:
                    continue  # already noted

    def is_readable(self, position: int) -> bool:
        """Return whether the chunk of a message is not known to be unreadable."""
        return int(self._index.chunk[position]) not in self._damaged

    def message(self, position: int) -> memoryview:
        """Return the serialized bytes of a message, as recorded.

        Raises:
            BagDamaged: the message or its chunk cannot be read; others still can.
        """
        number_, offset = self._place(position)
        chunk, content = self._open_chunk(number_)
        try:
            if content is not None:
                return _message_in(memoryview(content)[offset:])
            return self._message_on_disk(self._file(number_), chunk, offset)
        except RecordError as error:
            self.note(position, str(error))
            raise BagDamaged(self._gap_of_message(position, str(error))) from error

    def own_time_ns(self, position: int) -> int:
        """Return the time of a message according to its own record.

        Raises:
            BagDamaged: the record or its chunk cannot be read.
        """
        number_, offset = self._place(position)
        chunk, content = self._open_chunk(number_)
        try:
            if content is not None:
                return _time_of(memoryview(content)[offset:])
            left = max(0, chunk.size - offset)
            return _time_of(memoryview(self._file(number_).read(
                chunk.offset + offset, min(_FIRST_READ_BYTES, left))))
        except RecordError as error:
            raise BagDamaged(self._gap_of_message(position, str(error))) from error

    def _place(self, position: int) -> Tuple[int, int]:
        """Return the chunk of a message, and its byte in the chunk.

        Raises:
            BagDamaged: the chunk is known to be unreadable.
        """
        number_ = int(self._index.chunk[position])
        if number_ in self._damaged:
            raise BagDamaged(self._damaged[number_])
        return number_, int(self._index.offset[position])

    def _open_chunk(self, number_: int) -> Tuple[Chunk, Optional[Content]]:
        """Return a chunk and, if it is compressed, its content."""
        try:
            chunk = self._chunk(number_)
            if chunk.compression == 'none':
                return chunk, None
            content = self._cache.get(number_)
            if content is None:
                content = decompressed(self._file(number_).read(chunk.offset, chunk.size), chunk)
                self._cache.put(number_, content)
            return chunk, content
        except RecordError as error:
            self._damaged[number_] = self._gap_of_chunk(number_, str(error))
            raise BagDamaged(self._damaged[number_]) from error

    def _file(self, number_: int) -> BagFile:
        return self._files[int(self._index.chunks.file[number_])]

    def _chunk_at(self, number_: int) -> Chunk:
        return chunk_at(self._file(number_), int(self._index.chunks.position[number_]))

    def _message_on_disk(self, file: BagFile, chunk: Chunk, offset: int) -> memoryview:
        """Return a message of an uncompressed chunk; a small one needs only one read."""
        left = max(0, chunk.size - offset)
        block = memoryview(file.read(chunk.offset + offset, min(_FIRST_READ_BYTES, left)))
        begin, size = _message_span(block)
        if begin + size > left:
            raise RecordError('a message goes beyond the end of its chunk')
        if begin + size <= len(block):
            return block[begin:begin + size]
        return memoryview(file.read(chunk.offset + offset + begin, size))

    def _gap_of_chunk(self, number_: int, reason: str) -> Gap:
        topics, begin_ns, end_ns = self._index.topics_of_chunk(number_)
        position = int(self._index.chunks.position[number_])
        return Gap(self._file(number_).path, position, begin_ns, end_ns, topics,
                   f'a chunk cannot be read: {reason}')

    def _gap_of_message(self, position: int, reason: str) -> Gap:
        number_ = int(self._index.chunk[position])
        topic = self._index.connections[int(self._index.connection[position])].topic
        time_ns = int(self._index.time_ns[position])
        return Gap(self._file(number_).path, int(self._index.chunks.position[number_]),
                   time_ns, time_ns, (topic,), f'a message cannot be read: {reason}')


class ChunkCache:
    """A cache of the most recently used chunks, up to a number of bytes."""

    def __init__(self, largest_size: int) -> None:
        self.size = 0
        self._largest_size = largest_size
        self._lock = threading.Lock()
        self._contents: OrderedDict[int, Content] = OrderedDict()

    def get(self, number_: int) -> Optional[Content]:
        """Return the content of a chunk, or None if it is not in the cache."""
        with self._lock:
            content = self._contents.get(number_)
            if content is not None:
                self._contents.move_to_end(number_)
            return content

    def put(self, number_: int, content: Content) -> None:
        """Cache the content of a chunk, and drop the least recently used ones."""
        with self._lock:
            if number_ in self._contents:
                return
            self._contents[number_] = content
            self.size += len(content)
            while self.size > self._largest_size and len(self._contents) > 1:
                self.size -= len(self._contents.popitem(last=False)[1])


def chunk_at(file: BagFile, position: int) -> Chunk:
    """Return the chunk that begins at a byte of a file.

    Raises:
        RecordError: there is no chunk, or it cannot be read.
    """
    head = file.head_at(position)
    if operation(head.fields) != OP_CHUNK:
        raise RecordError('no chunk begins here')
    compression = head.fields.get(b'compression', b'').decode('utf-8', 'replace')
    if compression not in ('none', 'bz2', 'lz4'):
        raise RecordError(f'its compression "{compression}" is not known (none, bz2, lz4 are)')
    size = number(head.fields, b'size')
    if head.data_size > size + size // 50 + _MORE_BYTES:
        raise RecordError(f'its {head.data_size} bytes are too many for the {size} that they hold')
    return Chunk(head.data_offset, head.data_size, compression, size)


def decompressed(data: bytes, chunk: Chunk) -> Content:
    """Return the content of a chunk, using no more memory than the chunk's header says.

    Raises:
        RecordError: the data cannot be decompressed, or its size differs from the header's.
    """
    size = chunk.uncompressed_size
    if chunk.compression == 'none':
        return data
    if size > _MAX_CHUNK_BYTES:
        raise RecordError(f'it would take {size} bytes of memory; at most {_MAX_CHUNK_BYTES} '
                          'are allowed')
    content = bytearray()
    try:
        for step in _steps(data, chunk.compression):
            content += step
            if len(content) > size:
                break
    except (OSError, RuntimeError, ValueError, EOFError) as error:
        raise RecordError(f'decompression ({chunk.compression}) fails: {error}') from error
    if len(content) != size:
        raise RecordError(f'it holds {"more" if len(content) > size else "less"} than the '
                          f'{size} bytes that its header says')
    return content


def _steps(data: bytes, compression: str) -> Iterator[bytes]:
    """Decompress data step by step; in a single step, the result would be in memory twice."""
    decompressor: Any = bz2.BZ2Decompressor() if compression == 'bz2' \
        else lz4.frame.LZ4FrameDecompressor()
    step = decompressor.decompress(data, max_length=_STEP_BYTES)
    while step:
        yield step
        if decompressor.eof:
            return
        step = decompressor.decompress(b'', max_length=_STEP_BYTES)


def _message_in(record: memoryview) -> memoryview:
    begin, size = _message_span(record)
    if begin + size > len(record):
        raise RecordError('a message goes beyond the end of its chunk')
    return record[begin:begin + size]


def _message_span(record: memoryview) -> Tuple[int, int]:
    """Return offset and size of the data of the message record at the start of a buffer."""
    _, end = _message_head(record)
    return end + 4, u32_at(record, end)


def _time_of(record: memoryview) -> int:
    return time_ns(_message_head(record)[0].get(b'time', b''))


def _message_head(record: memoryview) -> Tuple[Fields, int]:
    """Return the fields of the message record at the start of a buffer, and the header's end."""
    begin, end = sized_part(record, 0)
    fields = fields_of(record[begin:end])
    if operation(fields) != OP_MESSAGE:
        raise RecordError('no message begins where the index says')
    return fields, end
