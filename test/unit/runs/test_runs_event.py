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
    assert cycles([1.0, 5.0], [0.5, 3.0, 7.0]) == ((1.0, 3.0, False), (5.0, 7.0, False))


def test_a_cycle_that_was_broken_off_is_one() -> None:
    """It ends with the next beginning, or after the duration of a complete one."""
    assert cycles([1.0, 2.0, 5.0], [4.0]) == ((1.0, 2.0, True), (2.0, 4.0, False))
    assert cycles([1.0, 9.0, 15.0], [12.0]) == ((1.0, 4.0, True), (9.0, 12.0, False))


def test_what_is_shorter_than_a_run_is_none() -> None:
    assert cycles([1.0, 2.0], [1.2, 8.0], 0.5) == ((2.0, 8.0, False),)


def test_a_contact_that_bounces_passes_once() -> None:
    times_s = np.array([0.0, 1.0, 1.012, 1.03, 5.0, 5.02, 5.045, 9.0, 9.02])
    values = np.array([0.0, 1.0, 0.0, 1.0, 0.0, 1.0, 0.0, 1.0, 0.0])
    assert passages_s(times_s, values, 0.5, True, 0.0).tolist() == [1.0, 9.0]  # this is a pulse
    assert passages_s(times_s, values, 0.5, False, 0.0).tolist() == [5.0, 9.02]
    assert passages_s(times_s, values, 0.5, True, 0.0, 0.1).tolist() == [1.0]


@given(st.lists(st.floats(0.0, 100.0), max_size=20), st.lists(st.floats(0.0, 100.0), max_size=20))
def test_cycles_do_not_overlap(begins: 'list[float]', ends: 'list[float]') -> None:
    found = cycles(begins, ends)
    assert all(it.begin_s in begins and it.begin_s <= it.end_s for it in found)
    assert all(it.end_s in ends for it in found if not it.is_broken_off)
    assert all(one.end_s <= other.begin_s for one, other in zip(found, found[1:]))
