# SPDX-License-Identifier: BSD-3-Clause
"""Lengths, numbers and positions of arrows."""
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from process_visualizer.robot import arrows


@pytest.mark.parametrize('magnitude, length', [
    (0.0, 0.05), (0.01, 0.05), (0.05, 0.15), (0.1, 0.3), (1.0, 0.4), (float('inf'), 0.4)])
def test_length_is_linear_within_limits(magnitude, length):
    assert arrows.arrow_length(magnitude, 3.0, 0.05, 0.4) == pytest.approx(length)


@pytest.mark.parametrize('arguments, text', [
    (('v', 0.0516, 'm/s', 3), 'v 0.052 m/s'),
    (('F', 12.345, 'N', 1), 'F 12.3 N'),
    (('upper edge', 263.0, '', 0), 'upper edge 263'),
    (('', -0.0001, 'm/s', 3), '0.000 m/s'),
])
def test_numbers_are_written_with_label_and_unit(arguments, text):
    assert arrows.format_value(*arguments) == text


def test_age():
    assert arrows.format_age('v', 3.24) == 'v no data for 3.2 s'
    assert arrows.format_age('', 3.24) == 'no data for 3.2 s'


def test_blocks_of_lines_do_not_overlap():
    assert arrows.line_of_block('v', 0, 2).split('\n') == ['v', ' ']
    assert arrows.line_of_block('F', 1, 2).split('\n') == [' ', 'F']


def test_label_at_the_axis_of_the_base():
    offset = arrows.label_offset((0.0, 0.0, 1.0), 0.1, 0.2)
    assert np.allclose(offset, [0.1, 0.0, 0.2])


@given(st.tuples(*[st.floats(-2.0, 2.0)] * 3))
def test_label_stands_outward_and_up_from_the_tool(position):
    offset = arrows.label_offset(position, 0.12, 0.14)
    assert offset[2] == pytest.approx(0.14)
    assert np.hypot(*offset[:2]) == pytest.approx(0.12)
    distance = np.hypot(*position[:2])
    if distance > 1e-3:
        assert np.dot(offset[:2], position[:2]) == pytest.approx(0.12 * distance)
