# SPDX-License-Identifier: BSD-3-Clause
"""Steps from the viewer's side: by messages and by time, paused, playing and next to seeks."""
from __future__ import annotations

from typing import List

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from playback_stage import BEGIN_NS, MS, Message, Stage
from staged_playback import SECOND, check_scene_passed, messages_of_a_recording, queued, steps

from process_visualizer.playback.steps import Step
from process_visualizer.playback.timeline import CommandRefused


@settings(max_examples=300)
@given(messages_of_a_recording, st.integers(0, 300), steps, st.sampled_from([0, 8 * MS]))
def test_after_steps_what_is_seen_is_the_scene(messages: List[Message], pause_ms: int,
                                               steps: List[Step], begun_ns: int) -> None:
    stage = Stage(messages)
    stage.viewer.begun_ns = begun_ns
    stage.control.play()
    stage.clock.at(pause_ms, stage.control.pause)
    for number, step in enumerate(steps):
        stage.clock.at(400 + number, lambda step=step: queued(stage, step))
    stage.run()
    check_scene_passed(stage)


@pytest.mark.parametrize('count, duration_ms, expected', [
    (1, 0, 51), (-1, 0, 49), (1000, 0, 101), (0, 100, 60), (0, -100, 40)])
def test_a_step_just_after_a_seek_begins_there(count: int, duration_ms: int,
                                               expected: int) -> None:
    stage = Stage(SECOND)

    def seek_and_step() -> None:
        stage.control.seek(0.499)
        queued(stage, Step(count, '', duration_ms * MS))

    stage.clock.at(10, seek_and_step)
    stage.run()
    assert stage.playback.passed == expected
    assert stage.viewer.jumps[-1] == stage.timeline.position_ns()
    check_scene_passed(stage)


def test_a_step_while_it_plays_begins_at_the_position() -> None:
    stage = Stage([Message(number % 2, number) for number in range(301)])
    stage.viewer.begun_ns = 8 * MS  # a message that is being sent belongs to a later position
    stage.control.play()
    answers = []
    stage.clock.at(100, lambda: answers.append(stage.playback.request(Step(1, '', 0))))
    stage.run()
    assert answers[0].result(0).count == stage.playback.passed == 102
    check_scene_passed(stage)


def test_a_seek_while_a_step_is_done_comes_after_it() -> None:
    stage = Stage(SECOND)

    def seek_once() -> None:
        stage.viewer.watch = lambda: None
        stage.control.seek(0.2)

    def step() -> None:
        stage.viewer.watch = seek_once
        queued(stage, Step(0, '', 300 * MS))

    stage.clock.at(10, step)
    stage.run()
    assert stage.timeline.position_ns() == BEGIN_NS + 200 * MS
    check_scene_passed(stage)


def test_steps_that_come_quickly_never_take_back_what_was_published_at_once() -> None:
    stage = Stage(SECOND)
    stage.viewer.begun_ns = 8 * MS
    stage.control.play()
    stage.clock.at(103, lambda: queued(stage, Step(1, '', 0)))  # the message of 110 ms has started
    for time_ms in (104, 105, 106):
        stage.clock.at(time_ms, lambda: queued(stage, Step(0, '', 20 * MS)))
    stage.run()
    assert stage.timeline.position_ns() == BEGIN_NS + 170 * MS
    check_scene_passed(stage)


@pytest.mark.parametrize('count, topic, expected', [
    (1, '', 51), (3, '', 53), (-1, '', 49), (1, '/b', 52), (2, '/a', 53), (-1, '/a', 48),
    (1000, '', 101), (-1000, '', 0)])
def test_a_step_by_messages(count: int, topic: str, expected: int) -> None:
    stage = Stage(SECOND)
    stage.clock.at(0, lambda: stage.control.seek(0.499))  # 50 messages passed, the last on /b
    answers = []
    stage.clock.at(1, lambda: answers.append(stage.playback.request(Step(count, topic, 0))))
    stage.run()
    assert answers[0].result(0).count == stage.playback.passed == expected
    assert stage.timeline.state.paused


def test_a_step_beyond_the_end_is_refused_and_changes_nothing() -> None:
    stage = Stage(SECOND)
    stage.clock.at(0, lambda: stage.control.seek(1.0))
    answers = []
    stage.clock.at(1, lambda: answers.append(stage.playback.request(Step(1, '', 0))))
    stage.clock.at(2, lambda: answers.append(stage.playback.request(Step(1, '/nothing', 0))))
    stage.run()
    with pytest.raises(CommandRefused, match='no message after'):
        answers[0].result(0)
    with pytest.raises(CommandRefused, match='/nothing is not in the recording'):
        answers[1].result(0)
    assert stage.timeline.position_ns() == BEGIN_NS + 1000 * MS


def test_messages_stepped_through_with_equal_stamps_keep_them_equal() -> None:
    stage = Stage([Message(0, 0), Message(0, 10), Message(1, 10)])
    for number in range(2):
        stage.clock.at(50 * number, lambda: stage.playback.request(Step(1, '', 0)))
    stage.run()
    shown = {it.number: it for it in stage.viewer.log
             if it.now_ns <= stage.clock.begin_ns + 50 * MS}
    assert shown[2].now_ns > shown[1].now_ns
    assert shown[2].stamp_ns == shown[1].stamp_ns
