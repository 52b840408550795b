# SPDX-License-Identifier: BSD-3-Clause
"""The buttons, the time, the speed and the step unit, with real mouse and key events."""
from __future__ import annotations

from typing import Any

import pytest
from playback_stand import PlaybackStand
from PyQt5.QtCore import QPoint, Qt
from PyQt5.QtWidgets import QToolButton, QWidget
from pytestqt.qtbot import QtBot

from process_visualizer.gui.playback.playback_state import MESSAGE, StepUnit
from process_visualizer.gui.playback.transport_view import SpeedSlider, TransportView


class Bench:
    """View on the screen, with a player of 20 s."""

    def __init__(self, qtbot: QtBot, width: int = 430) -> None:
        self.qtbot = qtbot
        self.stand = PlaybackStand()
        self.view = TransportView(self.stand.model)
        qtbot.addWidget(self.view)
        self.view.resize(width, 130)
        self.view.show()
        qtbot.waitExposed(self.view)
        self.stand.state()

    def widget(self, name: str) -> Any:
        return self.view.findChild(QWidget, name)

    def click(self, name: str) -> None:
        self.qtbot.mouseClick(self.widget(name), Qt.LeftButton)

    def time(self) -> str:
        return self.view.time.text()


@pytest.fixture
def bench(qtbot: QtBot) -> Bench:
    return Bench(qtbot)


@pytest.mark.parametrize('name, expected', [
    ('to_start', [('seek', 0.0)]), ('step_back', [('step', -1, '', 0.0)]),
    ('play_backwards', [('set_rate', -1.0), ('play',)]), ('play', [('play',)]),
    ('stop', [('stop',)]), ('step_forward', [('step', 1, '', 0.0)]), ('to_end', [('seek', 20.0)]),
    ('loop', [('set_loop', True, 0.0, 20.0)]), ('loop_begin', [('set_loop', True, 5.0, 20.0)]),
    ('loop_end', [('set_loop', True, 0.0, 5.0)])])
def test_each_button(bench: Bench, name: str, expected: list) -> None:
    bench.stand.state(position_s=5.0)
    bench.click(name)
    assert bench.stand.commands() == expected


def test_every_control_has_a_name_and_a_hint(bench: Bench) -> None:
    for button in bench.view.findChildren(QToolButton):
        assert button.objectName() and button.toolTip() and button.accessibleName()
    for name in ('speed', 'rate', 'step_unit'):
        assert bench.widget(name).toolTip() and bench.widget(name).accessibleName()


def test_without_a_player_nothing_can_be_pressed(bench: Bench) -> None:
    bench.stand.model.take_state(None)
    assert not any(button.isEnabled() for button in bench.view.findChildren(QToolButton))
    assert bench.time() == '-:--.--- / -:--.---'


def test_the_time(bench: Bench) -> None:
    bench.stand.state(position_s=5.25, duration_s=725.0)
    assert bench.time() == ' 0:05.250 / 12:05.000'


def test_the_time_runs_between_states(bench: Bench) -> None:
    bench.stand.play(position_s=5.0)
    bench.stand.now_s += 0.123
    bench.qtbot.waitUntil(lambda: bench.time().startswith('0:05.123'))


def test_checked_buttons_show_what_is_and_not_what_was_pressed(bench: Bench) -> None:
    bench.stand.client.reason = 'no'
    bench.click('play_backwards')
    assert not bench.widget('play_backwards').isChecked()
    bench.stand.tasks.end_all()
    bench.stand.play(-1.0)
    assert bench.widget('play_backwards').isChecked()
    bench.stand.state(loop=(2.0, 5.0))
    assert all(bench.widget(name).isChecked() for name in ('loop', 'loop_begin', 'loop_end'))
    bench.stand.state(loop=(0.0, 20.0))
    assert bench.widget('loop').isChecked() and not bench.widget('loop_begin').isChecked()


def test_a_machine_that_is_too_slow_is_told(bench: Bench) -> None:
    bench.stand.play(4.0)
    assert bench.widget('reached_rate').text() == ''
    bench.stand.state(achieved_rate=2.5)
    assert bench.widget('reached_rate').text() == 'only 2.5×'
    bench.stand.state(paused=True, achieved_rate=0.0)
    assert bench.widget('reached_rate').text() == ''


class TestSpeed:
    """The slider with its detents, and the number."""

    def press(self, bench: Bench, x: float) -> None:
        bench.qtbot.mousePress(bench.view.slider, Qt.LeftButton, pos=QPoint(round(x), 10))

    @pytest.mark.parametrize('speed', [0.01, 0.1, 0.25, 0.5, 1.0, 2.0, 4.0, 16.0])
    def test_near_a_detent_is_the_detent(self, bench: Bench, speed: float) -> None:
        bench.stand.state(rate=3.0)
        self.press(bench, bench.view.slider.x_of(speed) + 2)
        assert bench.stand.commands() == [('set_rate', speed)]

    def test_between_detents_any_speed(self, bench: Bench) -> None:
        slider = bench.view.slider
        x = (slider.x_of(4.0) + slider.x_of(8.0)) / 2
        self.press(bench, x)
        (name, rate), = bench.stand.commands()
        assert name == 'set_rate' and 5.0 < rate < 6.5
        assert f'{rate:.3g}' == f'{rate:g}'

    def test_beyond_the_ends(self, bench: Bench) -> None:
        self.press(bench, 0)
        self.press(bench, bench.view.slider.width() - 1)
        assert bench.stand.commands() == [('set_rate', 0.01), ('set_rate', 16.0)]

    def test_the_direction_stays(self, bench: Bench) -> None:
        bench.stand.play(-1.0)
        self.press(bench, bench.view.slider.x_of(2.0))
        assert bench.stand.commands() == [('set_rate', -2.0)]

    def test_a_double_click_is_the_speed_of_the_recording(self, bench: Bench) -> None:
        bench.stand.state(rate=4.0)
        slider = bench.view.slider
        bench.qtbot.mouseDClick(slider, Qt.LeftButton, pos=QPoint(20, 10))
        assert bench.stand.commands()[-1] == ('set_rate', 1.0)

    def test_the_arrow_keys_move_it(self, qtbot: QtBot) -> None:
        slider = SpeedSlider()
        qtbot.addWidget(slider)
        slider.show_speed(1.0)
        with qtbot.waitSignal(slider.speed_chosen) as chosen:
            qtbot.keyClick(slider, Qt.Key_Right)
        assert chosen.args[0] > 1.0

    def test_a_state_moves_it_without_asking_for_anything(self, bench: Bench) -> None:
        bench.stand.play(0.25)
        assert bench.view.slider.speed == 0.25
        assert bench.view.rate.value() == 0.25
        assert bench.stand.commands() == []

    def test_a_number_counts_when_it_is_written(self, bench: Bench) -> None:
        bench.view.rate.setFocus()
        bench.view.rate.selectAll()
        bench.qtbot.keyClicks(bench.view.rate, '0.3')
        assert bench.stand.commands() == []
        bench.qtbot.keyClick(bench.view.rate, Qt.Key_Return)
        assert bench.stand.commands() == [('set_rate', 0.3)]

    def test_a_state_does_not_disturb_writing(self, bench: Bench) -> None:
        bench.view.rate.setFocus()
        bench.view.rate.selectAll()
        bench.qtbot.keyClicks(bench.view.rate, '0.3')
        bench.stand.state(position_s=3.0, dropped=4)
        assert bench.view.rate.lineEdit().text().startswith('0.3')

    def test_its_arrows_lead_through_the_ladder(self, bench: Bench) -> None:
        bench.qtbot.keyClick(bench.view.rate, Qt.Key_Up)
        assert bench.stand.commands() == [('set_rate', 2.0)]


class TestStepUnit:
    """Messages, messages of a topic, or times."""

    def test_a_topic_is_chosen(self, bench: Bench) -> None:
        bench.view.set_topics(['/camera', '/force'])
        texts = [bench.view.unit.itemText(row) for row in range(bench.view.unit.count())]
        assert texts == ['message', '10 ms', '100 ms', '1000 ms', '', '/camera', '/force']
        bench.view.unit.activated.emit(texts.index('/force'))
        bench.click('step_forward')
        assert bench.stand.commands() == [('step', 1, '/force', 0.0)]

    def test_a_topic_that_the_next_bag_has_not_is_not_kept(self, bench: Bench) -> None:
        bench.view.set_topics(['/camera'])
        bench.stand.model.set_step_unit(StepUnit('/camera'))
        assert bench.view.unit.currentText() == '/camera'
        bench.view.set_topics(['/force'])
        assert bench.stand.model.state.unit == MESSAGE
        assert bench.view.unit.currentText() == 'message'


def test_it_uses_the_room_there_is(qtbot: QtBot) -> None:
    view = Bench(qtbot).view

    def row_count() -> int:
        return len({it.mapTo(view, it.rect().center()).y() // 20
                    for it in (view.play, view.time, view.slider, view.unit)})
    for width, rows in ((430, 3), (1400, 1), (1000, 2), (430, 3)):
        view.resize(width, 130)
        qtbot.waitUntil(lambda rows=rows: row_count() == rows)
        assert view.width() == width
        assert view.minimumSizeHint().width() <= 430
