# SPDX-License-Identifier: BSD-3-Clause
"""The playback model: its requests to the player, and its values in between."""
from __future__ import annotations

import pytest
from playback_stand import PAUSED, PlaybackStand
from pytestqt.qtbot import QtBot

from process_visualizer.gui.playback.playback_state import (
    MESSAGE,
    TIMES,
    LoopPoints,
    PlacedMark,
    StepUnit,
)


@pytest.fixture
def stand(qtbot: QtBot) -> PlaybackStand:
    stand = PlaybackStand()
    stand.state()
    return stand


def test_without_a_player_nothing_is_asked_for(qtbot: QtBot) -> None:
    stand = PlaybackStand()
    model = stand.model
    for command in (model.play, model.pause, model.toggle, model.play_backwards, model.stop,
                    model.faster, model.toggle_loop,
                    model.set_loop_begin, model.to_next_mark):
        command()
    model.step(1)
    assert stand.commands() == [] and stand.failures == []
    assert not model.state.is_available and model.position_s == 0.0


def test_the_state_is_told(stand: PlaybackStand) -> None:
    stand.play(0.5, position_s=3.0, dropped=7)
    model = stand.model
    assert (model.state.is_playing, model.rate) == (True, 0.5)
    assert (model.position_s, model.state.duration_s, model.state.dropped) == (3.0, 20.0, 7)
    assert model.state.reached_rate is None
    stand.state(achieved_rate=0.4)
    assert model.state.reached_rate == 0.4


def test_changed_is_told_for_changes_alone_and_moved_for_positions(stand: PlaybackStand,
                                                                   qtbot: QtBot) -> None:
    with qtbot.assertNotEmitted(stand.model.changed), qtbot.waitSignal(stand.model.moved):
        stand.state(position_s=1.0)
    with qtbot.waitSignal(stand.model.changed):
        stand.state(rate=2.0)


def test_a_player_that_no_longer_reports_stands_where_it_was_last(stand: PlaybackStand,
                                                                  qtbot: QtBot) -> None:
    """The scene stays there as well, whatever is requested in the meantime."""
    stand.play(position_s=3.0)
    stand.now_s += 10.0
    stand.model.seek(12.0)
    assert stand.model.position_s == 12.0
    with qtbot.waitSignal(stand.model.changed):
        pass
    assert stand.model.state.is_silent and stand.model.position_s == 3.0
    stand.model.seek(15.0)
    assert stand.model.position_s == 3.0
    with qtbot.waitSignal(stand.model.changed):
        stand.play(position_s=3.1)
    assert not stand.model.state.is_silent and stand.model.position_s == 15.0
    assert stand.commands() == [('seek', 12.0), ('seek', 15.0)], 'it is done when it responds'
    stand.state(position_s=15.0, segment=2)
    stand.model.take_state(None)
    assert not stand.model.state.is_silent


def test_while_playing_the_position_is_told_at_the_rate_of_a_screen(stand: PlaybackStand,
                                                                    qtbot: QtBot) -> None:
    stand.play()
    with qtbot.waitSignals([stand.model.moved] * 5):
        pass
    stand.state(paused=True)
    assert not stand.model._frames.isActive()


@pytest.mark.parametrize('playing, rate, method, expected', [
    (False, 1.0, 'toggle', [('play',)]),
    (True, 1.0, 'toggle', [('pause',)]),
    (True, -1.0, 'toggle', [('pause',)]),
    (False, -2.0, 'toggle', [('set_rate', 2.0), ('play',)]),
    (False, 2.0, 'toggle_backwards', [('set_rate', -2.0), ('play',)]),
    (True, 2.0, 'toggle_backwards', [('set_rate', -2.0), ('play',)]),
    (True, -2.0, 'toggle_backwards', [('pause',)]),
    (True, -1.0, 'play', [('set_rate', 1.0), ('play',)]),
    (True, 1.0, 'stop', [('stop',)]),
])
def test_buttons_ask_for_what_they_say(stand: PlaybackStand, playing: bool, rate: float,
                                       method: str, expected: list) -> None:
    stand.state(paused=not playing, rate=rate)
    getattr(stand.model, method)()
    assert stand.commands() == expected


def test_while_a_rate_is_under_way_it_does_not_set_out_in_the_wrong_direction(
        stand: PlaybackStand) -> None:
    stand.model.set_rate(2.0)
    stand.model.play_backwards()
    assert stand.model.rate == -2.0
    assert stand.commands() == [('set_rate', 2.0), ('set_rate', -2.0), ('play',)]


@pytest.mark.parametrize('method', ['pause', 'stop'])
def test_who_stands_still_is_not_moved_by_a_rate_that_waited(stand: PlaybackStand,
                                                             method: str) -> None:
    stand.play()
    stand.model.set_rate(2.0)
    stand.model.play_backwards()
    getattr(stand.model, method)()
    commands = stand.commands()
    assert (method,) in commands and ('play',) not in commands
    assert commands[-1] == ('set_rate', -2.0)


def test_a_speed_that_is_changed_meanwhile_does_not_keep_it_from_playing(
        stand: PlaybackStand) -> None:
    stand.model.set_rate(2.0)
    stand.model.play_backwards()
    stand.model.set_rate(-3.0)
    assert stand.commands() == [('set_rate', 2.0), ('set_rate', -3.0), ('play',)]


def test_a_refusal_is_told(stand: PlaybackStand) -> None:
    stand.client.reason = 'there is nothing to play'
    stand.model.play()
    stand.tasks.end_all()
    assert stand.failures == ['there is nothing to play']


def test_an_error_that_is_no_refusal_is_not_hidden(stand: PlaybackStand) -> None:
    stand.client.play = lambda: 1 / 0
    stand.model.play()
    with pytest.raises(ZeroDivisionError):
        stand.tasks.end_all()


class TestSeeking:
    """Scrubbing: at most one seek in progress, then only the newest one."""

    def test_only_the_first_and_the_newest_are_sent(self, stand: PlaybackStand) -> None:
        for tenth in range(1, 101):
            stand.model.seek(tenth / 10)
            assert len(stand.tasks.held) == 1
        assert stand.commands() == [('seek', 0.1), ('seek', 10.0)]

    def test_the_slider_is_at_once_where_it_was_dragged(self, stand: PlaybackStand,
                                                        qtbot: QtBot) -> None:
        with qtbot.waitSignal(stand.model.moved):
            stand.model.seek(7.0)
        assert stand.model.position_s == 7.0

    def test_states_from_before_the_seek_do_not_move_it_back(self, stand: PlaybackStand) -> None:
        stand.play(position_s=1.0)
        stand.now_s += 1.0
        stand.model.seek(7.0)
        stand.state(position_s=2.0)
        assert stand.model.position_s == 7.0
        stand.tasks.end_all()
        stand.state(position_s=2.0, stamp_s=stand.now_s - 0.01)
        assert stand.model.position_s == 7.0
        stand.state(position_s=7.0, segment=2, stamp_s=stand.now_s)
        stand.now_s += 0.1
        assert stand.model.position_s == pytest.approx(7.1)

    def test_a_state_that_comes_before_the_answer_counts(self, stand: PlaybackStand) -> None:
        stand.client.seek = lambda _position_s: stand.state(position_s=7.25, segment=2)
        stand.model.seek(7.0)
        stand.tasks.end_all()
        assert stand.model.position_s == 7.25

    def test_a_refused_seek_leads_back(self, stand: PlaybackStand) -> None:
        stand.client.reason = 'no'
        stand.model.seek(7.0)
        stand.tasks.end_all()
        assert (stand.model.position_s, stand.failures) == (0.0, ['no'])

    def test_beyond_an_end_it_is_the_end(self, stand: PlaybackStand) -> None:
        stand.model.seek(99.0)
        stand.tasks.end_all()
        stand.model.seek(-1.0)
        assert stand.commands() == [('seek', 20.0), ('seek', 0.0)]

    def test_jumps_add_up_while_a_seek_is_under_way(self, stand: PlaybackStand) -> None:
        for _ in range(3):
            stand.model.seek(stand.model.position_s + 1.0)
        assert stand.commands()[-1] == ('seek', 3.0)

    def test_dragging_holds_the_playback(self, stand: PlaybackStand) -> None:
        stand.play()
        stand.model.begin_scrub()
        stand.model.begin_scrub()
        stand.model.seek(3.0)
        stand.model.end_scrub()
        stand.model.end_scrub()
        assert stand.commands() == [('pause',), ('seek', 3.0), ('play',)]

    def test_dragging_while_paused_stays_paused(self, stand: PlaybackStand) -> None:
        stand.model.begin_scrub()
        stand.model.end_scrub()
        assert stand.commands() == []

    def test_nothing_is_left_of_a_seek_when_the_player_goes(self, stand: PlaybackStand) -> None:
        stand.model.seek(7.0)
        stand.model.take_state(None)
        assert stand.model.position_s == 0.0


class TestSteps:
    """Steps by the selected unit; held keys do not pile up."""

    @pytest.mark.parametrize('unit, expected', [
        (MESSAGE, ('step', -1, '', 0.0)),
        (StepUnit('/camera'), ('step', -1, '/camera', 0.0)),
        (TIMES[0], ('step', 0, '', -0.01)),
        (TIMES[2], ('step', 0, '', -1.0)),
    ])
    def test_the_unit_counts(self, stand: PlaybackStand, unit: StepUnit, expected: tuple) -> None:
        stand.model.set_step_unit(unit)
        stand.model.step(-1)
        assert stand.commands() == [expected]

    def test_steps_that_wait_become_one(self, stand: PlaybackStand) -> None:
        for _ in range(10):
            stand.model.step(1)
        assert stand.commands() == [('step', 1, '', 0.0), ('step', 9, '', 0.0)]

    def test_steps_that_cancel_out_are_not_asked_for(self, stand: PlaybackStand) -> None:
        for count in (1, 1, -1):
            stand.model.step(count)
        assert stand.commands() == [('step', 1, '', 0.0)]

    def test_units_have_names(self) -> None:
        labels = [unit.label for unit in (MESSAGE, StepUnit('/a/b'), *TIMES)]
        assert labels == ['message', '/a/b', '10 ms', '100 ms', '1000 ms']


class TestRate:
    """The rate: newest first, within its limits, in the direction of play."""

    def test_the_newest_rate_wins_and_shows_at_once(self, stand: PlaybackStand) -> None:
        for rate in (2.0, 3.0, 4.0):
            stand.model.set_rate(rate)
        assert stand.model.rate == 4.0
        assert stand.commands() == [('set_rate', 2.0), ('set_rate', 4.0)]

    @pytest.mark.parametrize('wanted, expected', [(100.0, 16.0), (0.001, 0.01), (-99.0, -16.0)])
    def test_limits(self, stand: PlaybackStand, wanted: float, expected: float) -> None:
        stand.model.set_rate(wanted)
        assert stand.commands() == [('set_rate', expected)]

    def test_the_ladder_keeps_the_direction(self, stand: PlaybackStand) -> None:
        stand.state(rate=-1.0)
        stand.model.faster()
        stand.tasks.end_all()
        stand.model.slower()
        stand.tasks.end_all()
        stand.model.set_speed(0.3)
        assert stand.commands() == [('set_rate', -2.0), ('set_rate', -0.5), ('set_rate', -0.3)]

    def test_beyond_the_ladder_nothing_turns_round(self, stand: PlaybackStand) -> None:
        """Another program may set rates that the window does not offer."""
        stand.state(rate=100.0)
        stand.model.faster()
        stand.tasks.end_all()
        stand.state(rate=-0.001)
        stand.model.slower()
        assert stand.commands() == [('set_rate', 100.0), ('set_rate', -0.001)]


class TestLoop:
    """A, B and the loop."""

    def test_without_points_all_is_repeated(self, stand: PlaybackStand) -> None:
        stand.model.toggle_loop()
        assert stand.model.is_looping
        assert stand.commands() == [('set_loop', True, 0.0, 20.0)]
        stand.state(loop=(0.0, 20.0))
        assert stand.model.state.points == LoopPoints()
        stand.model.toggle_loop()
        assert stand.commands() == [('set_loop', False, 0.0, 20.0)]

    def test_a_alone_leads_to_the_end(self, stand: PlaybackStand) -> None:
        stand.state(position_s=4.0)
        stand.model.set_loop_begin()
        assert stand.commands() == [('set_loop', True, 4.0, 20.0)]

    def test_a_then_b(self, stand: PlaybackStand) -> None:
        stand.model.set_loop_begin(4.0)
        stand.model.set_loop_end(6.0)
        assert stand.commands()[-1] == ('set_loop', True, 4.0, 6.0)
        assert stand.model.state.points == LoopPoints(4.0, 6.0)

    def test_b_before_a_changes_places(self, stand: PlaybackStand) -> None:
        stand.model.set_loop_begin(8.0)
        stand.model.set_loop_end(3.0)
        assert stand.commands()[-1] == ('set_loop', True, 3.0, 8.0)

    def test_a_behind_b_begins_a_new_loop(self, stand: PlaybackStand) -> None:
        stand.model.set_loop_end(3.0)
        stand.model.set_loop_begin(8.0)
        assert stand.commands()[-1] == ('set_loop', True, 8.0, 20.0)

    @pytest.mark.parametrize('rate, set_point, start_s', [
        (1.0, 'set_loop_end', 4.0), (-1.0, 'set_loop_begin', 20.0)])
    def test_a_loop_whose_end_is_set_while_it_plays_begins_again(
            self, stand: PlaybackStand, rate: float, set_point: str, start_s: float) -> None:
        stand.model.set_loop_begin(4.0)
        stand.state(position_s=8.0, rate=rate, paused=False)
        getattr(stand.model, set_point)()
        assert ('seek', start_s) in stand.commands()

    def test_points_too_close_are_refused(self, stand: PlaybackStand) -> None:
        stand.model.set_loop_begin(8.0)
        stand.model.set_loop_end(8.05)
        assert stand.failures == ['A and B must be at least 0.1 s apart']
        assert stand.model.state.points == LoopPoints(8.0)

    def test_a_dragged_point_stops_at_the_other(self, stand: PlaybackStand) -> None:
        stand.model.set_loop_begin(4.0)
        stand.model.set_loop_end(6.0)
        stand.model.move_loop_point('A', 9.0)
        assert stand.model.state.points.begin_s == pytest.approx(5.9)
        stand.model.move_loop_point('B', 1.0)
        assert stand.model.state.points.end_s == pytest.approx(6.0)
        assert stand.failures == []

    def test_points_stay_while_the_loop_is_off(self, stand: PlaybackStand) -> None:
        stand.model.set_loop_begin(4.0)
        stand.tasks.end_all()
        stand.state(loop=(4.0, 20.0))
        stand.model.toggle_loop()
        stand.tasks.end_all()
        stand.state(loop=None)
        assert (stand.model.is_looping, stand.model.state.points.begin_s) == (False, 4.0)
        stand.client.taken()
        stand.model.toggle_loop()
        assert stand.commands() == [('set_loop', True, 4.0, 20.0)]

    def test_a_loop_that_somebody_else_set_is_taken_over(self, stand: PlaybackStand) -> None:
        stand.state(loop=(2.0, 5.0))
        assert stand.model.is_looping and stand.model.state.points == LoopPoints(2.0, 5.0)

    def test_another_recording_has_no_points(self, stand: PlaybackStand) -> None:
        stand.state(loop=(2.0, 5.0))
        stand.state(loop=None, files=('/bags/b.bag',))
        assert stand.model.state.points == LoopPoints()

    def test_a_recording_that_is_opened_again_has_its_points(self, stand: PlaybackStand) -> None:
        stand.state(loop=(2.0, 5.0))
        first = stand.model.state.snapshot.files
        stand.model.take_state(None)
        stand.state(loop=None, files=('/bags/b.bag',))
        stand.model.take_state(None)
        stand.state(loop=None, files=first)
        assert stand.model.state.points == LoopPoints(2.0, 5.0) and not stand.model.is_looping

    def test_clearing_forgets_both(self, stand: PlaybackStand) -> None:
        stand.state(loop=(2.0, 5.0))
        stand.model.clear_loop()
        assert stand.commands()[-1][:2] == ('set_loop', False)
        assert stand.model.state.points == LoopPoints()


class TestMarks:
    """To the next and the previous mark."""

    @pytest.fixture
    def marked(self, stand: PlaybackStand) -> PlaybackStand:
        stand.model.set_marks([PlacedMark(9.0, 'seam ends'), PlacedMark(3.0, 'seam begins')])
        return stand

    @pytest.mark.parametrize('position_s, next_s, previous_s', [
        (0.0, 3.0, 0.0), (3.0, 9.0, 0.0), (5.0, 9.0, 3.0), (9.0, None, 3.0), (12.0, None, 9.0)])
    def test_marks_lead_on_and_back(self, marked: PlaybackStand, position_s: float,
                                    next_s: float, previous_s: float) -> None:
        marked.state(position_s=position_s)
        marked.model.to_next_mark()
        assert marked.commands() == ([] if next_s is None else [('seek', next_s)])
        marked.state(segment=marked.snapshot.segment + 1)
        marked.model.to_previous_mark()
        assert marked.commands() == [('seek', previous_s)]

    def test_while_playing_twice_back_leads_past_the_mark_just_left(
            self, marked: PlaybackStand) -> None:
        marked.play(position_s=9.2)
        marked.model.to_previous_mark()
        assert marked.commands() == [('seek', 3.0)]


def test_the_last_state_is_forgotten_when_the_player_goes(stand: PlaybackStand) -> None:
    stand.play()
    stand.model.take_state(None)
    assert not stand.model.state.is_playing and not stand.model.state.is_available
    stand.snapshot = PAUSED
    stand.state(position_s=2.0)
    assert stand.model.position_s == 2.0
