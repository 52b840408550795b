# SPDX-License-Identifier: BSD-3-Clause
"""Index and messages equal the recorded ones, for every bag that rosbag can write."""
from __future__ import annotations

import os
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import List, Optional

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
    times_ns,
    write_bag,
)
from hypothesis import given, settings
from hypothesis import strategies as st

from process_visualizer.bagio.recording import Recording


@settings(max_examples=60, deadline=None)
@given(rows_of_messages, compressions, st.sampled_from([50, 300, 100_000]))
def test_messages_are_those_of_rosbag_in_the_order_of_time(
        rows: List[Row], compression: str, chunk_bytes: int) -> None:
    with TemporaryDirectory() as folder:
        path = write_bag(Path(folder) / 'a.bag', rows, compression, chunk_bytes)
        with Recording([path], cache_bytes=500) as recording, rosbag.Bag(path) as bag:
            assert content(recording) == in_time(rows)
            theirs = [Row(topic, time.to_nsec(), message[1])
                      for topic, message, time in bag.read_messages(raw=True)]
            assert sorted(content(recording)) == sorted(theirs)
            assert recording.gaps == ()


@settings(max_examples=40, deadline=None)
@given(rows_of_messages, st.lists(times_ns, min_size=1, max_size=10))
def test_last_message_at_a_time_is_that_of_a_scan(rows: List[Row], times: List[int]) -> None:
    with TemporaryDirectory() as folder:
        path = write_bag(Path(folder) / 'a.bag', rows, chunk_bytes=300)
        with Recording([path]) as recording:
            expected, index = in_time(rows), recording.index
            for time_ns in times + [row.time_ns for row in rows]:
                assert index.count_until(time_ns) == sum(it.time_ns <= time_ns for it in rows)
                assert index.count_before(time_ns) == sum(it.time_ns < time_ns for it in rows)
                for number, connection in enumerate(index.connections):
                    found = index.last_at(time_ns, number)
                    assert found == _last(expected, connection.topic, time_ns)


def _last(rows: List[Row], topic: str, time_ns: int) -> Optional[int]:
    matching = [position for position, row in enumerate(rows)
                if row.topic == topic and row.time_ns <= time_ns]
    return matching[-1] if matching else None


def test_connections_say_what_the_publishers_said(tmp_path: Path) -> None:
    path = write_bag(tmp_path / 'a.bag', some_rows(6), caller='/one')
    with Recording([path]) as recording:
        index = recording.index
        assert {(it.topic, it.caller_id) for it in index.connections} == {
            ('/topic0', '/one'), ('/topic1', '/one'), ('/topic2', '/one')}
        for connection in index.connections:
            assert connection.type == 'std_msgs/UInt8MultiArray'
            assert (connection.md5sum, connection.message_definition) == (MD5SUM, DEFINITION)
            assert connection.latching
        assert len(index.connections_of('/topic1')) == 1
        assert index.positions_of(index.connections_of('/topic1')).tolist() == [1, 4]
        assert index.positions_of([]).tolist() == []


def test_publisher_that_does_not_latch(tmp_path: Path) -> None:
    with Recording([write_bag(tmp_path / 'a.bag', some_rows(1))]) as recording:
        assert not recording.index.connections[0].latching


def test_times_of_a_recording(tmp_path: Path) -> None:
    rows = some_rows(100)
    with Recording([write_bag(tmp_path / 'a.bag', rows)]) as recording:
        assert recording.index.begin_ns == rows[0].time_ns
        assert recording.index.end_ns == rows[-1].time_ns


def test_bag_without_messages(tmp_path: Path) -> None:
    with Recording([write_bag(tmp_path / 'a.bag', [])]) as recording:
        assert len(recording.index) == 0
        assert (recording.index.begin_ns, recording.index.end_ns) == (0, 0)
        assert recording.index.count_until(5) == 0


def test_index_cannot_be_changed(tmp_path: Path) -> None:
    with Recording([write_bag(tmp_path / 'a.bag', some_rows(5))]) as recording:
        for array in (recording.index.time_ns, recording.index.positions(0)):
            with pytest.raises(ValueError):
                array[0] = 7


def test_opening_does_not_read_the_messages(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = write_bag(tmp_path / 'a.bag', some_rows(50, size=200_000))
    read: List[int] = []

    def counted(descriptor: int, size: int, offset: int) -> bytes:
        read.append(size)
        return pread(descriptor, size, offset)

    pread = os.pread
    monkeypatch.setattr(os, 'pread', counted)
    with Recording([path]) as recording:
        assert len(recording.index) == 50
    assert sum(read) < os.path.getsize(path) / 100


@pytest.mark.parametrize('compression', ['bz2', 'lz4'])
def test_memory_of_decompressed_chunks_is_bounded(tmp_path: Path, compression: str) -> None:
    rows = some_rows(200, size=1000)
    path = write_bag(tmp_path / 'a.bag', rows, compression, chunk_bytes=10_000)
    with Recording([path], cache_bytes=30_000) as recording:
        for position in (*range(200), *range(199, -1, -1), *range(0, 200, 17)):
            assert bytes(recording.message(position)) == rows[position].data
            assert recording.cached_bytes <= 30_000


def test_chunk_larger_than_the_cache_is_read(tmp_path: Path) -> None:
    rows = some_rows(30, size=1000)
    with Recording([write_bag(tmp_path / 'a.bag', rows, 'lz4')], cache_bytes=10) as recording:
        assert content(recording) == rows


def test_messages_of_every_size_are_read(tmp_path: Path) -> None:
    sizes = (0, 1, 4000, 4090, 4096, 5000, 2_000_000)
    rows = [Row('/a', 10 ** 9 + number, os.urandom(size)) for number, size in enumerate(sizes)]
    with Recording([write_bag(tmp_path / 'a.bag', rows)]) as recording:
        assert content(recording) == rows
