# SPDX-License-Identifier: BSD-3-Clause
"""Objects near robots: alarms, and times or positions in a recording."""
from __future__ import annotations

from typing import Any, List, Tuple

from hypothesis import example, given
from hypothesis import strategies as st

from process_visualizer.health.alarm_board import Action, AlarmBoard
from process_visualizer.health.alarm_conditions import object_conditions
from process_visualizer.health.device_state import Level
from process_visualizer.health.near_objects import (
    HOLD_S,
    NearMoment,
    NearObject,
    ObjectSpans,
    ObjectWatch,
    SeenObject,
    times,
)

WARN_M, STOP_M = 0.5, 0.2


def seen(distance_m: float, number: int = 1) -> SeenObject:
    level = Level.BAD if distance_m < STOP_M else \
        Level.WARNING if distance_m < WARN_M else Level.GOOD
    return SeenObject(number, 'ur_rt_upper/forearm_link', distance_m, (0.24, 0.181, 0.3), level)


def levels(watch: ObjectWatch, now_s: float) -> List[Tuple[int, Level]]:
    return [(it.seen.number, it.level) for it in watch.present(now_s)]


# The watch

def test_an_object_comes_near_at_once_and_goes_a_moment_later() -> None:
    watch = ObjectWatch(WARN_M, STOP_M)
    watch.take([seen(0.9)], 1.0)
    assert watch.present(1.0) == ()
    watch.take([seen(0.31)], 2.0)
    (near,) = watch.present(2.0)
    assert (near.level, near.since_s) == (Level.WARNING, 2.0)
    assert (levels(watch, 60.0), watch.ends_s(60.0)) == ([(1, Level.WARNING)], None)
    watch.take([], 61.0)
    assert watch.present(61.0) == ()  # it was last seen 59 s earlier
    watch.take([seen(0.31)], 62.0)
    watch.take([], 62.1)
    assert (levels(watch, 62.4), watch.ends_s(62.4)) == ([(1, Level.WARNING)], 62.0 + HOLD_S)
    assert levels(watch, 62.5) == []


def test_what_comes_too_near_is_worse() -> None:
    watch = ObjectWatch(WARN_M, STOP_M)
    for now_s, distance_m in ((1.0, 0.4), (1.1, 0.19), (1.2, 0.4)):
        watch.take([seen(distance_m)], now_s)
    assert levels(watch, 1.2) == [(1, Level.BAD)]
    assert levels(watch, 1.7) == [(1, Level.WARNING)]
    assert watch.present(1.7)[0].since_s == 1.0


def test_noise_at_a_limit_does_not_flicker() -> None:
    watch = ObjectWatch(WARN_M, STOP_M)
    watch.take([seen(0.499)], 0.0)
    for step in range(1, 100):
        watch.take([seen(0.503 if step % 10 else 0.499)], 0.1 * step)
        assert levels(watch, 0.1 * step) == [(1, Level.WARNING)]
    watch.take([seen(0.54)], 11.0)
    assert levels(watch, 11.0 + HOLD_S) == []


@example([(0.3, []), (0.011718750000000215, []), (0.25000000000000017, [0.0])])
@given(st.lists(st.tuples(st.floats(0.01, 0.3), st.lists(st.floats(0.0, 1.0), max_size=3))))
def test_nothing_near_is_left_out_and_nothing_far_stays(steps: Any) -> None:
    watch, now_s = ObjectWatch(WARN_M, STOP_M), 0.0
    for passed_s, distances_m in steps:
        now_s += passed_s
        watch.take([seen(it, number) for number, it in enumerate(distances_m)], now_s)
        told = dict(levels(watch, now_s))
        for number, distance_m in enumerate(distances_m):
            assert told.get(number, Level.GOOD) >= seen(distance_m).level
    watch.take([], now_s)
    assert watch.present(now_s + HOLD_S) == () and watch.ends_s(now_s + HOLD_S) is None


# As alarms

def test_the_alarm_of_an_object() -> None:
    near = NearObject(seen(0.31), Level.WARNING, 12.0)
    (found,) = object_conditions('kinect', [near])
    assert found.text == "object 1 is 0.31 m from ur_rt_upper's forearm_link: 24 × 18 × 30 cm"
    assert (found.source, found.level, found.since_s) == ('kinect', Level.WARNING, 12.0)
    assert found.actions == (Action.REPLAY,)


def test_coming_too_near_is_another_event() -> None:
    board = AlarmBoard()
    for now_s, distance_m, level in ((1.0, 0.4, Level.WARNING), (2.0, 0.1, Level.BAD),
                                     (3.0, 0.3, Level.WARNING)):
        board = board.seen(object_conditions('kinect', [NearObject(seen(distance_m), level, 1.0)]),
                           now_s)
    board = board.seen([], 4.0)
    assert [(event.time_s, event.text.split(' m from')[0]) for event in board.events] == [
        (1.0, 'kinect: object 1 is 0.40'), (2.0, 'kinect: object 1 is 0.10'),
        (4.0, 'kinect: object 1 is 0.30')]
    assert board.events[-1].text.endswith(': over after 3.0 s')


def test_in_a_recording_it_has_the_place_where_it_began() -> None:
    spans, near = ObjectSpans(), NearObject(seen(0.31), Level.WARNING, 12.0)
    assert object_conditions('kinect', [near], spans) == []
    for time_s in (7.0, 7.1, 7.2):
        spans.take('kinect', [near.seen], [near], NearMoment(1, time_s))
    (found,) = object_conditions('kinect', [near], spans)
    assert (found.position_s, found.actions) == (7.0, (Action.GO_THERE,))


# Spans

def passed(spans: ObjectSpans, segment: int, *steps: Tuple[float, float]) -> None:
    """Process an object at times, each with its distance [s, m]."""
    for time_s, distance_m in steps:
        it = seen(distance_m)
        near = [NearObject(it, it.level, 0.0)] if it.level > Level.GOOD else []
        spans.take('kinect', [it], near, NearMoment(segment, time_s))


def test_a_span_grows_while_it_is_played_in_both_directions() -> None:
    spans = ObjectSpans()
    passed(spans, 1, (5.0, 0.9), (6.0, 0.4), (7.0, 0.1), (8.0, 0.3), (9.0, 0.9))
    assert times(spans.spans, Level.WARNING) == ((6.0, 8.0),)
    assert times(spans.spans, Level.BAD) == ((7.0, 7.0),)
    assert spans.spans[0].text.startswith('object 0.10 m from')
    passed(spans, 2, (8.1, 0.3), (5.5, 0.3))
    assert times(spans.spans, Level.WARNING) == ((5.5, 8.1),)
    assert spans.begun_s('kinect', 1) == 6.0  # time of the first detection in this direction


def test_nothing_is_told_of_what_was_jumped_over() -> None:
    spans = ObjectSpans()
    passed(spans, 1, (5.0, 0.4), (6.0, 0.4))
    passed(spans, 2, (50.0, 0.4))
    assert times(spans.spans, Level.WARNING) == ((5.0, 6.0), (50.0, 50.0))
    assert spans.begun_s('kinect', 1) == 50.0


def test_it_was_away_between() -> None:
    spans = ObjectSpans()
    passed(spans, 1, (5.0, 0.4), (6.0, 0.9), (7.0, 0.4))
    assert times(spans.spans, Level.WARNING) == ((5.0, 5.0), (7.0, 7.0))
    spans.forget(6.0)
    assert times(spans.spans, Level.WARNING) == ((7.0, 7.0),)
