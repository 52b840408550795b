# SPDX-License-Identifier: BSD-3-Clause
"""Sensors that are stuck, vibration, and what holds for any run."""
from __future__ import annotations

from typing import Sequence, Tuple

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from made_runs import made_run, progress

from process_visualizer.runs.comparison.comparison import GoodRuns
from process_visualizer.runs.comparison.comparison_text import as_text
from process_visualizer.runs.run import ToolForce

GOOD = GoodRuns(made_run(1), [made_run(2), made_run(3), made_run(4)])
EVENTS = st.lists(st.tuples(st.sampled_from(['go', 'back', 'mark']), st.floats(0.0, 9.5)),
                  max_size=8)


def test_a_stuck_sensor_is_told_when_it_sticks() -> None:
    def stuck(process_s: np.ndarray, values: np.ndarray) -> np.ndarray:
        held = (process_s > 5.2) & (process_s < 6.2)  # the value is even there
        return np.where(held, values[np.flatnonzero(held)[0]], values)

    found = GOOD.compare(made_run(9, value=stuck))
    assert found.run_s(found.departures[0].onset_s) == pytest.approx(7.2, abs=0.1)
    assert 'robot tool force, stays exactly the same for ' in as_text(GOOD, [found])


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


@settings(max_examples=10, deadline=None)
@given(events=EVENTS)
def test_a_run_against_itself_is_silent_whatever_its_events(
        events: Sequence[Tuple[str, float]]) -> None:
    run = made_run(5, events=events)
    assert not GoodRuns(run).compare(run).departures


@settings(max_examples=10, deadline=None)
@given(by=st.floats(-2.0, 2.0), seed=st.integers(20, 30))
def test_leaving_out_a_channel_never_hides_that_a_run_was_out_of_range(by: float,
                                                                       seed: int) -> None:
    run = made_run(seed, value=lambda _, values: values + by)
    whole, less = GOOD.compare(run), GOOD.compare(run._replace(channels=()))
    assert not whole.departures or less.departures or less.unjudged


@settings(max_examples=8, deadline=None)
@given(by=st.floats(-0.2, 0.2), count=st.integers(1, 6))
def test_one_more_good_run_widens_no_band_beyond_what_it_did(by: float, count: int) -> None:
    runs = [made_run(seed) for seed in range(count)]
    more = made_run(99, value=lambda _, values: values + by)
    before, after = GoodRuns(runs[0], runs[1:]).band, GoodRuns(runs[0], [*runs[1:], more])
    added = after.compare(more).columns
    for signal, limits in after.band.signals.items():
        old = before.signals[signal]
        for side in (-1.0, 1.0):
            beyond = side * (limits.middle - old.middle) + limits.half_width - old.half_width
            reached = side * (added[signal] - old.middle) - old.half_width
            allowed = np.maximum(np.nanmax(reached), 0.0) + 0.5 * np.nanmax(old.half_width)
            assert np.nanmax(beyond) <= allowed, signal.name
