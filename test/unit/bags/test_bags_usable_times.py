# SPDX-License-Identifier: BSD-3-Clause
"""Impossible recording times are recognized by everything that reads bags."""
from __future__ import annotations

import re
from datetime import datetime
from pathlib import Path
from typing import List, Sequence

import pytest
from bag_files import Row, content, in_time, some_rows, write_bag
from hypothesis import given, settings
from hypothesis import strategies as st

from process_visualizer.bagio.bag_errors import Gap
from process_visualizer.bagio.bag_file import packed_time
from process_visualizer.bagio.catalog import read_catalog
from process_visualizer.bagio.recording import Recording
from process_visualizer.bagio.report import as_text, make_report, verdict

S, DAY_S = 10 ** 9, 24 * 3600
BEGIN_NS = 1_700_000_000 * S
YEAR_2106_NS = 4_294_967_295 * S


def rows(times_ns: Sequence[int], topic: str = '/a') -> List[Row]:
    return [Row(topic, time_ns, b'') for time_ns in times_ns]


GOOD = rows(range(BEGIN_NS, BEGIN_NS + 10 * S, S // 10))


@pytest.mark.parametrize('odd, told', [
    (rows([0] * 5), '/a: 5 messages have no time (0) and are left out'),
    (rows([1] * 150), '/a: 150 messages have no time (0) and are left out'),  # the largest part
    (rows([0, 1, 1_000_001]), '/a: 3 messages have no time (0) and are left out'),
    (rows([0], '/b'), '/b: one message has no time (0) and is left out'),
    (rows([5 * S, 6 * S]), '/a: 2 messages have a time far from that of all others (1970-01-01) '
                           'and are left out'),
    (rows([YEAR_2106_NS]), '/a: one message has a time far from that of all others (2106-02-07) '
                           'and is left out'),
    (rows([0, BEGIN_NS - 8 * DAY_S * S, YEAR_2106_NS]),
     '/a: one message has no time (0) and is left out\n'
     '/a: 2 messages have a time far from that of all others (2023-11-06 to 2106-02-07) and are '
     'left out')])
@pytest.mark.parametrize('are_first', [True, False])
def test_odd_times_are_no_part_of_the_timeline(tmp_path: Path, odd: List[Row], told: str,
                                               are_first: bool) -> None:
    path = write_bag(tmp_path / 'a.bag', odd + GOOD if are_first else GOOD + odd)
    with Recording([path]) as recording:
        assert content(recording) == GOOD
        assert (recording.begin_ns, recording.end_ns) == (GOOD[0].time_ns, GOOD[-1].time_ns)
        assert recording.remarks == tuple(told.splitlines())
        report = make_report(recording)
    assert f'\n{told}\n' in as_text(report)
    some = 'one message has' if len(odd) == 1 else f'{len(odd)} messages have'
    assert verdict(report).endswith(f'; {some} no usable time')
    assert not any(topic.gaps for topic in report.topics)
    catalog = read_catalog([path])
    assert catalog.remarks == tuple(told.splitlines())
    assert (catalog.duration_s, catalog.message_count) == (9.9, 100 + len(odd))


@pytest.mark.parametrize('times_ns', [
    [0] * 9,  # no other time is known
    [0, *range(S // 100, S, S // 100)], [1, *range(2, 9)],  # a simulated clock
    [BEGIN_NS, BEGIN_NS + 6 * DAY_S * S, BEGIN_NS + 12 * DAY_S * S],
    [BEGIN_NS, BEGIN_NS + 9 * DAY_S * S],  # it is unclear which of them is right
])
def test_other_times_are_taken_as_they_are(tmp_path: Path, times_ns: List[int]) -> None:
    with Recording([write_bag(tmp_path / 'a.bag', rows(times_ns))]) as recording:
        assert content(recording) == rows(times_ns)
        assert recording.remarks == ()


@pytest.mark.parametrize('topic, caller', [('/tf_static', ''), ('/arm/tf_static', ''),
                                           ('/map', '/map_server')])
@pytest.mark.parametrize('odd_ns', [0, YEAR_2106_NS])
def test_what_holds_is_there_from_the_beginning(tmp_path: Path, topic: str, caller: str,
                                                odd_ns: int) -> None:
    path = write_bag(tmp_path / 'a.bag', [*GOOD[:50], Row(topic, odd_ns, b'x'), *GOOD[50:]],
                     caller=caller)
    with Recording([path]) as recording:
        assert content(recording) == [Row(topic, BEGIN_NS, b'x'), *GOOD]
        remark, = recording.remarks
        assert remark.endswith(' and is there from the beginning on')
        report = make_report(recording)
    assert report.clock_jumps == ()


def test_messages_without_a_time_are_not_lost(tmp_path: Path) -> None:
    """This holds even if a topic has no others."""
    path = write_bag(tmp_path / 'a.bag', rows([0] * 3, '/only') + GOOD)
    with Recording([path]) as recording:
        assert 'nothing was received' not in verdict(make_report(recording))


@settings(max_examples=40, deadline=None)
@given(st.lists(st.sampled_from([0, 1, S, YEAR_2106_NS, BEGIN_NS - 100 * DAY_S * S]), max_size=40),
       st.randoms())
def test_odd_times_change_nothing_for_the_others(tmp_path_factory: pytest.TempPathFactory,
                                                 odd_ns: List[int], chance: object) -> None:
    mixed = rows(odd_ns) + some_rows(90)
    chance.shuffle(mixed)  # type: ignore[attr-defined]
    path = write_bag(tmp_path_factory.mktemp('bags') / 'a.bag', mixed)
    with Recording([path]) as recording:
        assert content(recording) == in_time(it for it in mixed if it.time_ns not in odd_ns)
        assert recording.index.left_out == len(odd_ns)


@pytest.mark.parametrize('wrong_ns', [0, YEAR_2106_NS])
@pytest.mark.parametrize('compression', ['none', 'lz4'])
def test_a_message_knows_its_time_better_than_the_index(tmp_path: Path, wrong_ns: int,
                                                        compression: str) -> None:
    path = Path(write_bag(tmp_path / 'a.bag', GOOD, compression, chunk_bytes=300))
    data = path.read_bytes()
    for row in GOOD[:20]:
        data = re.sub(b'(?<!time=)' + re.escape(packed_time(row.time_ns)),
                      lambda _: packed_time(wrong_ns), data)
    path.write_bytes(data)
    with Recording([str(path)]) as recording:
        assert content(recording) == GOOD
        assert recording.remarks == ()


def test_an_index_without_any_time(tmp_path: Path) -> None:
    path = Path(write_bag(tmp_path / 'a.bag', GOOD))
    data = path.read_bytes()
    for row in GOOD:
        data = re.sub(b'(?<!time=)' + re.escape(packed_time(row.time_ns)),
                      lambda _: bytes(8), data)
    path.write_bytes(data)
    with Recording([str(path)]) as recording:
        assert content(recording) == GOOD


def test_a_gap_at_an_odd_time_is_at_an_unknown_one(tmp_path: Path) -> None:
    """Chunk infos have wrong times, too; they show the position of the damaged index part."""
    path = Path(write_bag(tmp_path / 'a.bag', GOOD, chunk_bytes=300))
    data = re.sub(b'(?<=start_time=)........', bytes(8), path.read_bytes(), flags=re.DOTALL)
    at = data.rindex(b'op=\x04')  # the last index record
    path.write_bytes(data[:at] + b'op=\x01' + data[at + 4:])
    with Recording([str(path)]) as recording:
        gap, = recording.gaps
        assert (gap.begin_ns, gap.end_ns) == (0, 0)
        assert 'an unknown time' in str(gap)


def test_the_time_of_a_gap_is_that_of_the_clock() -> None:
    begin = datetime(2026, 11, 29, 14, 3, 5)
    begin_ns = round(begin.timestamp()) * S + 123_000_000
    gap = Gap('a.bag', 7, begin_ns, begin_ns + S, ('/q',), 'it is damaged')
    assert str(gap) == ('a.bag: at byte 7: it is damaged; missing are the topics /q from '
                        '2026-11-29 14:03:05.123 to 2026-11-29 14:03:06.123')


def test_each_file_is_taken_by_itself(tmp_path: Path) -> None:
    """A complete file is never left out."""
    later = rows(range(BEGIN_NS + 30 * DAY_S * S, BEGIN_NS + 30 * DAY_S * S + 5))
    paths = [write_bag(tmp_path / 'a.bag', GOOD + rows([0])),
             write_bag(tmp_path / 'b.bag', later + rows([0]))]
    with Recording(paths) as recording:
        assert content(recording) == GOOD + later
        assert recording.index.left_out == 2
        recording.choose([])
        assert recording.remarks == ()
