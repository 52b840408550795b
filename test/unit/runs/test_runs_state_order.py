# SPDX-License-Identifier: BSD-3-Clause
from __future__ import annotations

import pytest

from process_visualizer.runs.deviation.state_order import StateOrder
from process_visualizer.runs.series import States

GOOD = States((10.0, 40.0, 50.0), (0.0, 2.0, 4.0))


def test_a_state_is_called_by_its_name() -> None:
    order = StateOrder([GOOD] * 5, {40.0: 'tighten'})
    fault = order.fault(States((10.0, 50.0), (0.0, 4.0)), 6.0)
    assert fault is not None and fault.words == '40 (tighten) is missing'


def test_what_came_before_the_first_message_is_not_missing() -> None:
    """In the first run of a recording the state at its beginning is unknown."""
    order = StateOrder([GOOD] * 5, {})
    assert order.fault(States((40.0, 50.0), (2.0, 4.0)), 6.0) is None


def test_messages_that_end_say_nothing_of_what_came_then() -> None:
    order = StateOrder([GOOD] * 5, {})
    assert order.fault(States((10.0, 40.0), (0.0, 2.0), until_s=3.0), 6.0) is None


def test_a_number_that_is_another_one_in_each_run_is_not_judged() -> None:
    order = StateOrder([States((float(number),), (0.0,)) for number in range(6)], {})
    assert order.fault(States((77.0,), (0.0,)), 6.0) is None


@pytest.mark.parametrize('good, bad, is_told', [(8, 2, True), (6, 2, False), (16, 4, False)])
def test_two_of_ten_good_runs_with_another_order_are_none(good: int, bad: int,
                                                          is_told: bool) -> None:
    """More runs that agree are a variant of the process."""
    wrong = States((10.0, 99.0, 50.0), (0.0, 2.0, 4.0))
    order = StateOrder([*[GOOD] * good, *[wrong] * bad], {})
    assert order.outliers() == ({row: '99 instead of 40' for row in range(good, good + bad)}
                                   if is_told else {})


@pytest.mark.parametrize('good', [1, 6])
def test_a_counter_that_goes_on_in_each_run_is_no_wrong_state(good: int) -> None:
    order = StateOrder([States((float(it), it + 1.0), (0.0, 4.0)) for it in range(good)], {})
    assert order.fault(States((70.0, 71.0), (0.0, 4.0)), 6.0) is None
    assert order.fault(States((70.0, 72.0), (0.0, 4.0)), 6.0) is not None


@pytest.mark.parametrize(('values', 'times_s', 'words', 'since_s'), [
    ((0, 1, 0, 1, 0), (0.0, 6.0, 14.7, 15.0, 23.5), '0 and 1 occur once too often', 14.7),
    ((0, 1, 0, 1, 0), (0.0, 2.0, 2.3, 6.0, 23.5), '1 and 0 occur once too often', 2.0),
    ((0, 1, 0, 1, 0), (0.0, 6.0, 23.5, 25.0, 25.3), '1 and 0 occur once too often', 25.0)])
def test_of_a_bit_that_toggles_once_more_the_times_show_which_toggle(
        values: 'tuple[float, ...]', times_s: 'tuple[float, ...]', words: str, since_s: float
        ) -> None:
    good = [States((0.0, 1.0, 0.0), (0.0, 6.0 + late_s, 23.5 - late_s), 30.0)
            for late_s in (0.0, 0.1, 0.2)]
    fault = StateOrder(good, {}).fault(States(values, times_s, 30.0), 30.0)
    assert fault is not None
    assert fault.words == words and fault.since_s == pytest.approx(since_s)


def test_of_a_bit_that_toggles_too_seldom_the_times_show_which_is_missing() -> None:
    good = [States((0.0, 1.0, 0.0, 1.0, 0.0), (0.0, 6.0, 7.0, 16.0 + late_s, 17.0), 30.0)
            for late_s in (0.0, 0.1, 0.2)]
    order = StateOrder(good, {})
    first = order.fault(States((0.0, 1.0, 0.0), (0.0, 16.0, 17.0), 30.0), 30.0)
    last = order.fault(States((0.0, 1.0, 0.0), (0.0, 6.0, 7.0), 30.0), 30.0)
    assert first is not None and first.since_s == pytest.approx(6.0)
    assert last is not None and last.since_s == pytest.approx(16.1)
