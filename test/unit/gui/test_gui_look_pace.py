# SPDX-License-Identifier: BSD-3-Clause
"""Live curves use a small share of a core, for any number of curves."""
from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from process_visualizer.gui.live.live_curves_model import MAX_MS, MAX_SHARE, LookPace


@given(st.floats(0.0, 0.035))
def test_the_share_is_held(cost_s: float) -> None:
    pace, period_ms = LookPace(), 200
    for _ in range(60):
        period_ms = pace.period_ms(200, cost_s, 0.001 * period_ms)
    assert 200 <= period_ms <= MAX_MS
    assert cost_s / (0.001 * period_ms) <= 1.2 * MAX_SHARE


def test_what_costs_little_comes_often_again() -> None:
    pace = LookPace()
    slow = [pace.period_ms(200, 0.1, 0.2) for _ in range(20)][-1]
    assert slow == MAX_MS
    assert [pace.period_ms(200, 0.001, 0.5) for _ in range(20)][-1] == 200


@pytest.mark.parametrize('wanted_ms', [500, 1000])
def test_what_comes_seldom_anyway_stays(wanted_ms: int) -> None:
    assert LookPace().period_ms(wanted_ms, 10.0, 0.5) == wanted_ms
