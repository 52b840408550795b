# SPDX-License-Identifier: BSD-3-Clause
"""The window without a mouse: focusable widgets have names, and every button can have the focus."""
from __future__ import annotations

import time
from functools import partial
from pathlib import Path
from typing import Any, Iterator, List, Sequence

import pytest
from PyQt5.QtCore import QPoint, QRect, Qt
from PyQt5.QtWidgets import (
    QAbstractButton,
    QApplication,
    QDialog,
    QLabel,
    QLineEdit,
    QShortcut,
    QTreeWidgetItem,
    QWidget,
)

from process_visualizer.cell.model import Mode
from process_visualizer.gui.app.launcher import Launcher
from process_visualizer.gui.app.launcher_app import LauncherApp
from process_visualizer.gui.app.settings import Settings
from process_visualizer.gui.cell.alarm_strip import EventsView
from process_visualizer.gui.cell.devices_panel import WarningsView
from process_visualizer.gui.cell.launch_model import LaunchPhase
from process_visualizer.gui.recording.recording_model import RecordingModel
from process_visualizer.gui.recording.recording_types import RecordingPhase
from process_visualizer.gui.ros.snapshots import KeyPress
from process_visualizer.gui.toolkit.dialogs import ask, message_box, show_aside
from process_visualizer.gui.toolkit.widgets import MeaningGuard


@pytest.fixture
def window(qtbot: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[LauncherApp]:
    monkeypatch.setenv('ROS_HOME', str(tmp_path))
    launcher = Launcher()
    app = LauncherApp(launcher, Settings(str(tmp_path / 'settings')))
    qtbot.addWidget(app)
    app.show()
    yield app
    launcher.close()


def focusable(window: LauncherApp) -> List[QWidget]:
    """All widgets that can have the focus, except Qt's inner parts and read-only texts."""
    return [it for it in window.findChildren(QWidget)
            if it.window() is window and it.focusPolicy() != Qt.NoFocus and it.focusProxy() is None
            and not it.objectName().startswith('qt_') and not isinstance(it, QLabel)]


def words(widget: QWidget) -> str:
    """The text of a screen reader."""
    return widget.accessibleName() or (widget.text() if isinstance(widget, QAbstractButton) else '')


def tab_order(window: LauncherApp) -> List[QWidget]:
    """The visible widgets that the Tab key reaches, in order."""
    reached, widget = [], window.nextInFocusChain()
    while widget is not window:
        if widget.isVisible() and widget.isEnabled() and widget.focusPolicy() & Qt.TabFocus:
            reached.append(widget)
        widget = widget.nextInFocusChain()
    return reached


def test_whatever_can_have_the_focus_has_a_name(window: LauncherApp) -> None:
    nameless = [(type(it).__name__, it.objectName()) for it in focusable(window) if not words(it)]
    assert nameless == []


def test_every_button_can_be_reached(window: LauncherApp) -> None:
    unreachable = [it.objectName() for it in window.findChildren(QAbstractButton)
                   if not it.focusPolicy() & Qt.TabFocus and not it.objectName().startswith('qt_')]
    assert unreachable == []


@pytest.mark.parametrize('mode', list(Mode))
def test_the_key_tab_goes_from_the_top_to_the_bottom(window: LauncherApp, mode: Mode) -> None:
    window._launcher.session.set_mode(mode)
    QApplication.processEvents()
    places = [QRect(it.mapTo(window, QPoint(0, 0)), it.size()) for it in tab_order(window)]
    assert len(places) > 10
    assert [(before, after) for before, after in zip(places, places[1:])
            if after.bottom() < before.top()] == []


@pytest.mark.parametrize('key', [Qt.Key_Return, Qt.Key_Enter])
def test_enter_presses_the_button_that_has_the_focus(window: LauncherApp, qtbot: Any,
                                                     key: int) -> None:
    """The space bar plays, in playback mode."""
    for name in ('playback', 'realtime'):
        button = window.findChild(QAbstractButton, name)
        button.setFocus()
        qtbot.waitUntil(button.hasFocus)
        qtbot.keyClick(button, key)
        assert window._launcher.session.mode is Mode(name)


def test_escape_closes_the_message_beside_the_window(window: LauncherApp, qtbot: Any) -> None:
    """It leaves the keyboard to the window, so the key comes there."""
    box = message_box(window, 'the disk is full')
    show_aside(box)
    button = window.findChild(QAbstractButton, 'realtime')
    qtbot.keyClick(button, Qt.Key_Escape)
    assert not box.isVisible()
    qtbot.keyClick(button, Qt.Key_Escape)
    assert window.isVisible()


def test_the_space_bar_ticks_topics_though_it_is_a_shortcut(window: LauncherApp,
                                                            qtbot: Any) -> None:
    topics, pressed = window.playback.bag.topics, []
    QShortcut(Qt.Key_Space, topics, lambda: pressed.append('shortcut'))
    topics.addTopLevelItem(QTreeWidgetItem(['/q']))
    topics.topLevelItem(0).setCheckState(0, Qt.Unchecked)
    window._launcher.session.set_mode(Mode.PLAYBACK)
    topics.show()
    topics.setFocus()
    topics.setCurrentItem(topics.topLevelItem(0))
    qtbot.waitUntil(topics.hasFocus)
    qtbot.keyClick(topics, Qt.Key_Space)
    assert (topics.topLevelItem(0).checkState(0), pressed) == (Qt.Checked, [])


def test_what_can_have_the_focus_in_dialogs_has_a_name(window: LauncherApp) -> None:
    window._keys.show()
    EventsView(window._launcher.alarms, window).show()
    WarningsView('arm', window._launcher.states, window).show()
    window.playback.ask_for_curves()
    window.playback.ask_for_mark(1.0)
    window._save_view()
    dialogs = [it for it in window.findChildren(QDialog) if it.isVisible()]
    nameless = [(dialog.objectName(), type(it).__name__, it.objectName()) for dialog in dialogs
                for it in dialog.findChildren(QWidget)
                if it.focusPolicy() != Qt.NoFocus and it.focusProxy() is None and not words(it)
                and not it.objectName().startswith('qt_') and not isinstance(it, QLabel)
                and it not in [label.buddy() for label in dialog.findChildren(QLabel)]]
    assert len(dialogs) == 6 and nameless == []


class RvizKeys:
    """Window whose nodes run, and the keys that RViz must pass on."""

    def __init__(self, window: LauncherApp, mode: Mode, monkeypatch: pytest.MonkeyPatch) -> None:
        self.window, launcher = window, window._launcher
        self.told: Sequence[str] = ()
        self.done: List[str] = []
        monkeypatch.setattr(launcher.link, 'take_keys', self._take)
        for shortcut in window.findChildren(QShortcut):
            shortcut.activated.disconnect()
            shortcut.activated.connect(partial(self.done.append, shortcut.key().toString()))
        launcher.session.set_mode(mode)
        launcher.launch.phase = LaunchPhase.RUNNING
        launcher.launch.changed.emit()

    def _take(self, keys: Sequence[str]) -> None:
        self.told = keys


def test_keys_work_while_rviz_has_the_keyboard(window: LauncherApp,
                                               monkeypatch: pytest.MonkeyPatch) -> None:
    rviz = RvizKeys(window, Mode.REALTIME, monkeypatch)
    assert {'R', 'M', '?', 'F5'} <= set(rviz.told)
    assert not {'Space', 'A', 'Ctrl+L'} & set(rviz.told)  # Ctrl is used by RViz itself
    for key in ('R', 'M', 'Space'):
        window._launcher.link.key_pressed.emit(KeyPress(key, time.time()))
    assert rviz.done == ['R', 'M']
    window._launcher.session.set_mode(Mode.PLAYBACK)
    assert {'Space', 'Shift+Left', 'M', '['} <= set(rviz.told) and 'R' not in rviz.told
    window._launcher.link.key_pressed.emit(KeyPress('Space', time.time()))
    assert rviz.done[2:] == ['Space']
    window._launcher.launch.phase = LaunchPhase.IDLE
    window._launcher.launch.changed.emit()
    assert not {'R', 'M', 'Space'} & set(rviz.told)


def test_keys_of_rviz_answer_no_dialog(window: LauncherApp,
                                       monkeypatch: pytest.MonkeyPatch) -> None:
    rviz = RvizKeys(window, Mode.REALTIME, monkeypatch)
    question = ask(window, 'Quit all nodes?', 'Quit', lambda: None)
    window._launcher.link.key_pressed.emit(KeyPress('R', time.time()))
    assert rviz.done == []
    question.close()


def test_keys_of_rviz_go_on_beside_a_message_that_nobody_asked_for(
        window: LauncherApp, monkeypatch: pytest.MonkeyPatch) -> None:
    rviz = RvizKeys(window, Mode.REALTIME, monkeypatch)
    window._launcher.failed.emit('the disk is full')
    window._launcher.link.key_pressed.emit(KeyPress('R', time.time()))
    assert rviz.done == ['R']


def press(window: LauncherApp, key: str) -> None:
    [shortcut] = [it for it in window.findChildren(QShortcut) if it.key().toString() == key
                  and it.isEnabled()]
    shortcut.activated.emit()


def test_a_record_key_that_is_pressed_twice_does_not_stop(
        window: LauncherApp, qtbot: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    launcher, done = window._launcher, []
    monkeypatch.setattr(RecordingModel, 'toggle', lambda model: done.append(model.phase))
    launcher.launch.phase = LaunchPhase.RUNNING
    launcher.launch.changed.emit()
    for phase in (RecordingPhase.IDLE, RecordingPhase.RECORDING):
        launcher.recording._enter(launcher.recording.state._replace(phase=phase))
        press(window, 'R')
    assert done == [RecordingPhase.IDLE]
    qtbot.waitUntil(lambda: not any(it.is_ignoring for it in window.findChildren(MeaningGuard)))
    press(window, 'R')
    assert done == [RecordingPhase.IDLE, RecordingPhase.RECORDING]


def test_a_launch_key_that_is_pressed_twice_does_not_quit(window: LauncherApp) -> None:
    done: List[str] = []
    window.launch.quit_wanted.disconnect()
    window.launch.quit_wanted.connect(lambda: done.append('quit'))
    window.launch.show_phase(LaunchPhase.RUNNING, True, '')
    press(window, 'Ctrl+L')
    assert done == []


@pytest.fixture
def marks(monkeypatch: pytest.MonkeyPatch) -> List[float]:
    """The marked times."""
    found: List[float] = []
    monkeypatch.setattr(RecordingModel, 'mark', lambda model, age_s=0.0: found.append(age_s))
    return found


def test_a_moment_is_marked_whatever_is_asked_meanwhile(marks: List[float], window: LauncherApp,
                                                        qtbot: Any) -> None:
    launcher = window._launcher
    question = ask(window, 'Finish it and quit?', 'quit', lambda: None)
    qtbot.waitUntil(lambda: QApplication.focusWidget() is not None
                    and QApplication.focusWidget().window() is question)
    for expected in (1, 2):
        qtbot.keyClick(QApplication.focusWidget(), Qt.Key_M)
        assert len(marks) == expected
    qtbot.keyClick(QApplication.focusWidget(), Qt.Key_R)
    assert question.isVisible() and launcher.recording.phase is RecordingPhase.OFF
    launcher.launch.phase = LaunchPhase.RUNNING
    launcher.launch.changed.emit()
    launcher.recording._enter(launcher.recording.state._replace(phase=RecordingPhase.RECORDING))
    for key in ('M', 'R'):
        launcher.link.key_pressed.emit(KeyPress(key, time.time() - 7.0))
    assert len(marks) == 3 and marks[2] == pytest.approx(7.0, abs=2.0)  # RViz delivered it late
    assert launcher.recording.is_recording


def test_rviz_says_when_a_key_was_pressed() -> None:
    assert KeyPress.from_text('Shift+Space\n93.5', 100.0) == ('Shift+Space', 93.5)
    assert KeyPress.from_text('M\n101.0', 100.0) == ('M', 100.0)  # never in the future
    assert KeyPress.from_text('M', 100.0) == ('M', 100.0)


def test_a_letter_that_is_written_in_a_dialog_is_no_mark(marks: List[float], window: LauncherApp,
                                                         qtbot: Any) -> None:
    window.playback.ask_for_mark(1.0)
    qtbot.waitUntil(lambda: isinstance(QApplication.focusWidget(), QLineEdit))
    text = QApplication.focusWidget()
    qtbot.keyClicks(text, 'hem')
    assert (text.text()[-3:], marks) == ('hem', [])


def test_what_is_switched_is_switched_once_however_long_a_key_is_held(window: LauncherApp) -> None:
    repeating = {it.key().toString() for it in window.findChildren(QShortcut) if it.autoRepeat()}
    assert {'Left', 'Right', '[', ']', '+'} <= repeating
    assert not {'R', 'M', 'Space', 'L', 'Ctrl+L', 'Esc'} & repeating


@pytest.mark.parametrize('mode', list(Mode))
def test_a_recording_can_be_opened_on_every_tab_of_playback(window: LauncherApp, mode: Mode
                                                            ) -> None:
    """A button's own shortcut only works while the button is visible."""
    window._launcher.session.set_mode(mode)
    window.panels.setCurrentIndex(2)
    keys = [it for it in window.findChildren(QShortcut) if it.key().toString() == 'Ctrl+O']
    buttons = [it for it in window.findChildren(QAbstractButton)
               if it.shortcut().toString() == 'Ctrl+O']
    assert [(it.parent(), it.isEnabled()) for it in keys] == [(window, mode is Mode.PLAYBACK)]
    assert buttons == []
