# SPDX-License-Identifier: BSD-3-Clause
"""Zooming into a part of the recording: by wheel, double click, keys, menu and scroll bar."""
from __future__ import annotations

from typing import List

import numpy as np
import pytest
from PyQt5.QtCore import QPoint, Qt
from PyQt5.QtWidgets import QScrollBar
from pytestqt.qtbot import QtBot
from timeline_bench import LANES_Y, TRACK_Y, Bench, x_of

from process_visualizer.gui.lanes.timeline_lanes import Lane
from process_visualizer.gui.playback.playback_state import PlacedMark
from process_visualizer.gui.toolkit.theme import LIGHT
from process_visualizer.gui.toolkit.time_axis import ShownTime

CLOSER, FARTHER = QPoint(0, 120), QPoint(0, -120)


@pytest.fixture
def bench(qtbot: QtBot) -> Bench:
    return Bench(qtbot)


def shown(bench: Bench) -> 'tuple[float, float]':
    part: ShownTime = bench.view.zoom.shown
    return part.begin_s, part.end_s


def part_bar(bench: Bench) -> QScrollBar:
    return bench.view.findChild(QScrollBar, 'timeline_part')


def actions(bench: Bench) -> 'dict[str, object]':
    return {it.text(): it for it in bench.view.menu_at(7.5).actions() if it.text()}


@pytest.mark.parametrize('y', [TRACK_Y, LANES_Y])
def test_the_wheel_looks_closer_at_what_is_under_the_mouse(bench: Bench, y: int) -> None:
    bench.wheel(QPoint(x_of(5.0), y), CLOSER)
    assert shown(bench) == pytest.approx((1.0, 17.0))
    bench.press(5.0, TRACK_Y)
    bench.release(5.0, TRACK_Y)
    assert bench.stand.commands() == [('seek', pytest.approx(5.0))]
    bench.wheel(QPoint(x_of(5.0), y), FARTHER)
    assert shown(bench) == pytest.approx((0.0, 20.0))


def test_a_press_goes_to_the_time_that_is_shown_there(bench: Bench) -> None:
    bench.view.zoom.show_part(10.0, 12.0)
    bench.press(10.0, TRACK_Y)
    assert bench.stand.commands() == [('seek', pytest.approx(11.0))]


def test_double_click_shows_all(bench: Bench) -> None:
    bench.view.zoom.show_part(10.0, 12.0)
    bench.qtbot.mouseDClick(bench.view, Qt.LeftButton, pos=QPoint(x_of(3.0), LANES_Y))
    assert shown(bench) == (0.0, 20.0)


@pytest.mark.parametrize('turned, modifiers', [
    (QPoint(0, -120), Qt.ShiftModifier), (QPoint(-120, 0), Qt.NoModifier)])
def test_moving_by_the_wheel(bench: Bench, turned: QPoint,
                             modifiers: Qt.KeyboardModifiers) -> None:
    bench.view.zoom.show_part(10.0, 12.0)
    bench.wheel(QPoint(x_of(3.0), TRACK_Y), turned, modifiers)
    assert shown(bench) == pytest.approx((10.3, 12.3))


def test_the_scroll_bar_is_there_while_a_part_is_shown(bench: Bench) -> None:
    bar = part_bar(bench)
    assert not bar.isVisible()
    bench.view.zoom.show_part(10.0, 12.0)
    assert bar.isVisible()
    assert bar.value() / (bar.maximum() + bar.pageStep()) == pytest.approx(0.5)
    bar.setValue(bar.maximum())
    assert shown(bench) == pytest.approx((18.0, 20.0), abs=1e-4)
    bar.setValue(0)
    assert shown(bench) == pytest.approx((0.0, 2.0), abs=1e-4)


def test_where_curves_scroll_ctrl_and_the_header_still_zoom(qtbot: QtBot) -> None:
    bench = Bench(qtbot, lanes=12)
    bench.view.resize(bench.view.width(), 200)
    bench.wheel(QPoint(100, 150), CLOSER)
    assert bench.view.zoom.shown.is_all
    bench.wheel(QPoint(100, 150), CLOSER, Qt.ControlModifier)
    once = bench.view.zoom.shown.duration_s
    bench.wheel(QPoint(100, TRACK_Y), CLOSER)
    assert bench.view.zoom.shown.duration_s < once < 20.0


def test_keys_zoom_in_at_the_position(bench: Bench) -> None:
    bench.stand.state(position_s=10.0)
    bench.view.zoom_in(1.0)
    assert shown(bench) == pytest.approx((2.0, 18.0))
    bench.view.zoom_in(-1.0)
    assert shown(bench) == pytest.approx((0.0, 20.0))


def test_the_menu_shows_the_loop_or_all(bench: Bench) -> None:
    assert not actions(bench)['Show A to B only'].isEnabled()
    assert not actions(bench)['Show the whole recording (double click)'].isEnabled()
    bench.stand.state(loop=(5.0, 10.0))
    actions(bench)['Show A to B only'].trigger()
    assert shown(bench) == (5.0, 10.0)
    actions(bench)['Show the whole recording (double click)'].trigger()
    assert shown(bench) == (0.0, 20.0)


class TestFollowing:
    """Playback stays in view, unless the operator looks at another part."""

    def test_playing_turns_the_page(self, bench: Bench) -> None:
        bench.view.zoom.show_part(2.0, 4.0)
        bench.stand.play(position_s=3.9)
        bench.stand.play(position_s=4.1)
        assert shown(bench) == pytest.approx((3.9, 5.9), abs=0.05)

    def test_playing_does_not_disturb_who_looks_elsewhere(self, bench: Bench) -> None:
        bench.view.zoom.show_part(10.0, 12.0)
        bench.stand.play(position_s=3.9)
        bench.stand.play(position_s=4.1)
        assert shown(bench) == (10.0, 12.0)

    def test_who_goes_somewhere_sees_it(self, bench: Bench) -> None:
        bench.view.zoom.show_part(2.0, 4.0)
        bench.stand.model.set_marks([PlacedMark(9.0, 'slack')])
        bench.qtbot.keyClick(bench.view, Qt.Key_PageDown)
        assert bench.view.zoom.shown.contains(9.0)

    def test_of_another_recording_all_is_shown(self, bench: Bench) -> None:
        """Its curves and marks are shown at once, before its player replaces the last one."""
        bench.view.zoom.show_part(2.0, 4.0)
        bench.view.set_recording(30.0)
        assert shown(bench) == (0.0, 30.0)
        bench.stand.state(duration_s=30.0)
        assert shown(bench) == (0.0, 30.0)


class TestDrawing:
    """Everything is drawn at its time, and nothing outside the visible part is drawn."""

    def test_playhead(self, bench: Bench) -> None:
        bench.stand.state(position_s=11.0)
        bench.view.zoom.show_part(10.0, 12.0)
        assert bench.pixel(x_of(10.0), LANES_Y) == LIGHT.accent
        bench.view.zoom.show_part(14.0, 16.0)
        assert LIGHT.accent not in [bench.pixel(x, LANES_Y)
                                    for x in range(0, bench.view.width(), 4)]

    def test_values_under_the_mouse(self, bench: Bench) -> None:
        bench.view.zoom.show_part(10.0, 12.0)
        bench.view.grab()
        bench.move(10.0, LANES_Y)
        bench.qtbot.waitUntil(  # the picture has the scale, which determines the number of decimals
            lambda: bench.view.lane_texts(0).at_mouse == '5.50')

    def test_the_axis_moves_below_a_resting_mouse(self, bench: Bench) -> None:
        bench.view.zoom.show_part(10.0, 12.0)
        bench.view.grab()
        bench.move(10.0, LANES_Y)
        bench.view.zoom.show_part(14.0, 16.0)
        bench.qtbot.waitUntil(  # the picture has the scale, which determines the number of decimals
            lambda: bench.view.lane_texts(0).at_mouse == '7.50')

    def test_a_curve_with_a_peak(self, bench: Bench, qtbot: QtBot) -> None:
        """A peak of 20 ms at 11 s, in the middle of two seconds."""
        values = np.zeros(1000)
        values[550] = 1.0
        bench.view.set_lanes([Lane('', '', (1.0, 0.0, 0.0), values, values)])
        bench.view.zoom.show_part(10.0, 12.0)
        red: List[int] = []

        def is_drawn() -> bool:
            image = bench.view.grab().toImage()
            red[:] = [x for x in range(image.width())
                      if image.pixelColor(x, 90).red() > image.pixelColor(x, 90).blue() + 80]
            return bool(red)

        qtbot.waitUntil(is_drawn)
        assert x_of(10.0) - 3 <= min(red) and max(red) <= x_of(10.2) + 3
