# SPDX-License-Identifier: BSD-3-Clause
from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from made_runs import made_run

from process_visualizer.runs.alignment.alignment import AlignmentMethod, aligned, common_events
from process_visualizer.runs.alignment.slope_limited_warp import band_around, warp
from process_visualizer.runs.alignment.time_map import time_map
from process_visualizer.runs.run import Run, RunEvent, ToolMotion

TIMES = st.lists(st.floats(0.0, 100.0), min_size=1, max_size=20)
MOVING_S = np.concatenate((np.arange(1.5, 4.5, 0.05), np.arange(6.5, 8.5, 0.05)))
"""Process times."""


def errors_s(reference: Run, run: Run, speed: float, start_s: float) -> np.ndarray:
    found = aligned(reference, run)
    assert found.method is AlignmentMethod.MOTION
    return np.abs(found.time_map.to_run(2.0 + MOVING_S) - (start_s + speed * MOVING_S))


@given(TIMES, TIMES)
def test_a_map_rises_and_has_an_inverse(first: 'list[float]', second: 'list[float]') -> None:
    count = min(len(first), len(second))
    found = time_map(np.array(first[:count]), np.array(second[:count]))
    times_s = np.linspace(-10.0, 120.0, 200)
    there = found.to_run(times_s)
    assert (np.diff(there) >= 0.0).all()
    steps = np.diff(found.reference_s), np.diff(found.run_s)
    if count == 1 or min(step.min() for step in steps) > 0.01:
        np.testing.assert_allclose(found.to_reference(there), times_s, atol=1e-6)


def test_a_run_belongs_to_itself() -> None:
    run = made_run()
    times_s = np.arange(0.0, run.duration_s, 0.1)
    np.testing.assert_allclose(aligned(run, run).time_map.to_run(times_s), times_s, atol=2e-4)


@settings(max_examples=25)
@given(speed=st.floats(0.9, 1.1), start_s=st.floats(0.0, 7.0), has_events=st.booleans())
def test_a_known_warp_is_found(speed: float, start_s: float, has_events: bool) -> None:
    events = None if has_events else ()
    run = made_run(1, speed, start_s, events=events)
    found = errors_s(made_run(events=events), run, speed, start_s)
    assert np.median(found) < 0.01
    assert np.percentile(found, 95) < 0.02


def test_a_run_may_begin_in_the_middle_of_a_motion() -> None:
    found = aligned(made_run(), made_run(1, start_s=-2.7)).time_map
    later_s = MOVING_S[MOVING_S > 2.75]
    assert np.abs(found.to_run(2.0 + later_s) - (later_s - 2.7)).max() < 0.02


@settings(max_examples=10)
@given(speed=st.floats(0.9, 1.1), start_s=st.floats(0.0, 7.0))
def test_the_way_back_is_the_inverse(speed: float, start_s: float) -> None:
    reference, run = made_run(), made_run(1, speed, start_s)
    there, back = aligned(reference, run).time_map, aligned(run, reference).time_map
    times_s = 2.0 + MOVING_S
    assert np.percentile(np.abs(back.to_run(there.to_run(times_s)) - times_s), 95) < 0.03


def test_the_signal_that_is_judged_plays_no_part() -> None:
    plain = aligned(made_run(), made_run(1, 1.05, 4.0)).time_map
    run = made_run(1, 1.05, 4.0, value=lambda s, values: np.where(s > 3.0, 99.0, values))
    np.testing.assert_array_equal(aligned(made_run(), run).time_map.run_s, plain.run_s)


def test_what_a_tool_is_beside_its_path_is_no_time() -> None:
    run = made_run(1, 1.0, 2.0, place=lambda _, at: at + (0.0, 0.003, 0.002))
    assert np.percentile(errors_s(made_run(), run, 1.0, 2.0), 95) < 0.02


def test_a_dwell_is_a_jump_of_the_map() -> None:
    found = aligned(made_run(), made_run(1, dwell_s=0.2)).time_map
    lost_s = found.to_run(np.array([5.5])) - found.to_run(np.array([4.5])) - 1.0
    assert lost_s == pytest.approx(0.2, abs=0.01)


def moves_and_rests(slower: float, rests_s: 'list[float]') -> 'tuple[Run, np.ndarray]':
    """A tool that moves back and forth, and the times at which each movement begins and ends."""
    corners_s = np.cumsum([rests_s[0], *np.ravel([[1.5 * slower, it] for it in rests_s[1:]])])
    times_s = np.arange(0.0, corners_s[-1], 0.01)
    shares = [np.clip((times_s - begin) / (1.5 * slower), 0.0, 1.0) for begin in corners_s[:-1:2]]
    smooth = [share ** 3 * (10.0 - 15.0 * share + 6.0 * share ** 2) for share in shares]
    place = sum((-1) ** number * it for number, it in enumerate(smooth))
    noise = np.random.default_rng(int(10 * slower)).normal(0.0, 5e-5, (len(times_s), 3))
    positions = np.outer(place, [0.9, 0.3, 0.2]) + noise
    motion = ToolMotion('arm', times_s, positions)
    return Run('made', float(corners_s[-1]), (), (motion,)), corners_s


@pytest.mark.parametrize('slower, longer_s', [(1.0, 2.0), (1.1, 0.0), (0.9, 1.0), (1.0, -0.4)])
def test_tools_are_at_the_same_place_at_the_edges_of_rests(slower: float,
                                                           longer_s: float) -> None:
    rests_s = [0.7, 0.8, 0.5, 0.6]
    reference, corners_s = moves_and_rests(1.0, rests_s)
    rests_s[2] += longer_s
    run, run_corners_s = moves_and_rests(slower, rests_s)
    found = aligned(reference, run).time_map
    shares = np.linspace(0.1, 0.9, 40)
    for begin in range(0, len(corners_s) - 1, 2):
        expected, there = (it[begin] + shares * (it[begin + 1] - it[begin])
                           for it in (run_corners_s, corners_s))
        assert np.abs(found.to_run(there) - expected).max() < 0.025


def test_events_that_contradict_the_motion_do_not_bend_it() -> None:
    run = made_run(1, events=(('go', 1.6), ('back', 6.0)))
    assert np.percentile(errors_s(made_run(), run, 1.0, 2.0), 95) < 0.02


def test_without_motion_events_decide() -> None:
    found = aligned(made_run(has_motion=False), made_run(1, 1.1, 4.0, has_motion=False))
    assert found.method is AlignmentMethod.EVENTS
    np.testing.assert_allclose(found.time_map.to_run(np.array([3.0, 8.0])), [5.1, 10.6], atol=1e-9)


def test_without_motion_and_events_the_begin_decides() -> None:
    found = aligned(made_run(has_motion=False, events=()), made_run(1, has_motion=False, events=()))
    assert found.method is AlignmentMethod.BEGIN
    np.testing.assert_allclose(found.time_map.to_run(np.array([3.0])), [3.0])


def test_an_event_that_comes_twice_or_never_is_not_used() -> None:
    reference = [RunEvent('go', 1.0), RunEvent('back', 6.0)]
    found = common_events(reference, [RunEvent('go', 1.0), RunEvent('go', 3.0)])
    assert not len(found.reference_s)
    assert found.notes == (
        'the event "back" occurs once in the reference, but not here; it is ignored',
        'the event "go" occurs once in the reference, but twice here; it is ignored')


def test_events_in_another_order_are_not_used() -> None:
    reference = [RunEvent(name, time_s) for name, time_s in zip('abc', (1.0, 2.0, 3.0))]
    run = [RunEvent(name, time_s) for name, time_s in zip('abc', (1.0, 5.0, 4.0))]
    found = common_events(reference, run)
    assert found.reference_s.tolist() in ([1.0, 2.0], [1.0, 3.0])
    assert found.notes == ('1 of 3 events occur in a different order than in the reference; they '
                           'are ignored',)


@pytest.mark.parametrize('run', [
    made_run(1, place=lambda _, at: np.full_like(at, np.nan)),
    made_run(1, place=lambda s, at: np.where(s[:, np.newaxis] > 4.0, np.nan, at)),
    made_run(1)._replace(duration_s=0.0)], ids=['nowhere', 'lost half way', 'empty'])
def test_gaps_do_not_stop_it(run: Run) -> None:
    found = aligned(made_run(), run)
    assert np.isfinite(found.time_map.to_run(np.arange(0.0, 13.0))).all()


def test_an_hour_and_twenty_seconds() -> None:
    long = made_run(1, start_s=1800.0)._replace(duration_s=3600.0)
    found = aligned(made_run(), long)
    assert np.percentile(np.abs(found.time_map.to_run(2.0 + MOVING_S) - 1800.0 - MOVING_S),
                         95) < 0.02


def test_events_of_one_moment_are_no_disorder() -> None:
    """Two states are passed in one message: the order of the two events has no meaning."""
    both = [RunEvent('one', 1.0), RunEvent('two', 3.0), RunEvent('three', 3.0)]
    other = [RunEvent('one', 1.0), RunEvent('three', 3.5), RunEvent('two', 3.5)]
    for run in (both, other):
        found = common_events(both, run)
        assert found.notes == () and len(found.run_s) == 3


def test_a_gap_does_not_take_in_what_lies_before_it() -> None:
    """The run begins later and has a gap soon after, through which the alignment could jump."""
    rows = np.arange(80)
    reference = np.column_stack((np.cos(0.05 * rows), np.sin(0.05 * rows)))
    run = reference[7:].copy()
    run[9:20] = np.nan
    found = warp(reference, run, band_around(np.full(80, 40.0), np.full(80, 41.0)),
                 0.02 * float(np.var(reference, axis=0).sum()))
    known = np.isfinite(run[found[1], 0])
    assert np.abs((found[0] - found[1])[known] - 7).max() <= 2
    assert found[1][0] == 0
