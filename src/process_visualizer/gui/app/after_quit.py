# SPDX-License-Identifier: BSD-3-Clause
"""The end of all nodes, and what comes then: a recording is played, or the window closes."""
from __future__ import annotations

from typing import Tuple

from PyQt5.QtCore import QObject, pyqtSignal
from PyQt5.QtWidgets import QWidget

from process_visualizer.gui.app.launcher import Launcher
from process_visualizer.gui.toolkit.questions import ask


class AfterQuit(QObject):
    """Quits all nodes, asks first if a recording is in progress, and then does what was wanted."""

    close_wanted = pyqtSignal()
    """All nodes have quit: the window may close."""

    def __init__(self, window: QWidget, launcher: Launcher) -> None:
        super().__init__(window)
        self._window = window
        self._launcher = launcher
        self._is_leaving = False
        self._bags_to_play: Tuple[str, ...] = ()
        launcher.launch.stopped.connect(self._go_on)

    def play(self, paths: Tuple[str, ...]) -> None:
        """Switch from real-time mode to playback of a recording."""
        if self._launcher.launch.is_idle or self._launcher.launch.is_running:
            self._launcher.play(paths)
        else:
            self._bags_to_play = paths
            self._launcher.launch.quit()

    def quit(self) -> None:
        """Quit all nodes; the window stays."""
        if self._launcher.recording.is_recording:
            ask(self._window, 'A recording is in progress. Finish it and quit all nodes?',
                'Finish and quit', self._launcher.launch.quit)
        else:
            self._launcher.launch.quit()

    def ask_to_leave(self) -> None:
        """Leave, after a question if a recording is in progress."""
        if self._launcher.recording.is_recording and not self._is_leaving:
            ask(self._window, 'A recording is in progress. Finish it, quit all nodes and close?',
                'Finish and close', self.leave)
        else:
            self.leave()

    def leave(self) -> None:
        """Quit all nodes (the recorder finishes its bag), then close; without asking."""
        if self._is_leaving:
            return
        self._is_leaving = True
        self._launcher.guard.cancel()
        if self._launcher.launch.is_idle:
            self.close_wanted.emit()
        else:
            self._launcher.launch.quit()

    def _go_on(self) -> None:
        if self._is_leaving:
            self.close_wanted.emit()
        elif self._bags_to_play:
            paths, self._bags_to_play = self._bags_to_play, ()
            self._launcher.play(paths)
        else:
            self._launcher.launch.prepare()
