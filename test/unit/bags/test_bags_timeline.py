# SPDX-License-Identifier: BSD-3-Clause
"""Playback time with a fake clock: effects of each command, and refusals."""
import math
import threading

import pytest
from bags_fake_clock import FakeClock

from process_visualizer.playback.timeline import NS_PER_S, CommandRefused, Timeline

BEGIN = 1_600_000_000 * NS_PER_S
LENGTH = 100 * NS_PER_S


@pytest.fixture
def clock():
    return FakeClock()


@pytest.fixture
def timeline(clock):
    return Timeline(BEGIN, BEGIN + LENGTH, clock)


def at_s(timeline):
    return (timeline.position_ns() - BEGIN) / NS_PER_S


def pass_s(clock, seconds):
    clock.now_ns += int(seconds * NS_PER_S)


def test_begins_paused_at_the_beginning(timeline, clock):
    pass_s(clock, 3)
    assert at_s(timeline) == 0.0
    assert timeline.state.paused
    assert timeline.state.due_ns(BEGIN) is None


@pytest.mark.parametrize('rate', [0.01, 0.1, 0.25, 0.5, 1.0, 2.0, 16.0])
def test_plays_at_the_rate(timeline, clock, rate):
    timeline.set_rate(rate)
    timeline.play()
    pass_s(clock, 5)
    assert at_s(timeline) == pytest.approx(5 * rate, abs=1e-8)
    timeline.set_rate(-rate)
    pass_s(clock, 2)
    assert at_s(timeline) == pytest.approx(3 * rate, abs=1e-8)


@pytest.mark.parametrize('rate', [0.0, -0.0, math.nan, math.inf, -math.inf, 9e-7, 1.1e6, -2e6])
def test_rate_that_is_refused_changes_nothing(timeline, rate):
    before = timeline.state
    with pytest.raises(CommandRefused, match='rate must'):
        timeline.set_rate(rate)
    assert timeline.state is before


def test_pause_and_play_on(timeline, clock):
    timeline.play()
    pass_s(clock, 2)
    timeline.pause()
    pass_s(clock, 50)
    assert at_s(timeline) == 2.0
    timeline.toggle_paused()
    pass_s(clock, 1)
    assert at_s(timeline) == 3.0
    timeline.toggle_paused()
    assert timeline.state.paused
    assert timeline.state.segment == timeline.state.scene == 0


def test_play_while_playing_changes_nothing(timeline):
    timeline.play()
    before = timeline.state
    timeline.play()
    assert timeline.state is before


@pytest.mark.parametrize('rate', [1.0, -1.0])
def test_stop_is_at_the_beginning(timeline, clock, rate):
    timeline.seek(BEGIN + 50 * NS_PER_S)
    timeline.set_rate(rate)
    timeline.play()
    pass_s(clock, 2)
    segment = timeline.state.segment
    timeline.stop()
    assert at_s(timeline) == 0.0
    assert timeline.state.paused
    assert timeline.state.segment == segment + 1


@pytest.mark.parametrize('start', [0, 40, 100])
@pytest.mark.parametrize('target', [0, 20, 60, 100])
def test_seek_playing_and_paused(timeline, clock, start, target):
    timeline.seek(BEGIN + start * NS_PER_S)
    assert timeline.seek(BEGIN + target * NS_PER_S) == ''
    assert at_s(timeline) == target
    assert timeline.state.paused
    timeline.play()
    assert timeline.seek(BEGIN + target * NS_PER_S) == ''
    pass_s(clock, 0)
    assert at_s(timeline) == target
    assert not timeline.state.paused


@pytest.mark.parametrize(('asked_s', 'reached_s', 'where'), [
    (-0.5, 0.0, '-0.500 s is outside of the recording (0 to 100.000 s): moved to the beginning'),
    (300.0, 100.0, '300.000 s is outside of the recording (0 to 100.000 s): moved to the end')])
def test_seek_outside_is_clamped_and_says_so(timeline, asked_s, reached_s, where):
    assert timeline.seek(BEGIN + int(asked_s * NS_PER_S)) == where
    assert at_s(timeline) == reached_s


@pytest.mark.parametrize(('rate', 'end_s', 'other_s'), [(1.0, 100, 0), (-2.0, 0, 100)])
def test_stays_at_the_end_and_starts_over(timeline, clock, rate, end_s, other_s):
    timeline.seek(BEGIN + 50 * NS_PER_S)
    timeline.set_rate(rate)
    timeline.play()
    timeline.pass_limit(timeline.state.version)
    assert not timeline.state.paused, 'not at the limit yet'
    pass_s(clock, 60)
    assert at_s(timeline) == end_s
    timeline.pass_limit(timeline.state.version)
    assert timeline.state.paused
    assert at_s(timeline) == end_s
    segment = timeline.state.segment
    timeline.play()
    assert at_s(timeline) == other_s
    assert timeline.state.segment == segment + 1
    pass_s(clock, 10)
    assert at_s(timeline) == other_s + 10 * rate


@pytest.mark.parametrize(('rate', 'end_s', 'other_s'), [(1.0, 30, 20), (-1.0, 20, 30)])
def test_loop_jumps_once_its_end_is_passed(timeline, clock, rate, end_s, other_s):
    timeline.set_loop(BEGIN + 20 * NS_PER_S, BEGIN + 30 * NS_PER_S)
    timeline.seek(BEGIN + 25 * NS_PER_S)
    timeline.set_rate(rate)
    timeline.play()
    pass_s(clock, 7)
    assert at_s(timeline) == end_s
    segment = timeline.state.segment
    timeline.pass_limit(timeline.state.version)
    assert at_s(timeline) == other_s
    assert timeline.state.segment == segment + 1
    pass_s(clock, 1)
    assert at_s(timeline) == other_s + rate


def test_plays_into_the_loop_and_past_it(timeline, clock):
    timeline.set_loop(BEGIN + 20 * NS_PER_S, BEGIN + 30 * NS_PER_S)
    assert timeline.state.limit_ns == BEGIN + 30 * NS_PER_S
    timeline.seek(BEGIN + 40 * NS_PER_S)
    assert timeline.state.limit_ns == BEGIN + LENGTH
    timeline.set_rate(-1.0)
    assert timeline.state.limit_ns == BEGIN + 20 * NS_PER_S
    timeline.clear_loop()
    assert timeline.state.limit_ns == BEGIN


@pytest.mark.parametrize(('begin_s', 'end_s', 'message'), [
    (30, 20, 'its end must be'), (20, 20, 'its end must be'), (20, 20.09, 'its end must be'),
    (-1, 20, 'outside of the recording'), (20, 101, 'outside of the recording')])
def test_loop_that_is_refused_changes_nothing(timeline, begin_s, end_s, message):
    before = timeline.state
    with pytest.raises(CommandRefused, match=message):
        timeline.set_loop(BEGIN + int(begin_s * NS_PER_S), BEGIN + int(end_s * NS_PER_S))
    assert timeline.state is before


def test_steps_keep_the_segment_and_a_step_back_begins_a_scene(timeline, clock):
    timeline.play()
    pass_s(clock, 5)
    timeline.step_to(BEGIN + 6 * NS_PER_S)
    assert timeline.state.paused
    assert (at_s(timeline), timeline.state.segment, timeline.state.scene) == (6.0, 0, 0)
    timeline.step_to(BEGIN + 4 * NS_PER_S)
    assert (at_s(timeline), timeline.state.segment, timeline.state.scene) == (4.0, 0, 1)
    timeline.step_to(BEGIN - 4 * NS_PER_S)
    assert at_s(timeline) == 0.0


def test_turning_round_begins_a_scene_but_no_segment(timeline):
    timeline.set_rate(2.0)
    assert (timeline.state.segment, timeline.state.scene) == (0, 0)
    timeline.set_rate(-2.0)
    assert (timeline.state.segment, timeline.state.scene) == (0, 1)


@pytest.mark.parametrize('rate', [1.0, 4.0, 0.3, -1.0, -0.5])
def test_slip_delays_all_that_follows(timeline, clock, rate):
    timeline.seek(BEGIN + 50 * NS_PER_S)
    timeline.set_rate(rate)
    timeline.play()
    message, following = (BEGIN + int((50 + rate * seconds) * NS_PER_S) for seconds in (1, 2))
    interval = timeline.state.due_ns(following) - timeline.state.due_ns(message)
    pass_s(clock, 1.4)
    timeline.slip_to(message, timeline.state.version)
    assert timeline.state.due_ns(message) == clock.now_ns
    assert abs(timeline.state.due_ns(following) - clock.now_ns - interval) <= 1
    assert timeline.position_ns() == message
    assert timeline.state.segment == 1
    assert timeline.achieved_rate() == pytest.approx(rate * 0.6)


def test_slip_to_before_the_last_command(timeline, clock):
    """After a change of rate some messages are already overdue."""
    timeline.play()
    pass_s(clock, 3)
    timeline.set_rate(2.0)
    timeline.slip_to(BEGIN + 2 * NS_PER_S, timeline.state.version)
    assert at_s(timeline) == 2.0
    pass_s(clock, 1)
    assert at_s(timeline) == 4.0


def test_no_slip_for_what_is_still_to_come_nor_after_a_command(timeline, clock):
    timeline.play()
    version = timeline.state.version
    pass_s(clock, 1)
    before = timeline.state
    timeline.slip_to(BEGIN + 2 * NS_PER_S, version)
    assert timeline.state is before
    timeline.seek(BEGIN + 20 * NS_PER_S)
    pass_s(clock, 1)
    before = timeline.state
    timeline.slip_to(BEGIN + NS_PER_S, version)
    assert timeline.state is before
    timeline.pause()
    before = timeline.state
    timeline.slip_to(BEGIN, before.version)
    assert timeline.state is before


def test_achieved_rate_is_of_the_last_second(timeline, clock):
    assert timeline.achieved_rate() == 0.0
    timeline.set_rate(2.0)
    timeline.play()
    assert timeline.achieved_rate() == 2.0
    for _ in range(20):  # half of the time is lost
        due = timeline.position_ns()
        pass_s(clock, 0.1)
        timeline.slip_to(due + NS_PER_S // 10, timeline.state.version)
    assert timeline.achieved_rate() == pytest.approx(1.0)
    pass_s(clock, 0.5)
    assert timeline.achieved_rate() == pytest.approx(1.5)
    pass_s(clock, 0.6)
    assert timeline.achieved_rate() == 2.0
    timeline.pause()
    assert timeline.achieved_rate() == 0.0


def test_wait_ends_exactly_when_due(timeline, clock):
    timeline.set_rate(4.0)
    timeline.play()
    start = clock.now_ns
    assert timeline.wait_until_due(BEGIN + 10 * NS_PER_S, timeline.state.version)
    assert clock.now_ns - start == 2.5 * NS_PER_S
    assert timeline.wait_until_due(BEGIN + 9 * NS_PER_S, timeline.state.version)
    assert clock.waits == 1


COMMANDS = {
    'play': Timeline.play, 'pause': Timeline.pause, 'toggle': Timeline.toggle_paused,
    'stop': Timeline.stop, 'rate': lambda it: it.set_rate(-2.0), 'seek': lambda it: it.seek(BEGIN),
    'step': lambda it: it.step_to(BEGIN), 'clear_loop': Timeline.clear_loop,
    'loop': lambda it: it.set_loop(BEGIN, BEGIN + LENGTH), 'interrupt': Timeline.interrupt}


@pytest.mark.parametrize('name', [name for name in COMMANDS if name != 'play'])
def test_every_command_ends_a_wait(timeline, clock, name):
    timeline.play()
    version = timeline.state.version
    clock.interruptions.append(lambda: COMMANDS[name](timeline))
    assert not timeline.wait_until_due(BEGIN + NS_PER_S, version)
    assert not timeline.wait_until_due(BEGIN + NS_PER_S, version), 'a command came before the wait'
    assert clock.waits == 1


def test_waits_while_paused_and_for_nothing(timeline, clock):
    clock.interruptions.append(timeline.play)
    assert not timeline.wait_until_due(BEGIN, timeline.state.version)
    clock.interruptions.append(timeline.pause)
    assert not timeline.wait_until_due(None, timeline.state.version)
    assert clock.waits == 2


def test_play_begins_after_its_head_start(clock):
    timeline = Timeline(BEGIN, BEGIN + LENGTH, clock, NS_PER_S // 20)
    begin_ns = clock.now_ns
    timeline.play()
    assert timeline.state.due_ns(BEGIN) == begin_ns + NS_PER_S // 20
    pass_s(clock, 0.04)
    assert at_s(timeline) == 0.0
    pass_s(clock, 0.06)
    assert at_s(timeline) == pytest.approx(0.05)


def test_where_play_begins_after_a_jump_it_has_its_head_start_too(clock):
    timeline = Timeline(BEGIN, BEGIN + LENGTH, clock, NS_PER_S // 20)
    timeline.play()
    pass_s(clock, 1.0)
    timeline.seek(BEGIN + 10 * NS_PER_S)
    pass_s(clock, 0.3)  # until the scene is complete
    timeline.slip_to(BEGIN + 10 * NS_PER_S, timeline.state.version, begins=True)
    assert timeline.state.due_ns(BEGIN + 10 * NS_PER_S) == clock.now_ns + NS_PER_S // 20
    pass_s(clock, 0.1)
    assert timeline.achieved_rate() == 1.0  # the jump says nothing about the computer


def test_slip_while_waiting_makes_the_wait_longer(timeline, clock):
    timeline.play()
    pass_s(clock, 1.5)
    start, version = clock.now_ns, timeline.state.version
    clock.interruptions.append(lambda: timeline.slip_to(BEGIN + NS_PER_S, version))
    assert timeline.wait_until_due(BEGIN + 3 * NS_PER_S, version)
    assert clock.now_ns - start == 2 * NS_PER_S


def test_interrupt_leaves_the_times_alone(timeline, clock):
    timeline.play()
    pass_s(clock, 1.5)
    before = timeline.state
    timeline.interrupt()
    after = timeline.state
    assert (after.bag_ns, after.monotonic_ns, after.command) == (
        before.bag_ns, before.monotonic_ns, before.command)
    assert after.version == before.version + 1


def test_command_from_another_thread_ends_a_real_wait():
    timeline = Timeline(BEGIN, BEGIN + LENGTH)
    timeline.play()
    version, answers = timeline.state.version, []
    thread = threading.Thread(
        target=lambda: answers.append(timeline.wait_until_due(BEGIN + LENGTH, version)))
    thread.start()
    timeline.pause()
    thread.join(10.0)
    assert answers == [False]


def test_real_wait_ends_by_itself():
    timeline = Timeline(BEGIN, BEGIN + LENGTH)
    timeline.play()
    due = BEGIN + NS_PER_S // 50
    assert timeline.wait_until_due(due, timeline.state.version)
    assert timeline.position_ns() >= due


def test_recording_of_one_moment(clock):
    timeline = Timeline(BEGIN, BEGIN, clock)
    timeline.play()
    assert timeline.position_ns() == BEGIN
    assert timeline.wait_until_due(BEGIN, timeline.state.version)
    timeline.pass_limit(timeline.state.version)
    assert timeline.state.paused
    with pytest.raises(CommandRefused):
        timeline.set_loop(BEGIN, BEGIN)


def test_bounds_in_the_wrong_order(clock):
    with pytest.raises(ValueError, match='before the beginning'):
        Timeline(BEGIN, BEGIN - 1, clock)
