# SPDX-License-Identifier: BSD-3-Clause
"""Values read by a definition equal those read by ROS' own classes."""
from __future__ import annotations

import io
from contextlib import suppress
from typing import Any

import pytest
from geometry_msgs.msg import Transform, TransformStamped
from hypothesis import given
from hypothesis import strategies as st
from sensor_msgs.msg import Image, JointState, Temperature
from std_msgs.msg import Float32MultiArray, Header, MultiArrayDimension, MultiArrayLayout
from tf2_msgs.msg import TFMessage

from process_visualizer.bagio.message_definition import DefinitionError, parse_definitions
from process_visualizer.bagio.message_layout import MessageDamaged
from process_visualizer.bagio.message_values import LongArray, Values, message_values

MESSAGES = [
    Temperature(Header(frame_id='ofen/ä'), 21.5, 0.1), JointState(name=['a', 'b'], position=[1, 2]),
    TFMessage([TransformStamped(Header(frame_id='w'), 'c', Transform())]), Image(data=b'0' * 1000),
    Float32MultiArray(MultiArrayLayout([MultiArrayDimension('x', 2, 2)], 0), [0.5, -1.0])]


def data_of(message: Any) -> bytes:
    buffer = io.BytesIO()
    message.serialize(buffer)
    return buffer.getvalue()


def read(message: Any, data: bytes) -> Values:
    return message_values(message._type, parse_definitions(message._type, message._full_text), data)


@pytest.mark.parametrize('message', MESSAGES, ids=lambda it: it._type)
def test_values_are_those_of_the_message(message: Any) -> None:
    compare(read(message, data_of(message)), message)


def compare(values: Values, message: Any) -> None:
    for name in message.__slots__:
        value, expected = values[name], getattr(message, name)
        if hasattr(expected, 'secs'):
            assert tuple(value) == (expected.secs, expected.nsecs)
        elif hasattr(expected, '__slots__'):
            compare(value, expected)
        elif isinstance(value, LongArray):
            assert value.length == len(expected)
        elif isinstance(value, list) and value and isinstance(value[0], dict):
            for one, other in zip(value, expected):
                compare(one, other)
        else:
            assert value == (list(expected) if isinstance(value, list) else expected)


@given(st.sampled_from(MESSAGES), st.data())
def test_damaged_messages_raise_what_they_should(message: Any, data: st.DataObject) -> None:
    good = data_of(message)
    cut = data.draw(st.integers(0, len(good)))
    bad = good[:cut] + data.draw(st.binary(max_size=20))
    with suppress(MessageDamaged):
        read(message, bad)


@pytest.mark.parametrize('definition, reason', [
    ('a/B b', 'is not known'), ('T t', 'contains itself')])
def test_types_that_cannot_be_read(definition: str, reason: str) -> None:
    with pytest.raises(DefinitionError, match=reason):
        message_values('a/T', parse_definitions('a/T', definition), b'')


def test_arrays_of_nothing_end() -> None:
    with pytest.raises(MessageDamaged, match='too long'):
        message_values('a/T', {'a/T': parse_definitions('a/T', 'a/E[] e')['a/T'], 'a/E': []},
                       b'\xff\xff\xff\xff')


NESTED_NOTHING = '''a/E[100] e
uint8 behind
===
MSG: a/E
a/F[100] f
===
MSG: a/F
a/G[100] g
===
MSG: a/G
'''


def test_nested_arrays_of_nothing_end_too() -> None:
    with pytest.raises(MessageDamaged, match='more values than bytes'):
        message_values('a/T', parse_definitions('a/T', NESTED_NOTHING.replace('===', '=' * 80)),
                       b'\0')


def test_many_small_values_are_read() -> None:
    definitions = parse_definitions('a/T', 'a/E[] e\n' + '=' * 80 + '\nMSG: a/E\nuint8 x\n')
    values = message_values('a/T', definitions, b'\x10\x27\0\0' + 10_000 * b'\1')
    assert len(values['e']) == 10_000
