# SPDX-License-Identifier: BSD-3-Clause
"""The index of a message within its topic, in the messages of the generated bags."""
from __future__ import annotations

import struct
from typing import Dict, NamedTuple, Sequence

import numpy as np


class _Place(NamedTuple):
    """The index is in the bytes at ``offset`` as a number of ``kind``, in steps of ``step``."""

    offset: int
    kind: str
    step: float


FEED_RATE_STEP = 1e-4
"""m/s from one message of the feed rate to the next: a ramp, like the edges' sensors."""

_PLACES: Dict[str, _Place] = {
    'sensor_msgs/Image': _Place(0, '<u4', 1),  # header.seq, which a player of bytes keeps
    'sensor_msgs/CameraInfo': _Place(0, '<u4', 1),
    'std_msgs/Float32MultiArray': _Place(12, '<f4', 1),  # the padding in front of the data
    'std_msgs/UInt16': _Place(0, '<u2', 1),
    'std_msgs/Float32': _Place(0, '<f4', FEED_RATE_STEP),
    'std_msgs/String': _Place(4, 'S8', 1),
    'tf2_msgs/TFMessage': _Place(4, '<u4', 1),  # of the first transform
    'visualization_msgs/MarkerArray': _Place(4, '<u4', 1),  # of the first marker
}


def indexes(message_type: str, fronts: np.ndarray) -> np.ndarray:
    """Return the indexes (n,) int64 of messages from their first bytes (n, 64) uint8."""
    place = _PLACES[message_type]
    kind = np.dtype(place.kind)
    numbers = np.ascontiguousarray(fronts[:, place.offset:place.offset + kind.itemsize]).view(kind)
    return np.rint(numbers[:, 0].astype(float) / place.step).astype(np.int64)


def array_message(index: int, values: Sequence[float]) -> bytes:
    """Return a std_msgs/Float32MultiArray: the index as one number of padding, then the values."""
    return struct.pack(f'<IIIf{len(values)}f', 0, 1, 1 + len(values), index, *values)


def edge_message(index: int) -> bytes:
    """Return a std_msgs/UInt16, below 65536."""
    return struct.pack('<H', index)


def feed_rate_message(index: int) -> bytes:
    """Return a std_msgs/Float32 [m/s]."""
    return struct.pack('<f', index * FEED_RATE_STEP)


def text_message(index: int, size: int) -> bytes:
    """Return a std_msgs/String of this many bytes, at least 12."""
    return struct.pack('<I', size - 4) + f'{index:08d}'.encode().ljust(size - 4, b'.')
