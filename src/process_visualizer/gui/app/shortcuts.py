# SPDX-License-Identifier: BSD-3-Clause
"""The keys of the window, as in media players."""
from __future__ import annotations

import time
from typing import Callable, Dict, List, Mapping, NamedTuple, Optional

from PyQt5.QtCore import QEvent, QObject, Qt
from PyQt5.QtGui import QKeyEvent, QKeySequence
from PyQt5.QtWidgets import (
    QAbstractButton,
    QAbstractSpinBox,
    QApplication,
    QDialog,
    QFileDialog,
    QInputDialog,
    QLineEdit,
    QMessageBox,
    QShortcut,
    QWidget,
)

from process_visualizer.cell.model import Mode
from process_visualizer.gui.app.launcher import Launcher
from process_visualizer.gui.cell.launch_model import LaunchPhase
from process_visualizer.gui.live.replay_model import ReplayModel
from process_visualizer.gui.playback.playback_model import PlaybackModel
from process_visualizer.gui.ros.snapshots import KeyPress
from process_visualizer.gui.toolkit.dialogs import MESSAGE, KeysDialog
from process_visualizer.gui.toolkit.theme import theme

_ONCE = ('R', 'M', 'Space', 'Shift+Space', 'L', 'Ctrl+L', 'Ctrl+O', 'F5', '?', 'Esc')
"""Keys that do something once, however long they are held."""


class Shortcut(NamedTuple):
    """A key (as written by QKeySequence), its description, and its action."""

    key: str
    text: str
    action: Callable[[], None]


def playback_keys(playback: PlaybackModel, add_mark: Callable[[], None],
                  zoom_in: Callable[[float], None]) -> List[Shortcut]:
    """Return the keys that work during playback, in the order in which they are shown.

    ``zoom_in`` zooms in by a number of steps; below 0, it zooms out.
    """
    return [
        *_transport_keys(playback),
        Shortcut('A', 'set loop start', playback.set_loop_begin),
        Shortcut('B', 'set loop end', playback.set_loop_end),
        Shortcut('L', 'loop', playback.toggle_loop),
        Shortcut('M', 'add a mark here', add_mark),
        Shortcut('PgUp', 'to the previous mark', playback.to_previous_mark),
        Shortcut('PgDown', 'to the next mark', playback.to_next_mark),
        Shortcut('+', 'zoom in on the timeline', lambda: zoom_in(1.0)),
        Shortcut('-', 'zoom out', lambda: zoom_in(-1.0)),
    ]


def _transport_keys(playback: PlaybackModel) -> List[Shortcut]:
    return [
        Shortcut('Space', 'play or pause', playback.toggle),
        Shortcut('Shift+Space', 'play backwards', playback.toggle_backwards),
        Shortcut('Left', 'one step back', lambda: playback.step(-1)),
        Shortcut('Right', 'one step forward', lambda: playback.step(1)),
        Shortcut(',', 'one step back', lambda: playback.step(-1)),
        Shortcut('.', 'one step forward', lambda: playback.step(1)),
        Shortcut('Shift+Left', '1 s back', lambda: playback.seek(playback.position_s - 1.0)),
        Shortcut('Shift+Right', '1 s forward',
                 lambda: playback.seek(playback.position_s + 1.0)),
        Shortcut('[', 'slower', playback.slower),
        Shortcut(']', 'faster', playback.faster),
        Shortcut('Home', 'to the beginning', lambda: playback.seek(0.0)),
        Shortcut('End', 'to the end', lambda: playback.seek(playback.state.duration_s)),
    ]


_MARK = 'M'


def recording_keys(record_or_stop: Callable[[], None], mark: Callable[[], None]
                   ) -> List[Shortcut]:
    """Return the keys that work in real-time mode."""
    return [
        Shortcut('R', 'start or stop recording', record_or_stop),
        Shortcut(_MARK, 'mark this moment', mark),
    ]


def replay_keys(replay: ReplayModel) -> List[Shortcut]:
    """Return the keys that work while the past is shown in real-time mode."""
    return [Shortcut('Esc', 'back to live', replay.leave), *_transport_keys(replay.playback)]


def general_keys(launcher: Launcher, launch_or_quit: Callable[[], None],
                 show_help: Callable[[], None]) -> List[Shortcut]:
    """Return the keys that always work."""
    return [
        Shortcut('Ctrl+L', 'launch or quit all nodes', launch_or_quit),
        Shortcut('F5', 'read the configuration again', launcher.cell.reload),
        Shortcut('?', 'show these keys', show_help),
    ]


def bind(window: QWidget, keys: List[Shortcut]) -> List[QShortcut]:
    """Bind the keys in the whole window, except while a text or number is being edited."""
    bound = []
    for key in keys:
        shortcut = QShortcut(QKeySequence(key.key), window)
        shortcut.setContext(Qt.WindowShortcut)
        shortcut.setAutoRepeat(key.key not in _ONCE)
        shortcut.activated.connect(_unless_writing(key.action))
        bound.append(shortcut)
    return bound


class UnusedKeys(QObject):
    """Handles keys that no widget has used.

    Enter presses the focused button, as the space bar may be a shortcut. Esc closes the newest
    message beside the window, which does not take the keyboard.
    """

    def __init__(self, window: QWidget) -> None:
        super().__init__(window)
        self._window = window
        window.installEventFilter(self)

    def eventFilter(self, window: Optional[QObject], event: Optional[QEvent]) -> bool:
        """Handle a key that no widget has used."""
        if (not isinstance(event, QKeyEvent) or event.type() != QEvent.KeyPress
                or event.isAutoRepeat()):
            return super().eventFilter(window, event)
        button, messages = QApplication.focusWidget(), [
            it for it in self._window.findChildren(QMessageBox, MESSAGE) if it.isVisible()]
        if event.key() in (Qt.Key_Return, Qt.Key_Enter) and isinstance(button, QAbstractButton):
            button.click()
        elif event.key() == Qt.Key_Escape and messages:
            messages[-1].close()
        else:
            return super().eventFilter(window, event)
        return True


class MarksInDialogs(QObject):
    """Lets the key mark the moment while a dialog has the keyboard: the moment does not return.

    No other key passes a dialog: it would change what the dialog asks about.
    """

    def __init__(self, window: QWidget, mark: Callable[[], None]) -> None:
        super().__init__(window)
        self._window, self._key = window, Shortcut(_MARK, 'mark this moment', mark)
        app = QApplication.instance()
        assert isinstance(app, QApplication)
        app.focusChanged.connect(self._follow_focus)

    def _follow_focus(self, _before: Optional[QWidget], now: Optional[QWidget]) -> None:
        dialog = None if now is None else now.window()
        if (isinstance(dialog, QDialog) and dialog in self._window.findChildren(QDialog)
                and not isinstance(dialog, (QFileDialog, QInputDialog))
                and not dialog.findChildren(QShortcut)):
            bind(dialog, [self._key])


def help_text(groups: Mapping[str, List[Shortcut]]) -> str:
    """Return the keys in HTML: the longest group on the left, the others beside it."""
    first, *others = (f'<p><b>{title}</b></p>{_table(keys)}' for title, keys in groups.items())
    return (f'<table><tr><td>{first}</td><td width="32"></td>'
            f'<td>{"".join(others)}</td></tr></table>')


def _table(keys: List[Shortcut]) -> str:
    """Return the table of the keys; those with the same action share a row."""
    names: Dict[str, List[str]] = {}
    for key in keys:
        names.setdefault(key.text, []).append(key.key)
    space, accent = '&nbsp;&nbsp;', theme().accent
    rows = ''.join(f'<tr><td style="color: {accent}">{space.join(keys)}{space}</td>'
                   f'<td>{text}</td></tr>' for text, keys in names.items())
    return f'<table cellpadding="2">{rows}</table>'


def _unless_writing(action: Callable[[], None]) -> Callable[[], None]:
    def act() -> None:
        if not isinstance(QApplication.focusWidget(), (QLineEdit, QAbstractSpinBox)):
            action()
    return act


class WindowKeys:
    """Binds the keys of a window."""

    def __init__(self, window: QWidget, launcher: Launcher, launch_or_quit: Callable[[], None],
                 record_or_stop: Callable[[], None], add_mark: Callable[[], None],
                 zoom_in: Callable[[float], None], open_recording: Callable[[], None]) -> None:
        """``add_mark`` and ``zoom_in`` are those of ``playback_keys``."""
        self._window = window
        self._launcher = launcher
        playback = playback_keys(launcher.playback, add_mark, zoom_in)
        recording = recording_keys(record_or_stop, launcher.recording.mark)
        replay = replay_keys(launcher.replay)
        general = general_keys(launcher, launch_or_quit, self.show)
        choice = [Shortcut('Ctrl+O', 'open a recording', open_recording)]
        self._groups = {'Playback': [*playback, *choice], 'Recording': recording,
                        'Replay': replay[:1], 'Always': general}
        self._playback: List[QShortcut] = bind(window, playback)
        self._choice: List[QShortcut] = bind(window, choice)
        self._recording: List[QShortcut] = bind(window, recording)
        self._replay: List[QShortcut] = bind(window, replay)
        launcher.replay.changed.connect(self.enable)
        self._general: List[QShortcut] = bind(window, general)
        launcher.link.key_pressed.connect(self.press)
        UnusedKeys(window)
        MarksInDialogs(window, launcher.recording.mark)

    def show(self) -> None:
        """Show all keys."""
        KeysDialog(help_text(self._groups), self._window).open()

    def enable(self) -> None:
        """Enable the keys of the mode while nodes run in it."""
        is_playback = self._launcher.session.mode is Mode.PLAYBACK
        is_running = self._launcher.launch.phase is LaunchPhase.RUNNING
        for shortcut in self._playback:
            shortcut.setEnabled(is_running and is_playback)
        for shortcut in self._choice:
            shortcut.setEnabled(is_playback)
        for shortcut in self._recording:
            shortcut.setEnabled(is_running and not is_playback)
        for shortcut in self._replay:
            shortcut.setEnabled(not self._launcher.replay.is_live)
        self._launcher.link.take_keys([it.key().toString() for it in self._enabled()])

    def press(self, press: KeyPress) -> None:
        """Carry out a key pressed in RViz; while a dialog waits for an answer, only a mark.

        A mark is at the time of the press, though RViz may report it later.
        """
        recording = self._launcher.recording
        if press.key == _MARK and recording.is_recording:
            recording.mark(time.time() - press.pressed_s)
            return
        if any(it.isModal() and it.isVisible() for it in self._window.findChildren(QDialog)):
            return
        for shortcut in self._enabled():
            if shortcut.key().toString() == press.key:
                shortcut.activated.emit()
                return

    def _enabled(self) -> List[QShortcut]:
        """Return the keys that work now, except those with Ctrl, which RViz uses itself."""
        keys = (*self._playback, *self._recording, *self._replay, *self._general)
        return [it for it in keys if it.isEnabled() and 'Ctrl' not in it.key().toString()]
