"""The report finds what was taken out of a stream, and nothing where all is there."""
from __future__ import annotations

import json
from pathlib import Path
from typing import List, Optional

import numpy as np
import pytest
import rosbag
from genpy import Duration, Time
from hypothesis import given, settings
from hypothesis import strategies as st
from std_msgs.msg import Header, String, UInt32

from process_visualizer.bags.recording import Recording
from process_visualizer.bags.report import Report, make_report
from process_visualizer.bags.report_streams import Stream, backward_jumps, find_gaps
from process_visualizer.bags.report_text import as_json, as_text, verdict

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
    times_s[100:140] = times_s[140]  # the computer was busy for 0.4 s, then handed out all
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


def test_times_that_go_back_are_jumps() -> None:
    times_ns = np.array([0, 10, 5, 20], np.int64) * 1_000_000_000
    assert backward_jumps(times_ns, 0.1) == [(5_000_000_000, -5.0)]


def write(path: Path, numbers: 'List[int]', account: Optional[object] = None) -> str:
    """A bag with the numbers at 100 Hz on /n, and a recorder's account."""
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
    assert (report.is_complete, verdict(report)) == (True, 'complete')


def test_gaps_drops_and_jumps_are_told(tmp_path: Path) -> None:
    report = report_of(write(tmp_path / 'a.bag', [*range(50), *range(60, 100)],
                             {'topics': {'/n': {'received': 100, 'dropped': 10}},
                              'clock_jumps': [{'time': BEGIN_S + 0.2, 'seconds': -3.5}]}))
    assert not report.is_complete
    text = as_text(report)
    assert 'gap in /n at 0:00.490 of 0.110 s: about 10 missing' in text
    assert 'the clock jumped by -3.500 s at 0:00.200' in text
    assert 'verdict: not complete: 1 gap in /n; 10 dropped by the recorder' in text
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
    assert verdict(report) == 'complete; nothing came on /off'
    assert '/off' in as_text(report) and '/off' in as_json(report)


def test_a_bag_of_another_recorder_says_what_is_not_known(tmp_path: Path) -> None:
    report = report_of(write(tmp_path / 'a.bag', list(range(100))))
    assert report.is_complete
    assert 'left no account' in verdict(report)
    assert report.topics[0].dropped is None


@pytest.mark.parametrize('account', [
    [], {}, {'topics': 3, 'clock_jumps': 3}, {'topics': {'/n': 1}}, {'topics': {'/n': {}}},
    {'topics': {'/n': {'dropped': 'x'}}, 'clock_jumps': [{'time': 'x'}]}])
def test_an_account_that_is_none_does_no_harm(tmp_path: Path, account: object) -> None:
    report = report_of(write(tmp_path / 'a.bag', list(range(100)), account))
    assert not report.topics[0].dropped
    assert as_text(report) and as_json(report)


class Numbered(Header):
    """A message that is nothing but a header."""

    _full_text = f'Header header\n{"=" * 80}\nMSG: std_msgs/Header\n{Header._full_text}'


def test_numbers_in_headers_are_read(tmp_path: Path) -> None:
    with rosbag.Bag(str(tmp_path / 'a.bag'), 'w') as bag:
        for number in [*range(30), *range(35, 60)]:
            bag.write('/h', Numbered(seq=number), Time(BEGIN_S + number, 0))
    report = report_of(str(tmp_path / 'a.bag'))
    assert report.topics[0].lost == 5
    assert report.topics[0].gaps[0].is_numbered


def test_an_empty_bag(tmp_path: Path) -> None:
    report = report_of(write(tmp_path / 'a.bag', []))
    assert report.topics == () and 'duration 0.0 s' in as_text(report)
