# SPDX-License-Identifier: BSD-3-Clause
"""Small clouds as messages, and as a live page decodes them."""
from __future__ import annotations

import io
from struct import unpack_from
from typing import Tuple

import numpy as np
from sensor_msgs.msg import PointCloud2, PointField

KIND = np.dtype([('x', 'f4'), ('y', 'f4'), ('z', 'f4'), ('pad', 'f4'), ('rgb', 'u4')])


def cloud(points: np.ndarray, rgb: bool = True, is_big: bool = False) -> bytes:
    kind = KIND.newbyteorder('>') if is_big else KIND
    message = PointCloud2(height=1, width=len(points), is_bigendian=is_big, is_dense=False,
                          point_step=kind.itemsize, row_step=kind.itemsize * len(points))
    message.header.frame_id = '/camera'
    names = ('x', 'y', 'z', 'rgb') if rgb else ('x', 'y', 'z')
    message.fields = [PointField(it, KIND.fields[it][1], 7, 1) for it in names]
    message.data = points.astype(kind).tobytes()
    buffer = io.BytesIO()
    message.serialize(buffer)
    return buffer.getvalue()


def line(count: int) -> np.ndarray:
    points = np.zeros(count, KIND)
    points['x'] = np.arange(count) / 100.0
    points['z'] = 2.0
    points['rgb'] = 0x102030
    return points


def read(data: bytes) -> Tuple[float, np.ndarray, np.ndarray]:
    kind, _, count, time_s, *box = unpack_from('<BxHId6f', data)
    assert kind == 3
    steps = np.frombuffer(data, '<u2', 3 * count, 40).reshape(-1, 3)
    colors = np.frombuffer(data, np.uint8, 3 * count, 40 + 6 * count).reshape(-1, 3)
    return time_s, np.array(box[:3]) + steps / 65535 * np.array(box[3:]), colors
