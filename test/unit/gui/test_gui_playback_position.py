# SPDX-License-Identifier: BSD-3-Clause
"""The position between states: smooth, within its limits, and never against the direction."""
from __future__ import annotations

from typing import List

import pytest
from hypothesis import given
from hypothesis import strategies as st
from playback_stand import PAUSED

from process_visualizer.gui.playback.playback_state import MAX_AHEAD_S, PlaybackPosition
from process_visualizer.gui.ros.snapshots import PlayerSnapshot

PLAYING = PAUSED._replace(paused=False, achieved_rate=1.0, position_s=5.0)


def position_of(snapshot: PlayerSnapshot) -> PlaybackPosition:
    position = PlaybackPosition()
    position.take(snapshot)
    return position


@pytest.mark.parametrize('rate', [1.0, 0.25, 4.0, -1.0, -16.0])
def test_between_two_states_it_runs_at_the_rate(rate: float) -> None:
    position = position_of(PLAYING._replace(rate=rate, achieved_rate=rate))
    assert position.at(1000.1) == pytest.approx(5.0 + 0.1 * rate)


def test_it_runs_as_fast_as_the_machine_does() -> None:
    assert position_of(PLAYING._replace(achieved_rate=0.5)).at(1000.2) == pytest.approx(5.1)


def test_it_stands_while_paused() -> None:
    assert position_of(PLAYING._replace(paused=True)).at(1003.0) == 5.0


def test_it_waits_for_a_player_that_says_nothing_any_more() -> None:
    assert position_of(PLAYING).at(1060.0) == pytest.approx(5.0 + MAX_AHEAD_S)


def test_a_state_from_the_future_is_not_extrapolated_into_the_past() -> None:
    assert position_of(PLAYING).at(999.0) == 5.0


@pytest.mark.parametrize('rate, position_s, limit_s', [(16.0, 19.9, 20.0), (-16.0, 0.1, 0.0)])
def test_it_ends_where_the_recording_does(rate: float, position_s: float, limit_s: float) -> None:
    ending = PLAYING._replace(rate=rate, achieved_rate=rate, position_s=position_s)
    assert position_of(ending).at(1000.4) == limit_s


@pytest.mark.parametrize('rate, position_s, shown_s', [
    (4.0, 7.0, 8.0), (-4.0, 5.0, 4.0),  # at the ends of the loop it waits for the player
    (4.0, 9.0, 10.6), (-4.0, 3.0, 1.4),  # beyond them the loop does not matter
])
def test_it_stays_in_a_loop(rate: float, position_s: float, shown_s: float) -> None:
    looping = PLAYING._replace(rate=rate, achieved_rate=rate, position_s=position_s,
                               loop=(4.0, 8.0))
    assert position_of(looping).at(1000.4) == pytest.approx(shown_s)


def test_a_jump_of_the_player_is_followed_at_once() -> None:
    position = position_of(PLAYING)
    position.at(1000.2)
    position.take(PLAYING._replace(position_s=2.0, segment=2, stamp_s=1000.2))
    assert position.at(1000.2) == 2.0


@pytest.mark.parametrize('rate', [1.0, 16.0])
def test_a_player_that_hung_is_behind_its_own_first_state(rate: float) -> None:
    """It reported the position where it should have been, and then continued from the real one."""
    playing = PLAYING._replace(rate=rate, achieved_rate=rate)
    position = position_of(playing)
    position.take(playing._replace(position_s=5.0 + 3.0 * rate, stamp_s=1003.0))
    assert position.at(1003.0) > 7.9
    position.take(playing._replace(position_s=5.1, stamp_s=1003.1))
    assert position.at(1003.1) == pytest.approx(5.1)


def test_pausing_tells_the_exact_position_even_if_it_lies_behind() -> None:
    position = position_of(PLAYING)
    position.at(1000.2)
    position.take(PLAYING._replace(paused=True, position_s=5.15, stamp_s=1000.2))
    assert position.at(1000.3) == 5.15


states = st.lists(st.tuples(st.floats(0.01, 0.2), st.floats(0.0, 1.0), st.floats(0.0, 0.3)),
                  min_size=2, max_size=40)


@given(states, st.sampled_from([1.0, -1.0]))
def test_it_never_runs_against_the_direction(steps: List[List[float]], sign: float) -> None:
    """This holds for any rate that the player reaches, and for late states."""
    position, now_s, true_s = PlaybackPosition(), 1000.0, 10.0
    shown: List[float] = []
    for interval_s, share, late_s in steps:
        now_s += interval_s
        true_s += sign * interval_s * share
        position.take(PLAYING._replace(rate=sign, achieved_rate=sign * share, position_s=true_s,
                                       stamp_s=now_s))
        shown += [position.at(now_s), position.at(now_s + interval_s * late_s)]
    moves = [sign * (after - before) for before, after in zip(shown, shown[1:])]
    assert min(moves) >= 0.0
