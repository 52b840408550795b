# SPDX-License-Identifier: BSD-3-Clause
"""The time on /clock."""
from __future__ import annotations

from dataclasses import replace
from typing import List, Tuple

import pytest
from hypothesis import given
from hypothesis import strategies as st

from process_visualizer.playback.timeline import TimelineState
from process_visualizer.player.bag_publishers import SimulatedTime, next_tick_s

BASIS = TimelineState(0, 0, 0, 10 ** 9)


@given(st.lists(st.tuples(st.integers(0, 3), st.integers(0, 1000)), min_size=1, max_size=60),
       st.sampled_from([1.0, -1.0]))
def test_within_a_scene_it_goes_one_way_only(positions: List[Tuple[int, int]],
                                             rate: float) -> None:
    simulated = SimulatedTime()
    last_scene, last_ns = -1, 0
    for scene, bag_ns in sorted(positions, key=lambda it: it[0]):
        told_ns, goes_back = simulated.at(replace(BASIS, scene=scene, rate=rate), bag_ns)
        assert goes_back == (told_ns < last_ns)
        if scene != last_scene:
            assert told_ns == bag_ns
        elif rate > 0.0:
            assert told_ns == max(bag_ns, last_ns)
        else:
            assert told_ns == min(bag_ns, last_ns)
        last_scene, last_ns = scene, told_ns


def test_a_jump_back_is_told_once() -> None:
    simulated = SimulatedTime()
    jumped = replace(BASIS, scene=1)
    assert simulated.at(BASIS, 900) == (900, False)
    assert simulated.at(jumped, 300) == (300, True)
    assert simulated.at(jumped, 325) == (325, False)
    assert simulated.at(jumped, 300) == (325, False)  # playback slipped: the clock waits
    assert simulated.at(jumped, 330) == (330, False)


@given(st.lists(st.floats(0.0, 0.0099), min_size=1, max_size=200))
def test_who_wakes_up_late_by_less_than_a_period_leaves_nothing_out(late_s: List[float]) -> None:
    due_s = 5.0
    for it in late_s:
        due_s = next_tick_s(due_s, due_s + it, 0.01)
    assert due_s == pytest.approx(5.0 + 0.01 * len(late_s))


@given(st.integers(2, 1000), st.floats(0.1, 0.9))
def test_what_is_late_by_whole_periods_is_left_out(periods: int, part: float) -> None:
    now_s = 5.0 + 0.01 * (periods + part)
    assert next_tick_s(5.0, now_s, 0.01) == pytest.approx(5.0 + 0.01 * periods)
