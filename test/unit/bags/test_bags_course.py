# SPDX-License-Identifier: BSD-3-Clause
"""`rosbag play` behavior at empty parts and at some messages; steps at the ends."""
from __future__ import annotations

from typing import Callable, List

import pytest
from playback_stage import BEGIN_NS, MS, Message, Stage

from process_visualizer.playback.player_control import PlayerControl
from process_visualizer.playback.steps import Step
from process_visualizer.playback.timeline import CommandRefused

MOSTLY_EMPTY = [Message(0, 0), Message(0, 100), Message(1, 5000), Message(0, 5100),
                Message(0, 9000)]


def seen_ms(stage: Stage) -> List[int]:
    """Arrival times of the messages from the beginning."""
    return [round((it.now_ns - stage.clock.begin_ns) / MS) for it in stage.viewer.log]


def test_what_is_empty_for_long_is_skipped() -> None:
    stage = Stage(MOSTLY_EMPTY, skip_empty_ms=1000)
    stage.viewer.ends = True
    stage.control.play()
    segment = stage.timeline.state.segment
    stage.run()
    assert stage.numbers() == [0, 1, 2, 3, 4]
    assert seen_ms(stage) == [0, 100, 100, 200, 200]
    assert stage.timeline.state.segment == segment + 2
    assert stage.timeline.position_ns() == stage.messages[-1].time_ns


def test_it_plays_evenly_where_nothing_is_empty_for_so_long() -> None:
    stage = Stage(MOSTLY_EMPTY, skip_empty_ms=4900)
    stage.viewer.ends = True
    stage.control.play()
    stage.run()
    assert seen_ms(stage) == [0, 100, 5000, 5100, 9000]


def test_it_pauses_before_each_message_of_some_topics() -> None:
    stage = Stage([Message(0, 0), Message(0, 300), Message(1, 600), Message(0, 900),
                   Message(1, 1200)], pause_topics=['/b'])
    stage.viewer.ends = True
    positions, numbers = [], []

    def go_on() -> None:
        positions.append(stage.timeline.position_ns())
        numbers.append(stage.numbers()[-1])
        stage.control.play()

    stage.control.play()
    for time_ms in (3000, 6000):
        stage.clock.at(time_ms, go_on)
    stage.run()
    assert positions == [BEGIN_NS + 600 * MS - 1, BEGIN_NS + 1200 * MS - 1]
    assert numbers == [1, 3]
    assert stage.numbers()[-1] == 4


def test_at_a_key_it_does_not_pause_any_more() -> None:
    stage = Stage([Message(0, 0), Message(1, 300), Message(1, 600)], pause_topics=['/b'])
    stage.viewer.ends = True
    assert stage.control.toggle_pause_topics() == 'not pausing at topics'
    stage.control.play()
    stage.run()
    assert stage.numbers() == [0, 1, 2]
    with pytest.raises(CommandRefused, match='--pause-topics'):
        Stage(MOSTLY_EMPTY).control.toggle_pause_topics()


def test_it_waits_for_a_node_that_has_not_come_so_far() -> None:
    stage = Stage([Message(0, 100 * number) for number in range(11)], max_delay_ms=250)
    stage.viewer.ends = True
    stage.control.play()
    stage.clock.at(1000, lambda: stage.uneven_parts.heard(BEGIN_NS + 10 * MS))
    stage.clock.at(2000, lambda: stage.uneven_parts.heard(BEGIN_NS + 300 * MS))
    stage.clock.at(2100, lambda: stage.uneven_parts.heard(BEGIN_NS + 900 * MS))
    held = []
    for time_ms in (500, 1500, 2050):
        stage.clock.at(time_ms, lambda: held.append(stage.timeline.state.held))
    stage.run()
    assert held == [True, True, False]
    assert stage.numbers() == list(range(11))  # nothing is repeated in the meantime
    assert seen_ms(stage) == [0, 100, 200, 300, *range(2100, 2800, 100)]


def test_who_is_held_can_be_paused() -> None:
    stage = Stage([Message(0, 100 * number) for number in range(11)], max_delay_ms=250)
    stage.control.play()
    stage.clock.at(1000, stage.control.pause)
    stage.clock.at(2000, lambda: stage.uneven_parts.heard(BEGIN_NS + 900 * MS))
    stage.run()
    assert max(stage.numbers()) == 3


@pytest.mark.parametrize('command', [lambda it: it.seek(0.5), lambda it: it.set_rate(2.0),
                                     lambda it: it.set_rate(-1.0), lambda it: it.play()])
def test_who_is_held_goes_on_at_a_command(command: Callable[[PlayerControl], object]) -> None:
    stage = Stage([Message(0, 100 * number) for number in range(11)], max_delay_ms=1)
    bases = []

    def go_on() -> None:
        bases.append(stage.timeline.state)
        command(stage.control)
        bases.append(stage.timeline.state)

    stage.control.play()
    stage.clock.at(1000, go_on)
    stage.run()
    assert [(it.held, it.paused) for it in bases] == [(True, True), (False, False)]


def test_at_the_end_nothing_is_published_twice() -> None:
    stage = Stage([Message(0, 1000), Message(0, 2000), Message(0, 4000)], end_ms=3000)
    stage.viewer.ends = True
    stage.control.play()
    stage.run()
    assert stage.numbers() == [0, 1]
    assert stage.viewer.finished == 1


def test_a_step_does_not_lead_beyond_the_end_that_was_chosen() -> None:
    stage = Stage([Message(0, 1000), Message(0, 2000), Message(0, 4000)], end_ms=3000)
    answers = []
    for number, count in enumerate((2, 1)):
        stage.clock.at(number, lambda count=count: answers.append(
            stage.playback.request(Step(count, '', 0))))
    stage.run()
    assert answers[0].result(0).count == 2
    assert answers[0].result(0).changed == 'only 1 of 2 messages are left'
    with pytest.raises(CommandRefused, match='no message after'):
        answers[1].result(0)
    assert set(stage.numbers()) == {0, 1}


def test_a_step_in_time_that_is_changed_says_so() -> None:
    stage = Stage([Message(0, 0), Message(0, 1000)])
    answers = []
    for number, duration_ms in enumerate((1500, -200, -5000)):
        stage.clock.at(number, lambda duration_ms=duration_ms: answers.append(
            stage.playback.request(Step(0, '', duration_ms * MS))))
    stage.run()
    assert [it.result(0).changed for it in answers] == [
        '1.500 s is outside of the recording (0 to 1.000 s): moved to the end', '',
        '-4.200 s is outside of the recording (0 to 1.000 s): moved to the beginning']


def test_a_step_before_play_begins_is_done_at_once() -> None:
    stage = Stage([Message(0, 10 * number) for number in range(11)])
    assert stage.control.step(3) == 'at 0.030 s'
    assert stage.control.step(0, '', 0.02) == 'at 0.050 s'
    stage.run()
    assert stage.playback.passed == 6
    assert set(stage.numbers()) == {5}


def test_a_step_that_is_not_come_to_is_not_done_later() -> None:
    stage = Stage([Message(0, 10 * number) for number in range(11)])
    refusals = []

    def step_while_it_publishes() -> None:
        stage.viewer.watch = lambda: None
        with pytest.raises(CommandRefused) as refusal:
            stage.playback.step(Step(3, '', 0), answer_s=0.01)
        refusals.append(str(refusal.value))

    stage.viewer.watch = step_while_it_publishes
    stage.run()
    assert refusals == ['the player is busy: nothing was changed; try again']
    assert stage.timeline.position_ns() == BEGIN_NS


def test_the_scene_that_is_repeated_while_it_plays_does_not_move_the_position() -> None:
    stage = Stage([Message(0, 10 * number) for number in range(101)])
    stage.viewer.ends = True
    stage.control.play()
    stage.clock.at(505, stage.playback.repeat_scene)
    stage.run()
    assert stage.numbers() == [*range(51), 50, *range(51, 101)]
    assert seen_ms(stage)[-1] == 1000
