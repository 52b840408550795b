# SPDX-License-Identifier: BSD-3-Clause
"""Recordings for the tests of playback: messages with their times, and bags of them."""
from __future__ import annotations

import io
from typing import Any, List, NamedTuple, Sequence

import genpy
import rosbag
from geometry_msgs.msg import TransformStamped
from sensor_msgs.msg import CameraInfo, Image
from std_msgs.msg import Float32MultiArray, String
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import Marker

BEGIN_S = 1_600_000_000


class Row(NamedTuple):
    """A message to be recorded: topic, time [ms from the beginning], content."""

    topic: str
    time_ms: int
    message: Any


def stamp(time_ms: float) -> genpy.Time:
    """Return a bag time."""
    return genpy.Time.from_sec(BEGIN_S) + genpy.Duration.from_sec(time_ms / 1000.0)


def write_bag(path: Any, rows: Sequence[Row], latched: Sequence[str] = ('/text', '/tf_static'),
              compression: str = 'none') -> str:
    """Write messages into a bag as `rosbag record` does; return its path."""
    with rosbag.Bag(str(path), 'w', compression=compression, chunk_threshold=100_000) as bag:
        for row in sorted(rows, key=lambda it: it.time_ms):
            bag.write(row.topic, row.message, stamp(row.time_ms), connection_header={
                'topic': row.topic, 'type': row.message._type, 'md5sum': row.message._md5sum,
                'callerid': '/recorded', 'message_definition': row.message._full_text,
                'latching': '1' if row.topic in latched else '0'})
    return str(path)


def serialized(message: genpy.Message) -> bytes:
    """Return the bytes of a message."""
    buffer = io.BytesIO()
    message.serialize(buffer)
    return buffer.getvalue()


def transform(child: str, time_ms: int) -> TransformStamped:
    """Return a transform whose x [m] is its time [s]."""
    result = TransformStamped(child_frame_id=child)
    result.header.frame_id, result.header.stamp = 'world', stamp(time_ms)
    result.transform.translation.x = time_ms / 1000.0
    result.transform.rotation.w = 1.0
    return result


def cell_rows(length_ms: int = 1000) -> List[Row]:
    """A robot every 8 ms, images with their infos every 40 ms, transforms, a marker, a text."""
    rows = [Row('/text', 0, String('the cell')), Row('/text', length_ms // 2, String('changed'))]
    rows += [Row('/tcf', time_ms, Float32MultiArray(data=[time_ms / 1000.0]))
             for time_ms in range(0, length_ms + 1, 8)]
    for time_ms in range(4, length_ms, 40):
        image = Image(height=100, width=300, encoding='rgb8', step=900, data=bytes(90_000))
        image.header.stamp = stamp(time_ms - 3)
        rows += [Row('/image', time_ms, image),
                 Row('/info', time_ms + 1, CameraInfo(header=image.header))]
    for number, time_ms in enumerate((0, 200, 600)):
        rows.append(Row('/tf_static', time_ms, TFMessage([transform(f'fixed{number}', time_ms)])))
    for time_ms in range(0, length_ms, 100):
        rows.append(Row('/tf', time_ms, TFMessage([transform('moving', time_ms)])))
    marker = Marker(id=7, ns='seam', type=Marker.SPHERE)
    marker.header.frame_id = 'world'
    return sorted([*rows, Row('/marker', 300, marker)], key=lambda row: row.time_ms)
