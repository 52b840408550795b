# SPDX-License-Identifier: BSD-3-Clause
"""Large clouds and images are thinned for a slow connection; the rest is unchanged."""
from __future__ import annotations

from io import BytesIO
from typing import Any, Dict, List

import numpy as np
import pytest
from sensor_msgs.msg import Image, PointCloud2, PointField
from std_msgs.msg import Float64MultiArray, Header

from process_visualizer.remote.thinning import CLOUD, IMAGE, thinned

HEADER = Header(frame_id='camera_optical')


def written(message: Any) -> bytes:
    buffer = BytesIO()
    message.serialize(buffer)
    return buffer.getvalue()


def cloud(count: int, order: str = '<', depth: str = 'f4') -> PointCloud2:
    """A cloud with numbered x; of every three points, one has no depth and one no x."""
    rows = np.zeros(count, np.dtype([('x', order + 'f4'), ('z', order + depth), ('pad', 'u1')]))
    rows['x'] = np.where(np.arange(count) % 3 == 2, np.inf, np.arange(count))
    rows['z'] = np.where(np.arange(count) % 3 == 1, np.nan, 1.5)
    kind = PointField.FLOAT32 if depth == 'f4' else PointField.FLOAT64
    fields = [PointField('x', 0, PointField.FLOAT32, 1), PointField('z', 4, kind, 1)]
    size = rows.dtype.itemsize
    return PointCloud2(HEADER, 1, count, fields, order == '>', size, size * count,
                       rows.tobytes(), True)


def image(encoding: str, kind: str, channels: int, padding: int = 0) -> Image:
    """An image of 40 rows and 30 columns; all pixels differ."""
    pixels = np.arange(40 * 30 * channels).astype(kind).reshape(40, -1)
    rows = np.hstack((pixels.view(np.uint8), np.full((40, padding), 255, np.uint8)))
    return Image(HEADER, 40, 30, encoding, 0, rows.shape[1], rows.tobytes())


@pytest.mark.parametrize('order', ['<', '>'])
def test_points_that_are_kept_are_whole_and_measured(order: str) -> None:
    sent = cloud(900, order)
    slim = PointCloud2().deserialize(thinned(CLOUD, written(sent), 2000))
    rows = np.frombuffer(slim.data, np.dtype([('x', order + 'f4'), ('z', order + 'f4'),
                                              ('pad', 'u1')]))
    assert len(slim.data) == slim.row_step <= 2000 and (slim.height, slim.width) == (1, len(rows))
    assert (slim.header, slim.fields, slim.point_step) == (sent.header, sent.fields, 9)
    assert (rows['z'] == 1.5).all()
    assert rows['x'].tolist() == list(range(0, 900, 3))[::2]


def test_depths_of_another_type_are_kept_as_they_are() -> None:
    slim = PointCloud2().deserialize(thinned(CLOUD, written(cloud(900, depth='f8')), 2000))
    assert 0 < len(slim.data) <= 2000 and slim.width * slim.point_step == len(slim.data)


@pytest.mark.parametrize(('encoding', 'kind', 'channels', 'padding'), [
    ('mono8', 'u1', 1, 0), ('16UC1', 'u2', 1, 4), ('32FC1', 'f4', 1, 0), ('bgr8', 'u1', 3, 2),
    ('rgba8', 'u1', 4, 0)])
def test_rows_and_columns_are_left_out(encoding: str, kind: str, channels: int,
                                       padding: int) -> None:
    sent = image(encoding, kind, channels, padding)
    slim = Image().deserialize(thinned(IMAGE, written(sent), len(sent.data) / 3.9))
    assert (slim.height, slim.width, slim.encoding) == (20, 15, encoding)
    assert (slim.header, slim.step * slim.height) == (sent.header, len(slim.data))
    whole = np.arange(40 * 30 * channels).astype(kind).reshape(40, 30, channels)
    assert np.array_equal(np.frombuffer(slim.data, kind).reshape(20, 15, channels),
                          whole[::2, ::2])


def test_what_is_small_or_of_another_kind_is_unchanged() -> None:
    small, numbers = written(cloud(9)), written(Float64MultiArray(data=[0.0] * 999))
    assert thinned(CLOUD, small, 2000) == small
    assert thinned('std_msgs/Float64MultiArray', numbers, 100) == numbers


@pytest.mark.parametrize('change', [
    {'row_step': 1}, {'point_step': 0, 'row_step': 0}, {'width': 0xffffffff}, {'data': b'abc'}])
def test_a_cloud_that_contradicts_itself_is_unchanged(change: Dict[str, Any]) -> None:
    sent = cloud(900)
    for name, value in change.items():
        setattr(sent, name, value)
    data = written(sent)
    assert thinned(CLOUD, data, 20) == data


@pytest.mark.parametrize('change', [
    {'encoding': 'bayer_rggb8'}, {'encoding': 'jpeg\xe9'}, {'step': 1}, {'height': 0xffffffff},
    {'data': b'abc'}])
def test_an_image_that_contradicts_itself_is_unchanged(change: Dict[str, Any]) -> None:
    sent = image('rgb8', 'u1', 3)
    for name, value in change.items():
        setattr(sent, name, value)
    data = written(sent)
    assert thinned(IMAGE, data, 20) == data


def test_a_message_that_is_cut_off_is_unchanged() -> None:
    whole: List[bytes] = [written(cloud(900)), written(image('rgb8', 'u1', 3))]
    for kind, data in zip((CLOUD, IMAGE), whole):
        for end in (2, 14, 30, 60, 200):
            assert thinned(kind, data[:end], 1) == data[:end]
