# SPDX-License-Identifier: BSD-3-Clause
"""The report finds what was removed from a stream, and nothing in a complete one."""
from __future__ import annotations

import json
import math
import os
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any, Iterator, List, Optional, Tuple

import numpy as np
import pytest
import rosbag
from genpy import Duration, Time
from hypothesis import given, settings
from hypothesis import strategies as st
from sensor_msgs.msg import Image
from std_msgs.msg import Header, String, UInt32
from test_bags_damaged import places_of

from process_visualizer.bagio.bag_file import INDEX_ENTRY_BYTES, OP_INDEX, record_at
from process_visualizer.bagio.message_definition import Connection
from process_visualizer.bagio.recorder_topics import MARKS
from process_visualizer.bagio.recording import Recording
from process_visualizer.bagio.report import (
    Completeness,
    Report,
    as_json,
    as_text,
    make_report,
    verdict,
)
from process_visualizer.bagio.stream_gaps import (
    Stream,
    backward_jumps,
    find_gaps,
    header_numbers,
    range_minima,
)
from process_visualizer.commands.command_line import main

BEGIN_S = 1_600_000_000


def stream(times_s: 'np.ndarray', sequence: 'Optional[np.ndarray]' = None) -> Stream:
    """A stream of one publisher."""
    count = len(times_s)
    return Stream((np.asarray(times_s) * 1e9).astype(np.int64),
                  np.full(count, -1, np.int64) if sequence is None else sequence.astype(np.int64),
                  np.zeros(count, np.int16))


@given(st.integers(20, 400), st.floats(0.001, 1.0), st.integers(0, 1000))
def test_a_regular_stream_with_jitter_has_no_gap(count: int, period_s: float, seed: int) -> None:
    jitter_s = np.random.default_rng(seed).uniform(0, period_s / 2, count)
    assert find_gaps(stream(np.arange(count) * period_s + jitter_s)) == ()


@given(st.integers(15, 150), st.integers(4, 40))
def test_messages_left_out_are_a_gap(before: int, missing: int) -> None:
    times_s = np.delete(np.arange(400) * 0.01, slice(before, before + missing))
    gap, = find_gaps(stream(times_s))
    assert gap.begin_ns == int(times_s[before - 1] * 1e9)
    assert gap.duration_s == pytest.approx((missing + 1) * 0.01)
    assert abs(gap.missing - missing) <= 1
    assert not gap.is_numbered


def test_messages_that_come_late_are_no_gap() -> None:
    times_s = np.arange(400) * 0.01
    times_s[100:140] = times_s[140]  # the computer was busy for 0.4 s, then delivered all of them
    assert find_gaps(stream(times_s)) == ()


@settings(max_examples=50)
@given(st.sets(st.integers(1, 98), max_size=30))
def test_numbers_left_out_are_counted_exactly(left_out: 'set[int]') -> None:
    kept = np.array([number for number in range(100) if number not in left_out])
    gaps = find_gaps(stream(kept * 0.01, kept))
    assert sum(gap.missing for gap in gaps) == len(left_out)
    assert all(gap.is_numbered for gap in gaps)


def test_a_publisher_that_starts_anew_has_lost_nothing_by_its_numbers() -> None:
    numbers = np.array([*range(50), *range(50)])
    assert find_gaps(stream(np.arange(100) * 0.01, numbers)) == ()


def test_numbers_of_two_publishers_are_not_mixed() -> None:
    both = Stream(np.arange(100, dtype=np.int64) * 10_000_000,
                  np.repeat(np.arange(50), 2) + np.tile([0, 1000], 50),
                  np.tile(np.array([0, 1], np.int16), 50))
    assert find_gaps(both) == ()


def several(*times_s: 'np.ndarray') -> Stream:
    """A stream of several publishers."""
    time_ns = np.concatenate([(times * 1e9).astype(np.int64) for times in times_s])
    publisher = np.repeat(np.arange(len(times_s)), [len(times) for times in times_s])
    order = np.argsort(time_ns, kind='stable')
    return Stream(time_ns[order], np.full(len(order), -1, np.int64), publisher[order])


def test_a_slow_publisher_beside_a_fast_one_has_no_gap() -> None:
    """Three of 125 messages arrive together with each of the slow one's; then the fast one ends."""
    fast, slow = np.arange(250) * 0.008, np.arange(120) * 0.0333
    assert find_gaps(several(fast, slow)) == ()


def test_a_gap_of_one_publisher_is_not_hidden_by_another() -> None:
    fast, slow = np.delete(np.arange(500) * 0.008, slice(200, 230)), np.arange(120) * 0.0333
    gap, = find_gaps(several(fast, slow))
    assert gap.duration_s == pytest.approx(31 * 0.008)
    assert abs(gap.missing - 30) <= 1


def test_a_node_that_starts_anew_is_the_same_publisher(tmp_path: Path) -> None:
    """Its connection may be a new one, for example because it is latched now."""
    path = tmp_path / 'a.bag'
    with rosbag.Bag(str(path), 'w') as bag:
        for number in [*range(100), *range(150, 250)]:
            message = String('x')
            bag.write('/n', message, Time(BEGIN_S, 0) + _duration(number * 10_000_000),
                      connection_header={
                          'callerid': '/driver', 'topic': '/n', 'type': message._type,
                          'md5sum': message._md5sum, 'message_definition': message._full_text,
                          'host': f'computer{number // 150}'})
    gap, = report_of(str(path)).topics[0].gaps
    assert gap.duration_s == pytest.approx(0.51)


def test_times_that_go_back_are_jumps() -> None:
    times_ns = np.array([0, 10, 5, 20], np.int64) * 1_000_000_000
    assert backward_jumps(times_ns, 0.1) == [(5_000_000_000, -5.0)]


@pytest.mark.parametrize('late_topic, jumps', [('/n', [-7.0]), (MARKS, [])])
def test_a_mark_that_is_written_late_is_no_jump_of_the_clock(
        tmp_path: Path, late_topic: str, jumps: List[float]) -> None:
    """It waited for a recorder that hung, and has the time at which it was made."""
    path = tmp_path / 'a.bag'
    with rosbag.Bag(str(path), 'w') as bag:
        for second in range(20):
            bag.write('/n', UInt32(second), Time(BEGIN_S + second))
        bag.write(late_topic, String('seam tears'), Time(BEGIN_S + 12))
    assert [it.seconds for it in report_of(str(path)).clock_jumps] == jumps


def counted_array() -> Any:
    """Return an array type that counts the values that were looked at."""
    class Counted(np.ndarray):
        looks = 0

        def __array_ufunc__(self, function: Any, method: str, *inputs: Any, **others: Any) -> Any:
            plain = [np.asarray(it) if isinstance(it, Counted) else it for it in inputs]
            if 'out' in others:
                others['out'] = tuple(map(np.asarray, others['out']))
            Counted.looks += max(map(np.size, plain))
            found = getattr(function, method)(*plain, **others)
            return found.view(Counted) if isinstance(found, np.ndarray) else found

    return Counted


def write(path: Path, numbers: 'List[int]', account: Optional[object] = None) -> str:
    """A bag with the numbers at 100 Hz on /n, and a recorder's statistics."""
    with rosbag.Bag(str(path), 'w') as bag:
        for number in numbers:
            bag.write('/n', UInt32(number), Time(BEGIN_S, 0) + _duration(number * 10_000_000))
        if account is not None:
            bag.write('/process_visualizer/recording', String(json.dumps(account)),
                      Time(BEGIN_S + 100, 0))
    return str(path)


def _duration(nanoseconds: int) -> Duration:
    return Duration(*divmod(nanoseconds, 1_000_000_000))


def report_of(path: str) -> Report:
    """The report on one bag."""
    with Recording([path]) as recording:
        return make_report(recording)


def test_a_complete_recording(tmp_path: Path) -> None:
    report = report_of(write(tmp_path / 'a.bag', list(range(100)),
                             {'topics': {'/n': {'received': 100, 'dropped': 0}},
                              'clock_jumps': []}))
    topic, = report.topics
    assert (topic.topic, topic.message_count, topic.dropped, topic.gaps) == ('/n', 100, 0, ())
    assert topic.rate_hz == pytest.approx(100)
    assert (report.completeness, verdict(report)) == (Completeness.COMPLETE, 'complete')


def test_gaps_drops_and_jumps_are_told(tmp_path: Path) -> None:
    report = report_of(write(tmp_path / 'a.bag', [*range(50), *range(60, 100)],
                             {'topics': {'/n': {'received': 100, 'dropped': 10}},
                              'clock_jumps': [{'time': BEGIN_S + 0.2, 'seconds': -3.5}]}))
    assert report.completeness is Completeness.INCOMPLETE
    text = as_text(report)
    assert '/n at 0:00.490 for 0.110 s: no message (about 10 at its usual rate)' in text
    assert 'the clock jumped by -3.500 s at 0:00.200' in text
    assert text.endswith('verdict: not complete: 10 dropped by the recorder; the clock jumped '
                         'once, so times on both sides do not fit')
    value = json.loads(as_json(report))
    assert value['complete'] is False
    assert value['topics'][0]['gaps'][0]['missing'] == 10


def test_topics_on_which_nothing_came_are_told(tmp_path: Path) -> None:
    report = report_of(write(tmp_path / 'a.bag', list(range(100)),
                             {'topics': {'/n': {'received': 100, 'dropped': 0},
                                         '/off': {'received': 0, 'dropped': 0},
                                         '/process_visualizer/marks': {'received': 1}},
                              'clock_jumps': []}))
    assert [(it.topic, it.message_count) for it in report.topics] == [('/n', 100), ('/off', 0)]
    assert verdict(report) == 'complete; nothing was received on /off'
    assert '/off' in as_text(report) and '/off' in as_json(report)


def test_a_bag_of_another_recorder_says_what_is_not_known(tmp_path: Path) -> None:
    report = report_of(write(tmp_path / 'a.bag', list(range(100))))
    assert report.completeness is Completeness.UNKNOWN
    assert 'nothing is known to be missing' in verdict(report)
    assert json.loads(as_json(report))['complete'] is None
    assert report.topics[0].dropped is None


ALL_WRITTEN = {'topics': {}, 'clock_jumps': []}


def test_a_topic_that_speaks_when_something_happens_misses_nothing(tmp_path: Path) -> None:
    """A key is pressed now and then: an interval without a message is not a loss."""
    numbers = [number for press in range(0, 5000, 500) for number in range(press, press + 20)]
    report = report_of(write(tmp_path / 'a.bag', numbers, ALL_WRITTEN))
    assert len(report.topics[0].gaps) == 9
    assert verdict(report) == 'complete'


@pytest.mark.parametrize('account', [None, ALL_WRITTEN])
def test_a_throttled_topic_misses_nothing(tmp_path: Path, account: Optional[object]) -> None:
    """It has the numbers of its source, most of which are left out."""
    report = report_of(write_numbered(tmp_path / 'a.bag', list(range(0, 9000, 100)), account))
    assert sum(gap.missing for gap in report.topics[0].gaps) == 99 * 89
    assert report.is_good and report.topics[0].lost == 0
    assert 'numbers missing' in as_text(report)


@pytest.mark.parametrize('connections', [1, 2, 5])
def test_connections_do_not_change_the_verdict(tmp_path: Path, connections: int) -> None:
    numbers = [*range(0, 1000, 3)]
    report = report_of(write_numbered(tmp_path / 'a.bag', numbers, None, connections))
    assert report.completeness is Completeness.UNKNOWN


def test_numbers_left_out_now_and_then_are_lost(tmp_path: Path) -> None:
    path = write_numbered(tmp_path / 'a.bag', [*range(30), *range(35, 60)], ALL_WRITTEN)
    report = report_of(path)
    assert report.topics[0].lost == 5
    assert verdict(report) == 'not complete: 5 lost on /h'
    assert '/h at 0:29.000 for 6.000 s: 5 lost' in as_text(report)
    assert json.loads(as_json(report))['complete'] is False


def test_what_the_recorder_dropped_is_not_lost_as_well(tmp_path: Path) -> None:
    account = {'topics': {'/h': {'received': 59, 'dropped': 4}}, 'clock_jumps': []}
    path = write_numbered(tmp_path / 'a.bag', [*range(30), *range(35, 60)], account)
    assert verdict(report_of(path)) == 'not complete: 1 lost on /h; 4 dropped by the recorder'


def test_a_chunk_that_cannot_be_read_is_told_whatever_it_holds(tmp_path: Path) -> None:
    path = tmp_path / 'a.bag'
    with rosbag.Bag(str(path), 'w', compression='bz2', chunk_threshold=500) as bag:
        for number in range(100):
            bag.write('/n', UInt32(number), Time(BEGIN_S + number, 0))
    data = bytearray(path.read_bytes())
    at = data.index(b'BZh', len(data) // 2)
    data[at:at + 3] = b'xxx'
    path.write_bytes(data)
    assert 'a part of the file cannot be read' in verdict(report_of(str(path)))


@pytest.mark.parametrize('compression', ['none', 'lz4'])
@pytest.mark.parametrize('offset', [3, 5000, (1 << 32) - 1])
def test_an_index_that_points_at_no_message_is_told(tmp_path: Path, compression: str,
                                                    offset: int) -> None:
    """Also for a topic whose messages need not be read, and once per topic."""
    path = tmp_path / 'a.bag'
    with rosbag.Bag(str(path), 'w', compression=compression) as bag:
        for number in range(20):
            for topic in ('/a', '/b'):
                bag.write(topic, UInt32(number), Time(BEGIN_S + number, 0))
    data = bytearray(path.read_bytes())
    for index in places_of(bytes(data), OP_INDEX):
        entries = record_at(memoryview(bytes(data)), index).end - 2 * INDEX_ENTRY_BYTES
        data[entries + 8:entries + 12] = offset.to_bytes(4, 'little')
    path.write_bytes(data)
    report = report_of(str(path))
    assert 'not complete: a part of the file cannot be read' in verdict(report)
    assert [it.partition('missing are the topics ')[2][:2] for it in report.unreadable] == [
        '/a', '/b']


def test_many_topics_take_no_longer_than_many_messages(tmp_path: Path) -> None:
    class Counted(Tuple[Connection, ...]):
        looks = 0

        def __iter__(self) -> Iterator[Connection]:
            Counted.looks += 1
            return super().__iter__()

    def looks(count: int) -> int:
        path = tmp_path / f'{count}.bag'
        with rosbag.Bag(str(path), 'w') as bag:
            for number in range(count):
                bag.write(f'/n{number}', UInt32(number), Time(BEGIN_S, number))
        with Recording([str(path)]) as recording:
            recording.index.connections = Counted(recording.index.connections)
            Counted.looks = 0
            assert len(make_report(recording).topics) == count
        return Counted.looks

    assert looks(20) == looks(5)


def test_a_part_without_an_account_makes_it_unknown(tmp_path: Path) -> None:
    """For example a split recording of which one part was repaired."""
    paths = [write(tmp_path / 'a_0.bag', list(range(100))),
             write(tmp_path / 'a_1.bag', list(range(100, 200)), ALL_WRITTEN)]
    with Recording(paths) as recording:
        assert make_report(recording).completeness is Completeness.UNKNOWN


@pytest.mark.parametrize('account', [None, ALL_WRITTEN])
def test_a_bag_without_messages_is_not_complete(tmp_path: Path, account: Optional[object]) -> None:
    report = report_of(write(tmp_path / 'a.bag', [], account))
    assert not report.is_good and verdict(report) == 'empty: it holds no messages'


@pytest.mark.parametrize('numbers, code', [
    ([*range(60)], 0), ([*range(30), *range(35, 60)], 2)])
@pytest.mark.parametrize('words', [['report'], ['report', '--json']])
def test_the_exit_code_tells_scripts_whether_something_is_missing(
        tmp_path: Path, words: List[str], numbers: List[int], code: int) -> None:
    assert main([*words, write_numbered(tmp_path / 'a.bag', numbers, ALL_WRITTEN)]) == code


def test_a_reader_that_has_read_enough_is_no_problem(tmp_path: Path) -> None:
    """For example head; also if the report is short and only written at the end."""
    bag = write(tmp_path / 'a.bag', list(range(100)))
    reading, writing = os.pipe()
    os.close(reading)
    done = subprocess.run(
        [sys.executable, '-c', 'import sys; from process_visualizer.commands.command_line '
         'import main; sys.exit(main(sys.argv[1:]))', 'report', bag],
        stdout=writing, stderr=subprocess.PIPE, check=False)
    os.close(writing)
    assert (done.returncode, done.stderr) == (128 + signal.SIGPIPE, b'')


@pytest.mark.parametrize('kind', ['numbered', 'pausing'])
def test_many_gaps_take_no_longer_than_many_messages(kind: str) -> None:
    """The time is proportional: with 1,000,000 messages, a full pass for each gap takes minutes."""
    def work(count: int) -> int:
        intervals_ms = np.where(np.arange(count) % 5 == 4, 100, 1)
        sequence = np.arange(count) * (2 if kind == 'numbered' else 0) - (kind != 'numbered')
        many, counted = stream(np.cumsum(intervals_ms) / 1e3, sequence), counted_array()
        gaps = find_gaps(many._replace(time_ns=many.time_ns.view(counted),
                                       sequence=many.sequence.view(counted)))
        assert gaps
        return counted.looks

    assert work(40_000) < 5 * work(10_000)


@given(st.lists(st.integers(-9, 9), min_size=1, max_size=50), st.data())
def test_range_minima(values: List[int], draw: st.DataObject) -> None:
    begin = draw.draw(st.lists(st.integers(0, len(values) - 1), max_size=20))
    end = [draw.draw(st.integers(first + 1, len(values))) for first in begin]
    found = range_minima(np.array(values), np.array(begin, np.int64), np.array(end, np.int64))
    assert found.tolist() == [min(values[first:last]) for first, last in zip(begin, end)]


@pytest.mark.parametrize('account', [
    [], {}, {'topics': 3, 'clock_jumps': 3}, {'topics': {'/n': 1}}, {'topics': {'/n': {}}},
    {'topics': {'/n': {'dropped': 'x'}}, 'clock_jumps': [{'time': 'x'}]},
    {'topics': {'/n': {'dropped': -3}, '/\ud800': {}}, 'clock_jumps': [
        {'time': time_s, 'seconds': 1}
        for time_s in (math.inf, math.nan, 1e308, -1, 10 ** 400)]},
    {'topics': {}, 'clock_jumps': [{'time': 1, 'seconds': value}
                                   for value in (math.nan, math.inf, 10 ** 400, [], True)]}])
def test_an_account_that_is_none_does_no_harm(tmp_path: Path, account: object) -> None:
    report = report_of(write(tmp_path / 'a.bag', list(range(100)), account))
    assert not report.topics[0].dropped
    assert report.clock_jumps == ()
    assert as_text(report).encode() and as_json(report).encode()


class Numbered(Header):
    """Message with only a header."""

    _type = 'test_msgs/Numbered'
    _full_text = f'Header header\n{"=" * 80}\nMSG: std_msgs/Header\n{Header._full_text}'


def write_numbered(path: Path, numbers: List[int], account: Optional[object] = None,
                   connections: int = 1) -> str:
    """A bag with header numbers on /h, one per second, from this many publishers in turn."""
    with rosbag.Bag(str(path), 'w') as bag:
        for row, number in enumerate(numbers):
            message = Numbered(seq=number)
            bag.write('/h', message, Time(BEGIN_S + number, 0), connection_header={
                'callerid': f'/node{row % connections}', 'topic': '/h', 'type': message._type,
                'md5sum': message._md5sum, 'message_definition': message._full_text})
        if account is not None:
            bag.write('/process_visualizer/recording', String(json.dumps(account)),
                      Time(BEGIN_S + numbers[-1], 1))
    return str(path)


def test_numbers_in_headers_are_read(tmp_path: Path) -> None:
    report = report_of(write_numbered(tmp_path / 'a.bag', [*range(30), *range(35, 60)]))
    gap, = report.topics[0].gaps
    assert (gap.missing, gap.is_numbered) == (5, True)


def test_numbers_of_large_messages_are_read(tmp_path: Path) -> None:
    with rosbag.Bag(str(tmp_path / 'a.bag'), 'w') as bag:
        for number in (1, 2, 5):
            image = Image(data=bytes(300_000))
            image.header.seq = number
            bag.write('/i', image, Time(BEGIN_S + number, 0))
            bag.write('/n', UInt32(number), Time(BEGIN_S + number, 0))
    with Recording([str(tmp_path / 'a.bag')]) as recording:
        assert header_numbers(recording).tolist() == [1, -1, 2, -1, 5, -1]


def test_a_definition_that_cannot_be_read_has_no_numbers(tmp_path: Path) -> None:
    """For example from a publisher with its own definition language; the bag is reported anyway."""
    with rosbag.Bag(str(tmp_path / 'a.bag'), 'w') as bag:
        for number in range(60):
            bag.write('/h', Numbered(seq=number), Time(BEGIN_S + number, 0), connection_header={
                'topic': '/h', 'type': 'a/B', 'md5sum': '0' * 32,
                'message_definition': 'struct Header { int seq; };'})
    with Recording([str(tmp_path / 'a.bag')]) as recording:
        assert set(header_numbers(recording).tolist()) == {-1}
        assert make_report(recording).topics[0].message_count == 60


def test_an_empty_bag(tmp_path: Path) -> None:
    report = report_of(write(tmp_path / 'a.bag', []))
    assert report.topics == () and 'duration 0.0 s' in as_text(report)
