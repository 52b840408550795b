# SPDX-License-Identifier: BSD-3-Clause
"""Onsets of departures, and false ones: rare values, steep paths, waits, smoother noise."""
from __future__ import annotations

from typing import Sequence

import numpy as np
import pytest
from made_runs import made_run

from process_visualizer.commands.compare_command import as_text
from process_visualizer.runs.comparison.good_runs import GoodRuns
from process_visualizer.runs.comparison.wording import verdict
from process_visualizer.runs.deviation.band import BandLearner, SignalBand
from process_visualizer.runs.deviation.departures import (
    Departure,
    lasting_onset,
    onset,
    ranked,
)
from process_visualizer.runs.deviation.signals import TIMING_LABEL, Signal, SignalKind
from process_visualizer.runs.run import Channel, ChannelKind, Run, RunPhase
from process_visualizer.runs.series import is_sequence, states

TIMES_S = np.arange(0.0, 12.0, 0.02)


def with_current(run: Run, first_s: float, wrong_from_s: float = np.inf) -> Run:
    """Return a run with a current that is sent once per second and is 40 % higher from a time."""
    times_s = np.arange(first_s, run.duration_s, 1.0)
    flows = np.where((times_s > 4.0) & (times_s < 10.0), 2.0, 0.5)
    noise = np.random.default_rng(int(1000 * first_s)).normal(0.0, 0.01, len(times_s))
    values = flows * np.where(times_s >= wrong_from_s, 1.4, 1.0) + noise
    return run._replace(channels=(*run.channels, Channel(
        'spindle', 'current', 'A', ChannelKind.VARIABLE, times_s, values)))


@pytest.mark.parametrize('begin_s', [5.7, 6.1, 7.4, 8.3])
def test_what_is_sent_once_a_second_began_between_two_values(begin_s: float) -> None:
    good = GoodRuns(with_current(made_run(0), 0.1),
                    [with_current(made_run(row), 0.1 + 0.15 * row) for row in range(1, 6)])
    found = good.compare(with_current(made_run(9), 0.5, begin_s))
    current, = found.departures
    assert abs(found.run_s(current.onset_s) - begin_s) <= current.uncertainty_s + 0.02
    assert current.uncertainty_s < 1.1
    last, first = (f'0:{it:05.2f}' for it in (np.floor(begin_s - 0.5) + 0.5,
                                             np.ceil(begin_s - 0.5) + 0.5))
    assert f'between {last} (' in verdict(found) and f' and {first}, with a value every 1 s' in \
        verdict(found)
    assert f'between {last}' in as_text(good, [found])


def lifting(seed: int, late_s: float = 0.0) -> Run:
    """Return a run whose tool only moves up and down, and moves down late after a wait."""
    run = made_run(seed, events=(('waits', 5.2), ('goes on', 5.8)))
    times_s = run.motions[0].times_s
    up = run.motions[0].positions[:, 0]
    up = np.where(times_s > 7.5, np.interp(times_s - late_s, times_s, up), up)
    motion = run.motions[0]._replace(positions=np.column_stack((np.zeros((len(up), 2)), up)))
    return run._replace(channels=(), motions=(motion,),
                        phases=(RunPhase('wait', 'waits', 'goes on', True),))


def test_a_tool_too_high_on_a_steep_path_is_no_reason_to_be_late() -> None:
    late = Departure(Signal('', TIMING_LABEL, 's', SignalKind.TIMING), 4.1, None, 4.1, 0.1, 4.3,
                     0.6, 0.1)
    high = Departure(Signal('robot', 'tool up', 'm', SignalKind.PLACE), 4.0, None, 4.0, 0.1, 4.2,
                     0.02, 0.001)
    assert ranked([high, late])[0] is high, 'beside a level path'
    steep = high._replace(is_on_path=True)
    assert ranked([steep, late])[0] is late


@pytest.mark.parametrize('late_s', [0.2, 0.4, 0.8])
def test_a_tool_on_a_steep_path_that_is_late_is_not_beside_it(late_s: float) -> None:
    found = GoodRuns(lifting(0), map(lifting, range(1, 8))).compare(lifting(9, late_s))
    assert found.departures[0].signal.label == 'time lost'
    assert found.run_s(found.departures[0].onset_s) >= 7.7, 'nothing is lost in a wait'


def test_numbers_sent_on_change_are_states_however_quickly() -> None:
    times_s = np.array([0.0, 0.8, 2.3, 2.65, 2.95, 3.35, 4.25, 4.65, 4.95, 5.35, 6.15, 7.65, 8.0])
    on_change = Channel('plc', 'state', '', ChannelKind.VARIABLE, times_s,
                        10.0 + np.arange(13.0) % 7.0)
    assert is_sequence(on_change)
    assert states(on_change).until_s == np.inf
    even = on_change._replace(times_s=np.arange(13.0) * 0.3)
    assert not is_sequence(even), 'a measurement comes evenly'


def test_a_mean_began_no_longer_ago_than_its_window() -> None:
    random = np.random.default_rng(4)
    deviation = 0.2 * random.standard_normal(len(TIMES_S)) + 0.5 * (TIMES_S > 8.0)
    deviation += 0.3 * ((TIMES_S > 1.0) & (TIMES_S < 7.9))
    found = lasting_onset(TIMES_S, deviation, int(9.5 / 0.02), 1.0, 2.0)
    assert found.time_s >= 7.0


def test_an_onset_is_as_uncertain_as_is_said() -> None:
    """Smoothed noise has few independent values: the onset is nearly always in the stated range."""
    known = []
    for seed in range(60):
        random = np.random.default_rng(seed)
        noise = np.convolve(random.standard_normal(len(TIMES_S) + 9), np.ones(10) / 10.0, 'valid')
        deviation = 0.5 * noise + 0.5 * np.clip(TIMES_S - 7.0, 0.0, 9.0)
        found = onset(TIMES_S, deviation, int(9.0 / 0.02))
        known.append(abs(found.time_s - 7.0) <= found.uncertainty_s + 0.02)
    assert np.mean(known) >= 0.75


def test_what_differs_after_values_that_are_missing_began_among_them() -> None:
    random = np.random.default_rng(2)
    deviation = 0.3 * random.standard_normal(len(TIMES_S)) - 8.0 * (TIMES_S > 8.0)
    deviation[(TIMES_S > 7.5) & (TIMES_S < 8.2)] = np.nan
    left_row = int(np.flatnonzero(deviation < -4.0)[0])
    found = onset(TIMES_S, deviation, left_row, np.full(len(TIMES_S), 10.0))
    assert found.time_s == pytest.approx(7.85, abs=0.05)
    assert found.uncertainty_s == pytest.approx(0.35, abs=0.05)


def test_a_value_that_drops_just_after_an_edge_was_usual_at_the_edge() -> None:
    level = 20.0 * np.clip((TIMES_S - 6.0) / 0.4, 0.0, 1.0) + 20.0 * (TIMES_S < 5.0)
    deviation = np.where((TIMES_S > 4.9) & (TIMES_S < 5.0), -3.0, 0.0)
    deviation += 0.2 * np.random.default_rng(3).standard_normal(len(TIMES_S))
    deviation -= np.where((TIMES_S > 6.3) & (TIMES_S < 6.6), level, 0.0)
    found = onset(TIMES_S, deviation, int(6.32 / 0.02), level)
    assert found.time_s == pytest.approx(6.3, abs=0.06)
    assert found.uncertainty_s <= 0.1


def test_a_jump_that_the_level_does_not_explain_began_there() -> None:
    """The level crosses zero, where its relative value is unknown; the value had drifted before."""
    level = 8.0 * np.sin(0.9 * TIMES_S)
    deviation = np.where((TIMES_S > 3.0) & (TIMES_S < 3.7), 0.9, 0.0)
    deviation += np.where(TIMES_S > 8.0, 0.75 + 0.3 * (TIMES_S - 8.0), 0.0)
    deviation += 0.1 * np.sin(3.0 * TIMES_S)
    left_row = int(np.flatnonzero((deviation > 1.0) & (TIMES_S > 5.0))[0])
    assert onset(TIMES_S, deviation, left_row, level).time_s == pytest.approx(8.0, abs=0.1)


def test_noise_of_a_value_that_drops_begins_with_the_drop() -> None:
    def value(process_s: np.ndarray, values: np.ndarray) -> np.ndarray:
        fine = 0.3 * np.random.default_rng(len(values)).standard_normal(len(values))
        return values + np.where(process_s > 2.0, 60.0 + fine, 0.0)

    def dropped(process_s: np.ndarray, values: np.ndarray) -> np.ndarray:
        return np.where((process_s > 2.6) & (process_s < 2.85), 0.0, value(process_s, values))
    good = GoodRuns(made_run(0, value=value), [made_run(it, value=value) for it in range(1, 6)])
    found = good.compare(made_run(9, value=dropped))
    assert {it.signal.name for it in found.departures} >= {'robot tool force',
                                                           'robot tool force noise'}
    for it in found.departures:
        assert found.run_s(it.onset_s) == pytest.approx(4.6, abs=0.15), it.signal.name


def test_a_state_that_follows_from_a_value_comes_after_it() -> None:
    value = Departure(Signal('process', 'current', 'A', SignalKind.VARIABLE), 4.0, 5.0, 4.0, 0.1,
                      4.2, -50.0, 5.0)
    bit = Departure(Signal('plc', 'arc on', '', SignalKind.STATE), 4.1, None, 4.1, 0.05, 4.1,
                    10.0, 1.0, '0 occurs once too often')
    assert [it.signal.label for it in ranked([bit, value])] == ['current', 'arc on']
    commanded = value._replace(onset_s=4.15, left_s=4.15)
    assert [it.signal.label for it in ranked([bit, commanded])] == ['arc on', 'current']
    sent_at_10_hz = bit._replace(uncertainty_s=0.15)  # it may have changed before the value
    assert [it.signal.label for it in ranked([sent_at_10_hz, value])] == ['arc on', 'current']


def test_time_lost_on_a_steep_path_shows_at_the_place_first() -> None:
    late = Departure(Signal('', TIMING_LABEL, 's', SignalKind.TIMING), 6.8, None, 6.6, 0.03, 7.1,
                     0.13, 0.04)
    high = Departure(Signal('robot', 'tool up', 'm', SignalKind.PLACE), 6.24, 6.5, 6.24, 0.1, 6.4,
                     0.0013, 0.0005, is_on_path=True)
    assert ranked([high, late])[0] is late
    assert ranked([high, late._replace(onset_s=7.6)])[0] is high


def test_a_gain_that_drifts_across_a_pause_began_before_it() -> None:
    level = np.where((TIMES_S > 2.0) & (TIMES_S < 5.0) | (TIMES_S > 6.0), 100.0, 0.0)
    deviation = level * 0.06 * np.clip(TIMES_S - 3.0, 0.0, 4.0)
    deviation += 0.3 * np.random.default_rng(1).standard_normal(len(TIMES_S))
    assert onset(TIMES_S, deviation, int(6.1 / 0.02), level).time_s == pytest.approx(3.0, abs=0.2)


def noisy(levels: Sequence[np.ndarray], chance: float = 0.0) -> SignalBand:
    """Return the band of noise."""
    signal = Signal('robot', 'force noise', '', SignalKind.NOISE, chance=chance)
    return BandLearner([{signal: it} for it in levels]).band().signals[signal]


def test_the_roughness_of_an_edge_may_be_over_sooner() -> None:
    edge = np.where((TIMES_S > 4.0) & (TIMES_S < 4.5), 3.0, 0.0)
    band = noisy([edge] * 5)
    sooner = np.where((TIMES_S > 4.0) & (TIMES_S < 4.2), 3.0, 0.0)
    assert (np.abs(sooner - band.middle) <= band.half_width).all()
    rougher = np.where((TIMES_S > 4.0) & (TIMES_S < 5.0), 3.0, 0.0)
    assert (np.abs(rougher - band.middle) > band.half_width).any()


def test_noise_of_few_values_may_differ_more() -> None:
    level = [np.zeros(len(TIMES_S))] * 5
    assert noisy(level, 0.3).half_width.max() > 1.4 * noisy(level).half_width.max()


def test_who_waits_less_has_no_departure_at_the_end_of_the_wait() -> None:
    def waiting(seed: int, wait_s: float) -> Run:
        run = made_run(seed, dwell_s=wait_s, events=(('waits', 2.999), ('goes on', 3.001)))
        channel = run.channels[0]
        begin_s = 5.0  # 3 s of the process
        times_s = np.arange(0.03, run.duration_s, 0.1)
        runs = np.where((times_s > begin_s) & (times_s < begin_s + wait_s), 200.0, 0.0)
        belt = Channel('belt', 'speed', 'mm/s', ChannelKind.VARIABLE, times_s, runs)
        return run._replace(channels=(channel, belt),
                            phases=(RunPhase('wait', 'waits', 'goes on', True),))

    good = GoodRuns(waiting(1, 2.7), [waiting(seed, 2.0 + 0.3 * seed) for seed in range(2, 6)])
    assert [it.signal.name for it in good.compare(waiting(9, 0.9)).departures] == []
