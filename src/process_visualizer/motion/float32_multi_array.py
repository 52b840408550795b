# SPDX-License-Identifier: BSD-3-Clause
"""Reads the numbers of a std_msgs/Float32MultiArray straight from its bytes.

A driver sends a few numbers at 125 Hz and more; building the message with its layout costs
several times as much as finding where the numbers are. For that few, Python's own numbers are
faster than an array.
"""
from __future__ import annotations

import struct
from typing import Tuple

_UINT32 = struct.Struct('<I')


def float32_values(message: bytes) -> Tuple[float, ...]:
    """Return the numbers without the layout's data_offset of padding.

    Args:
        message: the serialised message: the layout's dimensions (label, size, stride),
            data_offset, and the data.

    Raises:
        ValueError: the bytes are not those of such a message.
    """
    try:
        position = _end_of_dimensions(message)
        (offset,) = _UINT32.unpack_from(message, position)
        (count,) = _UINT32.unpack_from(message, position + 4)
    except struct.error:
        raise ValueError('the message is cut off in its layout') from None
    if len(message) != position + 8 + 4 * count:
        raise ValueError('the message has another size than its layout says')
    if offset > count:
        raise ValueError('data_offset of the layout lies behind the end of the data')
    return struct.unpack_from(f'<{count}f', message, position + 8)[offset:]


def _end_of_dimensions(message: bytes) -> int:
    """Return where the layout's list of dimensions ends."""
    (dimension_count,) = _UINT32.unpack_from(message, 0)
    position = 4
    for _ in range(dimension_count):
        (label_length,) = _UINT32.unpack_from(message, position)
        position += 4 + label_length + 8  # the label, then size and stride
    return position
