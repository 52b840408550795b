# SPDX-License-Identifier: BSD-3-Clause
"""Several bags are one recording."""
from __future__ import annotations

import io
import threading
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import List, Sequence

import pytest
import rosbag
from bag_files import (
    DEFINITION,
    MD5SUM,
    Row,
    compressions,
    content,
    in_time,
    rows_of_messages,
    some_rows,
    write_bag,
)
from hypothesis import given, settings
from hypothesis import strategies as st

from process_visualizer.bagio.bag_errors import BagDamaged, BagError
from process_visualizer.bagio.bag_file import header_of, packed_record, packed_time
from process_visualizer.bagio.bag_writer import BagWriter, ConnectionRecord, IndexEntry
from process_visualizer.bagio.recording import Recording


@settings(max_examples=40, deadline=None)
@given(st.lists(st.tuples(rows_of_messages, compressions), min_size=2, max_size=4))
def test_files_are_one_timeline(parts: List) -> None:
    with TemporaryDirectory() as folder:
        paths = [write_bag(Path(folder) / f'{number}.bag', rows, compression, 300)
                 for number, (rows, compression) in enumerate(parts)]
        with Recording(paths) as recording:
            assert content(recording) == in_time(row for rows, _ in parts for row in rows)
            assert recording.paths == tuple(paths)


def test_split_bag_has_every_publisher_once(tmp_path: Path) -> None:
    rows = some_rows(90)
    paths = [write_bag(tmp_path / f'{number}.bag', rows[number * 30:number * 30 + 30],
                       caller='/camera' if number < 2 else '/other') for number in range(3)]
    with Recording(paths) as recording:
        index = recording.index
        assert content(recording) == rows
        assert len(index.connections) == 6
        assert len(index.connections_of('/topic0')) == 2
        assert index.positions_of(index.connections_of('/topic0')).tolist() == [*range(0, 90, 3)]


def test_order_of_the_files_does_not_matter(tmp_path: Path) -> None:
    rows = some_rows(90)
    paths = [write_bag(tmp_path / f'{number}.bag', rows[number::3]) for number in (2, 0, 1)]
    with Recording(paths) as recording:
        assert content(recording) == rows


def test_error_names_the_file(tmp_path: Path) -> None:
    good = write_bag(tmp_path / 'good.bag', some_rows(3))
    bad = tmp_path / 'bad.bag'
    bad.write_bytes(b'nothing')
    with pytest.raises(BagError, match='bad.bag: is not a bag'):
        Recording([good, str(bad)])


def test_gap_names_the_file(tmp_path: Path) -> None:
    rows = some_rows(60)
    paths = [Path(write_bag(tmp_path / f'{number}.bag', rows[number::2], 'lz4'))
             for number in range(2)]
    data = paths[1].read_bytes()
    paths[1].write_bytes(data.replace(b'compression=lz4', b'compression=bz2'))
    with Recording([str(path) for path in paths]) as recording:
        assert bytes(recording.message(58)) == rows[58].data
        with pytest.raises(BagDamaged) as caught:
            recording.message(59)
        assert caught.value.gap.file == str(paths[1])
        assert recording.is_readable(58) and not recording.is_readable(57)
        assert [gap.file for gap in recording.gaps] == [str(paths[1])]


def _write_publishers(path: Path, publishers: Sequence[int], rows: Sequence[Row]) -> str:
    """A bag with one connection for each publisher, as `rosbag record` writes it."""
    chunk, entries = io.BytesIO(), []
    for publisher, row in zip(publishers, rows):
        entries.append(IndexEntry(publisher, row.time_ns, chunk.tell()))
        chunk.write(packed_record({b'op': b'\2', b'conn': publisher.to_bytes(4, 'little'),
                                   b'time': packed_time(row.time_ns)}, row.data))
    with open(path, 'wb') as file:
        writer = BagWriter(file)
        writer.write_chunk(chunk.getvalue(), b'none', len(chunk.getvalue()), entries)
        writer.finish([ConnectionRecord(it, b'/tf_static', header_of(
            {b'topic': b'/tf_static', b'type': b'std_msgs/UInt8MultiArray',
             b'md5sum': MD5SUM.encode(), b'message_definition': DEFINITION.encode(),
             b'callerid': b'/publisher%d' % it, b'latching': b'1'})) for it in set(publishers)])
    return str(path)


def test_topic_of_several_publishers(tmp_path: Path) -> None:
    """Connection ids need not be consecutive; each publisher's last message is found."""
    rows = [Row('/tf_static', 10 ** 9 * (number + 1), bytes([number])) for number in range(6)]
    path = _write_publishers(tmp_path / 'a.bag', [7, 70000, 7, 3, 70000, 7], rows)
    with Recording([path]) as recording, rosbag.Bag(path) as bag:
        index = recording.index
        assert [message[1] for _, message, _ in bag.read_messages(raw=True)] == [
            row.data for row in content(recording)]
        assert [it.caller_id for it in index.connections] == [
            '/publisher3', '/publisher7', '/publisher70000']
        assert [index.last_at(4_500_000_000, it) for it in range(3)] == [3, 2, 1]
        assert index.last_at(3_999_999_999, 0) is None
        assert index.positions_of((0, 1)).tolist() == [0, 2, 3, 5]


def test_messages_are_read_by_several_threads(tmp_path: Path) -> None:
    rows = some_rows(400, size=500)
    path = write_bag(tmp_path / 'a.bag', rows, 'lz4', 5000)
    wrong: List[int] = []
    with Recording([path], cache_bytes=12_000) as recording:
        def read(step: int) -> None:
            wrong.extend(position for position in range(0, 400, step)
                         if bytes(recording.message(position)) != rows[position].data)

        threads = [threading.Thread(target=read, args=(step,)) for step in (1, 3, 7, 11)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join(30)
        assert wrong == [] and recording.cached_bytes <= 12_000
