# SPDX-License-Identifier: BSD-3-Clause
"""Serialized messages of well-known types: their parts, and messages that clear a display.

Messages with different transforms, markers, joints or diagnostics hold at the same time: many
drivers send each group of joints in its own message. RViz keeps what it received, so some messages
are made to remove it. The layouts are those of ROS 1 serialization (little-endian).
"""
from __future__ import annotations

import re
import struct
from typing import (
    Any,
    Callable,
    Collection,
    Dict,
    Iterator,
    List,
    NamedTuple,
    Optional,
    Tuple,
    Union,
)

from process_visualizer.bagio.message_definition import Connection
from process_visualizer.bagio.message_layout import (
    Data,
    MessageDamaged,
    checked_end,
    read_length,
    read_text,
)
from process_visualizer.bagio.number_places import transform_places
from process_visualizer.ros_names import TF_TYPES

_LENGTH = struct.Struct('<I')
_STAMPED = struct.Struct('<III')  # sequence number and stamp; stamp 0: the latest transform


def joined(transforms: Collection[bytes]) -> bytes:
    """Return a TFMessage with the given transforms."""
    return _LENGTH.pack(len(transforms)) + b''.join(transforms)


def split(data: bytes) -> Iterator[Tuple[bytes, bytes]]:
    """Yield child frame (without a leading slash) and bytes of each transform in a TFMessage.

    Raises:
        MessageDamaged: the bytes are not a TFMessage.
    """
    for it in transform_places(data):
        yield it.child_name.lstrip(b'/'), data[it.begin:it.end]


_MARKER = 'visualization_msgs/Marker'
_MARKER_ARRAY = 'visualization_msgs/MarkerArray'
_DEFINITIONS = {(_MARKER, '4048c9de2a16f4ae8e0538085ebf1b97'),
                (_MARKER_ARRAY, 'd155b9ce5188fbaf89745847fd5882d7')}
_DELETE_ALL = 3  # the action that removes all markers of a topic


def shows_markers(connection: Connection) -> bool:
    """Return whether the messages of a connection are markers or arrays of markers for RViz."""
    return (connection.type, connection.md5sum) in _DEFINITIONS


_IDENTITY = struct.Struct('<iii')  # id, type, action
_LOOKS_BYTES = 7 * 8 + 3 * 8 + 4 * 4  # pose, scale, color
_LIFETIME = struct.Struct('<ii')
_POINT_BYTES, _COLOR_BYTES, _FLOAT64_BYTES = 24, 16, 8
_NS_PER_S = 1_000_000_000
_DIAGNOSTICS = 'diagnostic_msgs/DiagnosticArray'
_JOINT_STATE = 'sensor_msgs/JointState'
_NAMED_JOINTS = re.compile(r'\w+/\w*JointStates?')
_NAMES_FIRST = re.compile(r'(std_msgs/)?Header\s+\w+\s+string\[\]\s')
_REMARK = re.compile(r'#.*|^\s*\n', re.MULTILINE)


class MessagePart(NamedTuple):
    """The part of a message about one thing: its key, and its lifetime [ns; 0: until replaced]."""

    key: bytes
    lifetime_ns: int = 0


Parts = Tuple[MessagePart, ...]
PartsReader = Callable[[bytes], Parts]
CLEARS = MessagePart(b'')
"""The part of a message that makes all earlier parts invalid."""


def parts_reader(connection: Connection) -> Optional[PartsReader]:
    """Return a reader for the parts of a connection's messages; None if each is a complete state.

    The reader raises MessageDamaged if the bytes do not fit the type.
    """
    if connection.type in TF_TYPES:
        return lambda data: tuple(MessagePart(it.child_name.lstrip(b'/'))
                                  for it in transform_places(data))
    if shows_markers(connection):
        is_array = connection.type == _MARKER_ARRAY
        return lambda data: _markers(data, is_array)
    if lasts(connection):
        return _joint_state if connection.type == _JOINT_STATE else lambda data: _names(data)[0]
    if connection.type == _DIAGNOSTICS:
        return _diagnostics
    return None


def lasts(connection: Connection) -> bool:
    """Return whether the parts of a connection's messages never expire, as with joints.

    Types of joint states begin with a header and the names of their joints.
    """
    return connection.type == _JOINT_STATE or bool(
        _NAMED_JOINTS.fullmatch(connection.type)
        and _NAMES_FIRST.match(_REMARK.sub('', connection.message_definition).lstrip()))


def expires(connection: Connection) -> bool:
    """Return whether the parts of a connection's messages expire after a while, as with tf."""
    return connection.type in TF_TYPES


def _joint_state(data: bytes) -> Parts:
    """Return a part for each joint; none without positions, as earlier positions still hold."""
    parts, offset = _names(data)
    counts = []
    for _ in ('position', 'velocity', 'effort'):
        count, offset = read_length(data, offset)
        counts.append(count)
        offset += count * _FLOAT64_BYTES
    if offset != len(data):
        raise MessageDamaged(f'a joint state takes {offset} bytes, and there are {len(data)}')
    return parts if counts[0] else ()


def _names(data: bytes) -> Tuple[Parts, int]:
    """Return the names that follow the header, and the position after them."""
    _, offset = read_text(data, _STAMPED.size)
    count, offset = read_length(data, offset)
    parts = []
    for _ in range(count):
        name, offset = read_text(data, offset)
        parts.append(MessagePart(name))
    return tuple(parts), offset


def _diagnostics(data: bytes) -> Parts:
    """Return a part for each status, by its name."""
    _, offset = read_text(data, _STAMPED.size)
    count, offset = read_length(data, offset)
    parts = []
    for _ in range(count):
        name, offset = read_text(data, offset + 1)  # after the level
        parts.append(MessagePart(name))
        for _ in range(2):  # message, hardware_id
            _, offset = read_text(data, offset)
        values, offset = read_length(data, offset)
        for _ in range(2 * values):  # keys and values
            _, offset = read_text(data, offset)
    return tuple(parts)


def _markers(data: bytes, is_array: bool) -> Parts:
    """Return a part for each marker, by namespace and number."""
    count, offset = read_length(data, 0) if is_array else (1, 0)
    parts = []
    for _ in range(count):
        part, offset = _read_marker(data, offset)
        parts.append(part)
    if offset != len(data):
        raise MessageDamaged(f'{count} markers take {offset} bytes, and there are {len(data)}')
    return tuple(parts)


def _read_marker(data: bytes, offset: int) -> Tuple[MessagePart, int]:
    _, offset = read_text(data, offset + _STAMPED.size)
    namespace, offset = read_text(data, offset)
    try:
        number, _, action = _IDENTITY.unpack_from(data, offset)
        offset += _IDENTITY.size + _LOOKS_BYTES
        seconds, nanoseconds = _LIFETIME.unpack_from(data, offset)
    except struct.error as error:
        raise MessageDamaged(f'a marker ends too early: {error}') from None
    offset += _LIFETIME.size + 1
    for size in (_POINT_BYTES, _COLOR_BYTES):
        length, offset = read_length(data, offset)
        offset += length * size
    for _ in range(2):
        _, offset = read_text(data, offset)
    if action == _DELETE_ALL:
        return CLEARS, offset + 1
    lifetime_ns = max(0, seconds * _NS_PER_S + nanoseconds)
    return MessagePart(_LENGTH.pack(number & 0xffffffff) + namespace, lifetime_ns), offset + 1


# Messages that clear the display of a topic, for the types that have such a message.
#
# RViz keeps the last message of each topic. It must not show what does not exist yet at the current
# time, such as what it showed before a jump. Numbers and poses have no value for "nothing"; a cloud
# without points, a path without poses and the removal of all markers do.

_CLOUD = ('sensor_msgs/PointCloud2', '1158d486dd51d683ce2f1be655c3c181')
_REST = struct.Struct('<Iiii 7d 3d 4f ii B IIII B')  # namespace to mesh_use_embedded_materials
_EMPTY = bytes(4)  # the length of an array, or a number
_FIELD_END = 4 + 1 + 4  # of a sensor_msgs/PointField after its name: offset, type, count


class _Arrays(NamedTuple):
    """A message of a header, other fields (``kept_bytes``), and arrays at its end."""

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
    """Return whether a connection's type has a message that clears its display."""
    key = (connection.type, connection.md5sum)
    return shows_markers(connection) or key == _CLOUD or key in _BY_TYPE


def emptied(connection: Connection, example: Data) -> bytes:
    """Return a message that clears the display, with frame and format of an example message.

    Raises:
        MessageDamaged: the bytes of the example do not fit its type.
    """
    if shows_markers(connection):
        return _marker_removal(connection, example)
    if (connection.type, connection.md5sum) == _CLOUD:
        return _cloud(example)
    arrays = _BY_TYPE[connection.type, connection.md5sum]
    behind = read_text(example, _STAMPED.size)[1]
    kept = checked_end(example, behind, arrays.kept_bytes)
    return _header(example, behind) + bytes(example[behind:kept]) + _EMPTY * arrays.array_count


def _marker_removal(connection: Connection, example: Data) -> bytes:
    """Return a marker with the action DELETEALL, in the frame of an example."""
    array = connection.type == _MARKER_ARRAY
    marker = _STAMPED.pack(0, 0, 0) + _frame(example, _LENGTH.size if array else 0) + _REST.pack(
        0, 0, 0, _DELETE_ALL, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0)
    return (_LENGTH.pack(1) if array else b'') + marker


def _frame(example: Data, marker_offset: int) -> bytes:
    """Return the frame_id with its length; empty if the example has no marker."""
    begin = marker_offset + _STAMPED.size
    if len(example) < begin + _LENGTH.size:
        return _LENGTH.pack(0)
    end = begin + _LENGTH.size + int(_LENGTH.unpack_from(example, begin)[0])
    return bytes(memoryview(example)[begin:end])


def _cloud(example: Data) -> bytes:
    """Return a cloud without points, but with the fields of the example, which RViz needs."""
    behind = read_text(example, _STAMPED.size)[1]
    fields = checked_end(example, behind, 2 * len(_EMPTY))
    count, end = read_length(example, fields)
    for _ in range(count):
        end = checked_end(example, read_text(example, end)[1], _FIELD_END)
    steps = checked_end(example, end, 1 + 4)  # is_bigendian, point_step
    return (_header(example, behind) + _EMPTY * 2 + bytes(example[fields:steps])
            + _EMPTY * 2 + bytes([1]))  # row_step, data, is_dense


def _header(example: Data, behind: int) -> bytes:
    return _STAMPED.pack(0, 0, 0) + bytes(example[_STAMPED.size:behind])


# The meshes to which markers refer.

_TEXT, _MESH = 'text', 'mesh'
_Shape = Tuple[Union[int, str, List[Any]], ...]
"""Consecutive parts: a number of bytes, a string, the URI of a mesh, or an array of shapes."""
_MARKER_SHAPE: _Shape = (12, _TEXT, _TEXT, 117, [_POINT_BYTES], [_COLOR_BYTES], _TEXT, _MESH, 1)
_CONTROL_SHAPE: _Shape = (_TEXT, 35, [_MARKER_SHAPE], 1, _TEXT)
_INTERACTIVE_SHAPE: _Shape = (12, _TEXT, 56, _TEXT, _TEXT, 4, [(8, _TEXT, _TEXT, 1)],
                              [_CONTROL_SHAPE])
_SHAPES: Dict[str, _Shape] = {
    '4048c9de2a16f4ae8e0538085ebf1b97': _MARKER_SHAPE,
    'd155b9ce5188fbaf89745847fd5882d7': ([_MARKER_SHAPE],),
    'b3c81e785788195d1840b86c28da1aac': _CONTROL_SHAPE,
    'dd86d22909d5a3364b384492e35c10af': _INTERACTIVE_SHAPE,
    'd5f2c5045a72456d228676ab91048734': (_TEXT, 8, [_INTERACTIVE_SHAPE]),
    '710d308d0a9276d65945e92dd30b3946': (_TEXT, 9, [_INTERACTIVE_SHAPE],
                                         [(12, _TEXT, 56, _TEXT)], [(_TEXT,)])}
"""Shapes of markers by the MD5 sum of the type, the only thing by which RViz recognizes it."""


def named_meshes(connection: Connection, data: Data) -> Tuple[str, ...]:
    """Return the URIs of the meshes that RViz would open for a message of markers, each once.

    Raises:
        MessageDamaged: the bytes do not fit the type.
    """
    shape = _SHAPES.get(connection.md5sum)
    if shape is None:
        return ()
    found: Dict[bytes, None] = {}
    _note_meshes(data, 0, shape, found)
    return tuple(it.decode('utf-8', 'replace') for it in found)


def _note_meshes(data: Data, offset: int, shape: _Shape, found: Dict[bytes, None]) -> int:
    """Add the URIs of meshes to ``found``; return the position after the parts."""
    for part in shape:
        if isinstance(part, int):
            offset = checked_end(data, offset, part)
            continue
        count, offset = read_length(data, offset)
        if isinstance(part, str):
            end = checked_end(data, offset, count)
            if part is _MESH and count:
                found[bytes(data[offset:end])] = None
            offset = end
        elif isinstance(part[0], int):
            offset = checked_end(data, offset, count * part[0])
        else:
            for _ in range(count):
                offset = _note_meshes(data, offset, part[0], found)
    return offset
