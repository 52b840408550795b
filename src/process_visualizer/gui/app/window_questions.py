# SPDX-License-Identifier: BSD-3-Clause
"""Messages and questions that the window shows by itself, each of them once at a time."""
from __future__ import annotations

from typing import Callable, Optional

from PyQt5.QtCore import QObject
from PyQt5.QtWidgets import QMainWindow, QMessageBox

from process_visualizer.cell.model import Mode
from process_visualizer.gui.app.launcher import Launcher
from process_visualizer.gui.toolkit.questions import ask, message_box
from process_visualizer.gui.toolkit.sentences import listing, parted, sentence

_BRIEF_MS = 15_000


class WindowQuestions(QObject):
    """The messages and questions of a window."""

    def __init__(self, window: QMainWindow, launcher: Launcher) -> None:
        super().__init__(window)
        self._window = window
        self._launcher = launcher
        self._message: Optional[QMessageBox] = None
        self._mixture: Optional[QMessageBox] = None

    def show_message(self, message: str) -> None:
        """Show a message; further ones are added to it while it is open."""
        message, details = parted(sentence(message))
        if self._message is None:
            self._message = message_box(self._window, message)
            self._message.setDetailedText(details)
            self._message.finished.connect(self._forget_message)
            self._message.open()
        elif message not in self._message.text():
            self._message.setText(f'{self._message.text()}\n\n{message}')
        self.show_briefly(message)

    def show_briefly(self, message: str) -> None:
        """Show a message in the status bar, for long enough to be read."""
        bar = self._window.statusBar()
        assert bar is not None
        bar.showMessage(sentence(message), _BRIEF_MS)

    def ask_about_lost_master(self, start_again: Callable[[], None]) -> None:
        """Offer to start the program again; the question closes when the master returns."""
        self.show_briefly('The ROS master is not responding')
        question = ask(
            self._window,
            'The ROS master is not responding. Running nodes continue, but nothing can be '
            'launched or commanded. Quit all nodes (this finishes a recording) and start '
            f'the launcher again?{self._what_stays()}', 'Quit and start again', start_again)
        self._launcher.master.returned.connect(question.close)

    def ask_about_mixture(self, who: str, mode: Mode) -> None:
        """Ask about nodes that prevent a launch; the question closes when they are gone."""
        what, first = (('playback', ', paused') if mode is Mode.PLAYBACK
                       else ('real-time mode', ''))
        text = (f'{who}.\n\nStop that node: {what} starts by itself as soon as it is gone. '
                f'Or start anyway{first}.')
        if self._mixture is not None:
            self._mixture.setText(text)
            return
        guard = self._launcher.guard
        question = ask(self._window, text, 'Start anyway', guard.launch_all_the_same,
                       guard.cancel)
        question.setDefaultButton(QMessageBox.Cancel)
        guard.settled.connect(question.close)
        question.finished.connect(self._forget_mixture)
        self._mixture = question

    def _what_stays(self) -> str:
        unsaved = self._launcher.unsaved.unsaved
        return f' Not saved, but offered again then: {listing(unsaved)}.' if unsaved else ''

    def _forget_message(self) -> None:
        self._message = None

    def _forget_mixture(self) -> None:
        self._mixture = None
