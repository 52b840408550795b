# SPDX-License-Identifier: BSD-3-Clause
"""The scale of a curve: it contains the values, has tidy ticks, and seldom changes."""
from __future__ import annotations

import math
from typing import List, Tuple

import numpy as np
import pytest
from hypothesis import assume, example, given
from hypothesis import strategies as st

from process_visualizer.curves.value_scale import (
    EMPTY_SCALE,
    MAX_TICKS,
    ValueScale,
    tick_texts,
    tidy_scale,
    with_near_limits,
)

NAN = float('nan')


@st.composite
def ends(draw: st.DrawFn) -> Tuple[float, float]:
    """The least and the greatest value, of any size and distance."""
    size = 10.0 ** draw(st.integers(-250, 250))
    values = draw(st.tuples(*[st.floats(-1.0, 1.0)] * 2))
    return min(values) * size, max(values) * size


@given(ends())
@example((1e15, 1e15 + 1.0))
@example((-1.7e308, 1.7e308))
@example((0.0, 5e-324))
def test_any_values_are_within_the_bounds(values: Tuple[float, float]) -> None:
    scale = tidy_scale(*values)
    low, high = (min(max(value, -1e300), 1e300) for value in values)
    tolerance = 1e-9 * scale.span
    assert scale.low <= low + tolerance and high - tolerance <= scale.high
    assert 2 <= len(scale.ticks) <= MAX_TICKS


@given(ends())
def test_ticks_are_multiples_of_1_2_or_5_and_within_the_bounds(
        values: Tuple[float, float]) -> None:
    scale = tidy_scale(*values)
    digit = scale.step / 10.0 ** math.floor(math.log10(scale.step) + 1e-9)
    assert round(digit, 6) in (1.0, 2.0, 5.0)
    counts = np.array(scale.ticks) / scale.step
    np.testing.assert_allclose(counts, np.round(counts), rtol=1e-9)
    assert np.all(np.diff(np.round(counts)) == 1)
    assert scale.low <= scale.ticks[0] and scale.ticks[-1] <= scale.high


@given(ends())
def test_the_values_fill_much_of_the_scale(values: Tuple[float, float]) -> None:
    low, high = values
    assume(high - low > 1e-6 * max(abs(low), abs(high)) and high - low > 1e-280)
    scale = tidy_scale(low, high)
    shown = max(high, 0.0) - min(low, 0.0) if scale.low <= 0.0 <= scale.high else high - low
    assert shown >= 0.39 * scale.span


@given(ends())
def test_the_same_values_have_the_same_scale(values: Tuple[float, float]) -> None:
    scale = tidy_scale(*values)
    assert tidy_scale(*values) == scale
    assert tidy_scale(*values, before=scale) == scale


@given(st.lists(st.floats(-0.02, 0.02), min_size=2, max_size=40), st.floats(0.5, 100.0))
def test_slow_changes_hardly_change_the_scale(noise: List[float], high: float) -> None:
    """In any order of values that differ by a few percent: at most two changes."""
    scales, scale = [], None
    for part in noise:
        scale = tidy_scale(0.0, high * (1.0 + part), before=scale)
        scales.append(scale)
    assert sum(one != other for one, other in zip(scales, scales[1:])) <= 2


@pytest.mark.parametrize('low, high, bounds, texts', [
    (0.0, 19.8, (0.0, 20.0), ['0', '10', '20']),
    (19.6, 20.0, (19.6, 20.0), ['19.6', '19.8', '20.0']),
    (0.01, 0.3, (0.0, 0.3), ['0.0', '0.2']),
    (254.0, 273.0, (250.0, 275.0), ['250', '260', '270']),
    (-20.0, -3.0, (-20.0, 0.0), ['−20', '−10', '0']),
    (-3.0, 10.0, (-5.0, 10.0), ['0', '10']),
    (1e8, 3e8, (0.0, 3e8), ['0', '2e8']),
    (1e-7, 3e-7, (0.0, 3e-7), ['0', '2e−7']),
    (-1e300, 1e300, (-1e300, 1e300), ['−1e300', '0', '1e300'])])
def test_tidy_numbers(low: float, high: float, bounds: Tuple[float, float],
                      texts: List[str]) -> None:
    scale = tidy_scale(low, high)
    assert (scale.low, scale.high) == bounds
    assert list(tick_texts(scale)) == texts


@given(ends())
def test_the_numbers_at_the_ticks_differ(values: Tuple[float, float]) -> None:
    low, high = values
    assume(high - low > 1e-6 * max(abs(low), abs(high)))
    scale = tidy_scale(low, high)
    texts = tick_texts(scale)
    assert len(set(texts)) == len(scale.ticks)
    for text, tick in zip(texts, scale.ticks):
        assert float(text.replace('−', '-')) == pytest.approx(tick, rel=1e-9)


@pytest.mark.parametrize('value, bounds', [
    (5.0, (0.0, 7.5)), (-5.0, (-7.5, 0.0)), (0.0, (0.0, 1.0)), (254.0, (0.0, 400.0))])
def test_a_constant_or_a_single_sample_is_shown_with_zero(
        value: float, bounds: Tuple[float, float]) -> None:
    scale = tidy_scale(value, value)
    assert (scale.low, scale.high) == bounds


@pytest.mark.parametrize('low, high', [(NAN, NAN), (NAN, 1.0), (-math.inf, 3.0)])
def test_without_values_the_scale_stays(low: float, high: float) -> None:
    before = tidy_scale(3.0, 20.0)
    assert tidy_scale(low, high) == EMPTY_SCALE
    assert tidy_scale(low, high, before=before) == before


def test_a_scale_changes_when_the_values_leave_it_or_need_little_of_it() -> None:
    before = tidy_scale(0.0, 20.0)
    assert tidy_scale(0.0, 20.1, before=before).high > 20.0
    assert tidy_scale(12.0, 19.0, before=before) == before
    assert tidy_scale(19.6, 20.0, before=before) == tidy_scale(19.6, 20.0)


def test_a_wiggle_too_small_to_matter_does_not_fill_the_scale() -> None:
    scale: ValueScale = tidy_scale(10.0, 10.001, least_span=0.2)
    assert scale.span >= 0.2 and scale.low < 10.0 < 10.001 < scale.high


@pytest.mark.parametrize('limits, expected', [
    ((), (2.0, 4.0)), ((5.0,), (2.0, 5.0)), ((5.1, 1.0), (1.0, 4.0)), ((3.0,), (2.0, 4.0))])
def test_limits_are_shown_if_they_are_near(limits: Tuple[float, ...],
                                           expected: Tuple[float, float]) -> None:
    assert with_near_limits(2.0, 4.0, limits) == expected
