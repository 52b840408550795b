# SPDX-License-Identifier: BSD-3-Clause
"""Runs with the same path in a different position each time."""
from __future__ import annotations

import math
from typing import Callable, Optional

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from made_runs import made_run

from process_visualizer.runs.alignment.displacement import Displacement, displacement
from process_visualizer.runs.comparison.good_runs import GoodRuns
from process_visualizer.runs.comparison.wording import verdict
from process_visualizer.runs.run import Channel, ChannelKind, Run

Change = Callable[[np.ndarray, np.ndarray], np.ndarray]


def elsewhere(seed: int, turn_rad: float, *shift_m: float, place: Optional[Change] = None) -> Run:
    """A run whose path is turned and shifted, with a joint that follows."""
    there = Displacement(turn_rad, np.array(shift_m))
    run = made_run(seed, speed=1.0 + 0.01 * (seed % 3), place=place)
    run = there.of_run(run)
    times_s = run.motions[0].times_s
    joint = Channel('robot', 'joint a', 'rad', ChannelKind.JOINT, times_s,
                    np.arctan2(run.motions[0].positions[:, 1] + 1.0, 1.0))
    return run._replace(channels=(*run.channels, joint))


def somewhere(seed: int, place: Optional[Change] = None) -> Run:
    """A run in a random position, drawn with the seed."""
    random = np.random.default_rng(seed)
    return elsewhere(seed, random.uniform(-1.0, 1.0), *random.uniform(-0.4, 0.4, 3), place=place)


def beside(process_s: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Let the tool leave its path sideways for a while."""
    return at + np.where((process_s > 2.5) & (process_s < 4.0), 1.0, 0.0)[:, np.newaxis] * (
        0.0, 0.02, 0.0)


@settings(max_examples=20, deadline=None)
@given(st.floats(-3.0, 3.0), st.tuples(*[st.floats(-0.5, 0.5)] * 3))
def test_a_turn_and_a_shift_are_found(turn_rad: float, shift_m: 'tuple[float, float, float]',
                                      ) -> None:
    run = elsewhere(2, turn_rad, *shift_m)
    found = displacement(made_run(), run)
    assert found is not None
    both = found.moved(Displacement(turn_rad, np.array(shift_m)).moved(
        made_run().motions[0].positions))
    np.testing.assert_allclose(both, made_run().motions[0].positions, atol=6e-3)


def test_another_path_is_none_of_another_place() -> None:
    def other(process_s: np.ndarray, at: np.ndarray) -> np.ndarray:
        return np.column_stack((at[:, 0], 0.6 * np.sin(4.0 * at[:, 0]), at[:, 2]))
    assert displacement(made_run(), made_run(1, place=other)) is None


@pytest.fixture(scope='module')
def good() -> GoodRuns:
    return GoodRuns(somewhere(0), [somewhere(seed) for seed in range(1, 6)])


def test_a_run_at_another_place_is_judged_relative_to_it(good: GoodRuns) -> None:
    found = good.compare(elsewhere(20, math.radians(30.0), 0.2, 0.0, 0.0))
    assert verdict(found) == 'in range'
    assert 'its path is that of the reference, shifted by ' in found.notes[0]
    assert 'joints are not judged' in found.notes[0]


def test_a_tool_beside_its_path_is_found_at_another_place_too(good: GoodRuns) -> None:
    first = good.compare(somewhere(21, beside)).departures[0]
    assert first.signal.name == 'robot tool sideways'
    assert abs(first.deviation) == pytest.approx(0.02, abs=0.004)


def test_a_place_at_which_no_good_run_was_is_a_departure_where_all_are_at_one() -> None:
    good = GoodRuns(elsewhere(0, 0.0, 0.0, 0.0, 0.0),
                    [elsewhere(seed, 0.0, 0.0, 0.0, 0.0) for seed in range(1, 6)])
    found = good.compare(elsewhere(20, 0.0, 0.03, 0.0, 0.0))
    assert found.departures[0].signal.name.startswith('robot tool')
