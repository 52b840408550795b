# SPDX-License-Identifier: BSD-3-Clause
"""Numbers out of the bytes of a Float32MultiArray."""
import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from process_visualizer.nodes.robot.message_reader import float32_values


def serialized(values, dimensions=(), offset=0):
    """Return the bytes of a message; dimensions are (label, size, stride)."""
    message = struct.pack('<I', len(dimensions))
    for label, size, stride in dimensions:
        text = label.encode()
        message += struct.pack(f'<I{len(text)}sII', len(text), text, size, stride)
    return message + struct.pack(f'<II{len(values)}f', offset, len(values), *values)


dimension = st.tuples(st.text(max_size=8), st.integers(0, 2**32 - 1), st.integers(0, 2**32 - 1))
float32s = st.lists(st.floats(width=32, allow_nan=False), max_size=20)


@given(float32s, st.lists(dimension, max_size=3))
def test_values_come_back(values, dimensions):
    assert float32_values(serialized(values, dimensions)) == tuple(values)


@given(float32s, st.integers(0, 20))
def test_padding_is_left_out(values, offset):
    message = serialized(values, [('joints', len(values), len(values))], min(offset, len(values)))
    assert float32_values(message) == tuple(values[offset:])


@given(st.binary(max_size=200))
def test_other_bytes_are_an_error_or_numbers(message):
    try:
        assert len(float32_values(message)) <= len(message) / 4
    except ValueError as error:
        assert str(error)


@pytest.mark.parametrize('message, problem', [
    (b'', 'cut off'),
    (serialized([1.0, 2.0])[:-1], 'another size'),
    (serialized([1.0]) + b'\0', 'another size'),
    (serialized([1.0], offset=2), 'data_offset'),
    (struct.pack('<I', 2**32 - 1), 'cut off'),
])
def test_wrong_bytes_say_what_is_wrong(message, problem):
    with pytest.raises(ValueError, match=problem):
        float32_values(message)
