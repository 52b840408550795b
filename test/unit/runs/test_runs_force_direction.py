# SPDX-License-Identifier: BSD-3-Clause
from __future__ import annotations

import numpy as np
import pytest
from made_runs import made_run

from process_visualizer.runs.comparison.comparison import GoodRuns
from process_visualizer.runs.run import Run, ToolForce


def pressed(seed: int, turned_deg: float = 0.0) -> Run:
    """A run with a force of 20 N, which turns to the side after 5 s and stays as great."""
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
