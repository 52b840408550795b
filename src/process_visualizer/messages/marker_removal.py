# SPDX-License-Identifier: BSD-3-Clause
"""The message that removes all markers of a topic from RViz.

The bytes are those of visualization_msgs/Marker in ROS 1's serialisation, with action DELETEALL.
"""
from __future__ import annotations

import struct

from process_visualizer.messages.connection import Connection
from process_visualizer.messages.message_layout import Data

MARKER = 'visualization_msgs/Marker'
_MARKER_ARRAY = 'visualization_msgs/MarkerArray'
_DEFINITIONS = {(MARKER, '4048c9de2a16f4ae8e0538085ebf1b97'),
                (_MARKER_ARRAY, 'd155b9ce5188fbaf89745847fd5882d7')}
_DELETE_ALL = 3
_LENGTH = struct.Struct('<I')
_STAMPED = struct.Struct('<III')  # sequence number; no stamp: the latest transform there is
_REST = struct.Struct('<Iiii 7d 3d 4f ii B IIII B')  # namespace to mesh_use_embedded_materials


def shows_markers(connection: Connection) -> bool:
    """Return whether the messages of a connection are markers, or arrays of them, for RViz."""
    return (connection.type, connection.md5sum) in _DEFINITIONS


def has_markers(connection: Connection) -> bool:
    """Return whether RViz would read messages as markers: it compares the checksum only."""
    return any(connection.md5sum == checksum for _, checksum in _DEFINITIONS)


def marker_removal(connection: Connection, example: Data) -> bytes:
    """Return the message for a connection with markers, in the frame of an example message."""
    array = connection.type == _MARKER_ARRAY
    marker = _STAMPED.pack(0, 0, 0) + _frame(example, _LENGTH.size if array else 0) + _REST.pack(
        0, 0, 0, _DELETE_ALL, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0)
    return (_LENGTH.pack(1) if array else b'') + marker


def _frame(example: Data, marker_offset: int) -> bytes:
    """The frame with its length; empty where the example has no marker."""
    begin = marker_offset + _STAMPED.size
    if len(example) < begin + _LENGTH.size:
        return _LENGTH.pack(0)
    end = begin + _LENGTH.size + int(_LENGTH.unpack_from(example, begin)[0])
    return bytes(memoryview(example)[begin:end])
