# SPDX-License-Identifier: BSD-3-Clause
"""Signals of a running cell that are out of the band, and since when."""
from __future__ import annotations

from typing import List, Optional, Tuple

import numpy as np
import pytest
from made_runs import made_run, progress

from process_visualizer.runs.comparison.good_runs import GoodRuns
from process_visualizer.runs.comparison.live_comparison import (
    LiveComparison,
    LiveDeparture,
    _lacks_values,
    beyond_text,
    departure_text,
)
from process_visualizer.runs.deviation.band import SignalBand, widened
from process_visualizer.runs.deviation.departures import outside_since
from process_visualizer.runs.deviation.signals import RATE_HZ, Signal, SignalKind

KEY = ('robot', 'tool force')
FORCE = Signal(*KEY, 'N', SignalKind.FORCE)
EPOCH_S = 1_700_000_000.0
START_S = 2.0
"""Time at which the process of a synthetic run begins."""


@pytest.fixture(scope='module')
def learned() -> LiveComparison:
    """The band of 40 good runs."""
    return LiveComparison(GoodRuns(made_run(0), [made_run(seed) for seed in range(1, 41)]))


def window(now_s: float, extra_n: float = 0.0, from_s: float = np.inf, until_s: float = np.inf,
           seed: int = 99, late_s: float = 0.0) -> Tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Times, forces and reference moments of a run up to a moment of the reference [s].

    The phase is found ``late_s`` too late; from ``from_s`` on, the force is greater.
    """
    reference_s = np.arange(0.0, now_s, 1.0 / RATE_HZ)
    values = 10.0 * progress(reference_s - START_S)
    values += 0.05 * np.random.default_rng(seed).standard_normal(len(values))
    values[(reference_s >= from_s) & (reference_s < until_s)] += extra_n
    return EPOCH_S + reference_s, values, reference_s - late_s


def departure(comparison: LiveComparison, now_s: float, extra_n: float = 0.0,
              from_s: float = np.inf, until_s: float = np.inf) -> Optional[LiveDeparture]:
    times_s, values, reference_s = window(now_s, extra_n, from_s, until_s)
    found = comparison.departures(times_s, {KEY: values}, reference_s)
    return found[0] if found else None


def test_a_good_run_stays_within_even_if_its_moment_is_found_a_little_late(
        learned: LiveComparison) -> None:
    alarms = 0
    for seed in range(100, 120):
        times_s, values, reference_s = window(12.5, seed=seed, late_s=0.05)
        alarms += any(learned.departures(times_s[:end], {KEY: values[:end]}, reference_s[:end])
                      for end in range(50, len(times_s), 10))
    assert alarms <= 3


def test_a_departure_whose_values_stop_is_lost_and_not_over(learned: LiveComparison) -> None:
    times_s, values, reference_s = window(9.0, 3.0, from_s=6.0)
    for stopped_s, is_lost in ((8.5, False), (7.0, True)):
        known = np.where(reference_s < stopped_s, values, np.nan)
        assert bool(learned.departures(times_s, {KEY: known}, reference_s)) is not is_lost
        assert (KEY in learned.lost(times_s, {KEY: known})) is is_lost
    assert KEY in learned.lost(times_s, {})
    over = np.where(reference_s < 7.0, values, values - 3.0)
    assert not learned.departures(times_s, {KEY: over}, reference_s)
    assert KEY not in learned.lost(times_s, {KEY: over})


@pytest.mark.parametrize('extra_n', [3.0, -3.0])
def test_what_is_out_is_told_with_how_far_and_since_when(learned: LiveComparison,
                                                         extra_n: float) -> None:
    found = departure(learned, 8.0, extra_n, from_s=6.0)
    assert found is not None and found.signal == FORCE
    assert found.since_s - EPOCH_S == pytest.approx(6.0, abs=0.1)
    assert 2.0 < abs(found.beyond) < 3.0 and np.sign(found.beyond) == np.sign(extra_n)
    side = 'above' if extra_n > 0.0 else 'below'
    assert departure_text(found, EPOCH_S + 8.0) == (
        f'robot tool force {f"{found.beyond:+.2g}".replace("-", "−")} N {side} range for '
        f'{EPOCH_S + 8.0 - found.since_s:.1f} s')
    assert beyond_text(found).endswith(f'N {side} range')


def test_what_is_back_is_told_no_longer_and_a_moment_not_at_all(learned: LiveComparison) -> None:
    assert departure(learned, 8.0, 3.0, 6.0, until_s=7.5) is None
    assert departure(learned, 8.0, 3.0, from_s=7.9) is None
    back = departure(learned, 8.0, 3.0, 6.0, until_s=7.96)
    assert back is not None, 'it may swing back for a moment'


def test_what_came_and_went_between_two_judgments_counts_once(learned: LiveComparison) -> None:
    """On a busy computer a late feed of 0.35 s was in range, though its curve was red."""
    def passed(since_s: float, until_s: float = 6.35) -> List[float]:
        times_s, values, reference_s = window(8.0, 3.0, from_s=6.0, until_s=until_s)
        return [it.since_s - EPOCH_S for it in learned.passed(
            times_s, {KEY: values}, reference_s, EPOCH_S + since_s)]
    assert passed(5.0) == pytest.approx([6.0], abs=0.1)
    assert passed(6.2) == pytest.approx([6.0], abs=0.1)
    assert passed(6.5) == passed(5.0, until_s=6.1) == passed(5.0, until_s=7.9) == []


def test_what_passed_before_its_moment_was_known_counts_when_that_comes(
        learned: LiveComparison) -> None:
    """On a busy computer the moments of the reference came a second late."""
    times_s, values, reference_s = window(8.0, 3.0, from_s=6.0, until_s=6.35)
    late = np.where(times_s > EPOCH_S + 5.9, np.nan, reference_s)
    since_s = learned.judged_until_s(times_s, late)
    assert since_s == pytest.approx(EPOCH_S + 5.9, abs=0.05)
    assert not learned.passed(times_s, {KEY: values}, late, EPOCH_S)
    assert len(learned.passed(times_s, {KEY: values}, reference_s, since_s)) == 1


def test_moments_that_stay_unknown_are_not_judged(learned: LiveComparison) -> None:
    times_s, values, reference_s = window(9.0)
    reference_s[(reference_s > 4.0) & (reference_s < 5.0)] = np.nan
    found = learned.unjudged_s(times_s, {KEY: values}, reference_s, EPOCH_S)
    assert found == {'anything': pytest.approx(1.0, abs=0.1)}
    for by_s in (4.5, 0.8):  # another run, which begins anywhere
        other_s = reference_s - by_s * (times_s > EPOCH_S + 4.5)
        assert not learned.unjudged_s(times_s, {KEY: values}, other_s, EPOCH_S)


def test_moments_at_which_the_motion_was_late_are_not_judged(learned: LiveComparison) -> None:
    """On a busy computer good runs were out of range, as the messages of both robots were late."""
    times_s, values, reference_s = window(9.0, 3.0, from_s=6.3, until_s=6.7)
    even_s = EPOCH_S + np.arange(0.0, 9.0, 0.008)
    late_s = even_s[(even_s < EPOCH_S + 6.3) | (even_s > EPOCH_S + 6.5)]

    def found(*motions_s: np.ndarray) -> List[LiveDeparture]:
        moments_s = learned.certain(times_s, {KEY: values}, reference_s, motions_s)
        return list(learned.passed(times_s, {KEY: values}, moments_s, EPOCH_S))

    assert len(found()) == len(found(even_s, even_s)) == 1
    assert len(found(even_s, late_s)) == 1, 'the other robot shows the moment'
    assert not found(late_s, late_s) and not found(late_s)
    began_anew_s = even_s[(even_s < EPOCH_S + 3.0) | (even_s > EPOCH_S + 4.5)]
    assert len(found(began_anew_s)) == 1, 'only the robots were silent: they rest'
    assert not found(even_s[even_s < EPOCH_S + 6.0]), 'the motion is still missing'
    values[(reference_s > 3.0) & (reference_s < 4.5)] = np.nan
    assert not found(began_anew_s), 'until it is found where the process is'


def test_where_a_run_is_that_is_followed_from_the_middle_is_uncertain_at_first(
        learned: LiveComparison) -> None:
    """A good run was out of range, as the comparison was ready 2 s before its end."""
    times_s, values, reference_s = window(9.0, 3.0, from_s=6.3, until_s=6.7)

    def found(known_from_s: float) -> int:
        moments_s = np.where(reference_s < known_from_s, np.nan, reference_s)
        return len(learned.passed(times_s, {KEY: values}, learned.certain(
            times_s, {KEY: values}, moments_s, ()), EPOCH_S))

    assert found(2.0) == 1 and found(3.5) == 1 and found(5.5) == 0


def test_nothing_is_judged_at_the_very_end_where_robots_may_rest_already(
        learned: LiveComparison) -> None:
    """Good runs were below their range at the end of the motion, at 0:17.3 of 17.7 s."""
    times_s, values, reference_s = window(12.95, 3.0, from_s=12.55)
    assert len(learned.departures(times_s, {KEY: values}, reference_s)) == 1
    certain_s = learned.certain(times_s, {KEY: values}, reference_s, ())
    assert not learned.departures(times_s, {KEY: values}, certain_s)


def test_a_robot_that_was_restarted_is_judged_when_it_moves(learned: LiveComparison) -> None:
    times_s, values, reference_s = window(9.0)
    values[(reference_s > 4.0) & (reference_s < 6.0)] = np.nan
    values[(reference_s > 6.0) & (reference_s < 6.4)] -= 3.0
    assert not learned.passed(times_s, {KEY: values}, reference_s, EPOCH_S)
    values[(reference_s > 6.0) & (reference_s < 7.0)] -= 3.0
    assert learned.passed(times_s, {KEY: values}, reference_s, EPOCH_S)


def test_a_departure_that_swings_back_for_a_moment_is_one(learned: LiveComparison) -> None:
    times_s, values, reference_s = window(8.0, 3.0, from_s=6.0, until_s=6.44)
    good = window(8.0)[1]
    swings = (reference_s > 6.14) & (reference_s < 6.3)
    found = learned.passed(times_s, {KEY: np.where(swings, good, values)}, reference_s, EPOCH_S)
    assert len(found) == 1


def test_a_gap_does_not_make_a_departure_last(learned: LiveComparison) -> None:
    """It began just before a gap, and seemed to last until the end of the gap."""
    times_s, values, reference_s = window(8.0, 3.0, from_s=6.0)
    values[(reference_s > 6.2) & (reference_s < 7.82)] = np.nan
    found = learned.departures(times_s, {KEY: values}, reference_s)
    assert found == ()


def test_what_has_no_values_or_no_moment_is_not_judged(learned: LiveComparison) -> None:
    times_s, values, reference_s = window(8.0, 3.0, from_s=6.0)
    unknown = np.full(len(times_s), np.nan)
    assert learned.departures(times_s, {KEY: unknown}, reference_s) == ()
    assert learned.departures(times_s, {KEY: values}, unknown) == ()
    assert learned.departures(times_s, {('other', 'force'): values}, reference_s) == ()
    values[-100:] = np.nan  # its last one is two seconds old
    assert learned.departures(times_s, {KEY: values}, reference_s) == ()


def test_a_sparse_channel_is_judged_too(learned: LiveComparison) -> None:
    times_s, values, reference_s = window(8.0, 3.0, from_s=6.0)
    values[np.arange(len(values)) % 5 != 0] = np.nan
    found, = learned.departures(times_s, {KEY: values}, reference_s)
    assert found.since_s - EPOCH_S == pytest.approx(6.0, abs=0.15)


def test_means_that_lack_values_are_not_judged(learned: LiveComparison) -> None:
    """A busy computer loses messages: of an oscillating force, only peaks may be left."""
    times_s, values, reference_s = window(8.0)
    swing = np.sin(2.0 * np.pi * 10.0 * reference_s)
    values += 3.0 * swing
    assert not learned.departures(times_s, {KEY: values}, reference_s)
    crests = np.where((reference_s < 6.0) | (swing > 0.5), values, np.nan)
    assert not learned.departures(times_s, {KEY: crests}, reference_s)
    assert KEY in learned.lost(times_s, {KEY: crests})
    band = learned.band(KEY, crests, reference_s, 1.0 / RATE_HZ)
    assert band is not None and not band.departed[310:].any()


def test_how_long_values_were_missing_is_counted_once(learned: LiveComparison) -> None:
    times_s, values, reference_s = window(9.0)
    values[(reference_s > 4.0) & (reference_s < 6.0)] = np.nan
    counted_s, since_s = 0.0, 0.0
    for end in range(200, len(times_s) + 1, 20):
        shown = slice(max(end - 400, 0), end)
        counted_s += sum(learned.unjudged_s(times_s[shown], {KEY: values[shown]},
                                            reference_s[shown], since_s).values())
        since_s = learned.judged_until_s(times_s[shown], reference_s[shown])
    assert counted_s == pytest.approx(2.65, abs=0.1)  # including the values next to the gap
    assert not learned.unjudged_s(times_s, {}, reference_s, EPOCH_S), 'it has no live curve'
    whole_s = learned.unjudged_s(times_s, {}, reference_s, EPOCH_S, [KEY])
    assert whole_s[FORCE.name] == pytest.approx(8.5, abs=0.1)
    sparse = np.where(np.arange(len(values)) % 5 == 0, window(9.0)[1], np.nan)
    assert not learned.unjudged_s(times_s, {KEY: sparse}, reference_s, EPOCH_S)


def test_a_variable_that_is_sent_when_it_changes_lacks_nothing() -> None:
    variable = FORCE._replace(kind=SignalKind.VARIABLE)
    times_s = np.arange(0.0, 20.0, 1.0 / RATE_HZ)
    once, changes = np.full((2, len(times_s)), np.nan)
    once[100] = 1.0
    changes[200:230] = changes[700:720] = 1.0
    for values in (once, changes):
        assert not _lacks_values(variable, times_s, values).any()
        assert _lacks_values(FORCE, times_s, values).any()
    steady = np.where((times_s > 8.0) & (times_s < 12.0), np.nan, 1.0)
    assert _lacks_values(variable, times_s, steady)[450:550].all()


@pytest.mark.parametrize('rate_hz', [1.3, 1.9, 5.0, 10.0])
def test_a_slow_sensor_lacks_nothing(rate_hz: float) -> None:
    times_s = np.arange(0.0, 20.0, 1.0 / RATE_HZ)
    values = np.full(len(times_s), np.nan)
    values[np.round(np.arange(0.0, 19.9, 1.0 / rate_hz) * RATE_HZ).astype(int)] = 1.0
    assert not _lacks_values(FORCE, times_s, values).any()


def test_values_beside_a_gap_are_not_judged(learned: LiveComparison) -> None:
    times_s, values, reference_s = window(8.0, 3.0, from_s=7.2)
    values[(reference_s > 7.3) & (reference_s < 7.9)] = np.nan
    assert not learned.departures(times_s, {KEY: values}, reference_s)
    assert KEY not in learned.lost(times_s, {KEY: values})


def test_the_run_before_does_not_count(learned: LiveComparison) -> None:
    before, now = window(13.0, 3.0, from_s=6.0), window(4.0)
    times_s = EPOCH_S + np.arange(len(before[0]) + len(now[0])) / RATE_HZ
    joined = [np.concatenate(it) for it in zip(before[1:], now[1:])]
    assert learned.departures(times_s, {KEY: joined[0]}, joined[1]) == ()


def test_the_run_before_does_not_count_when_the_next_one_has_nothing_to_judge_yet(
        learned: LiveComparison) -> None:
    before = window(7.0, 3.0, from_s=6.0)
    assert departure(learned, 7.0, 3.0, from_s=6.0) is not None
    reference_s = np.append(before[2], 0.02)  # a value that has no mean yet
    times_s = EPOCH_S + np.arange(len(reference_s)) / RATE_HZ
    assert learned.departures(times_s, {KEY: np.append(before[1], np.nan)}, reference_s) == ()


def test_the_band_for_the_curve(learned: LiveComparison) -> None:
    _, values, reference_s = window(8.0, 3.0, from_s=6.0)
    reference_s[:50] = np.nan
    band = learned.band(KEY, values, reference_s, 1.0 / RATE_HZ)
    assert band is not None
    assert np.isnan(band.low[:50]).all() and (band.high[50:] > band.low[50:]).all()
    assert band.departed[320:].all() and not band.departed[:290].any()
    assert learned.band(('other', 'force'), values, reference_s, 0.02) is None
    assert learned.band(KEY, values, np.full(len(values), np.nan), 0.02) is None
    assert KEY in learned.keys


def test_where_the_good_runs_lack_data_a_channel_has_no_band() -> None:
    run = made_run(0)
    force = run.channels[0]
    known = (force.times_s < 5.0) | (force.times_s > 7.0)
    holed = force._replace(times_s=force.times_s[known], values=force.values[known])
    comparison = LiveComparison(GoodRuns(run._replace(channels=(holed, *run.channels[1:]))))
    assert KEY in comparison.without_band(6.0) and KEY not in comparison.without_band(4.0)


def test_a_tolerance_of_one_good_run() -> None:
    comparison = LiveComparison(GoodRuns(made_run(0)))
    assert departure(comparison, 8.0) is None
    assert departure(comparison, 8.0, 3.0, from_s=6.0) is not None


def test_outside_since() -> None:
    def since(text: str) -> Optional[int]:
        return outside_since(np.array([it == '#' for it in text]))

    assert since('') is None and since('..........') is None
    assert since('....######') == 4
    assert since('..##......########') == 2, 'it was back for a moment only'
    assert since('..##...............#####') == 19
    assert since('....######' + 10 * '.') is None
    assert since('....######' + 9 * '.') == 4


def test_a_widened_band_holds_the_band() -> None:
    middle = np.sin(np.arange(300) / 20.0)
    middle[:20] = np.nan
    wide = widened(SignalBand(middle, np.full(300, 0.1)))
    with np.errstate(invalid='ignore'):
        low, high = wide.middle - wide.half_width, wide.middle + wide.half_width
    assert np.isnan(low[:20]).all()
    for shift in (-5, 0, 5):
        moved = np.roll(middle, shift)[30:-10]
        assert (low[30:-10] <= moved - 0.1 + 1e-9).all()
        assert (high[30:-10] >= moved + 0.1 - 1e-9).all()
