# SPDX-License-Identifier: BSD-3-Clause
"""Bags for the tests, written by rosbag itself."""
from __future__ import annotations

from pathlib import Path
from typing import Dict, Iterable, List, NamedTuple

import genpy
import rosbag
from hypothesis import strategies as st

from process_visualizer.bagio.recording import Recording

DEFINITION = 'uint8[] data'
MD5SUM = 'f43a8e1b362b75baa741461b46adc7e0'


class Row(NamedTuple):
    """A message: topic, time [ns], serialized bytes."""

    topic: str
    time_ns: int
    data: bytes


class RawType:
    """Stand-in for a message class, with the attributes that rosbag needs for serialized bytes."""

    _type = 'std_msgs/UInt8MultiArray'
    _md5sum = MD5SUM
    _full_text = DEFINITION


def write_bag(path: Path, rows: Iterable[Row], compression: str = 'none',
              chunk_bytes: int = 768 * 1024, caller: str = '') -> str:
    """Write the messages in the given order; a named publisher latches."""
    with rosbag.Bag(str(path), 'w', compression=compression, chunk_threshold=chunk_bytes) as bag:
        for row in rows:
            bag.write(row.topic, (RawType._type, row.data, MD5SUM, RawType),
                      genpy.Time(*divmod(row.time_ns, 10 ** 9)), raw=True,
                      connection_header=_connection_header(row.topic, caller) if caller else None)
    return str(path)


def _connection_header(topic: str, caller: str) -> Dict[str, str]:
    return {'topic': topic, 'type': RawType._type, 'md5sum': MD5SUM,
            'message_definition': DEFINITION, 'callerid': caller, 'latching': '1'}


def content(recording: Recording) -> List[Row]:
    """All messages of a recording in index order."""
    index = recording.index
    return [Row(index.connections[int(index.connection[position])].topic,
                int(index.time_ns[position]), bytes(recording.message(position)))
            for position in range(len(index))]


def in_time(rows: Iterable[Row]) -> List[Row]:
    """The messages sorted by time; messages with equal times in the order of writing."""
    return sorted(rows, key=lambda row: row.time_ns)


def some_rows(count: int, step_ns: int = 10_000_000, size: int = 40) -> List[Row]:
    """Messages on three topics, one per step; each has its number in its bytes."""
    return [Row(f'/topic{number % 3}', 1_600_000_000_000_000_000 + number * step_ns,
                number.to_bytes(4, 'little') + bytes(size)) for number in range(count)]


END_NS = 4_294_967_295_999_999_999
"""Last time that ROS can represent."""
_DAY_NS = 24 * 3600 * 10 ** 9
times_ns = st.one_of(st.integers(1, 20), st.integers(1, _DAY_NS)).map(lambda it: END_NS - it)
rows_of_messages = st.lists(
    st.builds(Row, st.sampled_from(['/a', '/b', '/ns/c', '/tf']), times_ns,
              st.binary(max_size=300)), max_size=60)
compressions = st.sampled_from(['none', 'bz2', 'lz4'])
