# SPDX-License-Identifier: BSD-3-Clause
"""Files that are not bags, or are damaged, truncated or changed while they are open."""
from __future__ import annotations

import bz2
import os
import random
import tracemalloc
from datetime import datetime
from pathlib import Path
from typing import Callable, Iterator, List, Tuple

import lz4.frame
import pytest
from bag_files import Row, content, rows_of_messages, some_rows, write_bag
from hypothesis import given, settings
from hypothesis import strategies as st

from process_visualizer.bagio.bag_errors import BagDamaged, BagError, BagUnindexed
from process_visualizer.bagio.bag_file import (
    MAGIC,
    OP_BAG_HEADER,
    OP_CHUNK,
    OP_CHUNK_INFO,
    OP_CONNECTION,
    OP_INDEX,
    BagFile,
    header_of,
    packed_record,
    record_at,
)
from process_visualizer.bagio.chunk_store import Chunk, decompressed
from process_visualizer.bagio.recording import Recording
from process_visualizer.bagio.reindex import reindex


def record_places(data: bytes) -> Iterator[Tuple[int, int]]:
    """Kind and byte position of every record outside the chunks."""
    at = len(MAGIC)
    while at < len(data):
        record = record_at(memoryview(data), at)
        yield record.fields[b'op'][0], at
        at = record.end


def places_of(data: bytes, kind: int) -> List[int]:
    return [place for found, place in record_places(data) if found == kind]


def readable(path: str) -> Tuple[List[Row], Tuple[str, ...]]:
    """The readable content of a bag, and the remarks about the rest."""
    rows = []
    with Recording([path]) as recording:
        index = recording.index
        for position in range(len(index)):
            try:
                data = bytes(recording.message(position))
            except BagDamaged:
                continue
            topic = index.connections[int(index.connection[position])].topic
            rows.append(Row(topic, int(index.time_ns[position]), data))
        return rows, tuple(map(str, recording.gaps))


def bag_header(**fields: bytes) -> bytes:
    values = {b'op': bytes([OP_BAG_HEADER]), b'index_pos': bytes(8), b'conn_count': bytes(4),
              b'chunk_count': bytes(4)}
    values.update({name.encode(): value for name, value in fields.items()})
    return MAGIC + packed_record(values, b'')


@pytest.mark.parametrize('data, message', [
    (b'', 'is empty'),
    (b'#ROS', 'is not a bag'),
    (b'#!/bin/sh\nexit 1\n', 'is not a bag'),
    (os.urandom(5000), 'is not a bag'),
    (b'#ROSBAG V1.2\n' + bytes(4096), 'is a bag of version 1.2; only version 2.0 can be read'),
    (b'#ROSRECORD V1.1\n' + bytes(4096), 'is a bag of version'),
    (MAGIC, 'the header of the bag cannot be read'),
    (MAGIC + b'\xff' * 100, 'the header of the bag cannot be read'),
    (MAGIC + packed_record({b'op': b'\x05'}, b''), 'another record is in its place'),
    (bag_header(encryptor=b'rosbag/AesCbcEncryptor', index_pos=b'\xff' * 8),
     'is encrypted (rosbag/AesCbcEncryptor)'),
    (bag_header(index_pos=b'\1'), 'index_pos'),
])
def test_what_is_no_readable_bag(tmp_path: Path, data: bytes, message: str) -> None:
    path = tmp_path / 'a.bag'
    path.write_bytes(data)
    with pytest.raises(BagError) as caught:
        Recording([str(path)])
    assert message in str(caught.value)
    assert str(caught.value).startswith(f'{path}: ')
    assert not isinstance(caught.value, BagUnindexed)


@pytest.mark.parametrize('data, message', [
    (bag_header(), 'has no index'),
    (bag_header(index_pos=b'\xff' * 8), 'has lost its index'),
    (bag_header(index_pos=b'\1' + bytes(7)), 'has lost its index'),
])
def test_bag_without_an_index(tmp_path: Path, data: bytes, message: str) -> None:
    path = tmp_path / 'a.bag'
    path.write_bytes(data)
    with pytest.raises(BagUnindexed, match=message):
        Recording([str(path)])


def test_what_is_not_a_file(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / 'pipe')
    for name, message in (('none.bag', 'cannot be opened: No such file'), ('.', 'is not a file'),
                          ('pipe', 'is not a file'), ('a\0b', 'cannot be opened')):
        with pytest.raises(BagError, match=message):
            BagFile(f'{tmp_path}/{name}')


def test_recording_needs_a_file() -> None:
    with pytest.raises(ValueError, match='at least one'):
        Recording([])


@pytest.mark.parametrize('compression', ['none', 'bz2', 'lz4'])
def test_bag_cut_off_anywhere_says_so(tmp_path: Path, compression: str) -> None:
    """Cuts at each end of a record, at the bytes around it, and anywhere."""
    path = write_bag(tmp_path / 'a.bag', some_rows(40), compression, 500)
    data = Path(path).read_bytes()
    ends = [place for _, place in record_places(data)]
    chosen = {end + more for end in ends for more in (-1, 0, 1, 5)}
    chosen |= set(random.Random(4).sample(range(len(data)), 200))
    cut = tmp_path / 'cut.bag'
    for size in sorted(chosen):
        cut.write_bytes(data[:size])
        with pytest.raises(BagError) as caught:
            Recording([str(cut)])
        assert str(caught.value).startswith(f'{cut}: ')
        assert isinstance(caught.value, BagUnindexed) == (size >= ends[1])


@settings(max_examples=150, deadline=None)
@given(rows_of_messages, st.sampled_from(['none', 'bz2', 'lz4']), st.data())
def test_changed_bytes_never_raise_anything_else(
        tmp_path_factory: pytest.TempPathFactory, rows: List[Row], compression: str,
        draw: st.DataObject) -> None:
    path = Path(write_bag(tmp_path_factory.getbasetemp() / 'a.bag', rows, compression, 400))
    data = bytearray(path.read_bytes())
    # the padding after the bag header is left out, since nothing reads it
    places = st.one_of(st.integers(0, 120), st.integers(4109, max(4109, len(data) - 1)))
    for place in draw.draw(st.lists(places, min_size=1, max_size=8)):
        if place < len(data):
            data[place] = draw.draw(st.sampled_from([0, 1, 0x7f, 0x80, 0xff]))
    path.write_bytes(data)
    try:
        readable(str(path))
    except BagError as error:
        assert str(error).startswith(f'{path}: ')


HOLE_BYTES = 400 << 20


def with_a_hole(path: Path) -> int:
    """Insert a gap between the chunks and the chunk list of a bag; return the new list position."""
    data = path.read_bytes()
    at = data.index(b'index_pos=') + len(b'index_pos=')
    end = int.from_bytes(data[at:at + 8], 'little')
    with path.open('r+b') as file:
        file.seek(at)
        file.write((end + HOLE_BYTES).to_bytes(8, 'little'))
        file.seek(end)
        file.write(bytes(min(len(data) - end, 1000)))
        file.truncate(end + HOLE_BYTES)
        file.seek(end + HOLE_BYTES)
        file.write(data[end:])
    return end + HOLE_BYTES


def change(path: Path, place: int, value: bytes) -> None:
    with path.open('r+b') as file:
        file.seek(place)
        file.write(value)


def damage_count(path: Path, summary: int) -> None:
    """Change one bit in the message count of the first chunk."""
    with path.open('rb') as file:
        file.seek(summary)
        data = memoryview(file.read())
    at = 0
    while record_at(data, at).fields[b'op'][0] != OP_CHUNK_INFO:
        at = record_at(data, at).end
    record = record_at(data, at)
    change(path, summary + record.end - len(record.data) + 7, b'\x08')


def damage_index_position(path: Path, summary: int) -> None:
    """Set the position of the list to that of the first chunk."""
    change(path, path.read_bytes()[:4000].index(b'index_pos=') + len(b'index_pos='),
           (len(MAGIC) + 4096).to_bytes(8, 'little'))


def damage_chunk_length(path: Path, summary: int) -> None:
    """Extend a chunk into the gap."""
    with path.open('rb') as file:
        data = file.read(20_000)
    chunk = record_at(memoryview(data), len(MAGIC)).end
    header = int.from_bytes(data[chunk:chunk + 4], 'little')
    change(path, chunk + 4 + header, (HOLE_BYTES - 5000).to_bytes(4, 'little'))


@pytest.mark.parametrize('compression', ['none', 'bz2', 'lz4'])
@pytest.mark.parametrize('damage', [damage_count, damage_index_position, damage_chunk_length])
def test_a_wrong_length_takes_no_memory(tmp_path: Path, compression: str,
                                        damage: Callable[[Path, int], None]) -> None:
    path = Path(write_bag(tmp_path / 'a.bag', some_rows(60), compression, 2000))
    damage(path, with_a_hole(path))
    tracemalloc.start()
    try:
        for read in (readable, reindex):
            try:
                read(str(path))
            except BagError as error:
                assert str(error).startswith(f'{path}: ')
        assert tracemalloc.get_traced_memory()[1] < 100 << 20
    finally:
        tracemalloc.stop()


@pytest.mark.parametrize('compression', ['bz2', 'lz4'])
def test_chunk_that_cannot_be_decompressed_is_a_gap(tmp_path: Path, compression: str) -> None:
    rows = some_rows(60)
    path = Path(write_bag(tmp_path / 'a.bag', rows, compression, 1500))
    data = bytearray(path.read_bytes())
    chunk = places_of(bytes(data), OP_CHUNK)[1]
    content_at = record_at(memoryview(bytes(data)), chunk)
    for place in range(content_at.end - len(content_at.data), content_at.end - 4, 3):
        data[place] ^= 0x55
    path.write_bytes(data)
    found, gaps = readable(str(path))
    missing = [row for row in rows if row not in found]
    assert 0 < len(missing) < 40 and sorted(found + missing) == sorted(rows)
    assert len(gaps) == 1
    assert f'{path}: at byte {chunk}: a chunk cannot be read: ' in gaps[0]
    assert '/topic0, /topic1, /topic2' in gaps[0]
    first, last = (datetime.fromtimestamp(row.time_ns // 10 ** 9).strftime('%Y-%m-%d %H:%M:%S')
                   + f'.{row.time_ns // 10 ** 6 % 1000:03d}' for row in (missing[0], missing[-1]))
    assert f'{first} to {last}' in gaps[0]


@pytest.mark.parametrize('change', [7, -7, 2 ** 31])
def test_chunk_with_a_wrong_length_is_a_gap(tmp_path: Path, change: int) -> None:
    rows = some_rows(60)
    path = Path(write_bag(tmp_path / 'a.bag', rows, 'none', 1500))
    data = bytearray(path.read_bytes())
    chunk = places_of(bytes(data), OP_CHUNK)[1]
    length_at = chunk + 4 + int.from_bytes(data[chunk:chunk + 4], 'little')
    length = int.from_bytes(data[length_at:length_at + 4], 'little')
    data[length_at:length_at + 4] = ((length + change) % 2 ** 32).to_bytes(4, 'little')
    path.write_bytes(data)
    found, gaps = readable(str(path))
    assert 20 < len(found) < 60 and set(found) < set(rows)
    assert len(gaps) == 1 and f'at byte {chunk}: a part of the index cannot be read' in gaps[0]
    assert '/topic0, /topic1, /topic2' in gaps[0]


@pytest.mark.parametrize('compression', ['bz2', 'lz4'])
@pytest.mark.parametrize('size, message', [
    (10, 'it holds more than the 10 bytes'), (2 ** 27, 'it holds less than the 134217728 bytes'),
    (900_000_000, 'would take 900000000 bytes of memory'),
    (2 ** 32 - 1, 'would take 4294967295 bytes of memory')])
def test_chunk_that_lies_about_its_size(
        tmp_path: Path, compression: str, size: int, message: str) -> None:
    path = Path(write_bag(tmp_path / 'a.bag', some_rows(10), compression))
    data = path.read_bytes()
    at = data.index(b'size=', places_of(data, OP_CHUNK)[0]) + 5
    path.write_bytes(data[:at] + size.to_bytes(4, 'little') + data[at + 4:])
    with Recording([str(path)]) as recording:
        assert recording.is_readable(0)
        for _ in range(2):
            with pytest.raises(BagDamaged, match=message):
                recording.message(0)
        assert not recording.is_readable(0)
        assert len(recording.gaps) == 1


@pytest.mark.parametrize('compression', ['bz2', 'lz4'])
def test_chunk_of_which_little_is_in_the_file_is_not_twice_in_memory(compression: str) -> None:
    size = 40_000_000
    compress = bz2.compress if compression == 'bz2' else lz4.frame.compress
    data = compress(bytes(size))
    tracemalloc.start()
    try:
        content = decompressed(data, Chunk(0, len(data), compression, size))
        peak_bytes = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert len(content) == size and not any(content[::997])
    assert peak_bytes < 1.3 * size


def test_unknown_compression_is_named(tmp_path: Path) -> None:
    path = Path(write_bag(tmp_path / 'a.bag', some_rows(10), 'lz4'))
    path.write_bytes(path.read_bytes().replace(b'compression=lz4', b'compression=zip'))
    found, gaps = readable(str(path))
    assert found == [] and 'its compression "zip" is not known (none, bz2, lz4 are)' in gaps[0]


def test_index_that_points_beside_a_message(tmp_path: Path) -> None:
    """Only this message is missing; the rest of its chunk is there."""
    rows = some_rows(30)
    path = Path(write_bag(tmp_path / 'a.bag', rows))
    data = bytearray(path.read_bytes())
    index = places_of(bytes(data), OP_INDEX)[0]
    data[record_at(memoryview(bytes(data)), index).end - 4] ^= 1
    path.write_bytes(data)
    found, _ = readable(str(path))
    assert len(found) == 29 and set(found) < set(rows)
    with Recording([str(path)]) as recording:
        with pytest.raises(BagDamaged, match='a message cannot be read') as caught:
            content(recording)
        gap = caught.value.gap
        assert gap.begin_ns == gap.end_ns == (set(rows) - set(found)).pop().time_ns


@pytest.mark.parametrize('kind', [OP_CONNECTION, OP_CHUNK_INFO])
def test_missing_part_of_the_summary_says_that_it_is_to_be_reindexed(
        tmp_path: Path, kind: int) -> None:
    path = Path(write_bag(tmp_path / 'a.bag', some_rows(60), chunk_bytes=500))
    data = path.read_bytes()
    place = [it for it in places_of(data, kind) if it > places_of(data, OP_INDEX)[-1]][-1]
    path.write_bytes(data[:place] + data[record_at(memoryview(data), place).end:])
    with pytest.raises(BagUnindexed, match='a part of its index is missing'):
        Recording([str(path)])


def test_definitions_are_only_text(tmp_path: Path) -> None:
    """A definition that looks like code, or is not text at all, is passed on unchanged."""
    path = Path(write_bag(tmp_path / 'a.bag', some_rows(3)))
    data = path.read_bytes().replace(b'uint8[] data', b'1/0;\xff\0exit()')
    path.write_bytes(data)
    with Recording([str(path)]) as recording:
        assert recording.index.connections[0].message_definition == '1/0;\ufffd\0exit()'


def test_bag_that_is_deleted_is_still_played(tmp_path: Path) -> None:
    rows = some_rows(60)
    path = write_bag(tmp_path / 'a.bag', rows, chunk_bytes=500)
    with Recording([path]) as recording:
        os.remove(path)
        assert content(recording) == rows


def test_bag_that_grows_is_played_as_it_was(tmp_path: Path) -> None:
    rows = some_rows(60)
    path = write_bag(tmp_path / 'a.bag', rows, chunk_bytes=500)
    with Recording([path]) as recording, open(path, 'ab') as file:
        file.write(os.urandom(10_000))
        file.flush()
        assert content(recording) == rows


def test_bag_that_becomes_shorter_is_damaged(tmp_path: Path) -> None:
    rows = some_rows(60)
    path = write_bag(tmp_path / 'a.bag', rows, chunk_bytes=500)
    with Recording([path]) as recording:
        os.truncate(path, 5000)
        assert bytes(recording.message(0)) == rows[0].data
        with pytest.raises(BagDamaged, match='the file has become shorter'):
            recording.message(59)


def test_closed_recording_says_so(tmp_path: Path) -> None:
    recording = Recording([write_bag(tmp_path / 'a.bag', some_rows(60))])
    recording.close()
    recording.close()
    with pytest.raises(BagDamaged, match='cannot be read'):
        recording.message(0)


def test_chunks_that_are_listed_twice_count_once(tmp_path: Path) -> None:
    rows = some_rows(60)
    path = Path(write_bag(tmp_path / 'a.bag', rows, chunk_bytes=500))
    data = path.read_bytes()
    infos = data[places_of(data, OP_CHUNK_INFO)[0]:]
    path.write_bytes(data + infos * 20)
    assert readable(str(path)) == (rows, ())


def test_index_cannot_take_more_room_than_the_file(tmp_path: Path) -> None:
    """Chunks that all point to the same index records do not multiply them without limit."""
    head, count = record_head_of_chunk(0), 400
    index = packed_record({b'op': bytes([OP_INDEX]), b'ver': u32(1), b'conn': u32(0),
                           b'count': u32(200)}, bytes(12 * 200))
    chunks = b''.join(record_head_of_chunk((count - 1 - number) * len(head))
                      for number in range(count))
    begin = len(bag_header())
    infos = b''.join(packed_record(
        {b'op': bytes([OP_CHUNK_INFO]), b'ver': u32(1), b'count': u32(1),
         b'chunk_pos': (begin + number * len(head)).to_bytes(8, 'little'),
         b'start_time': bytes(8), b'end_time': bytes(8)}, u32(0) + u32(200))
        for number in range(count))
    connection = packed_record(
        {b'op': bytes([OP_CONNECTION]), b'conn': u32(0), b'topic': b'/a'},
        header_of({b'type': b'std_msgs/Empty', b'md5sum': b'd41d8cd98f00b204e9800998ecf8427e'}))
    path = tmp_path / 'a.bag'
    place = (begin + len(chunks) + len(index)).to_bytes(8, 'little')
    path.write_bytes(bag_header(index_pos=place) + chunks + index + connection + infos)
    with Recording([str(path)]) as recording:
        assert 0 < len(recording.index) < path.stat().st_size / 12
        assert 'overlaps the next one' in str(recording.gaps[-1])


def u32(value: int) -> bytes:
    return value.to_bytes(4, 'little')


def record_head_of_chunk(size: int) -> bytes:
    """The record header of a chunk with this many bytes, without the bytes."""
    header = header_of({b'op': bytes([OP_CHUNK]), b'compression': b'none', b'size': u32(size)})
    return u32(len(header)) + header + u32(size)
