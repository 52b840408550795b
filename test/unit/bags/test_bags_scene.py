# SPDX-License-Identifier: BSD-3-Clause
"""The scene at a time, compared with a scan of all messages from the beginning."""
from __future__ import annotations

from typing import Dict, List, Tuple

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from process_visualizer.bagio.bag_index import BagIndex, ChunkPlaces, Columns
from process_visualizer.bagio.message_definition import Connection
from process_visualizer.playback.scene import Scene, sources

STATIC_TOPIC = '/tf_static'

CONNECTIONS = (
    Connection('/tcf', 'std_msgs/Float32MultiArray', '', '', False, '/a'),
    Connection('/tcf', 'std_msgs/Float32MultiArray', '', '', False, '/b'),
    Connection('/map', 'nav_msgs/OccupancyGrid', '', '', True, '/a'),
    Connection('/map', 'nav_msgs/OccupancyGrid', '', '', True, '/b'),
    Connection('/tf', 'tf2_msgs/TFMessage', '', '', False, '/a'),
    Connection('/tf', 'tf2_msgs/TFMessage', '', '', False, '/b'),
    Connection(STATIC_TOPIC, 'tf2_msgs/TFMessage', '', '', True, '/a'),
    Connection(STATIC_TOPIC, 'tf2_msgs/TFMessage', '', '', True, '/b'),
)
SHARED = {0: 0, 1: 0}
"""Connections that replace each other's messages, mapped to the first of them."""

numbers_of_connections = st.lists(st.integers(0, len(CONNECTIONS) - 1), max_size=60)


def index_of(numbers: List[int]) -> BagIndex:
    """An index with one message per millisecond of these connections."""
    count = len(numbers)
    columns = Columns(np.arange(count, dtype=np.int64) * 1_000_000,
                      np.array(numbers, dtype=np.int16), np.zeros(count, np.int32),
                      np.arange(count, dtype=np.int32))
    return BagIndex(CONNECTIONS, columns,
                    ChunkPlaces(np.zeros(1, np.int32), np.zeros(1, np.int64)))


def scanned(numbers: List[int], count: int) -> Tuple[List[int], List[int]]:
    """The scene and the static messages, found by scanning all messages."""
    newest: Dict[int, int] = {}
    static: List[int] = []
    for position, number in enumerate(numbers[:count]):
        if CONNECTIONS[number].topic == STATIC_TOPIC:
            static.append(position)
        else:
            newest[SHARED.get(number, number)] = position
    return sorted(newest.values()), static


def static_positions(scene: Scene, count: int) -> List[int]:
    """The static messages among the first messages."""
    return [int(it) for positions in scene.static_topics.values() for it in positions
            if it < count]


@given(numbers_of_connections, st.integers(0, 70))
def test_the_scene_is_what_a_scan_finds(numbers: List[int], count: int) -> None:
    scene = Scene(index_of(numbers))
    assert (scene.positions(count), static_positions(scene, count)) == scanned(numbers, count)


@given(numbers_of_connections, st.integers(0, 70), st.integers(0, 70))
def test_a_topic_is_in_the_scene_or_absent(numbers: List[int], count: int, moment: int) -> None:
    scene = Scene(index_of(numbers))
    present = {CONNECTIONS[numbers[position]].topic for position in scene.positions(count, moment)}
    assert set(scene.absent_topics(count, moment)) == set(scene.topics) - present


@given(numbers_of_connections, st.integers(0, 70), st.integers(0, 70))
def test_what_has_nothing_yet_has_its_first_message_if_that_comes_within_the_moment(
        numbers: List[int], count: int, moment: int) -> None:
    scene = Scene(index_of(numbers))
    added = set(scene.positions(count, moment)) - set(scene.positions(count))
    for position in added:
        assert count <= position < moment
        assert position in map(scene.first, [scene.source_of(position)])
    assert [it for it in scene.absent_topics(count, moment) if scene.first_of(it) < moment] == []


@given(numbers_of_connections, st.data())
def test_before_a_message_what_it_replaced_and_the_newest_are_seen(numbers: List[int],
                                                                   data: st.DataObject) -> None:
    scene = Scene(index_of(numbers))
    moving = [it for it, number in enumerate(numbers) if CONNECTIONS[number].topic != STATIC_TOPIC]
    if not moving:
        return
    position = data.draw(st.sampled_from(moving))
    number = numbers[position]
    before = [it for it in moving if it < position
              and CONNECTIONS[numbers[it]].topic == CONNECTIONS[number].topic]
    source = SHARED.get(number, number)
    same = [it for it in before if SHARED.get(numbers[it], numbers[it]) == source]
    if CONNECTIONS[number].topic == '/tf':  # each transform has one publisher
        assert scene.shown_again(position) == same[-1:]
    else:
        assert scene.shown_again(position) == sorted({*same[-1:], *before[-1:]})


def test_a_node_that_was_restarted_replaces_what_it_had_said() -> None:
    one, other = CONNECTIONS[2], CONNECTIONS[3]
    assert sources((one, other, one._replace(message_definition='# as before'))) == [0, 1, 0]


def test_an_empty_recording_has_an_empty_scene() -> None:
    scene = Scene(index_of([]))
    assert scene.positions(0) == [] and not scene.topics and not scene.static_topics
