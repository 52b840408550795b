# SPDX-License-Identifier: BSD-3-Clause
"""Parts of a message, where several messages together are the state of a topic.

Two messages with different transforms, markers, joints or diagnostics hold beside each other:
many drivers send each group of joints in a message of its own. The layouts are those of ROS 1's
serialisation (little-endian).
"""
from __future__ import annotations

import re
import struct
from typing import Callable, NamedTuple, Optional, Tuple

from process_visualizer.messages.connection import Connection
from process_visualizer.messages.marker_removal import MARKER, shows_markers
from process_visualizer.messages.message_layout import MessageDamaged
from process_visualizer.messages.static_transforms import split
from process_visualizer.ros_names import TF_TYPES

_LENGTH = struct.Struct('<I')
_STAMPED_BYTES = 12  # sequence number and stamp
_IDENTITY = struct.Struct('<iii')  # id, type, action
_LOOKS_BYTES = 7 * 8 + 3 * 8 + 4 * 4  # pose, scale, colour
_LIFETIME = struct.Struct('<ii')
_POINT_BYTES, _COLOUR_BYTES, _FLOAT64_BYTES = 24, 16, 8
_DELETE_ALL = 3
_NS_PER_S = 1_000_000_000
_DIAGNOSTICS = 'diagnostic_msgs/DiagnosticArray'
_JOINT_STATE = 'sensor_msgs/JointState'
_NAMED_JOINTS = re.compile(r'\w+/\w*JointStates?')
_NAMES_FIRST = re.compile(r'(std_msgs/)?Header\s+\w+\s+string\[\]\s')
_REMARK = re.compile(r'#.*|^\s*\n', re.MULTILINE)


class MessagePart(NamedTuple):
    """A message's part about one thing: which, and for how long [ns] (0: until replaced)."""

    key: bytes
    lifetime_ns: int = 0


Parts = Tuple[MessagePart, ...]
PartsReader = Callable[[bytes], Parts]
CLEARS = MessagePart(b'')
"""The part of a message that ends all that was said before."""


def parts_reader(connection: Connection) -> Optional[PartsReader]:
    """Return what reads the parts of a connection's messages; None where each is a whole state.

    The reader raises MessageDamaged where the bytes do not fit the type.
    """
    if connection.type in TF_TYPES:
        return lambda data: tuple(MessagePart(child) for child, _ in split(data))
    if shows_markers(connection):
        return _marker if connection.type == MARKER else _markers
    if lasts(connection):
        return _joint_state if connection.type == _JOINT_STATE else _joints
    if connection.type == _DIAGNOSTICS:
        return _diagnostics
    return None


def lasts(connection: Connection) -> bool:
    """Return whether the parts of its messages hold however old they are, as those of joints do.

    Types of joint states begin with a header and the names of their joints.
    """
    return connection.type == _JOINT_STATE or bool(
        _NAMED_JOINTS.fullmatch(connection.type)
        and _NAMES_FIRST.match(_REMARK.sub('', connection.message_definition).lstrip()))


def expires(connection: Connection) -> bool:
    """Return whether the parts of its messages are out of date after a while, as those of tf."""
    return connection.type in TF_TYPES


def _joints(data: bytes) -> Parts:
    """Return a part for each joint that a message names."""
    return _names(data)[0]


def _joint_state(data: bytes) -> Parts:
    """Return the same; none of a message without positions, beside which those of before hold."""
    parts, offset = _names(data)
    counts = []
    for _ in ('position', 'velocity', 'effort'):
        count, offset = _number(data, offset)
        counts.append(count)
        offset += count * _FLOAT64_BYTES
    if offset != len(data):
        raise MessageDamaged(f'a joint state takes {offset} bytes, and there are {len(data)}')
    return parts if counts[0] else ()


def _names(data: bytes) -> Tuple[Parts, int]:
    """Return the names behind the header, and the place behind them."""
    _, offset = _text(data, _STAMPED_BYTES)
    count, offset = _number(data, offset)
    parts = []
    for _ in range(count):
        name, offset = _text(data, offset)
        parts.append(MessagePart(name))
    return tuple(parts), offset


def _diagnostics(data: bytes) -> Parts:
    """Return a part for each status, by its name."""
    _, offset = _text(data, _STAMPED_BYTES)
    count, offset = _number(data, offset)
    parts = []
    for _ in range(count):
        name, offset = _text(data, offset + 1)  # behind the level
        parts.append(MessagePart(name))
        for _ in range(2):  # message, hardware_id
            _, offset = _text(data, offset)
        values, offset = _number(data, offset)
        for _ in range(2 * values):  # keys and values
            _, offset = _text(data, offset)
    return tuple(parts)


def _marker(data: bytes) -> Parts:
    return _read_markers(data, 0, 1)


def _markers(data: bytes) -> Parts:
    count, offset = _number(data, 0)
    return _read_markers(data, offset, count)


def _read_markers(data: bytes, offset: int, count: int) -> Parts:
    """Return the parts of so many markers, which begin at an offset and end with the message."""
    parts = []
    for _ in range(count):
        part, offset = _read_marker(data, offset)
        parts.append(part)
    if offset != len(data):
        raise MessageDamaged(f'{count} markers take {offset} bytes, and there are {len(data)}')
    return tuple(parts)


def _read_marker(data: bytes, offset: int) -> Tuple[MessagePart, int]:
    _, offset = _text(data, offset + _STAMPED_BYTES)
    namespace, offset = _text(data, offset)
    try:
        number, _, action = _IDENTITY.unpack_from(data, offset)
        offset += _IDENTITY.size + _LOOKS_BYTES
        seconds, nanoseconds = _LIFETIME.unpack_from(data, offset)
    except struct.error as error:
        raise MessageDamaged(f'a marker ends too early: {error}') from None
    offset += _LIFETIME.size + 1
    for size in (_POINT_BYTES, _COLOUR_BYTES):
        length, offset = _number(data, offset)
        offset += length * size
    for _ in range(2):
        _, offset = _text(data, offset)
    if action == _DELETE_ALL:
        return CLEARS, offset + 1
    lifetime_ns = max(0, seconds * _NS_PER_S + nanoseconds)
    return MessagePart(_LENGTH.pack(number & 0xffffffff) + namespace, lifetime_ns), offset + 1


def _text(data: bytes, offset: int) -> Tuple[bytes, int]:
    length, begin = _number(data, offset)
    end = begin + length
    if end > len(data):
        raise MessageDamaged(f'a message of {len(data)} bytes ends within a text')
    return data[begin:end], end


def _number(data: bytes, offset: int) -> Tuple[int, int]:
    end = offset + _LENGTH.size
    if end > len(data):
        raise MessageDamaged(f'a message of {len(data)} bytes ends too early')
    return int(_LENGTH.unpack_from(data, offset)[0]), end
