# SPDX-License-Identifier: BSD-3-Clause
"""Alarms of variables beyond their limits: one per excursion, with the right extreme."""
from __future__ import annotations

from typing import Any, List, Tuple

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from process_visualizer.robot.limit_alarms import (
    BEGIN_S,
    END_S,
    LimitAlarm,
    Limits,
    LimitWatch,
    limit_alarms,
)

LIMITS = Limits(100.0, 200.0)
STEP_S = 0.02


def course(*pieces: Tuple[float, float]) -> Tuple[np.ndarray, np.ndarray]:
    """Times [s] and values of a piecewise constant curve."""
    values = np.concatenate([np.full(round(length_s / STEP_S), value)
                             for length_s, value in pieces])
    return np.arange(len(values)) * STEP_S, values


def alarms(*pieces: Tuple[float, float], limits: Limits = LIMITS) -> Tuple[LimitAlarm, ...]:
    return limit_alarms(limits, *course(*pieces))


def test_a_value_beyond_its_limit() -> None:
    (alarm,) = alarms((1.0, 150.0), (1.0, 210.0), (0.5, 240.0), (0.5, 220.0), (2.0, 150.0))
    assert alarm == pytest.approx((1.0, 3.0, 240.0))


def test_a_value_below_its_limit_until_the_end() -> None:
    (alarm,) = alarms((1.0, 150.0), (1.0, 60.0), (0.5, 50.0))
    assert alarm == pytest.approx((1.0, 2.48, 50.0))


def test_a_short_peak_is_no_alarm() -> None:
    assert alarms((1.0, 150.0), (BEGIN_S - 2 * STEP_S, 900.0), (1.0, 150.0)) == ()


def test_a_value_between_two_alarms_has_to_be_back_for_some_time() -> None:
    beyond = (1.0, 230.0)
    assert len(alarms(beyond, (END_S - 2 * STEP_S, 150.0), beyond)) == 1
    assert len(alarms(beyond, (END_S + 2 * STEP_S, 150.0), beyond)) == 2
    assert len(alarms(beyond, (10.0, 199.0), beyond)) == 1  # just inside is not back


@pytest.mark.parametrize(('limits', 'value'), [
    (Limits(low=100.0), 90.0), (Limits(high=100.0), 110.0)])
def test_one_limit_is_enough(limits: Limits, value: float) -> None:
    (alarm,) = alarms((1.0, 100.0), (1.0, value), (1.0, value), limits=limits)
    assert (alarm.begin_s, alarm.extreme) == (pytest.approx(1.0), value)


def test_noise_at_the_limit_is_one_alarm() -> None:
    noise = np.random.default_rng(1).normal(0.0, 2.0, 20_000)
    assert len(limit_alarms(LIMITS, np.arange(20_000) * STEP_S, 200.0 + noise)) == 1


def test_a_value_holds_until_the_next() -> None:
    assert limit_alarms(LIMITS, np.array([0.0, 1.0, 3.0, 5.0]), np.array(
        [150.0, 250.0, 150.0, 150.0])) == ((1.0, 3.0, 250.0),)


def test_present_alarm_while_values_come() -> None:
    watch = LimitWatch(LIMITS)
    lasting = []
    for time_s, value in zip(*course((0.5, 150.0), (0.5, 250.0), (1.0, 150.0))):
        watch.add(float(time_s), float(value))
        lasting += [time_s] if watch.present else []
    assert (lasting[0], lasting[-1]) == (pytest.approx(0.5 + BEGIN_S),
                                         pytest.approx(1.0 + END_S - STEP_S))
    assert [tuple(it) for it in watch.take_ended()] == [pytest.approx((0.5, 1.0, 250.0))]
    assert watch.take_ended() == ()


def test_nothing_without_values_or_limits() -> None:
    assert limit_alarms(LIMITS, np.empty(0), np.empty(0)) == ()
    assert not Limits().exist
    assert limit_alarms(Limits(), *course((1.0, 1e300))) == ()


@st.composite
def courses(draw: Any) -> Tuple[np.ndarray, np.ndarray]:
    """Times and values around the limits, with gaps."""
    steps = draw(st.lists(st.tuples(st.sampled_from((0.01, 0.1, 0.25, 0.6)), st.sampled_from(
        (50.0, 99.9, 101.0, 104.9, 106.0, 150.0, 197.0, 200.0, 200.1, 260.0))), max_size=80))
    times_s = np.cumsum([step for step, _ in steps])
    return times_s, np.array([value for _, value in steps])


@given(courses())
def test_alarms_are_apart_and_long_with_the_right_extreme(
        given_course: Tuple[np.ndarray, np.ndarray]) -> None:
    times_s, values = given_course
    found = limit_alarms(LIMITS, times_s, values)
    for alarm, following in zip(found, found[1:]):
        assert following.begin_s - alarm.end_s >= END_S - 1e-9
    for alarm in found:
        inside = (times_s >= alarm.begin_s) & (times_s < alarm.end_s)
        assert alarm.end_s - alarm.begin_s >= BEGIN_S
        assert LIMITS.excess(values[inside | (times_s == alarm.end_s) & (values == alarm.extreme)]
                             ).max() == LIMITS.excess(np.array([alarm.extreme]))[0]


@given(courses())
def test_what_is_beyond_for_long_is_in_an_alarm(
        given_course: Tuple[np.ndarray, np.ndarray]) -> None:
    times_s, values = given_course
    found = limit_alarms(LIMITS, times_s, values)
    for row in np.flatnonzero(LIMITS.excess(values) > 0.0):
        if row + 1 < len(values) and times_s[row + 1] - times_s[row] >= BEGIN_S:
            assert any(it.begin_s <= times_s[row] <= it.end_s for it in found)


@given(courses(), st.lists(st.integers(0, 80), max_size=5))
def test_in_pieces_as_in_one_go(given_course: Tuple[np.ndarray, np.ndarray],
                                cuts: List[int]) -> None:
    times_s, values = given_course
    watch = LimitWatch(LIMITS)
    for part_s, part in zip(np.split(times_s, sorted(cuts)), np.split(values, sorted(cuts))):
        watch.add_all(part_s, part)
    last = () if watch.present is None else (watch.present,)
    assert watch.take_ended() + last == limit_alarms(LIMITS, times_s, values)
