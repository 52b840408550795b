# SPDX-License-Identifier: BSD-3-Clause
"""The timeline: real mouse and key events, requests to the player, and display."""
from __future__ import annotations

import numpy as np
import pytest
from PyQt5.QtCore import QEvent, QPoint, QPointF, Qt
from PyQt5.QtWidgets import QApplication, QScrollBar
from pytestqt.qtbot import QtBot
from timeline_bench import FLAGS_Y, HANDLES_Y, LANES_Y, TRACK_Y, WIDTH, Bench, lane, x_of

from process_visualizer.gui.lanes.timeline_header import (
    HEADER_HEIGHT,
    TRACK_TOP,
    Alarms,
    target_at,
)
from process_visualizer.gui.playback.minimap import BAR_HEIGHT
from process_visualizer.gui.playback.playback_state import PlacedMark
from process_visualizer.gui.playback.timeline_view import moment_at, moment_tip
from process_visualizer.gui.toolkit.theme import LIGHT
from process_visualizer.runs.comparison.timeline_bands import MomentKind, ReferenceMoment


@pytest.fixture
def bench(qtbot: QtBot) -> Bench:
    return Bench(qtbot)


class TestSeeking:
    """Press anywhere to go there, drag to scrub."""

    @pytest.mark.parametrize('y', [TRACK_Y, 55, LANES_Y])
    def test_a_press_goes_there(self, bench: Bench, y: int) -> None:
        bench.press(5.0, y)
        bench.release(5.0, y)
        assert bench.stand.commands() == [('seek', 5.0)]

    def test_beyond_the_ends_are_the_ends(self, bench: Bench) -> None:
        bench.press(-0.5, TRACK_Y)
        assert bench.stand.commands() == [('seek', 0.0)]
        bench.move(20.5, TRACK_Y, Qt.LeftButton)
        assert bench.stand.commands() == [('seek', 20.0)]

    def test_dragging_while_playing_holds_it_and_plays_on(self, bench: Bench) -> None:
        bench.stand.play(position_s=2.0)
        bench.press(5.0, TRACK_Y)
        bench.move(6.0, TRACK_Y, Qt.LeftButton)
        bench.move(7.0, TRACK_Y, Qt.LeftButton)
        bench.release(7.0, TRACK_Y)
        assert bench.stand.commands() == [('seek', 5.0), ('pause',), ('play',), ('seek', 7.0)]

    def test_only_the_newest_place_of_a_fast_drag_is_asked_for(self, bench: Bench) -> None:
        bench.press(1.0, TRACK_Y)
        for time_s in np.linspace(1.0, 15.0, 60):
            bench.move(float(time_s), TRACK_Y, Qt.LeftButton)
        assert bench.stand.model.position_s == 15.0
        assert bench.stand.commands() == [('seek', 1.0), ('seek', 15.0)]

    def test_the_knob_follows_the_drag_before_the_player_answers(self, bench: Bench) -> None:
        bench.press(10.0, TRACK_Y)
        assert bench.pixel(x_of(10.0), LANES_Y) == LIGHT.accent

    def test_the_right_button_does_not_seek(self, bench: Bench) -> None:
        bench.qtbot.mousePress(bench.view, Qt.RightButton, pos=QPoint(x_of(5.0), TRACK_Y))
        assert bench.stand.commands() == []

    def test_without_a_player_nothing_happens(self, bench: Bench) -> None:
        bench.stand.model.take_state(None)
        bench.press(5.0, TRACK_Y)
        bench.move(6.0, TRACK_Y, Qt.LeftButton)
        bench.release(6.0, TRACK_Y)
        assert bench.stand.commands() == []


class TestMarks:
    """Flags: a press goes to the mark, not to the mouse position."""

    def test_a_press_on_a_flag(self, bench: Bench) -> None:
        bench.stand.model.set_marks([PlacedMark(3.0, 'seam'), PlacedMark(9.0, 'slack')])
        bench.press(9.3, FLAGS_Y)
        assert bench.stand.commands() == [('seek', 9.0)]

    def test_of_two_flags_the_nearer_one(self, bench: Bench) -> None:
        bench.stand.model.set_marks([PlacedMark(3.0, 'one'), PlacedMark(3.3, 'two')])
        bench.press(3.55, FLAGS_Y)
        assert bench.stand.commands() == [('seek', 3.3)]

    def test_below_the_flag_is_the_time(self, bench: Bench) -> None:
        bench.stand.model.set_marks([PlacedMark(9.0, 'slack')])
        bench.press(9.2, TRACK_Y)
        assert bench.stand.commands() == [('seek', pytest.approx(9.2))]

    def test_the_hand_shows_that_a_flag_can_be_pressed(self, bench: Bench) -> None:
        bench.stand.model.set_marks([PlacedMark(9.0, 'slack')])
        bench.move(9.2, FLAGS_Y)
        assert bench.view.cursor().shape() == Qt.PointingHandCursor
        bench.move(14.0, FLAGS_Y)
        assert bench.view.cursor().shape() == Qt.ArrowCursor


class TestLoop:
    """The handles A and B."""

    def test_dragging_b(self, bench: Bench) -> None:
        bench.stand.state(loop=(5.0, 10.0))
        bench.press(10.0, HANDLES_Y)
        assert bench.stand.commands() == []
        bench.move(12.0, HANDLES_Y, Qt.LeftButton)
        bench.release(12.0, HANDLES_Y)
        assert bench.stand.commands() == [('set_loop', True, 5.0, 12.0)]

    def test_dragging_the_letter_b(self, bench: Bench) -> None:
        place = QPoint(round(bench.view.axis.x(10.0)) + 10, HANDLES_Y)
        assert target_at(place, bench.view.axis, (), (5.0, 10.0)).kind == 'B'
        assert target_at(place, bench.view.axis, (), (10.0, 15.0)).kind == 'time'

    def test_a_and_b_are_dragged_while_it_plays_on(self, bench: Bench) -> None:
        bench.stand.play(position_s=6.0, loop=(5.0, 10.0))
        for begin_s, end_s in ((10.0, 12.0), (5.0, 3.0)):
            bench.press(begin_s, HANDLES_Y)
            bench.stand.now_s += 0.2
            bench.stand.play(position_s=6.2)
            bench.move(end_s, HANDLES_Y, Qt.LeftButton)
            bench.release(end_s, HANDLES_Y)
        assert bench.stand.commands() == [('set_loop', True, 5.0, 12.0),
                                          ('set_loop', True, 3.0, 12.0)]
        assert bench.stand.model.state.is_playing

    def test_dragging_a_over_b_stops_before_it(self, bench: Bench) -> None:
        bench.stand.state(loop=(5.0, 10.0))
        bench.press(5.0, HANDLES_Y)
        bench.move(19.0, HANDLES_Y, Qt.LeftButton)
        assert bench.stand.commands() == [('set_loop', True, pytest.approx(9.9), 10.0)]

    def test_without_a_loop_there_are_no_handles(self, bench: Bench) -> None:
        bench.press(0.0, HANDLES_Y)
        assert bench.stand.commands() == [('seek', 0.0)]

    def test_the_repeated_part_is_shaded(self, bench: Bench) -> None:
        before = bench.pixel(x_of(7.0), 60)
        bench.stand.state(loop=(5.0, 10.0))
        assert bench.pixel(x_of(7.0), 60) != before
        assert bench.pixel(x_of(12.0), 60) == before


class TestShowing:
    """The drawn content, and how much of it is redrawn."""

    def test_values_at_the_playhead_and_under_the_mouse(self, bench: Bench) -> None:
        bench.view.grab()
        assert bench.view.lane_texts(0) == ('1.0 N', '', '')
        bench.move(10.0, LANES_Y)
        assert bench.view.lane_texts(0) == ('1.0', '5.0', 'Δ +4.0 N')
        bench.stand.state(position_s=14.0)
        assert bench.view.lane_texts(0) == ('7.0', '5.0', 'Δ −2.0 N')
        QApplication.sendEvent(bench.view, QEvent(QEvent.Leave))
        assert bench.view.lane_texts(0) == ('7.0 N', '', '')

    def test_while_playing_only_the_playhead_is_drawn(self, qtbot: QtBot) -> None:
        bench = Bench(qtbot, lanes=0)
        bench.stand.play(position_s=5.0)
        bench.drawn_widths()
        bench.stand.now_s += 0.2
        qtbot.waitUntil(lambda: bool(bench.view.widths))
        assert max(bench.view.widths) <= 30

    def test_while_the_playhead_stays_within_a_pixel_nothing_is_drawn(self, qtbot: QtBot) -> None:
        bench = Bench(qtbot, lanes=0)
        bench.stand.play(position_s=5.0)
        bench.drawn_widths()
        bench.stand.now_s += 0.005
        with qtbot.waitSignal(bench.stand.model.moved):
            pass
        assert bench.drawn_widths() == [1]

    def test_gaps_are_hatched(self, bench: Bench) -> None:
        before = bench.view.grab().toImage()
        bench.view.set_recording(20.0, [(8.0, 12.0)])
        after = bench.view.grab().toImage()
        changed = [x for x in range(WIDTH) if any(before.pixel(x, y) != after.pixel(x, y)
                                                  for y in range(70, 110))]
        assert x_of(8.0) - 1 <= min(changed) and max(changed) <= x_of(12.0) + 1
        assert len(changed) > 60

    @pytest.mark.parametrize('width', [260, 420, 1280])
    @pytest.mark.parametrize('lanes', [0, 1, 12])
    def test_any_size(self, bench: Bench, width: int, lanes: int) -> None:
        bench.view.set_lanes([lane(number) for number in range(lanes)])
        bench.view.resize(width, bench.view.minimumSizeHint().height())
        assert bench.view.grab().width() >= width

    def test_a_recording_without_length(self, qtbot: QtBot) -> None:
        bench = Bench(qtbot)
        bench.stand.state(duration_s=0.0, position_s=0.0)
        bench.view.set_recording(0.0)
        bench.press(5.0, TRACK_Y)
        assert bench.stand.commands() == [('seek', 0.0)]
        assert not bench.view.grab().isNull()

    def test_many_lanes_scroll(self, qtbot: QtBot) -> None:
        bench = Bench(qtbot, lanes=12)
        bench.view.resize(WIDTH, 200)
        bar = bench.view.findChild(QScrollBar, 'timeline_scroll')
        visible = 200 - int(HEADER_HEIGHT) - BAR_HEIGHT
        assert bar.isVisible() and bar.maximum() == 12 * 46 + 2 - visible
        bench.wheel(QPoint(100, 150), QPoint(0, -120))
        assert bar.value() > 0
        assert bench.view.zoom.shown.is_all
        scrolled = bar.value()
        bench.qtbot.keyClick(bench.view, Qt.Key_Down)
        assert bar.value() > scrolled

    def test_lanes_that_fit_do_not_scroll(self, bench: Bench) -> None:
        assert not bench.view.findChild(QScrollBar, 'timeline_scroll').isVisible()


class TestKeysAndMenu:
    """Actions without a mouse and by its right button."""

    @pytest.mark.parametrize('key, expected', [
        (Qt.Key_Home, ('seek', 0.0)), (Qt.Key_End, ('seek', 20.0)),
        (Qt.Key_Left, ('step', -1, '', 0.0)), (Qt.Key_Right, ('step', 1, '', 0.0)),
        (Qt.Key_PageDown, ('seek', 9.0)), (Qt.Key_PageUp, ('seek', 0.0))])
    def test_keys(self, bench: Bench, key: Qt.Key, expected: tuple) -> None:
        bench.stand.model.set_marks([PlacedMark(9.0, 'slack')])
        bench.qtbot.keyClick(bench.view, key)
        assert bench.stand.commands() == [expected]

    def test_the_menu(self, bench: Bench) -> None:
        menu = bench.view.menu_at(7.5)
        actions = {action.text(): action for action in menu.actions() if action.text()}
        assert list(actions)[0] == 'Go to 0:07.500'
        actions['Loop from here (A)'].trigger()
        assert bench.stand.commands() == [('set_loop', True, 7.5, 20.0)]
        actions['Loop to here (B)'].trigger()
        assert bench.stand.failures == ['A and B must be at least 0.1 s apart']
        with bench.qtbot.waitSignal(bench.view.mark_wanted) as wanted:
            actions['Add a mark here…'].trigger()
        assert wanted.args == [7.5]


def test_alarms_are_bars_below_the_groove(qtbot: QtBot) -> None:
    bench = Bench(qtbot)
    below = TRACK_Y + 9
    assert bench.pixel(x_of(12.0), below) != LIGHT.bad
    bench.view.alarms = Alarms(((11.0, 14.0), (16.0, 16.0)), ((5.0, 6.0),))
    bench.view.set_lanes([lane()])
    assert bench.pixel(x_of(5.5), below) == LIGHT.warning
    assert [bench.pixel(x_of(time_s), below) == LIGHT.bad
            for time_s in (10.8, 11.1, 12.5, 13.9, 14.2, 16.05, 16.5)] == [
        False, True, True, True, False, True, False]


class TestMoments:
    """Moments of a good run are dragged to the right time; a press goes there."""

    Y = int(TRACK_TOP) + 5

    @pytest.fixture
    def asked(self, bench: Bench) -> 'list[tuple[ReferenceMoment, float]]':
        moments = [ReferenceMoment(4.0, MomentKind.EVENT, 'go', 0, 1.0),
                   ReferenceMoment(9.0, MomentKind.DEPARTURE, 'force', 0, 6.0)]
        bench.view.set_moments(moments)
        asked: 'list[tuple[ReferenceMoment, float]]' = []
        bench.view.anchor_wanted.connect(lambda moment, time_s: asked.append((moment, time_s)))
        return asked

    def test_a_drag_says_where_it_belongs(self, bench: Bench,
                                          asked: 'list[tuple[ReferenceMoment, float]]') -> None:
        bench.press(9.0, self.Y)
        bench.move(11.0, self.Y, Qt.LeftButton)
        assert bench.pixel(x_of(11.0), self.Y) == LIGHT.accent
        bench.release(11.0, self.Y)
        (moment, time_s), = asked
        assert (moment.label, time_s) == ('force', pytest.approx(11.0, abs=0.05))
        assert bench.stand.commands() == []

    def test_a_press_goes_there(self, bench: Bench,
                                asked: 'list[tuple[ReferenceMoment, float]]') -> None:
        bench.press(4.05, self.Y)
        bench.release(4.05, self.Y)
        assert bench.stand.commands() == [('seek', 4.0)] and asked == []

    def test_a_new_alignment_ends_a_drag(self, bench: Bench,
                                         asked: 'list[tuple[ReferenceMoment, float]]') -> None:
        bench.press(9.0, self.Y)
        bench.view.set_moments([])
        bench.release(12.0, self.Y)
        assert asked == []

    def test_a_new_alignment_ends_no_other_drag(
            self, bench: Bench, asked: 'list[tuple[ReferenceMoment, float]]') -> None:
        bench.press(6.0, TRACK_Y)
        bench.move(7.0, TRACK_Y, Qt.LeftButton)
        bench.view.set_moments([])
        bench.move(8.0, TRACK_Y, Qt.LeftButton)
        bench.release(8.0, TRACK_Y)
        assert bench.stand.commands()[-1] == ('seek', 8.0) and asked == []

    def test_beside_them_the_time_is_pressed(self, bench: Bench,
                                             asked: 'list[tuple[ReferenceMoment, float]]') -> None:
        bench.press(6.0, self.Y)
        assert bench.stand.commands() == [('seek', 6.0)]
        assert moment_at(QPointF(x_of(9.0), self.Y), bench.view.axis, []) == -1
        assert 'drag it there' in moment_tip(ReferenceMoment(4.0, MomentKind.EVENT, 'go', 0, 1.0))
