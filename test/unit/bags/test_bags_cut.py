# SPDX-License-Identifier: BSD-3-Clause
"""A part of a recording becomes a bag of its own, which other bag readers can read too."""
from __future__ import annotations

import os
import re
from pathlib import Path
from typing import List

import pytest
import rosbag
from bag_files import Row, compressions, content, in_time, rows_of_messages, some_rows, write_bag
from hypothesis import assume, given, settings
from rosbags.rosbag1 import Reader
from small_bags import BEGIN_S, whole_bags

from process_visualizer.bagio.bag_cut import CutSpan, cut
from process_visualizer.bagio.bag_errors import BagError
from process_visualizer.bagio.marks import Mark, add_mark, added_marks, read_marks
from process_visualizer.bagio.recorder_topics import CONFIGURATION, recorded_configuration
from process_visualizer.bagio.recording import Recording
from process_visualizer.bagio.recording_calibration import save_pose, saved_poses
from process_visualizer.cell.model import Pose
from process_visualizer.commands.command_line import main

BEGIN_NS = BEGIN_S * 10 ** 9


@pytest.fixture(name='whole')
def _whole(tmp_path: Path) -> str:
    """A recording of 3 s: a configuration, marks, two publishers of /tf_static."""
    path = tmp_path / 'whole.bag'
    path.write_bytes(whole_bags(tmp_path)['lz4 1500'])
    return str(path)


@settings(max_examples=40, deadline=None)
@given(rows_of_messages.filter(len), compressions, compressions)
def test_every_message_of_the_span_is_there_and_no_other(
        tmp_path_factory: pytest.TempPathFactory, rows: List[Row], source: str,
        compression: str) -> None:
    folder = tmp_path_factory.mktemp('cut')
    times_ns = sorted(row.time_ns for row in rows)
    span = CutSpan(times_ns[len(times_ns) // 4], times_ns[3 * len(times_ns) // 4])
    wanted = [it for it in in_time(rows) if span.begin_ns <= it.time_ns <= span.end_ns]
    path = str(folder / 'part.bag')
    with Recording([write_bag(folder / 'a.bag', rows, source, 300)]) as recording:
        assume(len(recording.index) == len(rows))  # no message with an impossible time
        done = cut(recording, span, path, compression=compression)
    assert (done.message_count, done.held_count, done.lost_count) == (len(wanted), 0, 0)
    with Recording([path]) as part:
        assert content(part) == wanted and not part.gaps
    with rosbag.Bag(path) as bag:
        assert sorted((topic, time.to_nsec(), data[1]) for topic, data, time
                      in bag.read_messages(raw=True)) == sorted(wanted)
    with Reader(path) as reader:
        assert sorted((it.topic, time, bytes(data)) for it, time, data in reader.messages()) \
            == sorted(wanted)


def test_it_begins_with_what_held_then(whole: str, tmp_path: Path) -> None:
    path = str(tmp_path / 'part.bag')
    with Recording([whole]) as recording:
        stored = recorded_configuration(recording)
        done = cut(recording, CutSpan(BEGIN_NS + 10 ** 9, BEGIN_NS + 2 * 10 ** 9), path)
    assert done.held_count == 4
    with rosbag.Bag(path) as bag:
        first = [(topic, time.to_nsec()) for topic, _, time in bag.read_messages()][:4]
        connections = {it.topic: it for it in bag._get_connections()}
        statics = [message for _, message, _ in bag.read_messages('/tf_static')]
        assert sum(len(message.transforms) for message in statics) == 2
    assert first == [(topic, BEGIN_NS + 10 ** 9)
                     for topic in (CONFIGURATION, '/tf_static', '/tf_static', '/markers')]
    assert connections['/markers'].header['latching'] in ('1', b'1')
    with Recording([path]) as part:
        assert recorded_configuration(part) == stored
        assert [mark.label for mark in read_marks(part)] == ['the seam tears']
        assert part.begin_ns == BEGIN_NS + 10 ** 9


def test_chosen_topics_keep_the_cell(whole: str, tmp_path: Path) -> None:
    path = str(tmp_path / 'part.bag')
    with Recording([whole]) as recording:
        cut(recording, CutSpan(BEGIN_NS, BEGIN_NS + 10 ** 9), path, ['/edge'])
    with Recording([path]) as part:
        assert {it.topic for it in part.index.connections} == {CONFIGURATION, '/edge'}


def test_added_marks_of_the_span_come_along(whole: str, tmp_path: Path) -> None:
    path = str(tmp_path / 'part.bag')
    inside, outside = (Mark(BEGIN_NS + round(it * 1e9), f'at {it}') for it in (0.5, 2.5))
    add_mark(whole, inside)
    add_mark(whole, outside)
    with Recording([whole]) as recording:
        cut(recording, CutSpan(BEGIN_NS, BEGIN_NS + 10 ** 9), path)
    with Recording([path]) as part:
        assert read_marks(part) == [inside]


def test_what_is_beside_it_is_that_of_the_source(whole: str, tmp_path: Path) -> None:
    path, old, new = (str(tmp_path / 'part.bag'), Pose((1.0, 2.0, 3.0), (0.0, 0.0, 0.0)),
                      Pose((4.0, 5.0, 6.0), (0.0, 0.0, 0.0)))
    write_bag(Path(path), some_rows(3), 'none', 500)
    add_mark(path, Mark(BEGIN_NS, 'of another bag'))
    save_pose(path, 'old/base', old)
    save_pose(whole, 'arm/base', new)
    for poses in ({'arm/base': new}, {}):
        with Recording([whole]) as recording:
            cut(recording, CutSpan(BEGIN_NS, BEGIN_NS + 10 ** 9), path)
        assert (added_marks(path), saved_poses(path)) == ([], poses)
        save_pose(whole, 'arm/base', None)
    assert sorted(it for it in os.listdir(tmp_path) if it.startswith('part')) == ['part.bag']


def test_messages_that_cannot_be_read_are_counted(tmp_path: Path) -> None:
    source = Path(write_bag(tmp_path / 'a.bag', some_rows(100), 'bz2', 500))
    data = bytearray(source.read_bytes())
    at = data.index(b'BZh', len(data) // 2)
    data[at:at + 3] = b'xxx'
    source.write_bytes(data)
    with Recording([str(source)]) as recording:
        done = cut(
            recording, CutSpan(recording.begin_ns, recording.end_ns), str(tmp_path / 'b.bag')
        )
    assert done.lost_count > 0 and done.message_count + done.lost_count == 100
    assert main(['cut', str(source), '--from', '0', '-o', str(tmp_path / 'c.bag')]) == 2


@pytest.mark.parametrize('name, span_s', [('whole.bag', (0, 1)), ('no/part.bag', (0, 1)),
                                          ('part.bag', (-20, -10))])
def test_what_cannot_be_written_leaves_nothing(whole: str, tmp_path: Path, name: str,
                                               span_s: 'tuple[int, int]') -> None:
    before, files = Path(whole).read_bytes(), sorted(os.listdir(tmp_path))
    with Recording([whole]) as recording, pytest.raises(BagError):
        cut(recording, CutSpan(*(BEGIN_NS + it * 10 ** 9 for it in span_s)), str(tmp_path / name))
    assert Path(whole).read_bytes() == before and sorted(os.listdir(tmp_path)) == files


@pytest.mark.parametrize('words, begin_s, end_s', [
    (['--from', '0:01', '--to', '2'], 1.0, 2.0),
    (['--from', '0:01', '--to', '2', '--margin', '0.5'], 0.5, 2.5),
    (['--from', '2.5', '--to', '9'], 2.5, 2.9),
    (['--around', '1.2', '--margin', '0.1'], 1.1, 1.3),
    (['--around', 'SEAM', '--margin', '0.2'], 1.3, 1.7)])
def test_spans_as_people_name_them(whole: str, tmp_path: Path, words: List[str], begin_s: float,
                                   end_s: float) -> None:
    path = str(tmp_path / 'part.bag')
    assert main(['cut', whole, *words, '-o', path]) == 0
    with Recording([path]) as part:
        assert (part.begin_ns - BEGIN_NS) / 1e9 == pytest.approx(begin_s, abs=0.001)
        assert (part.end_ns - BEGIN_NS) / 1e9 == pytest.approx(end_s, abs=0.101)


@pytest.mark.parametrize('words, reason', [
    ([], 'name one span'),
    (['--from', '1', '--around', '1'], 'name one span'),
    (['--from', '7', '--to', '8'], 'goes from 0:00.0 to 0:03.1'),
    (['--from', '1', '--topics', '/nothing'], 'has no topic /nothing')])
def test_spans_that_are_none(whole: str, tmp_path: Path, capsys: pytest.CaptureFixture[str],
                             words: List[str], reason: str) -> None:
    assert main(['cut', whole, *words, '-o', str(tmp_path / 'part.bag')]) == 1
    assert re.search(reason, capsys.readouterr().err)
    assert not (tmp_path / 'part.bag').exists()
