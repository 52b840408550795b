# SPDX-License-Identifier: BSD-3-Clause
from __future__ import annotations

import numpy as np
import pytest
from made_runs import made_run

from process_visualizer.runs.comparison.good_runs import GoodRuns
from process_visualizer.runs.run import Run, ToolForce


def pressed(seed: int, turned_deg: float = 0.0) -> Run:
    """A run with a force of 20 N, which turns to the side after 5 s without changing its amount."""
    run = made_run(seed)
    times_s = np.arange(0.0, run.duration_s, 0.01)
    angle = np.radians(turned_deg) * (times_s > 5.0)
    vectors = 20.0 * np.column_stack((np.sin(angle), 0.0 * angle, np.cos(angle)))
    noise = np.random.default_rng(seed).standard_normal(vectors.shape)
    return run._replace(forces=(ToolForce('robot', 'tool0', times_s, vectors + noise),))


@pytest.mark.parametrize('count', [1, 6, 24])
def test_a_force_that_is_turned_is_told_though_it_is_as_great(count: int) -> None:
    good = GoodRuns(pressed(1), [pressed(seed) for seed in range(2, count + 1)])
    assert good.compare(pressed(77)).departures == ()
    found, = good.compare(pressed(77, 30.0)).departures
    assert found.signal.name == 'robot tool force direction'
    assert found.deviation == pytest.approx(30.0, abs=4.0)
    assert found.onset_s == pytest.approx(5.0, abs=0.3)


def setting_in(seed: int, from_deg: float = 0.0, later_s: float = 0.0) -> Run:
    """A run with a force of 3 to 20 N, which is turned while it rises, from 5 s on."""
    run = made_run(seed)
    times_s = np.arange(0.0, run.duration_s, 0.01)
    size = np.interp(times_s - later_s, (5.0, 6.0), (3.0, 20.0))
    angle = np.radians(np.interp(times_s - later_s, (5.0, 5.6), (from_deg, 0.0)))
    vectors = size[:, np.newaxis] * np.column_stack((np.sin(angle), 0.0 * angle, np.cos(angle)))
    noise = 0.3 * np.random.default_rng(seed).standard_normal(vectors.shape)
    return run._replace(forces=(ToolForce('robot', 'tool0', times_s, vectors + noise),))


def test_a_force_may_set_in_from_another_side_than_in_the_one_good_run() -> None:
    assert GoodRuns(setting_in(1), []).compare(setting_in(77, 18.0)).departures == ()


@pytest.mark.parametrize('count', [1, 6])
def test_a_force_may_turn_a_moment_later(count: int) -> None:
    good = GoodRuns(setting_in(1, 90.0), [setting_in(it, 90.0) for it in range(2, count + 1)])
    found = good.compare(setting_in(77, 90.0, later_s=0.08)).departures
    assert [it.signal.name for it in found if 'direction' in it.signal.name] == []
