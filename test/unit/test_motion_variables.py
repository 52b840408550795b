# SPDX-License-Identifier: BSD-3-Clause
"""Lengths, numbers and positions of process variables."""
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from process_visualizer.robot.arrows import (
    MAX_LENGTH_M,
    arrow_feet,
    text_position,
    variable_text,
    variable_vector,
)

AXES = st.tuples(*[st.floats(-1.0, 1.0)] * 3).filter(lambda axis: np.linalg.norm(axis) > 0.1).map(
    lambda axis: axis / np.linalg.norm(axis))


@pytest.mark.parametrize('value, offset, scale, vector', [
    (263, 255.0, 0.01, [0.0, 0.08, 0.0]),
    (245, 255.0, 0.01, [0.0, -0.1, 0.0]),
    (245, 255.0, -0.01, [0.0, 0.1, 0.0]),
    (255, 255.0, 0.01, [0.0, 0.0, 0.0]),
    (1e30, 0.0, 0.0, [0.0, 0.0, 0.0]),
    (1e308, -1e308, 1e10, [0.0, MAX_LENGTH_M, 0.0]),
    (-1e308, 1e308, 1.0, [0.0, -MAX_LENGTH_M, 0.0]),
    (1e308, -1e308, 0.0, [0.0, 0.0, 0.0]),
    (2**64 - 1, 0.0, 1e300, [0.0, MAX_LENGTH_M, 0.0]),
])
def test_arrow(value, offset, scale, vector):
    assert np.allclose(variable_vector(value, offset, scale, (0.0, 1.0, 0.0)), vector)


@pytest.mark.parametrize('value, length_m', [(2.0, 0.2), (90.0, 0.6), (-90.0, -0.6)])
def test_arrow_has_a_longest_length(value, length_m):
    assert np.allclose(variable_vector(value, 0.0, 0.1, (0.0, 1.0, 0.0), 0.6), [0, length_m, 0])


@given(st.floats(-1e6, 1e6), st.floats(-1e6, 1e6), st.floats(-1e-5, 1e-5), AXES)
def test_arrow_is_linear_along_the_axis(value, offset, scale, axis):
    vector = variable_vector(value, offset, scale, axis)
    assert np.dot(vector, axis) == pytest.approx(scale * (value - offset), abs=1e-9)
    assert np.linalg.norm(np.cross(vector, axis)) < 1e-9


@pytest.mark.parametrize('arguments, text', [
    (('feed', 0.0625, 'm/s', 0.0, 3.0), 'feed 0.062 m/s'),
    (('feed', -0.0625, 'm/s', 0.0, 3.0), 'feed -0.062 m/s'),
    (('feed', -0.0001, 'm/s', 0.0, 3.0), 'feed 0.000 m/s'),
    (('upper edge', 263, '', 255.0, 0.003), 'upper edge 263, 8 above 255'),
    (('upper edge', 249, '', 255.0, 0.003), 'upper edge 249, 6 below 255'),
    (('level', 249, '', 255.5, 0.003), 'level 249, 6.5 below 255.5'),
    (('oven', 351.25, '°C', 350.0, 0.01), 'oven 351.2 °C, 1.2 above 350'),
    (('oven', 350.04, '°C', 350.0, 0.01), 'oven 350.0 °C, at 350'),
    (('count', 1013250, '', 1013250.0, 0.01), 'count 1013250, at 1013250'),
    (('gap', 0.0, 'mm', -1.5, 0.01), 'gap 0.00 mm, 1.50 above -1.5'),
    (('oven', 12.34, '°C', 0.0, 0.0), 'oven 12.3 °C'),
    (('', 1013.25, 'hPa', 0.0, 0.0), '1013 hPa'),
    (('oven', 5.34, '°C', 0.0, 0.01), 'oven 5.3 °C'),
    (('oven', 0.53, 'bar', 0.0, 0.0001), 'oven 0.53 bar'),
    (('oven', 0.0, 'bar', 0.0, 0.0), 'oven 0.000 bar'),
    (('door', 1, '', 0.0, 0.1), 'door 1'),
    (('count', 2**64 - 1, '', 0.0, 0.0), 'count 18446744073709551615'),
    (('', 1.5e300, '', 0.0, 0.0), '1.5e+300'),
    (('tiny', 1.2e-5, 'm', 0.0, 1000.0), 'tiny 0.000012 m'),
])
def test_text(arguments, text):
    assert variable_text(*arguments) == text


@given(st.floats(-1e307, 1e307), st.floats(-1e300, 1e300),
       st.floats(-1e300, 1e300))
def test_every_number_has_a_short_text(value, offset, scale):
    text = variable_text('', value, '', offset, scale)
    assert 0 < len(text) < 70
    number = float(text.split()[0].rstrip(','))
    assert number == pytest.approx(value, rel=5e-2, abs=1e-3)  # two digits


@pytest.mark.parametrize('vectors, height', [
    ([(0.5, 0.0, 0.0)], 0.09),
    ([(0.0, 0.0, -0.5)], 0.09),
    ([(0.0, 0.0, 0.3), (0.0, 0.1, 0.0)], 0.39),
    ([(0.0, 0.0, 50.0)], 1.09),
])
def test_text_stands_above_feet_and_tips(vectors, height):
    assert text_position(vectors, 0.1) == pytest.approx((0.0, 0.0, height))


def test_parallel_arrows_in_one_frame_stand_side_by_side():
    feet = arrow_feet([('a', (1, 0, 0)), ('a', (-1, 0, 0)), ('a', (0, 0, 1)), ('b', (1, 0, 0)),
                       ('a', (1, 0, 0))], 0.1)
    assert np.allclose(feet, [(0, -0.1, 0), (0, 0, 0), (0, 0, 0), (0, 0, 0), (0, 0.1, 0)])


@given(AXES, st.integers(2, 5))
def test_no_parallel_arrow_touches_another(axis, count):
    feet = np.array(arrow_feet([('a', axis)] * count, 0.1))
    assert np.allclose(feet.mean(axis=0), 0.0, atol=1e-12)
    apart = np.linalg.norm(np.cross(np.diff(feet, axis=0), axis), axis=1)
    assert np.allclose(apart, 0.1, atol=2e-4)
