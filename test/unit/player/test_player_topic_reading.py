# SPDX-License-Identifier: BSD-3-Clause
"""The player reads parts of the recording for others, unchanged."""
from __future__ import annotations

import math
from pathlib import Path
from typing import Any, Iterator, List

import pytest
import rosbag
import rospy
from simulated_node import SimulatedNode, message_bytes
from std_msgs.msg import Float32MultiArray, UInt8MultiArray

from process_visualizer.bagio.recording import Recording
from process_visualizer.player.bag_publishers import PublishedTopic
from process_visualizer.player.player_services import MAX_BYTES, TopicReadingService
from process_visualizer.srv import ReadTopicRequest

BEGIN_S = 1_600_000_000
TIMES_MS = range(0, 1001, 8)
IMAGE_BYTES = MAX_BYTES // 10


def tcf(time_ms: int) -> Float32MultiArray:
    return Float32MultiArray(data=[time_ms / 1000])


@pytest.fixture(scope='module')
def recording(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Recording]:
    """A second: a robot state every 8 ms, an image every 40 ms."""
    path: Path = tmp_path_factory.mktemp('bag') / 'cell.bag'
    rows: List[Any] = [('tcf', time_ms, tcf(time_ms)) for time_ms in TIMES_MS]
    rows += [('/image', time_ms, UInt8MultiArray(data=bytes(IMAGE_BYTES)))
             for time_ms in range(4, 1000, 40)]
    with rosbag.Bag(str(path), 'w') as bag:
        for topic, time_ms, message in sorted(rows, key=lambda row: row[1]):
            bag.write(topic, message, rospy.Time(BEGIN_S, time_ms * 1_000_000))
    with Recording([str(path)]) as found:
        yield found


@pytest.fixture
def node(recording: Recording) -> SimulatedNode:
    """A player in the namespace /r that plays all topics."""
    topics = [PublishedTopic(it.topic, it, False, [number])
              for number, it in enumerate(recording.index.connections)]
    found = SimulatedNode('/r/bag_player')
    TopicReadingService(recording, topics, found, lambda _topic, _bag_ns: ())
    return found


def read(node: SimulatedNode, topic: str, begin_s: float, end_s: float) -> Any:
    return node.call('~read', ReadTopicRequest(topic, begin_s, end_s))


def messages(answer: Any) -> List[bytes]:
    """The messages of an answer."""
    ends = [sum(answer.sizes[:count]) for count in range(len(answer.sizes) + 1)]
    return [answer.data[begin:end] for begin, end in zip(ends, ends[1:])]


def test_it_answers_what_was_recorded(node: SimulatedNode) -> None:
    answer = read(node, '/r/tcf', 0.2, 0.4)
    wanted = [time_ms for time_ms in TIMES_MS if 200 <= time_ms <= 400]
    assert answer.success, answer.message
    assert answer.type == 'std_msgs/Float32MultiArray'
    assert answer.recording_begin == rospy.Time(BEGIN_S)
    assert answer.end == 0.4
    assert answer.period == pytest.approx(0.008, abs=1e-6)
    assert answer.positions == [time_ms / 1000 for time_ms in wanted]
    assert messages(answer) == [message_bytes(tcf(time_ms)) for time_ms in wanted]


def test_the_name_is_the_one_that_it_is_published_by(node: SimulatedNode) -> None:
    answer = read(node, '/tcf', 0.0, 0.1)
    assert (answer.success, answer.message) == (False, '/tcf is not played')


@pytest.mark.parametrize('begin_s, end_s', [(0.4, 0.2), (math.nan, 1.0), (0.0, math.inf)])
def test_what_are_no_positions_is_refused(node: SimulatedNode, begin_s: float,
                                          end_s: float) -> None:
    answer = read(node, '/r/tcf', begin_s, end_s)
    assert not answer.success and answer.message.startswith('begin and end must be positions')


def test_beyond_the_end_there_is_nothing(node: SimulatedNode) -> None:
    answer = read(node, '/r/tcf', 7.0, 8.0)
    assert (answer.success, answer.sizes) == (True, [])


def test_of_too_much_it_says_up_to_where_it_is(node: SimulatedNode) -> None:
    answer = read(node, '/image', 0.0, 1.0)
    assert len(answer.sizes) == 9  # with their layout, ten exceed the limit
    assert answer.end == pytest.approx(0.324, abs=1e-6)
