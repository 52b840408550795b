# SPDX-License-Identifier: BSD-3-Clause
"""Playback from the viewer's side, compared with a scan of the recording from its beginning."""
from __future__ import annotations

from contextlib import suppress
from functools import partial
from random import Random
from typing import Callable, List, Tuple

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from playback_stage import (
    BEGIN_NS,
    LATCHED,
    MARKERS,
    MS,
    PATH,
    STATIC,
    Message,
    Stage,
    number_in,
    static_in,
)
from staged_playback import (
    SECOND,
    check_scene,
    check_scene_passed,
    messages_of_a_recording,
    queued,
    steps,
)

from process_visualizer.playback.steps import Step
from process_visualizer.playback.timeline import CommandRefused

rates = st.sampled_from([0.01, 0.25, 1.0, 3.0, 16.0, -0.1, -1.0, -4.0])
commands = st.one_of(
    st.just(('play',)), st.just(('pause',)), st.just(('toggle_paused',)), st.just(('stop',)),
    st.tuples(st.just('seek'), st.floats(-0.1, 0.5)),
    st.tuples(st.just('set_rate'), rates),
    st.tuples(st.just('set_loop'), st.just(True), st.floats(0.0, 0.1), st.floats(0.11, 0.4)),
    st.just(('set_loop', False)),
)
scripts = st.lists(st.tuples(st.integers(0, 500), commands), max_size=8)


def obeying(action: Callable[..., object], *arguments: object) -> Callable[[], None]:
    """Action for the script that accepts a refusal."""
    def act() -> None:
        with suppress(CommandRefused):
            action(*arguments)
    return act


@given(messages_of_a_recording, st.sampled_from([0.25, 1.0, 16.0]))
def test_every_message_is_published_once_in_order_and_when_it_is_due(
        messages: List[Message], rate: float) -> None:
    stage = Stage(messages)
    stage.control.set_rate(rate)
    stage.control.play()
    begin_ns = stage.clock.now_ns
    stage.run()
    log = [shown for shown in stage.viewer.log
           if shown.connection != MARKERS or b'\x03\x00\x00\x00' not in shown.data[28:40]]
    log = log[:len(messages)]  # the rest repeats the scene
    assert [shown.connection for shown in log] == [it.connection for it in stage.messages]
    first_ms = stage.messages[0].time_ms
    for shown, message in zip(log, stage.messages):
        due_ns = begin_ns + round((message.time_ms - first_ms) * MS / rate)
        assert abs(shown.now_ns - due_ns) <= 1
    assert stage.viewer.finished == (len({it.time_ms for it in messages}) > 0)


@given(messages_of_a_recording)
def test_bytes_are_as_recorded_but_for_the_stamps(messages: List[Message]) -> None:
    stage, recorded = Stage(messages), Stage(messages, restamp=False)
    for it in (stage, recorded):
        it.control.play()
        it.run()
    assert len(stage.viewer.log) == len(recorded.viewer.log)
    for moved, kept in zip(stage.viewer.log, recorded.viewer.log):
        assert (moved.connection, len(moved.data)) == (kept.connection, len(kept.data))
        if moved.connection < STATIC:
            assert moved.data[12:] == kept.data[12:] and moved.data[:4] == kept.data[:4]
            assert kept.stamp_ns == stage.messages[kept.number].time_ns
            assert moved.stamp_ns <= moved.now_ns + stage.clock.wall_offset_ns


@settings(max_examples=300)
@given(messages_of_a_recording, scripts, st.sampled_from([0, 8 * MS]))
def test_when_paused_what_is_seen_is_the_scene_at_the_position(
        messages: List[Message], script: List[Tuple[int, Tuple[object, ...]]],
        begun_ns: int) -> None:
    stage = Stage(messages)
    stage.viewer.begun_ns = begun_ns
    for time_ms, (name, *arguments) in script:
        stage.clock.at(time_ms, obeying(getattr(stage.control, str(name)), *arguments))
    stage.clock.at(600, stage.control.pause)
    stage.run()
    check_scene(stage)


@given(messages_of_a_recording, st.integers(0, 300))
def test_playing_backwards_shows_at_each_moment_the_scene_of_that_moment(
        messages: List[Message], pause_ms: int) -> None:
    stage = Stage(messages)
    stage.control.set_rate(-1.0)
    stage.control.play()
    stage.clock.at(pause_ms, stage.control.pause)
    stage.run()
    check_scene(stage)


@settings(max_examples=500)
@given(messages_of_a_recording, st.lists(st.tuples(st.integers(0, 4), commands), max_size=6),
       steps, st.randoms(use_true_random=False), st.sampled_from([0, 8 * MS]))
def test_commands_in_the_middle_of_others_end_in_the_scene_at_the_position(
        messages: List[Message], script: List[Tuple[int, Tuple[object, ...]]], steps: List[Step],
        random: Random, begun_ns: int) -> None:
    stage = Stage(messages)
    stage.viewer.begun_ns, stage.viewer.work_ns = begun_ns, 3 * MS
    actions = [(gap, obeying(getattr(stage.control, str(name)), *arguments))
               for gap, (name, *arguments) in script]
    actions += [(0, partial(queued, stage, step)) for step in steps]
    random.shuffle(actions)

    def act() -> None:  # called after each message, whatever the player is doing
        while actions and actions[0][0] == 0:
            actions.pop(0)[1]()
        if actions:
            actions[0] = (actions[0][0] - 1, actions[0][1])
        if stage.clock.now_ns > stage.clock.begin_ns + 3000 * MS:
            stage.control.pause()  # also if it is always late and never waits

    stage.viewer.watch = act
    stage.control.play()
    for time_ms in range(400, 600, 10):
        stage.clock.at(time_ms, act)
    stage.clock.at(3000, stage.control.pause)
    stage.run()
    check_scene_passed(stage)


def test_a_pause_before_the_scene_of_a_seek_was_published_shows_what_was_played_since() -> None:
    stage = Stage(SECOND)

    def pause_once() -> None:
        stage.viewer.watch, stage.viewer.work_ns = lambda: None, 0
        stage.control.pause()

    def seek() -> None:
        stage.viewer.watch, stage.viewer.work_ns = pause_once, 15 * MS
        stage.control.seek(0.2)

    stage.control.play()
    stage.clock.at(500, seek)
    stage.run()
    assert stage.timeline.position_ns() == BEGIN_NS + 215 * MS
    check_scene_passed(stage)


def test_play_and_pause_while_a_scene_is_published_show_what_was_played() -> None:
    stage = Stage(SECOND)
    commands = [stage.control.play, stage.control.pause]

    def act() -> None:
        if commands:
            commands.pop(0)()

    def seek() -> None:
        stage.viewer.watch, stage.viewer.work_ns = act, 15 * MS
        stage.control.seek(0.2)

    stage.clock.at(50, seek)
    stage.run()
    assert stage.timeline.position_ns() == BEGIN_NS + 215 * MS
    check_scene_passed(stage)


def test_a_scene_repeated_at_a_pause_is_that_of_the_pause() -> None:
    stage = Stage(SECOND)

    def pause_and_repeat() -> None:
        stage.control.pause()
        stage.playback.repeat_scene()

    stage.control.play()
    stage.clock.at(200, lambda: setattr(stage.clock, 'now_ns', stage.clock.now_ns + 60 * MS))
    stage.clock.at(201, pause_and_repeat)
    stage.run()
    check_scene_passed(stage)


@given(st.integers(0, 1000), st.sampled_from([0.25, 1.0, 4.0, -1.0]))
def test_nothing_beyond_the_position_is_seen_when_a_pause_comes(pause_ms: int,
                                                                rate: float) -> None:
    stage = Stage(SECOND)
    if rate < 0.0:
        stage.control.seek(1.0)
    stage.control.set_rate(rate)
    stage.control.play()
    stage.clock.at(pause_ms, stage.control.pause)
    stage.run()
    position_ns = stage.timeline.position_ns()
    times_ns = [stage.messages[number].time_ns for number in stage.numbers()]
    if rate > 0.0:  # /b has no message so far, and its first one comes soon
        seen_ns = {time_ns for time_ns in times_ns if time_ns != stage.messages[1].time_ns}
        assert max(seen_ns) <= position_ns
        assert len(seen_ns) == stage.playback.passed - (stage.playback.passed > 1)
    else:
        assert min(times_ns) >= position_ns - 20 * MS  # the last visible message of each topic


def test_a_change_of_the_rate_takes_effect_on_the_next_message() -> None:
    stage = Stage(SECOND)
    stage.control.play()
    stage.clock.at(205, lambda: stage.control.set_rate(0.5))
    stage.run()
    seen_ms = [(it.now_ns - stage.clock.begin_ns) / MS for it in stage.viewer.log[:101]]
    assert seen_ms[:21] == [10 * number for number in range(21)]
    assert seen_ms[21:] == [215 + 20 * number for number in range(80)]
    stamps_ms = [it.stamp_ns / MS - stage.clock.wall_offset_ns / MS for it in stage.viewer.log]
    assert all(stamp - stage.clock.begin_ns / MS <= seen
               for stamp, seen in zip(stamps_ms, seen_ms))


def test_what_is_given_ahead_is_bounded() -> None:
    stage = Stage([Message(0, number) for number in range(101)], lead_bytes=1500)  # two messages
    waiting = []
    stage.viewer.watch = lambda: waiting.append(stage.viewer.waiting)
    stage.control.play()
    stage.run()
    assert stage.numbers()[:101] == list(range(101))
    assert 1 < max(waiting) <= 4


def test_what_was_taken_back_at_a_pause_is_stamped_anew() -> None:
    stage = Stage(SECOND)
    stage.control.play()
    stage.clock.at(205, stage.control.pause)
    stage.clock.at(5000, stage.control.play)
    stage.run()
    later = [it for it in stage.viewer.log if it.number > 20][:20]
    assert [it.number for it in later] == list(range(21, 41))
    for it in later:
        assert it.stamp_ns == it.now_ns + stage.clock.wall_offset_ns


def test_playing_at_a_loop_repeats_exactly_the_messages_within() -> None:
    stage = Stage(SECOND)
    stage.control.set_loop(True, 0.2, 0.4)
    stage.clock.at(0, lambda: stage.control.seek(0.2))
    stage.clock.at(0, stage.control.play)
    stage.clock.at(590, stage.control.pause)
    stage.run()
    numbers = stage.numbers()
    round_ = list(range(20, 41))
    begin = numbers.index(20)
    again = numbers.index(20, begin + 1)
    assert numbers[begin:begin + 21] == round_
    assert numbers[again:again + 21] == round_
    assert stage.timeline.state.segment >= 3


def test_when_the_receiver_is_too_slow_all_slows_down_and_nothing_is_lost() -> None:
    stage = Stage(SECOND)
    stage.viewer.work_ns = 20 * MS  # while messages are 10 ms apart
    rates = []
    stage.viewer.watch = lambda: rates.append(stage.timeline.achieved_rate())
    stage.control.play()
    stage.run()
    assert stage.numbers()[:101] == list(range(101))
    times_ms = [(shown.now_ns - stage.clock.begin_ns) / MS for shown in stage.viewer.log[:101]]
    assert all(later - earlier >= 19.99 for earlier, later in zip(times_ms, times_ms[1:]))
    assert rates[80] == pytest.approx(0.5, abs=0.1)


def test_a_short_delay_is_caught_up() -> None:
    stage = Stage(SECOND)
    stage.clock.at(200, lambda: setattr(stage.clock, 'now_ns', stage.clock.now_ns + 60 * MS))
    stage.control.play()
    stage.run()
    assert (stage.viewer.log[100].now_ns - stage.clock.begin_ns) / MS == pytest.approx(1000)


def test_who_comes_late_while_it_plays_gets_all_static_transforms() -> None:
    stage = Stage([Message(STATIC, 0), Message(0, 100), Message(STATIC, 500), Message(0, 900)])
    late = []
    stage.clock.at(0, lambda: stage.control.seek(0.3))
    stage.clock.at(1, stage.control.play)
    stage.clock.at(400, lambda: late.append(static_in(stage.viewer.latched[STATIC])))
    stage.run()
    assert late == [{'frame0': 0.0, 'frame2': 2.0}]


def test_backwards_the_message_of_a_publisher_that_came_later_disappears() -> None:
    one, two = LATCHED, LATCHED + 1
    stage = Stage([Message(one, 0), Message(two, 500), Message(0, 900)])
    stage.control.seek(0.9)
    stage.control.set_rate(-1.0)
    stage.control.play()
    stage.clock.at(600, stage.control.pause)
    stage.run()
    assert stage.viewer.newest['/latched'] == 0
    assert [number_in(data) for data in stage.viewer.latched.values()] == [0]


def test_at_the_beginning_nothing_is_seen_of_what_a_seek_came_from() -> None:
    soon, late = 0, PATH
    stage = Stage([Message(1, 0), Message(soon, 27), Message(late, 300), Message(soon, 900)])
    stage.clock.at(0, lambda: stage.control.seek(0.9))
    stage.clock.at(200, lambda: stage.control.seek(0.0))
    stage.run()
    assert stage.viewer.newest == {'/a': 1, '/b': 0}
    assert stage.viewer.path == []


def test_only_the_newest_of_several_seeks_is_published() -> None:
    stage = Stage(SECOND)

    def seek_often() -> None:
        for position_s in (0.1, 0.9, 0.3, 0.5):
            stage.control.seek(position_s)

    stage.clock.at(10, seek_often)
    stage.run()
    assert stage.numbers()[:4] == [0, 1, 49, 50]  # first the scene at the beginning
    assert set(stage.numbers()[4:]) == {49, 50}
    assert stage.viewer.jumps == [BEGIN_NS, BEGIN_NS + 500 * MS]


def test_recorded_stamps_stay_also_after_a_jump_back() -> None:
    stage = Stage(SECOND, restamp=False)
    stage.control.play()
    stage.clock.at(600, lambda: stage.control.seek(0.2))
    stage.run()
    for shown in stage.viewer.log:
        assert shown.stamp_ns == stage.messages[shown.number].time_ns


def test_the_scene_is_repeated_on_request() -> None:
    stage = Stage(SECOND)
    stage.clock.at(10, lambda: stage.control.seek(0.5))
    stage.clock.at(20, stage.playback.repeat_scene)
    stage.run()
    assert stage.numbers() == [0, 1, 49, 50, 49, 50]
    first, again = [shown for shown in stage.viewer.log if shown.number == 50]
    assert again.stamp_ns - first.stamp_ns == again.now_ns - first.now_ns == 10 * MS


def test_what_is_shown_is_repeated_at_once_and_when_it_has_been_quiet_for_a_while() -> None:
    stage = Stage(SECOND)
    stage.clock.at(10, lambda: stage.control.seek(0.5))
    stage.clock.at(200, stage.control.repeat)
    stage.clock.at(210, stage.control.repeat)
    stage.run()
    assert stage.numbers() == [0, 1, *[49, 50] * 5]
    times_ms = [(shown.now_ns - stage.clock.begin_ns) / MS
                for shown in stage.viewer.log if shown.number == 50]
    assert times_ms == [10, 110, 200, 210, 310]


def test_what_plays_on_is_not_repeated() -> None:
    stage = Stage(SECOND)
    stage.control.play()
    stage.clock.at(300, stage.control.repeat)
    stage.run()
    assert stage.numbers() == [*range(101), 99, 100]  # it stops at the end


def test_the_scene_is_repeated_once_when_it_has_been_quiet_for_a_while() -> None:
    stage = Stage(SECOND)
    for time_ms, position_s in ((10, 0.2), (60, 0.3), (120, 0.5)):
        stage.clock.at(time_ms, lambda position_s=position_s: stage.control.seek(position_s))
    stage.run()
    assert stage.numbers() == [0, 1, 19, 20, 29, 30, 49, 50, 49, 50]
    assert stage.viewer.log[-1].now_ns == stage.clock.begin_ns + 220 * MS


def test_a_scene_has_the_messages_that_belong_together_by_their_stamps() -> None:
    info, image = 0, 1
    stage = Stage([Message(info, 10, stamp_ms=5), Message(image, 20, stamp_ms=5),
                   Message(info, 30, stamp_ms=25), Message(image, 40, stamp_ms=25),
                   Message(info, 50, stamp_ms=45)])
    stage.clock.at(0, lambda: stage.control.seek(0.025))
    stage.run()
    shown = stage.viewer.log[-3:]
    assert [it.number for it in shown] == [0, 1, 2]
    assert shown[0].stamp_ns == shown[1].stamp_ns <= shown[2].stamp_ns
