# SPDX-License-Identifier: BSD-3-Clause
"""The state of playback in the window as a value: what each transition keeps and changes."""
from __future__ import annotations

from typing import List, Optional, Tuple

import pytest
from hypothesis import given
from hypothesis import strategies as st
from playback_stand import PAUSED

from process_visualizer.gui.playback.playback_state import (
    MIN_LOOP_S,
    TIMES,
    LoopPoints,
    Marks,
    PlacedMark,
    PlaybackState,
    SeekTarget,
)

LENGTH_S = PAUSED.duration_s
CHOSEN = PlaybackState(
    PAUSED,
    SeekTarget(7.0, PAUSED.segment),
    LoopPoints(2.0, 5.0),
    True,
    TIMES[0],
    Marks.of([PlacedMark(3.0, 'seam')]),
    PAUSED.files,
)
SENT_S = PAUSED.stamp_s
times = st.floats(-1.0, LENGTH_S + 1.0)


def test_what_the_player_says_changes_nothing_that_the_operator_has_chosen() -> None:
    told = CHOSEN.updated(PAUSED._replace(position_s=1.0), asks_for_loop=False)
    assert told._replace(snapshot=PAUSED) == CHOSEN


@pytest.mark.parametrize('loop, asks, expected', [
    ((4.0, 8.0), False, LoopPoints(4.0, 8.0)),
    ((4.0, 8.0), True, CHOSEN.points),
    (None, False, CHOSEN.points),
])
def test_a_loop_of_somebody_else_is_taken_over_unless_one_is_asked_for(
        loop: Optional[Tuple[float, float]], asks: bool, expected: LoopPoints) -> None:
    assert CHOSEN.updated(PAUSED._replace(loop=loop), asks).points == expected


def test_a_loop_that_the_player_had_already_leaves_points_that_were_moved() -> None:
    looping = PAUSED._replace(loop=(4.0, 8.0))
    moved = CHOSEN._replace(snapshot=looping, points=LoopPoints(4.0, 9.0))
    seen = moved.updated(looping._replace(position_s=5.0), asks_for_loop=False)
    assert seen.points == moved.points


@pytest.mark.parametrize('loop, expected', [
    (None, LoopPoints()), ((4.0, LENGTH_S), LoopPoints(4.0))])
def test_another_recording_has_points_of_its_own(loop: Optional[Tuple[float, float]],
                                                 expected: LoopPoints) -> None:
    other = PAUSED._replace(files=('/bags/b.bag',), loop=loop)
    assert CHOSEN.updated(other, asks_for_loop=False).points == expected
    assert CHOSEN.updated(None, asks_for_loop=False).updated(other, False).points == expected


@pytest.mark.parametrize('segment, stamp_s, sent_s, holds', [
    (1, SENT_S + 1.0, SENT_S, True),  # of the segment that the seek is to end
    (2, SENT_S - 0.1, SENT_S, True),  # from before the seek was sent
    (2, SENT_S + 1.0, None, True),  # still in progress
    (2, SENT_S, SENT_S, False),
])
def test_a_seek_holds_until_the_player_tells_of_it(segment: int, stamp_s: float,
                                                   sent_s: Optional[float], holds: bool) -> None:
    state = CHOSEN._replace(snapshot=PAUSED._replace(segment=segment, stamp_s=stamp_s))
    assert state.arrived(sent_s) == (state if holds else state._replace(sought=None))


def test_without_a_player_nothing_is_sought() -> None:
    gone = CHOSEN._replace(snapshot=None)
    assert gone.arrived(None).sought is None
    assert gone.failed(SeekTarget(9.0, 1)).sought is None


def test_a_failure_leads_back_to_what_the_player_does() -> None:
    looping = CHOSEN._replace(snapshot=PAUSED._replace(loop=(4.0, 8.0)))
    assert looping.failed(None) == looping._replace(sought=None, points=LoopPoints(4.0, 8.0))
    assert CHOSEN.failed(SeekTarget(9.0, 1)) == CHOSEN._replace(sought=SeekTarget(9.0, 1))


@pytest.mark.parametrize('changes, differs', [
    ({'position_s': 1.0, 'stamp_s': 2.0, 'published': 3, 'segment': 4}, False),
    ({'achieved_rate': 0.001}, False), ({'achieved_rate': 0.5}, True), ({'paused': False}, True)])
def test_another_position_is_no_other_state(changes: dict, differs: bool) -> None:
    assert CHOSEN._replace(snapshot=PAUSED._replace(**changes)).differs_from(CHOSEN) == differs


@given(times)
def test_a_seek_leads_into_the_recording(position_s: float) -> None:
    sought = CHOSEN.sought_at(position_s)
    assert sought.segment == PAUSED.segment
    assert 0.0 <= sought.position_s <= LENGTH_S
    assert sought.position_s == position_s or not 0.0 <= position_s <= LENGTH_S


@given(st.lists(st.tuples(st.sampled_from(['begin', 'end', 'A', 'B']), times.map(CHOSEN.within))))
def test_a_comes_before_b_whatever_is_set_and_dragged(changes: List[Tuple[str, float]]) -> None:
    points = LoopPoints()
    for what, time_s in changes:
        changed = {'begin': points.with_begin(time_s), 'end': points.with_end(time_s)}.get(
            what, points.moved(what, time_s, LENGTH_S))
        begin_s, end_s = changed.bounds(LENGTH_S)
        assert 0.0 <= begin_s <= end_s <= LENGTH_S
        if what in 'AB':
            assert end_s - begin_s >= MIN_LOOP_S - 1e-6
        points = changed if changed.is_long_enough(LENGTH_S) else points


@given(st.lists(st.integers(0, 20)), st.booleans())
def test_from_mark_to_mark_none_is_left_out(positions_s: List[int], playing: bool) -> None:
    marks = Marks.of(PlacedMark(float(it), str(it)) for it in positions_s)
    expected = sorted({float(it) for it in positions_s})
    there, position_s = [], marks.after(-1.0)
    while position_s is not None:
        there.append(position_s)
        position_s = marks.after(position_s)
    assert there == expected
    back, position_s = [], marks.before(LENGTH_S + 1.0, playing)
    while position_s > 0.0:
        back.append(position_s)
        position_s = marks.before(position_s, playing)
    assert back == [it for it in reversed(expected) if it > 0.0]
