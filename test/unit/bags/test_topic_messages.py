# SPDX-License-Identifier: BSD-3-Clause
"""The messages of a topic between two times of a recording."""
from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import List

import pytest
from bag_files import Row, compressions, in_time, rows_of_messages, some_rows, times_ns, write_bag
from hypothesis import given, settings

from process_visualizer.bagio.recording import Recording
from process_visualizer.curves.topic_messages import topic_messages

PLENTY_BYTES = 1 << 20


@settings(max_examples=60, deadline=None)
@given(rows_of_messages, compressions, times_ns, times_ns)
def test_they_are_those_of_the_time(rows: List[Row], compression: str, one_ns: int,
                                    other_ns: int) -> None:
    begin_ns, end_ns = sorted((one_ns, other_ns))
    with TemporaryDirectory() as folder:
        path = write_bag(Path(folder) / 'a.bag', rows, compression, 300)
        with Recording([path]) as recording:
            found = topic_messages(
                recording, recording.index.connections_of('/a'), begin_ns, end_ns, PLENTY_BYTES)
    wanted = [row for row in in_time(rows)
              if row.topic == '/a' and begin_ns <= row.time_ns <= end_ns]
    assert found.times_ns == [row.time_ns for row in wanted]
    assert [bytes(it) for it in found.messages] == [row.data for row in wanted]
    assert found.end_ns == end_ns


@pytest.mark.parametrize('largest_bytes, count', [(1, 1), (44 * 5, 5), (44 * 10, 10)])
def test_too_much_is_cut_off_where_it_says(tmp_path: Path, largest_bytes: int,
                                           count: int) -> None:
    rows = some_rows(30)
    with Recording([write_bag(tmp_path / 'a.bag', rows)]) as recording:
        found = topic_messages(
            recording, recording.index.connections_of('/topic0'), recording.begin_ns,
            recording.end_ns, largest_bytes)
    assert len(found.messages) == count
    assert found.end_ns == (recording.end_ns if count == 10 else found.times_ns[-1])


def test_what_cannot_be_read_is_left_out(tmp_path: Path) -> None:
    rows = some_rows(300)
    path = write_bag(tmp_path / 'a.bag', rows, 'bz2', 2000)
    with Recording([path]) as recording:
        place = int(recording.index.chunks.position[2])
        with open(path, 'r+b') as file:
            file.seek(place + 200)
            file.write(bytes(40))
        found = topic_messages(
            recording, recording.index.connections_of('/topic0'), recording.begin_ns,
            recording.end_ns, PLENTY_BYTES)
    assert 50 < len(found.messages) < 100
