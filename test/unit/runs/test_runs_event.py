# SPDX-License-Identifier: BSD-3-Clause
from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from process_visualizer.runs.event import cycles, passages_s

VALUES = st.lists(st.one_of(st.floats(-2.0, 2.0), st.just(float('nan'))), max_size=60)


def passages(values: 'list[float]', hysteresis: float, is_above: bool = True) -> 'list[float]':
    return passages_s(np.arange(len(values), dtype=float), np.array(values, float), 0.5, is_above,
                      hysteresis).tolist()


def test_each_time_that_it_rises() -> None:
    assert passages([0.0, 1.0, 0.4, 1.0], 0.0) == [1.0, 3.0]


def test_noise_at_the_threshold_counts_once() -> None:
    assert passages([0.0, 1.0, 0.4, 1.0, 0.2, 1.0], 0.2) == [1.0, 5.0]


def test_a_number_that_begins_beyond_does_not_pass() -> None:
    assert passages([1.0, 1.0], 0.0) == []


def test_below() -> None:
    assert passages([1.0, 0.0, 1.0, 0.0], 0.0, is_above=False) == [1.0, 3.0]


@given(VALUES, st.floats(0.0, 1.0), st.booleans())
def test_it_is_as_walking_through_the_values(values: 'list[float]', hysteresis: float,
                                             is_above: bool) -> None:
    expected, is_in = [], None
    for time_s, value in enumerate(values):
        beyond = value - 0.5 if is_above else 0.5 - value
        if beyond > 0.0:
            expected += [float(time_s)] if is_in is False else []
            is_in = True
        elif beyond <= -hysteresis:
            is_in = False
    assert passages(values, hysteresis, is_above) == expected


def test_cycles_from_each_begin_to_the_next_end() -> None:
    assert cycles([1.0, 5.0], [0.5, 3.0, 7.0]) == ((1.0, 3.0), (5.0, 7.0))


def test_a_cycle_that_was_broken_off_is_left_out() -> None:
    assert cycles([1.0, 2.0, 5.0], [3.0]) == ((2.0, 3.0),)


@given(st.lists(st.floats(0.0, 100.0), max_size=20), st.lists(st.floats(0.0, 100.0), max_size=20))
def test_cycles_do_not_overlap(begins: 'list[float]', ends: 'list[float]') -> None:
    found = cycles(begins, ends)
    assert all(begin in begins and end in ends and begin <= end for begin, end in found)
    assert all(one[1] <= other[0] for one, other in zip(found, found[1:]))
