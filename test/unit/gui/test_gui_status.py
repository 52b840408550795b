# SPDX-License-Identifier: BSD-3-Clause
"""The status line."""
from __future__ import annotations

from typing import Any, List

import pytest
from PyQt5.QtCore import QEvent, Qt
from PyQt5.QtGui import QKeyEvent
from PyQt5.QtWidgets import QApplication, QLabel, QPushButton

from process_visualizer.cell.model import Mode
from process_visualizer.gui.app.launcher import player_activity, recorder_activity, status_text
from process_visualizer.gui.cell.launch_model import LaunchPhase
from process_visualizer.gui.cell.launch_view import LaunchView, status_lines
from process_visualizer.gui.recording.recording_types import RecordingPhase as RecordingPhase
from process_visualizer.gui.ros.snapshots import PlayerSnapshot
from process_visualizer.gui.toolkit.scrolling import TextPlace
from process_visualizer.gui.toolkit.widgets import MeaningGuard, NoticeFrame
from process_visualizer.health.device_state import Level, Line

GOOD = Line(Level.GOOD, 'arm: running')
DIED = Line(Level.BAD, 'arm: driver ended with code 1')


def player(rate: float, paused: bool = False) -> PlayerSnapshot:
    return PlayerSnapshot(0.0, 0.0, 10.0, 1.0, rate, rate, paused)


@pytest.mark.parametrize('text, expected', [
    (status_text(LaunchPhase.IDLE, None, '', GOOD), 'Idle'),
    (status_text(LaunchPhase.LAUNCHING, Mode.REALTIME, '', GOOD), 'Launching nodes…'),
    (status_text(LaunchPhase.RUNNING, Mode.REALTIME, '', GOOD), 'In real-time mode.'),
    (status_text(LaunchPhase.RUNNING, Mode.REALTIME, 'Recording', GOOD),
     'In real-time mode. Recording'),
    (status_text(LaunchPhase.RUNNING, Mode.PLAYBACK, 'Paused', DIED),
     'In playback mode. Paused\narm: driver ended with code 1'),
    (status_text(LaunchPhase.RUNNING, Mode.REALTIME, '', DIED, 'Run in range'),
     'In real-time mode.\nRun in range\narm: driver ended with code 1'),
    (status_text(LaunchPhase.QUITTING, Mode.PLAYBACK, 'Paused', GOOD), 'Quitting all nodes…'),
])
def test_status(text: str, expected: str) -> None:
    assert text == expected


def test_what_recorder_and_player_do() -> None:
    assert recorder_activity(RecordingPhase.RECORDING, False) == 'Recording'
    assert recorder_activity(RecordingPhase.RECORDING, True) == 'The recorder is not responding'
    assert recorder_activity(RecordingPhase.IDLE, False) == ''
    assert player_activity(None, False) == ''
    assert player_activity(player(0.5), False) == 'Playing at 0.5×'
    assert player_activity(player(-2.0), False) == 'Playing backwards at 2×'
    assert player_activity(player(1.0, paused=True), False) == 'Paused'
    assert player_activity(player(0.5), True) == 'The player is not responding'
    assert player_activity(player(0.5), True, has_ended=True) == ''


def test_a_second_click_that_is_meant_for_launch_does_not_quit(qtbot: Any) -> None:
    view = LaunchView()
    qtbot.addWidget(view)
    view.show()
    told: List[str] = []
    view.quit_wanted.connect(lambda: told.append('quit'))
    view.launch_wanted.connect(lambda: told.append('launch'))
    view.launch_wanted.connect(lambda: view.show_phase(LaunchPhase.LAUNCHING, True, ''))
    guard = view.launch.findChild(MeaningGuard)
    view.show_phase(LaunchPhase.IDLE, True, '')
    qtbot.mouseClick(view.launch, Qt.LeftButton)
    qtbot.mouseClick(view.launch, Qt.LeftButton)
    assert told == ['launch'] and not view.launch.isDown()
    for kind in (QEvent.KeyPress, QEvent.KeyRelease):
        QApplication.sendEvent(view.launch, QKeyEvent(kind, Qt.Key_Space, Qt.NoModifier))
    assert told == ['launch'] and not view.launch.isDown()
    qtbot.waitUntil(lambda: not guard.is_ignoring)
    view.show_phase(LaunchPhase.RUNNING, True, '')
    qtbot.mouseClick(view.launch, Qt.LeftButton)
    assert told == ['launch', 'quit']
    view.show_phase(LaunchPhase.RUNNING, True, '', 5)
    qtbot.mouseClick(view.launch, Qt.LeftButton)
    assert told == ['launch', 'quit'], 'the click that was to quit takes nothing back'


def test_a_button_that_does_the_same_as_before_is_used_at_once(qtbot: Any) -> None:
    button = QPushButton()
    qtbot.addWidget(button)
    guard = MeaningGuard(button)
    for meaning, is_ignoring in (('record', False), ('', True), ('record', False), ('', True),
                                 ('stop', True)):
        guard.show(meaning)
        assert guard.is_ignoring is is_ignoring


def test_a_long_line_does_not_move_the_buttons(qtbot: Any) -> None:
    view = LaunchView()
    qtbot.addWidget(view)
    view.show_status('Idle')
    before = view.minimumSizeHint()
    text = f'In real-time mode.\nkinect: 1 warning: {40 * "no transform "}'
    view.show_status(text)
    assert view.status.text() == view.status.toolTip() == text
    assert view.minimumSizeHint() == before


@pytest.mark.parametrize('screen_px, is_whole', [(1080 - 48, True), (768, False)])
def test_a_notice_of_four_lines_is_whole_on_a_tall_screen(qtbot: Any, screen_px: int,
                                                          is_whole: bool) -> None:
    notice = NoticeFrame('mixture', 'bad')
    notice._text.setText('\n'.join(['a line'] * 4))
    place = TextPlace(status_lines(screen_px), notice)
    qtbot.addWidget(place)
    place.resize(400, place.sizeHint().height())
    place.show()
    qtbot.waitUntil(lambda: notice.height() >= 4 * notice.fontMetrics().lineSpacing())
    assert (place.verticalScrollBar().maximum() == 0) is is_whole


def test_the_last_line_that_is_seen_is_not_cut(qtbot: Any) -> None:
    """An underscore is at the bottom of its line."""
    view = LaunchView()
    qtbot.addWidget(view)
    view.resize(440, 300)
    view.show()
    view.show_status('\n'.join(['___'] * 6))
    place = view.findChild(TextPlace)
    qtbot.waitUntil(lambda: view.findChild(QLabel, 'status').height() > place.height())
    picture = place.viewport().grab().toImage()
    inks = [min(picture.pixelColor(x, y).lightness() for x in range(40))
            for y in range(picture.height())]
    assert min(inks) < 100 and inks[-2:] == [max(inks)] * 2
