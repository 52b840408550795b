# SPDX-License-Identifier: BSD-3-Clause
"""Messages that arrive together after a silence were delayed."""
from __future__ import annotations

from typing import List

import numpy as np
import pytest

from process_visualizer.robot.late_arrivals import LateArrivals
from process_visualizer.robot.measuring_time import certain_rows, measuring_times
from process_visualizer.robot.recorded_velocity import speeds

STEADY_S = [0.1 * it for it in range(100)]


def late_of(times_s: List[float], part: int) -> List[bool]:
    arrivals, late = LateArrivals(), []
    for begin in range(0, len(times_s), part):
        times_ns = np.round(np.array(times_s[begin:begin + part]) * 1e9).astype(np.int64) + 1
        late += arrivals.find(times_ns).tolist()
    return late


@pytest.mark.parametrize('part', [1, 2, 7, 1000])
def test_a_bunch_after_a_silence_was_held_up(part: int) -> None:
    bunch_s = [20.0 + 1e-4 * it + (0.05 if it > 30 else 0.0) for it in range(100)]  # uneven steps
    after_s = [20.2 + 0.1 * it for it in range(50)]
    late = late_of([*STEADY_S, *bunch_s, *after_s], part)
    assert not any(late[:100]) and not any(late[207:])
    assert all(late[102:200])
    assert all(late[100:102]) or part in (1, 2)  # a few messages are not recognized as a bunch


def test_a_long_bunch_may_have_pauses() -> None:
    """A recorder that stood still for 13 s read what had waited for it with pauses of 0.3 s."""
    bunch_s = [20.0 + 1e-4 * it + 0.3 * (it // 40) for it in range(130)]
    late = late_of([*STEADY_S, *bunch_s, *(22.0 + 0.1 * it for it in range(50))], 1000)
    assert all(late[100:230]) and not any(late[235:])


def test_the_first_messages_after_a_silence_may_be_old() -> None:
    times_s = [*(0.01 * it for it in range(300)), *(20.0 + 0.01 * it for it in range(100))]
    late = late_of(times_s, 7)
    assert [row for row, is_late in enumerate(late) if is_late] == list(range(300, 350))


@pytest.mark.parametrize(('since_s', 'count'), [(18.0, 20), (19.5, 0)])
def test_a_part_may_begin_in_a_silence(since_s: float, count: int) -> None:
    late = LateArrivals(0.01, round(1e9 * since_s)).find(
        np.round(1e9 * (20.0 + 0.01 * np.arange(50))).astype(np.int64))
    assert late.tolist() == [True] * count + [False] * (50 - count)


@pytest.mark.parametrize('times_s', [
    [*STEADY_S, *(9.95 + 1e-4 * it for it in range(20)), 10.5],  # no silence before
    [begin_s + 1e-3 * it for begin_s in range(0, 50, 5) for it in range(20)],  # it sends in bursts
    [0.0, 20.0, 20.001, 20.002],  # the usual interval is unknown
    [0.0]])
def test_what_else_comes_fast_was_not(times_s: List[float]) -> None:
    assert not any(late_of(times_s, 7))


PERIOD_S, SPEED_M_S = 0.008, 0.3


def starved(measured_s: np.ndarray, lost: bool) -> 'tuple[np.ndarray, np.ndarray]':
    """Return which messages of a driver arrive, and when, if the recorder is starved for 0.5 s.

    It gets some messages at a time. Meanwhile the driver's queue overflows if some are ``lost``.
    """
    arrival_s = measured_s + 0.001
    for begin_s, end_s in ((5.0, 5.09), (5.09, 5.13), (5.13, 5.3), (5.3, 5.5)):
        waits = (measured_s > begin_s) & (measured_s <= end_s)
        arrival_s[waits] = end_s + 1e-5 * np.arange(waits.sum())
    is_lost = lost & (measured_s > 5.14) & (measured_s < 5.23)
    return ~is_lost, arrival_s


@pytest.mark.parametrize('lost', [False, True])
def test_a_speed_is_that_of_the_tool_although_messages_came_late(lost: bool) -> None:
    """The measuring times of messages next to lost ones are unknown."""
    measured_s = PERIOD_S * np.arange(1250)
    arrives, arrival_s = starved(measured_s, lost)
    x = SPEED_M_S * measured_s[arrives]
    positions = np.column_stack((x, np.zeros((len(x), 2))))
    arrival_s = arrival_s[arrives]
    stamps_s = np.full(len(x), np.nan)
    rows = certain_rows(arrival_s, stamps_s)
    _, found = speeds(measuring_times(arrival_s, stamps_s)[rows], positions[rows])
    assert found == pytest.approx(SPEED_M_S, rel=0.06)
    assert rows.all() or lost
    late = (arrival_s > 5.0) & (arrival_s < 5.6)
    assert rows[~late].all()


def test_what_is_sent_when_it_changes_is_never_late() -> None:
    random = np.random.default_rng(3)
    arrival_s = np.cumsum(random.exponential(0.02, 2000))
    assert certain_rows(arrival_s, np.full(2000, np.nan)).all()
    pairs_s = np.sort(np.concatenate((0.04 * np.arange(500), 0.04 * np.arange(500) + 1e-4)))
    assert certain_rows(pairs_s, np.full(1000, np.nan)).all()


@pytest.mark.parametrize('periods_s', [(0.05, 0.008, 0.05), (0.008, 0.05, 0.008)])
def test_a_driver_that_sends_less_often_at_times_is_not_late(
        periods_s: 'tuple[float, float, float]') -> None:
    begins_s = (0.0, 8.0, 13.0, 20.0)
    measured_s = np.concatenate([np.arange(begin_s, end_s, period_s) for begin_s, end_s, period_s
                                 in zip(begins_s, begins_s[1:], periods_s)])
    arrival_s = measured_s + np.random.default_rng(4).uniform(0.0, 0.003, len(measured_s))
    assert certain_rows(arrival_s, np.full(len(arrival_s), np.nan)).all()


def test_a_starved_driver_that_skips_messages_and_sends_others_late_has_no_known_times() -> None:
    """Nothing arrived in bunches: late messages were skipped. The steps were recorded."""
    steps_ms = (8, 8, 15, 2, 15, 16, 22, 90, 28, 40, 8, 8)
    before, after = np.arange(0.0, 5.0, PERIOD_S), PERIOD_S * np.arange(1, 500)
    starved_s = before[-1] + np.cumsum(steps_ms) / 1e3
    arrival_s = np.concatenate((before, starved_s, starved_s[-1] + after))
    rows = certain_rows(arrival_s, np.full(len(arrival_s), np.nan))
    assert not rows[(arrival_s > 5.14) & (arrival_s < 5.25)].any()
    assert rows[arrival_s < 5.0].all() and rows[arrival_s > 5.5].all()


def test_two_and_a_half_periods_that_are_lost_make_times_unknown() -> None:
    """A good run was 2.3 mm behind: three poses were skipped, and four arrived together."""
    measured_s = PERIOD_S * np.arange(1250)
    arrival_s = measured_s + 0.001
    waits = (measured_s > 5.0) & (measured_s <= 5.066)
    arrival_s[waits] = 5.067 + 1e-5 * np.arange(waits.sum())
    arrives = ~((measured_s > 5.01) & (measured_s < 5.035))
    assert np.count_nonzero(~arrives) == 3
    rows = certain_rows(arrival_s[arrives], np.full(np.count_nonzero(arrives), np.nan))
    assert not rows[waits[arrives]].all()
