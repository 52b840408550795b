# SPDX-License-Identifier: BSD-3-Clause
"""The keys of the window, in force where they have a meaning."""
from __future__ import annotations

from typing import Callable, List

from PyQt5.QtWidgets import QDialog, QShortcut, QWidget

from process_visualizer.cell.model import Mode
from process_visualizer.gui.app.launcher import Launcher
from process_visualizer.gui.app.shortcuts import (
    EnterPresses,
    bind,
    general_keys,
    help_text,
    playback_keys,
    recording_keys,
    replay_keys,
)
from process_visualizer.gui.models.cell.launch_model import Phase
from process_visualizer.gui.views.parts.keys_dialog import KeysDialog


class WindowKeys:
    """Binds the keys of a window."""

    def __init__(self, window: QWidget, launcher: Launcher, launch_or_quit: Callable[[], None],
                 add_mark: Callable[[], None], zoom_in: Callable[[float], None]) -> None:
        """``add_mark`` and ``zoom_in`` are of playback (``playback_keys``)."""
        self._window = window
        self._launcher = launcher
        playback = playback_keys(launcher.playback, add_mark, zoom_in)
        recording = recording_keys(launcher.recording)
        replay = replay_keys(launcher.replay)
        general = general_keys(launcher, launch_or_quit, self.show)
        self._groups = {'Playback': playback, 'Recording': recording, 'Replay': replay[:1],
                        'Always': general}
        self._playback: List[QShortcut] = bind(window, playback)
        self._recording: List[QShortcut] = bind(window, recording)
        self._replay: List[QShortcut] = bind(window, replay)
        launcher.replay.changed.connect(self.enable)
        self._general: List[QShortcut] = bind(window, general)
        launcher.link.key_pressed.connect(self.press)
        EnterPresses(window)

    def show(self) -> None:
        """Show all keys."""
        KeysDialog(help_text(self._groups), self._window).open()

    def enable(self) -> None:
        """Enable the keys of the mode while nodes run in it."""
        is_playback = self._launcher.cell.mode is Mode.PLAYBACK
        is_running = self._launcher.launch.phase is Phase.RUNNING
        for shortcut in self._playback:
            shortcut.setEnabled(is_running and is_playback)
        for shortcut in self._recording:
            shortcut.setEnabled(is_running and not is_playback)
        for shortcut in self._replay:
            shortcut.setEnabled(not self._launcher.replay.is_live)
        self._launcher.link.take_keys([it.key().toString() for it in self._enabled()])

    def press(self, key: str) -> None:
        """Do what a key does that was pressed in RViz, unless a dialog waits for an answer."""
        if any(it.isModal() and it.isVisible() for it in self._window.findChildren(QDialog)):
            return
        for shortcut in self._enabled():
            if shortcut.key().toString() == key:
                shortcut.activated.emit()
                return

    def _enabled(self) -> List[QShortcut]:
        """Those that have a meaning now; what RViz itself does with Ctrl is not passed on."""
        keys = (*self._playback, *self._recording, *self._replay, *self._general)
        return [it for it in keys if it.isEnabled() and 'Ctrl' not in it.key().toString()]
