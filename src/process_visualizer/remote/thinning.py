# SPDX-License-Identifier: BSD-3-Clause
"""Clouds and images reduced to the size that a slow link carries."""
from __future__ import annotations

import math
from struct import Struct, error
from typing import Tuple

import numpy as np

from process_visualizer.bagio.message_layout import MessageDamaged, read_text

CLOUD, IMAGE = 'sensor_msgs/PointCloud2', 'sensor_msgs/Image'
_STAMPED = 12
_PIXEL_BYTES = {'mono8': 1, '8UC1': 1, 'mono16': 2, '16UC1': 2, '32FC1': 4, 'rgb8': 3, 'bgr8': 3,
                '8UC3': 3, 'rgba8': 4, 'bgra8': 4, '8UC4': 4}


def thinned(kind: str, data: bytes, most_bytes: float) -> bytes:
    """Return a cloud or an image reduced to about ``most_bytes``, other messages unchanged.

    Points without coordinates are dropped first, then every n-th point is kept, or every n-th row
    and column of an image. Messages that cannot be parsed are returned unchanged.
    """
    if len(data) <= most_bytes:
        return data
    try:
        if kind == CLOUD:
            return _thinned_cloud(data, most_bytes)
        if kind == IMAGE:
            return _thinned_image(data, most_bytes)
    except (MessageDamaged, error, ValueError, IndexError, KeyError):
        return data
    return data


def _thinned_cloud(data: bytes, most_bytes: float) -> bytes:
    position = read_text(data, _STAMPED)[1]
    begin = position
    height, width, count = Struct('<III').unpack_from(data, position)
    position += 12
    offsets = {}
    for _ in range(count):
        name, position = read_text(data, position)
        offset, datatype, _count = Struct('<IBI').unpack_from(data, position)
        offsets[name] = offset, datatype
        position += 9
    fields_end = position
    big, point_step, row_step, size = Struct('<BIII').unpack_from(data, position)
    position += 13
    if row_step != width * point_step or size != height * row_step or not point_step:
        return data
    points = np.frombuffer(data, np.uint8, size, position).reshape(-1, point_step)
    points = _somewhere(points, offsets, '>f4' if big else '<f4')
    step = max(1, math.ceil(points.size / max(1.0, most_bytes)))
    points = points[::step]
    dense = data[position + size:position + size + 1]
    return b''.join([
        data[:begin], Struct('<III').pack(1, len(points), count), data[begin + 12:fields_end],
        Struct('<BIII').pack(big, point_step, points.size, points.size), points.tobytes(), dense])


def _somewhere(points: np.ndarray, offsets: 'dict[bytes, Tuple[int, int]]',
               number: str) -> np.ndarray:
    """Return the points with finite coordinates; only float32 coordinates are checked."""
    known = np.ones(len(points), bool)
    for axis in (b'x', b'y', b'z'):
        offset, datatype = offsets.get(axis, (0, 0))
        if datatype == 7 and offset + 4 <= points.shape[1]:  # FLOAT32
            known &= np.isfinite(
                np.ascontiguousarray(points[:, offset:offset + 4]).view(number)[:, 0])
    return points[known]


def _thinned_image(data: bytes, most_bytes: float) -> bytes:
    position = read_text(data, _STAMPED)[1]
    begin = position
    height, width = Struct('<II').unpack_from(data, position)
    encoding, position = read_text(data, position + 8)
    encoding_end = position
    big, row_step, size = Struct('<BII').unpack_from(data, position)
    position += 9
    pixel = _PIXEL_BYTES[encoding.decode()]
    if row_step < width * pixel or size != height * row_step:
        return data
    rows = np.frombuffer(data, np.uint8, size, position).reshape(height, row_step)
    step = max(1, math.ceil(math.sqrt(size / max(1.0, most_bytes))))
    kept = rows[::step, :width * pixel].reshape(-1, width, pixel)[:, ::step]
    return b''.join([
        data[:begin], Struct('<II').pack(*kept.shape[:2]), data[begin + 8:encoding_end],
        Struct('<BII').pack(big, kept.shape[1] * pixel, kept.size), kept.tobytes()])
