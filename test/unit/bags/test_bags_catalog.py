# SPDX-License-Identifier: BSD-3-Clause
"""The contents of a recording, and how they match the devices of a configuration."""
from __future__ import annotations

import json
from pathlib import Path
from typing import Tuple

import pytest
import rosbag
from bag_files import Row, some_rows, write_bag
from genpy import Time
from std_msgs.msg import String, UInt8

from process_visualizer.bagio.bag_errors import BagError, BagUnindexed
from process_visualizer.bagio.catalog import (
    Catalog,
    CatalogTopic,
    missing_topics,
    read_catalog,
    unused_topics,
)
from process_visualizer.bagio.marks import Mark, add_mark, marks_path
from process_visualizer.bagio.recorder_topics import CONFIGURATION, MARKS
from process_visualizer.cell.errors import Location
from process_visualizer.cell.model import Device, DeviceType, Topic

BEGIN_NS = 1_600_000_000_000_000_000


def device(name: str, *topics: Tuple[str, bool]) -> Device:
    """A device with topics, each recorded or not."""
    here = Location('cell.xml', 1)
    return Device(DeviceType.OTHER, name, here,
                  topics=tuple(Topic(topic, None, None, record, here)
                               for topic, record in topics))


def test_what_is_in_a_recording_of_two_files(tmp_path: Path) -> None:
    rows = some_rows(301)  # 100 Hz over three topics
    paths = [write_bag(tmp_path / 'a.bag', rows[:150]), write_bag(tmp_path / 'b.bag', rows[150:])]
    catalog = read_catalog(paths)
    assert catalog.paths == tuple(paths)
    assert (catalog.begin_ns, catalog.duration_s) == (BEGIN_NS, 3.0)
    assert catalog.size_bytes == sum(Path(path).stat().st_size for path in paths)
    assert catalog.message_count == 301
    assert catalog.topics == (
        CatalogTopic('/topic0', ('std_msgs/UInt8MultiArray',), 101, pytest.approx(100 / 3)),
        CatalogTopic('/topic1', ('std_msgs/UInt8MultiArray',), 100, pytest.approx(100 / 3)),
        CatalogTopic('/topic2', ('std_msgs/UInt8MultiArray',), 100, pytest.approx(100 / 3)))
    assert (catalog.marks, catalog.problems, catalog.configuration) == ((), (), None)


def test_what_the_recorder_adds_is_no_topic(tmp_path: Path) -> None:
    stored = {'file': '/c.xml', 'files': {'/c.xml': '<visualizer/>'}, 'arguments': {}}
    path, other = tmp_path / 'a.bag', tmp_path / 'b.bag'
    with rosbag.Bag(str(path), 'w') as bag:
        bag.write(CONFIGURATION, String(json.dumps(stored)), Time(10))
        bag.write('/x', UInt8(1), Time(10))
        bag.write(MARKS, String('here'), Time(12))
    with rosbag.Bag(str(other), 'w') as bag:
        bag.write('/x', String('another type'), Time(14))
    add_mark(str(path), Mark(11_000_000_000, 'before'))
    catalog = read_catalog([str(path), str(other)])
    assert catalog.topics == (
        CatalogTopic('/x', ('std_msgs/UInt8', 'std_msgs/String'), 2, 0.25),)
    assert catalog.message_count == 4  # all of them, as rosbag counts
    assert [mark.label for mark in catalog.marks] == ['before', 'here']
    assert [catalog.position_s(mark) for mark in catalog.marks] == [1.0, 2.0]
    assert catalog.configuration is not None
    assert catalog.configuration.files == {'/c.xml': '<visualizer/>'}


def test_a_recording_without_messages(tmp_path: Path) -> None:
    catalog = read_catalog([write_bag(tmp_path / 'a.bag', [])])
    assert (catalog.duration_s, catalog.message_count, catalog.topics) == (0.0, 0, ())


def test_one_message_has_no_rate(tmp_path: Path) -> None:
    catalog = read_catalog([write_bag(tmp_path / 'a.bag', [Row('/a', 5, b'')])])
    assert catalog.topics == (CatalogTopic('/a', ('std_msgs/UInt8MultiArray',), 1, 0.0),)


def test_marks_that_cannot_be_read_are_a_problem_and_no_error(tmp_path: Path) -> None:
    path = write_bag(tmp_path / 'a.bag', some_rows(3))
    Path(marks_path(path)).write_text('[3]')
    catalog = read_catalog([path])
    assert catalog.message_count == 3
    assert [problem.split(':')[0] for problem in catalog.problems] == [marks_path(path)]


def test_a_part_that_cannot_be_read_is_a_problem(tmp_path: Path) -> None:
    path = write_bag(tmp_path / 'a.bag', some_rows(300), chunk_bytes=2000)
    data = Path(path).read_bytes()
    at = data.index(b'op=\4', len(data) // 2)  # an index record
    Path(path).write_bytes(data[:at] + b'op=\7' + data[at + 4:])
    catalog = read_catalog([path])
    assert 0 < catalog.message_count < 300
    assert 'a part of the index cannot be read' in catalog.problems[0]


@pytest.mark.parametrize('content', [b'', b'text', b'#ROSBAG V1.2\n'])
def test_what_is_no_bag(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / 'a.bag'
    path.write_bytes(content)
    with pytest.raises(BagError, match='a.bag'):
        read_catalog([str(path)])


def test_a_bag_without_an_index_is_told_apart(tmp_path: Path) -> None:
    path = Path(write_bag(tmp_path / 'a.bag', some_rows(30)))
    path.write_bytes(path.read_bytes()[:-100])
    with pytest.raises(BagUnindexed):
        read_catalog([str(path)])


def test_what_devices_would_play_and_what_they_would_not() -> None:
    catalog = Catalog(('a.bag',), 0, 1.0, 1, 3, tuple(
        CatalogTopic(name, ('std_msgs/String',), 1, 0.0) for name in ('/a', '/b', '/d')))
    devices = [device('first', ('/a', True), ('/c', True), ('/e', False)),
               device('second', ('/b', True)),
               device('third', ('/d', False), ('/c', True), ('/c', True))]
    assert missing_topics(catalog, devices) == {'first': ('/c',), 'third': ('/c',)}
    assert missing_topics(catalog, devices[1:2]) == {}
    assert unused_topics(catalog, devices) == ('/d',)
    assert unused_topics(catalog, []) == ('/a', '/b', '/d')
