# SPDX-License-Identifier: BSD-3-Clause
"""The transforms in messages on /tf_static, taken apart and put into one message.

A tf2_msgs/TFMessage is, in ROS 1's serialisation (little-endian), the number of transforms and
then each geometry_msgs/TransformStamped: sequence number, stamp, parent frame, child frame, and
seven float64 for translation and rotation.
"""
from __future__ import annotations

import struct
from typing import Collection, Iterator, Tuple

from process_visualizer.messages.message_layout import MessageDamaged

_COUNT = struct.Struct('<I')
_BEFORE_PARENT = 12
_POSE = 7 * 8


def joined(transforms: Collection[bytes]) -> bytes:
    """Return a TFMessage with some transforms."""
    return _COUNT.pack(len(transforms)) + b''.join(transforms)


def split(data: bytes) -> Iterator[Tuple[bytes, bytes]]:
    """Yield child frame (without a leading slash) and bytes of each transform of a TFMessage.

    Raises:
        MessageDamaged: the bytes are no TFMessage.
    """
    offset = _COUNT.size
    for _ in range(_number(data, 0)):
        begin = offset
        _, offset = _text(data, offset + _BEFORE_PARENT)
        child, offset = _text(data, offset)
        offset += _POSE
        if offset > len(data):
            raise MessageDamaged(f'a TFMessage of {len(data)} bytes ends within a transform')
        yield child.lstrip(b'/'), data[begin:offset]
    if offset != len(data):
        raise MessageDamaged(f'a TFMessage has {len(data) - offset} bytes too many')


def _number(data: bytes, offset: int) -> int:
    if offset + _COUNT.size > len(data):
        raise MessageDamaged(f'a TFMessage of {len(data)} bytes ends within a length')
    return int(_COUNT.unpack_from(data, offset)[0])


def _text(data: bytes, offset: int) -> Tuple[bytes, int]:
    end = offset + _COUNT.size + _number(data, offset)
    return data[offset + _COUNT.size:end], end
