# SPDX-License-Identifier: BSD-3-Clause
"""A bag without an index is copied with one; the original stays unchanged."""
from __future__ import annotations

from pathlib import Path
from typing import List

import pytest
from bag_files import Row, compressions, content, in_time, rows_of_messages, some_rows, write_bag
from hypothesis import given, settings

from process_visualizer.bagio.bag_errors import BagError, BagUnindexed
from process_visualizer.bagio.bag_file import MAGIC, record_at
from process_visualizer.bagio.recording import Recording
from process_visualizer.bagio.reindex import ReindexCanceled, copy_path, reindex


def without_index(path: str) -> Path:
    """A bag as a killed recorder leaves it: no position of the index, no list of chunks."""
    data = Path(path).read_bytes()
    at = data.index(b'index_pos=') + len(b'index_pos=')
    end = int.from_bytes(data[at:at + 8], 'little')
    Path(path).write_bytes(data[:at] + bytes(8) + data[at + 8:end])
    return Path(path)


@settings(max_examples=40, deadline=None)
@given(rows_of_messages.filter(len), compressions)
def test_copy_holds_every_message(
        tmp_path_factory: pytest.TempPathFactory, rows: List[Row], compression: str) -> None:
    folder = tmp_path_factory.getbasetemp()
    path = without_index(write_bag(folder / 'a.bag', rows, compression, 300))
    before = path.read_bytes()
    with pytest.raises(BagUnindexed, match='has no index'):
        Recording([str(path)])
    result = reindex(str(path))
    assert (result.path, result.message_count, result.gaps) == (
        str(folder / 'a.reindexed.bag'), len(rows), ())
    with Recording([result.path]) as recording:
        assert content(recording) == in_time(rows)
    assert path.read_bytes() == before


@pytest.mark.parametrize('compression', ['none', 'bz2', 'lz4'])
def test_bag_cut_off_anywhere_is_saved_up_to_there(tmp_path: Path, compression: str) -> None:
    rows = some_rows(40)
    path = Path(write_bag(tmp_path / 'a.bag', rows, compression, 500))
    data, at = path.read_bytes(), len(MAGIC)
    ends = []
    while at < len(data):
        at = record_at(memoryview(data), at).end
        ends.append(at)
    counts = []
    for size in sorted({end + more for end in ends for more in (-3, 0, 2)} & set(range(len(data)))):
        path.write_bytes(data[:size])
        try:
            result = reindex(str(path))
        except BagError as error:
            assert 'has no message' in str(error) or 'header of the bag' in str(error)
            continue
        with Recording([result.path]) as recording:
            assert content(recording) == rows[:result.message_count]
            assert len(recording.index) == result.message_count
        assert size in ends or [gap.file for gap in result.gaps] == [str(path)]
        counts.append(result.message_count)
    assert counts == sorted(counts) and counts[-1] == 40


def test_chunk_that_cannot_be_read_is_a_gap(tmp_path: Path) -> None:
    rows = some_rows(60)
    path = without_index(write_bag(tmp_path / 'a.bag', rows, 'lz4', 1500))
    data = path.read_bytes()
    chunk = [at for at in range(len(data)) if data.startswith(b'compression=lz4', at)][1]
    path.write_bytes(data[:chunk] + b'compression=zip' + data[chunk + 15:])
    result = reindex(str(path))
    with Recording([result.path]) as recording:
        found = content(recording)
    assert 20 < len(found) < 60 and set(found) < set(rows)
    assert len(result.gaps) == 1 and 'its compression "zip" is not known' in str(result.gaps[0])


def test_progress_rises_to_the_end(tmp_path: Path) -> None:
    path = without_index(write_bag(tmp_path / 'a.bag', some_rows(60), chunk_bytes=500))
    parts: List[float] = []

    def progress(part: float) -> bool:
        parts.append(part)
        return True

    reindex(str(path), progress)
    assert parts == sorted(parts) and len(parts) > 5 and parts[-1] == 1.0


def test_cancelling_leaves_nothing_behind(tmp_path: Path) -> None:
    path = without_index(write_bag(tmp_path / 'a.bag', some_rows(60), chunk_bytes=500))
    with pytest.raises(ReindexCanceled):
        reindex(str(path), lambda part: part < 0.5)
    assert [it.name for it in tmp_path.iterdir()] == ['a.bag']


@pytest.mark.parametrize('data', [b'', b'nothing', MAGIC])
def test_what_is_no_bag_is_not_copied(tmp_path: Path, data: bytes) -> None:
    (tmp_path / 'a.bag').write_bytes(data)
    with pytest.raises(BagError, match='a.bag: '):
        reindex(str(tmp_path / 'a.bag'))
    assert [it.name for it in tmp_path.iterdir()] == ['a.bag']


def test_copy_that_cannot_be_written(tmp_path: Path) -> None:
    path = without_index(write_bag(tmp_path / 'a.bag', some_rows(3)))
    (tmp_path / 'a.reindexed.bag').mkdir()
    with pytest.raises(BagError, match='a.reindexed.bag: cannot be written: Is a directory'):
        reindex(str(path))
    assert {it.name for it in tmp_path.iterdir()} == {path.name, 'a.reindexed.bag'}


@pytest.mark.parametrize('name, copy', [
    ('/d/a.bag', '/d/a.reindexed.bag'), ('/d/a.bag.active', '/d/a.reindexed.bag'),
    ('/d/a', '/d/a.reindexed.bag')])
def test_name_of_the_copy(name: str, copy: str) -> None:
    assert copy_path(name) == copy
