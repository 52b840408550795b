# SPDX-License-Identifier: BSD-3-Clause
"""A bag on the disk, read at any place; its descriptor is held while it is open."""
from __future__ import annotations

import os
import stat
from typing import NamedTuple

from process_visualizer.bags.bag_errors import BagError, BagUnindexed, RecordError
from process_visualizer.bags.bag_records import (
    MAGIC,
    OP_BAG_HEADER,
    Fields,
    fields_of,
    number,
    operation,
    u32_at,
)

_USUAL_HEAD_BYTES = 256
_LONGEST_HEADER_BYTES = 1 << 20
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
        """Return so many bytes from an offset.

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
        if length > _LONGEST_HEADER_BYTES:
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
