# SPDX-License-Identifier: BSD-3-Clause
"""Copies a span of a recording into a new bag, as if only that span had been recorded."""
from __future__ import annotations

import bz2
import os
from functools import partial
from typing import BinaryIO, Callable, Collection, Dict, List, NamedTuple, Optional, Set, Tuple

import lz4.frame
import numpy as np

from process_visualizer.bagio.bag_errors import BagDamaged, BagError
from process_visualizer.bagio.bag_file import (
    OP_CONNECTION,
    OP_MESSAGE,
    header_of,
    packed_record,
    packed_time,
)
from process_visualizer.bagio.bag_writer import BagWriter, ConnectionRecord, IndexEntry
from process_visualizer.bagio.marks import added_marks, write_added_marks
from process_visualizer.bagio.message_definition import Connection
from process_visualizer.bagio.recorder_topics import (
    ACCOUNT,
    CALIBRATION,
    CONFIGURATION,
    MARKS,
    STATIC_FRAMES,
)
from process_visualizer.bagio.recording import Recording
from process_visualizer.bagio.recording_calibration import saved_poses, write_saved_poses
from process_visualizer.ros_names import STATIC_TF_TOPIC
from process_visualizer.whole_file import whole_file

_CHUNK_BYTES = 768 << 10
"""Chunk size, as in rosbag: a player reads and decompresses a whole chunk for one message."""
_ALWAYS = frozenset((CONFIGURATION, CALIBRATION, STATIC_FRAMES, MARKS))
_COMPRESS: Dict[str, Callable[[bytes], bytes]] = {
    'none': lambda data: data, 'bz2': bz2.compress,
    # the only kind of frame that rosbag's own reader accepts
    'lz4': partial(lz4.frame.compress, block_linked=False, content_checksum=True,
                   store_size=False)}
COMPRESSIONS: Tuple[str, ...] = tuple(_COMPRESS)
"""Compressions of chunks, as named by rosbag."""


class CutSpan(NamedTuple):
    """A part of a recording, in bag times [ns since the epoch], both included."""

    begin_ns: int
    end_ns: int


class BagCut(NamedTuple):
    """Message counts of a cut: in the span, still valid from before it, and lost.

    ``topics`` are the topics that have messages in the cut.
    """

    message_count: int
    held_count: int
    lost_count: int
    topics: Tuple[str, ...]


def cut(recording: Recording, span: CutSpan, path: str, topics: Optional[Collection[str]] = None,
        compression: str = 'none') -> BagCut:
    """Write the messages of a span to a bag, which appears only when it is complete.

    The bag begins as a recording does: with the latched messages and the transforms of /tf_static
    that are valid at its start, stamped with its start time. Marks that were added to the
    recording afterwards, and poses saved for it, are kept beside the bag, instead of those of a bag
    that it replaces. The recorder's account covers the whole recording and is left out: `cell
    report` then says that it cannot know what was lost before the cut.

    Args:
        recording: the source; it is only read.
        span: the span to copy.
        path: the new bag.
        topics: the topics to copy; default: all. The recorder's topics about the cell are always
            included.
        compression: one of COMPRESSIONS.

    Raises:
        BagError: the file belongs to the recording, cannot be written, or would be empty.
        ValueError: the recording does not have one of the topics.
    """
    if any(_is_same_file(path, it) for it in recording.paths):
        raise BagError(path, 'is the recording itself; choose another name')
    chosen = _chosen_connections(recording, topics)
    held = _held(recording, chosen, span.begin_ns)
    inside = _inside(recording, chosen, span)
    if not len(inside):
        raise BagError(path, 'would have no messages: the recording has none in this span')
    marks = [mark for source in recording.paths for mark in added_marks(source)
             if span.begin_ns <= mark.time_ns <= span.end_ns]
    poses = saved_poses(recording.paths[0])
    try:
        with whole_file(path) as unfinished, open(unfinished, 'wb') as file:
            writing = _Writing(recording, file, _COMPRESS[compression], compression)
            for position in held:
                writing.add(position, span.begin_ns)
            held_count = writing.count
            for position in inside.tolist():
                writing.add(position, int(recording.index.time_ns[position]))
            writing.finish()
    except OSError as error:
        raise BagError(path, f'cannot be written: {error.strerror}') from error
    write_added_marks(path, marks)
    write_saved_poses(path, poses)
    return BagCut(writing.count - held_count, held_count, writing.lost_count,
                  tuple(sorted(writing.topics)))


def _is_same_file(path: str, other: str) -> bool:
    return os.path.exists(path) and os.path.samefile(path, other)


def _chosen_connections(recording: Recording, topics: Optional[Collection[str]]) -> List[int]:
    connections = recording.index.connections
    known = {it.topic for it in connections}
    missing = sorted(set(topics or ()) - known)
    if missing:
        raise ValueError(f'{recording.paths[0]} has no topic {", ".join(missing)}; '
                         f'it has {", ".join(sorted(known))}')
    return [number for number, it in enumerate(connections)
            if it.topic != ACCOUNT and (topics is None or it.topic in topics
                                        or it.topic in _ALWAYS)]


def _held(recording: Recording, connections: List[int], begin_ns: int) -> List[int]:
    """Return the positions of earlier messages that still hold at a time, in recorded order.

    On a latched topic, the last message of each publisher holds. Static transforms accumulate: one
    message does not replace another, so all different messages hold.
    """
    index, count = recording.index, recording.index.count_before(begin_ns)
    found: List[int] = []
    for number in connections:
        connection = index.connections[number]
        positions = index.positions(number)
        before = positions[:int(positions.searchsorted(positions.dtype.type(count)))]
        if connection.topic.endswith(STATIC_TF_TOPIC):
            found += _different(recording, before)
        elif _is_held(connection) and len(before):
            found.append(int(before[-1]))
    return sorted(found)


def _is_held(connection: Connection) -> bool:
    return connection.topic != MARKS and (connection.latching or connection.topic in _ALWAYS)


def _different(recording: Recording, positions: np.ndarray) -> List[int]:
    """Return the last message of each group of equal messages."""
    last: Dict[bytes, int] = {}
    for position in positions.tolist():
        try:
            data = bytes(recording.message(position))
        except BagDamaged:
            continue  # it is in the recording's gaps
        last.pop(data, None)
        last[data] = position
    return list(last.values())


def _inside(recording: Recording, connections: List[int], span: CutSpan) -> np.ndarray:
    index = recording.index
    rows = np.arange(index.count_before(span.begin_ns), index.count_until(span.end_ns))
    result: np.ndarray = rows[np.isin(index.connection[rows], connections)]
    return result


class _Writing:
    """Writes chunks of messages, each connection before its first message."""

    def __init__(self, recording: Recording, file: BinaryIO, compress: Callable[[bytes], bytes],
                 compression: str) -> None:
        self._recording = recording
        self._writer = BagWriter(file)
        self._compress, self._compression = compress, compression
        self._known: Dict[int, ConnectionRecord] = {}
        self._content = bytearray()
        self._entries: List[IndexEntry] = []
        self.topics: Set[str] = set()
        self.count = 0
        self.lost_count = 0

    def add(self, position: int, time_ns: int) -> None:
        """Write a message with the given time; an unreadable message is counted as lost."""
        try:
            data = self._recording.message(position)
        except BagDamaged:
            self.lost_count += 1
            return
        number = int(self._recording.index.connection[position])
        if number not in self._known:
            connection = self._recording.index.connections[number]
            self.topics.add(connection.topic)
            self._known[number] = _record_of(number, connection)
            self._content += packed_record(_connection_fields(self._known[number]),
                                           self._known[number].header)
        self._entries.append(IndexEntry(number, time_ns, len(self._content)))
        self._content += packed_record(
            {b'op': bytes([OP_MESSAGE]), b'conn': number.to_bytes(4, 'little'),
             b'time': packed_time(time_ns)}, data)
        self.count += 1
        if len(self._content) >= _CHUNK_BYTES:
            self._write_chunk()

    def finish(self) -> None:
        """Write the last chunk and the index."""
        if self._entries:
            self._write_chunk()
        self._writer.finish([self._known[number] for number in sorted(self._known)])

    def _write_chunk(self) -> None:
        self._writer.write_chunk(self._compress(bytes(self._content)), self._compression.encode(),
                                 len(self._content), self._entries)
        self._content, self._entries = bytearray(), []


def _connection_fields(record: ConnectionRecord) -> Dict[bytes, bytes]:
    return {b'op': bytes([OP_CONNECTION]), b'conn': record.id.to_bytes(4, 'little'),
            b'topic': record.topic}


def _record_of(number: int, connection: Connection) -> ConnectionRecord:
    fields = {b'topic': connection.topic, b'type': connection.type, b'md5sum': connection.md5sum,
              b'message_definition': connection.message_definition,
              b'callerid': connection.caller_id, b'latching': '1' if connection.latching else '0'}
    return ConnectionRecord(number, connection.topic.encode(),
                            header_of({name: text.encode() for name, text in fields.items()}))
