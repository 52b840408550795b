# SPDX-License-Identifier: BSD-3-Clause
"""Stuck sensors, vibration, and properties of any run."""
from __future__ import annotations

from typing import Callable, Dict, Optional, Sequence

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from made_runs import made_run, progress

from process_visualizer.commands.compare_command import as_text
from process_visualizer.runs.comparison.good_runs import GoodRuns
from process_visualizer.runs.deviation.band import (
    RELATIVE_TOLERANCE,
    BandLearner,
    signal_tolerance,
)
from process_visualizer.runs.deviation.signals import Signal, SignalKind
from process_visualizer.runs.run import (
    Channel,
    ChannelKind,
    Run,
    RunPhase,
    ToolForce,
    part_of,
)

GOOD = GoodRuns(made_run(1), [made_run(2), made_run(3), made_run(4)])
EVENTS = st.lists(st.tuples(st.sampled_from(['go', 'back', 'mark']), st.floats(0.0, 9.5)),
                  max_size=8)


def test_a_stuck_sensor_is_told_when_it_sticks() -> None:
    def stuck(process_s: np.ndarray, values: np.ndarray) -> np.ndarray:
        held = (process_s > 5.2) & (process_s < 6.2)  # the value is constant there
        return np.where(held, values[np.flatnonzero(held)[0]], values)

    found = GOOD.compare(made_run(9, value=stuck))
    assert found.run_s(found.departures[0].onset_s) == pytest.approx(7.2, abs=0.1)
    assert 'robot tool force: stays exactly the same for ' in as_text(GOOD, [found])


def test_a_stuck_sensor_explains_why_its_value_is_wrong_later() -> None:
    def stuck(process_s: np.ndarray, values: np.ndarray) -> np.ndarray:
        held = (process_s > 5.2) & (process_s < 8.8)  # the value falls from 6 s on
        return np.where(held, values[np.flatnonzero(held)[0]], values)

    found = GOOD.compare(made_run(9, value=stuck)).departures
    assert [it.words.split(' for ')[0] for it in found if it.signal.label == 'tool force'] == [
        'stays exactly the same']
    assert found[0].signal.label == 'tool force'
    assert found[0].severity > 1.0


def test_a_value_that_changes_late_is_not_stuck() -> None:
    """Good runs are just as constant long before; the onset was dated to where all became so."""
    def made(seed: int, late_s: float) -> Run:
        run = made_run(seed)
        times_s, values = run.channels[0].times_s, np.zeros(len(run.channels[0].times_s))
        moves = times_s > 7.0 + late_s
        noise = np.random.default_rng(seed).standard_normal(int(moves.sum()))
        values[moves] = np.minimum(3.0 * (times_s[moves] - 7.0 - late_s), 3.0) + 0.01 * noise
        return run._replace(channels=(*run.channels, Channel(
            'machine', 'feed', 'm/s', ChannelKind.VARIABLE, times_s, values)))
    good = GoodRuns(made(1, 0.0), [made(seed, 0.0) for seed in (2, 3, 4)])
    found = good.compare(made(9, 1.0)).departures
    assert {it.signal.label for it in found} >= {'feed'}
    assert not any('stays' in it.words for it in found)
    assert found[0].onset_s == pytest.approx(7.0, abs=0.3)


def test_a_value_that_is_wrong_when_the_sensor_works_again_is_told() -> None:
    def stuck(process_s: np.ndarray, values: np.ndarray) -> np.ndarray:
        held = (process_s > 5.2) & (process_s < 8.8)
        return np.where(held, values[np.flatnonzero(held)[0]], values + 3.0 * (process_s > 5.2))

    found = GOOD.compare(made_run(9, value=stuck)).departures
    forces = [it for it in found if it.signal.label == 'tool force']
    assert sorted(bool(it.words) for it in forces) == [False, True]


def test_a_good_run_that_was_cut_says_nothing_of_the_standstill_before_it() -> None:
    def still(process_s: np.ndarray, values: np.ndarray) -> np.ndarray:
        return np.where(process_s < 2.0, 0.0, values)

    def cut(run: Run, begin_s: float) -> Run:
        return run._replace(channels=tuple(channel._replace(
            times_s=channel.times_s[channel.times_s >= begin_s],
            values=channel.values[channel.times_s >= begin_s]) for channel in run.channels))

    def stuck(run: Run, *good: Run) -> str:
        found = GoodRuns(good[0], good[1:])
        return as_text(found, [found.compare(run)])

    whole, other = made_run(1, value=still), made_run(9, value=still)
    short = cut(whole, 3.4)
    assert 'stays exactly the same' not in stuck(other, whole)
    assert 'stays exactly the same' not in stuck(other, short)
    assert 'stays exactly the same' in stuck(made_run(9, value=lambda process_s, values: np.where(
        process_s < 4.0, 0.0, values)), short), 'where the good run moves'


def test_what_is_less_rough_began_when_the_last_rough_value_came() -> None:
    smooth_s = 5.2  # in the process

    def smoothed(process_s: np.ndarray, values: np.ndarray) -> np.ndarray:
        even = 10.0 * progress(process_s) + 1e-3 * np.sin(40.0 * process_s)
        return np.where(process_s > smooth_s, even, values)

    found = GOOD.compare(made_run(9, value=smoothed))
    noise = next(it for it in found.departures if it.signal.label == 'tool force noise')
    assert found.run_s(noise.onset_s) == pytest.approx(2.0 + smooth_s, abs=0.25)


def test_a_vibration_is_told_with_its_frequency() -> None:
    def shaken(process_s: np.ndarray, values: np.ndarray) -> np.ndarray:
        return values + 0.15 * (process_s > 4.0) * np.sin(2.0 * np.pi * 12.0 * process_s)

    noise = next(it for it in GOOD.compare(made_run(9, value=shaken)).departures
                 if it.signal.label == 'tool force noise')
    assert noise.frequency_hz == pytest.approx(12.0, abs=0.5)


@pytest.mark.parametrize('begin_s', [1.5, 3.0, 6.5])
def test_what_is_rougher_is_dated_by_its_values_and_not_by_a_window(begin_s: float) -> None:
    def rough(process_s: np.ndarray, values: np.ndarray) -> np.ndarray:
        noise = np.random.default_rng(2).standard_normal(len(values))
        return values + 0.07 * np.where(process_s > begin_s, noise, 0.0)

    found = GOOD.compare(made_run(9, value=rough))
    noise = next(it for it in found.departures if it.signal.label == 'tool force noise')
    assert found.run_s(noise.onset_s) == pytest.approx(2.0 + begin_s, abs=0.1)


def test_more_noise_is_no_vibration() -> None:
    found = GOOD.compare(made_run(9, noise=0.5)).departures
    assert [it.frequency_hz for it in found if it.signal.label.endswith('noise')] == [None]


def test_a_force_to_the_side_is_told_by_several_good_runs_though_it_is_small() -> None:
    def pressed(seed: int, aside_n: float = 0.0):  # type: ignore[no-untyped-def]
        run = made_run(seed)
        times_s = np.arange(0.0, run.duration_s, 0.01)
        vectors = np.column_stack((aside_n * (times_s > 5.0), 0.0 * times_s, 20.0 + 0.0 * times_s))
        noise = np.random.default_rng(seed).standard_normal(vectors.shape)
        return run._replace(forces=(ToolForce('robot', 'tool0', times_s, vectors + noise),))

    good = GoodRuns(pressed(1), [pressed(seed) for seed in range(2, 9)])
    assert not good.compare(pressed(77)).departures
    assert good.compare(pressed(77, 3.0)).departures[0].signal.label == 'tool force direction'


@st.composite
def any_run(draw: st.DrawFn) -> Run:
    """A run with some events, states, waits and gaps."""
    run = made_run(draw(st.integers(0, 9)), events=draw(EVENTS), dwell_s=draw(st.floats(0.0, 2.0)),
                   has_motion=draw(st.booleans()))
    changes_s = sorted(draw(st.lists(st.floats(0.0, 12.0), min_size=1, max_size=6)))
    values = draw(st.lists(st.integers(0, 3), min_size=len(changes_s), max_size=len(changes_s)))
    state = Channel('plc', 'state', '', ChannelKind.VARIABLE, np.array(changes_s),
                    np.array(values, float))
    kept = (run.channels[0].times_s < (gap_s := draw(st.floats(0.0, 12.0)))) | (
        run.channels[0].times_s > gap_s + draw(st.floats(0.0, 3.0)))
    force = run.channels[0]._replace(times_s=run.channels[0].times_s[kept],
                                     values=run.channels[0].values[kept])
    wait = RunPhase('wait', 'go', 'back', draw(st.booleans()))
    return run._replace(channels=(force, state), phases=(wait,))


@settings(max_examples=25, deadline=None)
@given(run=any_run())
def test_a_run_against_itself_is_silent_whatever_it_has(run: Run) -> None:
    again = GoodRuns(run).compare(run._replace(name='again'))
    assert not again.departures


_FORCE_N = np.array([0.0, 3.0, 20.0])
FAULTS: Dict[str, Callable[[Run], Run]] = {
    'force': lambda run: _with(run, 'tool force', lambda values: values + 3.0),
    'state': lambda run: _with(run, 'state', lambda values: np.where(values == 2.0, 9.0, values)),
    'joint': lambda run: _with(run, 'joint a', lambda values: values + 0.3),
    'direction': lambda run: run._replace(forces=tuple(
        it._replace(vectors=it.vectors[:, [0, 2, 1]]) for it in run.forces)),
    'place': lambda run: run._replace(motions=tuple(
        it._replace(positions=it.positions + (0.0, 0.05, 0.0)) for it in run.motions))}


def _with(run: Run, label: str, change: Callable[[np.ndarray], np.ndarray]) -> Run:
    return run._replace(channels=tuple(
        it._replace(values=change(it.values)) if it.label == label else it
        for it in run.channels))


def complete(seed: int) -> Run:
    """A run with force, its direction, a joint and a state."""
    run = made_run(seed)
    times_s = run.channels[0].times_s
    random = np.random.default_rng(seed)
    vectors = _FORCE_N + 0.1 * random.standard_normal((len(times_s), 3))
    joint = Channel('robot', 'joint a', 'rad', ChannelKind.JOINT, times_s,
                    run.motions[0].positions[:, 0])
    state = Channel('plc', 'state', '', ChannelKind.VARIABLE, times_s[::5],
                    1.0 + (times_s[::5] > 4.0) + (times_s[::5] > 8.0))
    return run._replace(channels=(*run.channels, joint, state),
                        forces=(ToolForce('robot', 'tool0', times_s, vectors),))


WITHOUT: Dict[str, Callable[[Run], Run]] = {
    'nothing': lambda run: run,
    'channels': lambda run: run._replace(channels=run.channels[:1]),
    'force': lambda run: run._replace(channels=run.channels[1:]),
    'forces': lambda run: run._replace(forces=()),
    'motions': lambda run: run._replace(motions=()),
    'later states': lambda run: run._replace(channels=tuple(
        it._replace(times_s=it.times_s[:60], values=it.values[:60]) if it.label == 'state' else it
        for it in run.channels)),
    'half of all': lambda run: part_of(run, 0.0, 0.5 * run.duration_s, run.name)._replace(
        duration_s=run.duration_s)}


@pytest.mark.parametrize('count', [1, 6])
@pytest.mark.parametrize('fault', FAULTS)
def test_leaving_out_data_never_hides_that_a_run_was_out_of_range(fault: str, count: int) -> None:
    good = GoodRuns(complete(1), [complete(seed) for seed in range(2, count + 1)])
    assert not good.compare(complete(20)).departures
    run = FAULTS[fault](complete(20))
    assert good.compare(run).departures
    for what, left_out in WITHOUT.items():
        found = good.compare(left_out(run))
        assert found.departures or found.unjudged or [
            it for it in found.notes if 'only the reference has' in it], what


@given(levels=st.lists(st.floats(-10.0, 10.0), min_size=1, max_size=12),
       tolerance=st.one_of(st.none(), st.floats(0.01, 5.0)))
def test_no_good_run_widens_a_band_beyond_three_times_what_one_of_them_did(
        levels: Sequence[float], tolerance: Optional[float]) -> None:
    """Also an added one; with one or two runs the tolerance counts."""
    signal = Signal('robot', 'force', 'N', SignalKind.FORCE, tolerance)
    values = np.array(levels)
    learner = BandLearner([{signal: np.full(50, it)} for it in levels], most_left_out=0)
    limits = learner.band().signals[signal]
    away = [abs(it - np.delete(values, row).mean()) if len(values) > 1 else 0.0
            for row, it in enumerate(values)]
    least = tolerance or signal_tolerance(signal, values, RELATIVE_TOLERANCE)
    assert limits.half_width.max() <= max(least, 3.0 * max(away)) + 1e-5


def with_current(run: Run, first_s: float, size: Callable[[float], float] = lambda _: 1.0) -> Run:
    """Return a run with a current that is sent once per second, first at ``first_s``.

    It flows from 2 s to 8 s after the beginning of the process, which is 2 s after that of the run.
    ``size`` is a factor that depends on the process time.
    """
    times_s = np.arange(first_s, run.duration_s, 1.0)
    flows = [2.0 * size(it) if 2.0 < it < 8.0 else 0.0 for it in (times_s - 2.0).tolist()]
    noise = np.random.default_rng(int(1000 * first_s)).normal(0.0, 0.01, len(times_s))
    current = Channel('spindle', 'current', 'A', ChannelKind.VARIABLE, times_s, 0.1 + noise + flows)
    return run._replace(channels=(*run.channels, current))


def test_an_edge_of_what_is_sent_once_a_second_may_be_seen_anywhere_in_it() -> None:
    good = GoodRuns(with_current(made_run(0), 0.1))
    assert not good.compare(with_current(made_run(1), 0.7)).departures


def test_edges_of_what_is_sent_once_a_second_do_not_hide_another_value() -> None:
    good = GoodRuns(with_current(made_run(0), 0.1),
                    [with_current(made_run(row), 0.1 + 0.2 * row) for row in range(1, 5)])
    found = good.compare(with_current(made_run(7), 0.5, lambda _: 1.15)).departures
    assert [it.signal.label for it in found] == ['current']


def test_what_is_sent_once_a_second_is_not_the_cause_of_what_began_within_it() -> None:
    """It is on a straight line to the first wrong value, nearly a second earlier."""
    good = GoodRuns(with_current(made_run(0), 0.05), [
        with_current(made_run(row), 0.05 + 0.2 * row) for row in range(1, 5)])
    wrong = made_run(7, value=lambda process_s, values: values + 2.0 * (process_s > 4.98))
    found = good.compare(with_current(wrong, 0.05, lambda process_s: 0.3 if process_s > 4.98
                                      else 1.0)).departures
    assert [it.signal.label for it in found[:2]] == ['tool force', 'current']
    current = found[1]
    assert abs(current.onset_s - 6.98) <= current.uncertainty_s <= 0.6
