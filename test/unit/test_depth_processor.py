# SPDX-License-Identifier: BSD-3-Clause
"""The depth processor's new header on serialised clouds."""
from __future__ import annotations

from io import BytesIO

import pytest
import rospy
from hypothesis import given
from hypothesis import strategies as st
from sensor_msgs.msg import PointCloud2, PointField

from process_visualizer.nodes.depth_processor import SerializedPointCloud2, restamp

UINT32 = st.integers(0, 2**32 - 1)
FRAME_ID = st.text(alphabet='abc_/æ', max_size=20)


def serialize(message: PointCloud2) -> bytes:
    """Return the message as it goes over the wire."""
    buffer = BytesIO()
    message.serialize(buffer)
    return buffer.getvalue()


def make_cloud(frame_id: str, data: bytes = b'') -> PointCloud2:
    """Return a cloud with one field."""
    cloud = PointCloud2(fields=[PointField(name='x', datatype=PointField.FLOAT32)], data=data)
    cloud.header.frame_id = frame_id
    return cloud


@given(seq=UINT32, secs=UINT32, nsecs=st.integers(0, 10**9 - 1), frame_id=FRAME_ID,
       data=st.binary(max_size=100))
def test_changes_only_stamp_and_slashes(seq: int, secs: int, nsecs: int, frame_id: str,
                                        data: bytes) -> None:
    cloud = make_cloud(frame_id, data)
    cloud.header.seq = seq
    cloud.header.stamp = rospy.Time(1, 2)
    restamped = b''.join(restamp(serialize(cloud), lambda _: rospy.Time(secs, nsecs)))
    cloud.header.stamp = rospy.Time(secs, nsecs)
    cloud.header.frame_id = frame_id.lstrip('/')
    assert restamped == serialize(cloud)


def test_is_told_the_stamp() -> None:
    cloud = make_cloud('camera')
    cloud.header.stamp = rospy.Time(12, 34)
    assert b''.join(restamp(serialize(cloud), lambda stamp: stamp)) == serialize(cloud)


def test_the_rest_is_not_copied() -> None:
    message = serialize(make_cloud('camera', b'data'))
    _, rest = restamp(message, lambda stamp: stamp)
    assert rest.obj is message


@pytest.mark.parametrize('size', [0, 15, 16, 21])
def test_rejects_what_is_shorter_than_its_header(size: int) -> None:
    with pytest.raises(ValueError, match=f'^{size} bytes'):
        restamp(serialize(make_cloud('camera'))[:size], lambda stamp: stamp)


def test_serialises_its_parts() -> None:
    buffer = BytesIO()
    SerializedPointCloud2(b'abc', memoryview(b'def')).serialize(buffer)
    assert buffer.getvalue() == b'abcdef'


def test_passes_for_a_point_cloud() -> None:
    for attribute in ('_type', '_md5sum', '_full_text'):
        assert getattr(SerializedPointCloud2, attribute) == getattr(PointCloud2, attribute)
