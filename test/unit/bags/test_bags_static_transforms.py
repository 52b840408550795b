# SPDX-License-Identifier: BSD-3-Clause
"""Static transforms split and joined, compared with the real messages."""
from __future__ import annotations

from io import BytesIO
from typing import List

import pytest
from geometry_msgs.msg import TransformStamped
from hypothesis import given
from hypothesis import strategies as st
from tf2_msgs.msg import TFMessage

from process_visualizer.bagio.message_layout import MessageDamaged
from process_visualizer.bagio.message_parts import joined, split

names = st.sampled_from(['world', 'base', '/base', 'ur/tool', 'kamera_ä', ''])
transforms = st.tuples(names, names, st.floats(-10, 10))


def message(rows: List[tuple]) -> TFMessage:
    """A message with transforms of (parent, child, x)."""
    result = TFMessage()
    for parent, child, x in rows:
        transform = TransformStamped(child_frame_id=child)
        transform.header.frame_id = parent
        transform.header.stamp.secs = 7
        transform.transform.translation.x = x
        result.transforms.append(transform)
    return result


def serialized(value: TFMessage) -> bytes:
    buffer = BytesIO()
    value.serialize(buffer)
    return buffer.getvalue()


@given(st.lists(transforms, max_size=6))
def test_what_is_taken_apart_and_joined_is_the_same(rows: List[tuple]) -> None:
    data = serialized(message(rows))
    parts = list(split(data))
    assert joined([transform for _, transform in parts]) == data
    assert [child.decode() for child, _ in parts] == [child.lstrip('/') for _, child, _ in rows]


@given(st.lists(transforms, min_size=1, max_size=3), st.data())
def test_damaged_bytes_are_reported(rows: List[tuple], data: st.DataObject) -> None:
    whole = serialized(message(rows))
    cut = data.draw(st.integers(0, len(whole) - 1))
    with pytest.raises(MessageDamaged):
        list(split(whole[:cut]))
    with pytest.raises(MessageDamaged):
        list(split(whole + b'\0'))
    with pytest.raises(MessageDamaged):
        list(split(b'\xff\xff\xff\xff' + whole[4:]))
