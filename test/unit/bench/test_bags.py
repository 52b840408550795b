# SPDX-License-Identifier: BSD-3-Clause
"""The bags of the benchmarks contain what the programs expect."""
from __future__ import annotations

from collections import defaultdict
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip('sensor_msgs')

from bag_maker import MadeBag  # noqa: E402
from cell_bag import cell_bag  # noqa: E402
from message_index import indexes  # noqa: E402
from robots_bag import robots_bag  # noqa: E402

from process_visualizer.bagio.recording import Recording  # noqa: E402


@pytest.fixture(scope='module', params=['cell', 'robots'])
def bag(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> MadeBag:
    folder = str(tmp_path_factory.mktemp('bags'))
    return cell_bag(folder, 0.5) if request.param == 'cell' else robots_bag(folder, 0.02)


def test_every_message_is_there_with_its_index_and_time(bag: MadeBag):
    fronts, times = defaultdict(list), defaultdict(list)
    with Recording([str(bag.path)]) as recording:
        for position in range(len(recording.index)):
            topic = recording.index.connections[recording.index.connection[position]].topic
            front = bytes(recording.message(position))[:64].ljust(64, b'\0')
            fronts[topic].append(np.frombuffer(front, np.uint8))
            times[topic].append(recording.index.time_ns[position])
    assert set(times) == {topic.name for topic in bag.topics}
    for number, topic in enumerate(bag.topics):
        assert times[topic.name] == bag.times_ns(number).tolist()
        found = indexes(topic.message_class._type, np.array(fronts[topic.name]))
        assert found.tolist() == list(range(len(found)))


def test_the_messages_are_of_their_types(bag: MadeBag):
    rosbag = pytest.importorskip('rosbag')
    with rosbag.Bag(str(bag.path)) as file:
        kinds = {topic: type(message)._type for topic, message, _ in
                 ((topic, message, None) for topic, message, _ in file.read_messages())}
    assert {topic.name for topic in bag.topics} == set(kinds)


def test_a_bag_is_written_once(tmp_path: Path):
    first = robots_bag(str(tmp_path), 0.01)
    written = first.path.stat().st_mtime_ns
    assert robots_bag(str(tmp_path), 0.01).path.stat().st_mtime_ns == written
    assert [path.name for path in tmp_path.iterdir()] == [first.path.name]
