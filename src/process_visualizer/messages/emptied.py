# SPDX-License-Identifier: BSD-3-Clause
"""Messages that leave nothing of a topic in sight, for the types that have such a message.

RViz keeps the last message of each topic. What was not there yet must not be seen, above all not
what was there before a jump. Numbers and poses have no value that says "nothing"; a cloud
without points, a path without poses and the removal of all markers do.
"""
from __future__ import annotations

import struct
from typing import Dict, NamedTuple, Tuple

from process_visualizer.messages.connection import Connection
from process_visualizer.messages.marker_removal import marker_removal, shows_markers
from process_visualizer.messages.message_layout import Data, checked_end, read_length

_CLOUD = ('sensor_msgs/PointCloud2', '1158d486dd51d683ce2f1be655c3c181')
_HEADER_BEGIN = struct.Struct('<III')  # sequence number; no stamp: the latest transform there is
_EMPTY = bytes(4)  # the length of an array, or a number
_FIELD_END = 4 + 1 + 4  # of a sensor_msgs/PointField behind its name: offset, type, count


class _Arrays(NamedTuple):
    """A message that ends with arrays, behind its header and other fields of some bytes."""

    kept_bytes: int
    array_count: int


_BY_TYPE: Dict[Tuple[str, str], _Arrays] = {
    ('geometry_msgs/PoseArray', '916c28c5764443f268b296bb671b9d97'): _Arrays(0, 1),
    ('nav_msgs/GridCells', 'b9e4f5df6d28e272ebde00a3994830f5'): _Arrays(8, 1),
    ('nav_msgs/Path', '6227e2b7e9cce15051f669a5e197bbf7'): _Arrays(0, 1),
    ('sensor_msgs/LaserScan', '90c7ef2dc6895d81024acba2ac42f369'): _Arrays(28, 2),
    ('sensor_msgs/PointCloud', 'd8e9c3f5afbdd8a130fd1d2763945fca'): _Arrays(0, 2),
}


def can_be_emptied(connection: Connection) -> bool:
    """Return whether a connection's type has a message that leaves nothing in sight."""
    key = (connection.type, connection.md5sum)
    return shows_markers(connection) or key == _CLOUD or key in _BY_TYPE


def emptied(connection: Connection, example: Data) -> bytes:
    """Return that message, with the frame and the format of an example message.

    Raises:
        MessageDamaged: the bytes of the example are none of its type.
    """
    if shows_markers(connection):
        return marker_removal(connection, example)
    if (connection.type, connection.md5sum) == _CLOUD:
        return _cloud(example)
    arrays = _BY_TYPE[connection.type, connection.md5sum]
    behind = _behind_text(example, _HEADER_BEGIN.size)
    kept = checked_end(example, behind, arrays.kept_bytes)
    return _header(example, behind) + bytes(example[behind:kept]) + _EMPTY * arrays.array_count


def _cloud(example: Data) -> bytes:
    """A cloud of no points, with the fields of the example: RViz wants to know them."""
    behind = _behind_text(example, _HEADER_BEGIN.size)
    fields = checked_end(example, behind, 2 * len(_EMPTY))
    count, end = read_length(example, fields)
    for _ in range(count):
        end = checked_end(example, _behind_text(example, end), _FIELD_END)
    steps = checked_end(example, end, 1 + 4)  # is_bigendian, point_step
    return (_header(example, behind) + _EMPTY * 2 + bytes(example[fields:steps])
            + _EMPTY * 2 + bytes([1]))  # row_step, data, is_dense


def _header(example: Data, behind: int) -> bytes:
    return _HEADER_BEGIN.pack(0, 0, 0) + bytes(example[_HEADER_BEGIN.size:behind])


def _behind_text(data: Data, position: int) -> int:
    length, begin = read_length(data, position)
    return checked_end(data, begin, length)
