# SPDX-License-Identifier: BSD-3-Clause
"""Increasing and decreasing the rate."""
import pytest
from hypothesis import given
from hypothesis import strategies as st

from process_visualizer.playback.timeline import (
    MAX_RATE,
    MAX_REQUESTED_RATE,
    MIN_RATE,
    MIN_REQUESTED_RATE,
    RATES,
    checked_rate,
    faster,
    slower,
)

VALID_RATES = st.floats(MIN_REQUESTED_RATE, MAX_REQUESTED_RATE)


@pytest.mark.parametrize('rate, next_rate', [
    (1.0, 2.0), (0.25, 0.5), (0.7, 1.0), (8.0, 16.0), (16.0, 16.0), (0.01, 0.02),
    (0.001, 0.01), (100.0, 100.0), (-1.0, -2.0), (-16.0, -16.0), (-100.0, -100.0)])
def test_faster(rate, next_rate):
    assert faster(rate) == next_rate


@pytest.mark.parametrize('rate, next_rate', [
    (1.0, 0.5), (0.7, 0.5), (16.0, 8.0), (0.02, 0.01), (0.01, 0.01), (0.015, 0.01),
    (100.0, 16.0), (0.001, 0.001), (-2.0, -1.0), (-0.01, -0.01), (-0.001, -0.001)])
def test_slower(rate, next_rate):
    assert slower(rate) == next_rate


@given(VALID_RATES)
def test_steps_keep_direction_and_bounds(rate):
    assert slower(rate) <= rate <= faster(rate)
    for next_rate in (faster(rate), slower(rate)):
        checked_rate(next_rate)
    assert (faster(-rate), slower(-rate)) == (-faster(rate), -slower(rate))


def test_ladder_spans_what_is_allowed():
    assert (RATES[0], RATES[-1]) == (MIN_RATE, MAX_RATE)
    assert list(RATES) == sorted(set(RATES))
