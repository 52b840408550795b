"""The scene at a time, compared with a scan of all messages from the beginning."""
from __future__ import annotations

from typing import Dict, List, Tuple

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from process_visualizer.bags.bag_index import BagIndex, ChunkPlaces, Columns
from process_visualizer.bags.bag_records import Connection
from process_visualizer.bags.scene import STATIC_TOPIC, Scene

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
"""Connections that replace each other's messages, by the first of them."""

numbers_of_connections = st.lists(st.integers(0, len(CONNECTIONS) - 1), max_size=60)


def index_of(numbers: List[int]) -> BagIndex:
    """An index with a message each millisecond, of these connections."""
    count = len(numbers)
    columns = Columns(np.arange(count, dtype=np.int64) * 1_000_000,
                      np.array(numbers, dtype=np.int16), np.zeros(count, np.int32),
                      np.arange(count, dtype=np.int32))
    return BagIndex(CONNECTIONS, columns,
                    ChunkPlaces(np.zeros(1, np.int32), np.zeros(1, np.int64)))


def scanned(numbers: List[int], count: int) -> Tuple[List[int], List[int]]:
    """The scene and the static messages, found by going through all messages."""
    newest: Dict[int, int] = {}
    static: List[int] = []
    for position, number in enumerate(numbers[:count]):
        if CONNECTIONS[number].topic == STATIC_TOPIC:
            static.append(position)
        else:
            newest[SHARED.get(number, number)] = position
    return sorted(newest.values()), static


@given(numbers_of_connections, st.integers(0, 70))
def test_the_scene_is_what_a_scan_finds(numbers: List[int], count: int) -> None:
    scene = Scene(index_of(numbers))
    assert (scene.positions(count), scene.static_positions(count)) == scanned(numbers, count)


@given(numbers_of_connections, st.integers(0, 70))
def test_a_topic_is_in_the_scene_or_absent(numbers: List[int], count: int) -> None:
    scene = Scene(index_of(numbers))
    present = {CONNECTIONS[numbers[position]].topic
               for position in scene.positions(count) + scene.static_positions(count)}
    everything = {connection.topic for connection in CONNECTIONS}
    assert scene.absent_topics(count) == sorted(everything - present)


def test_only_the_chosen_topics_count() -> None:
    scene = Scene(index_of([0, 2, 4, 6]), topics=['/map'])
    assert scene.positions(4) == [1]
    assert scene.static_positions(4) == []
    assert scene.absent_topics(1) == ['/map']


def test_an_empty_recording_has_an_empty_scene() -> None:
    scene = Scene(index_of([]))
    assert scene.positions(0) == [] and scene.static_positions(0) == []
