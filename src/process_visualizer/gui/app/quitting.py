# SPDX-License-Identifier: BSD-3-Clause
"""Quits all nodes, after a question if something would be lost, and then plays or closes."""
from __future__ import annotations

import time
from typing import Callable, List, Sequence, Tuple

from PyQt5.QtCore import QObject, QTimer, pyqtSignal
from PyQt5.QtWidgets import QMessageBox, QWidget

from process_visualizer.gui.app.launcher import Launcher
from process_visualizer.gui.toolkit.dialogs import ask
from process_visualizer.gui.toolkit.labels import listing, sentence
from process_visualizer.gui.toolkit.tasks import DelayedAction

GRACE_S = 5.0
"""Time during which the command to quit can be canceled [s]."""


_END_MS = 5000
"""Longest time for which the window waits for a folder, to note the end of a recording [ms]."""


class Quitting(QObject):
    """Quits all nodes, and then does what was requested.

    It asks first if something would be lost. Otherwise it waits a moment, during which a second
    click cancels the command.
    """

    close_wanted = pyqtSignal()
    """All nodes have quit: the window may close."""

    def __init__(self, window: QWidget, launcher: Launcher,
                 clock_s: Callable[[], float] = time.monotonic) -> None:
        super().__init__(window)
        self._window = window
        self._launcher = launcher
        self._is_leaving = False
        self._bags_to_play: Tuple[str, ...] = ()
        self.grace = DelayedAction(GRACE_S, self._quit_unless_lost, clock_s, self)
        self._patience = QTimer(self, interval=_END_MS, singleShot=True)
        self._patience.timeout.connect(self.close_wanted)
        launcher.launch.stopped.connect(self._go_on)

    def play(self, paths: Tuple[str, ...]) -> None:
        """Switch from real-time mode to playback of a recording, if its files still exist."""
        self._launcher.if_there(paths, lambda: self._play(paths))

    def _play(self, paths: Tuple[str, ...]) -> None:
        if self._launcher.launch.is_idle or self._launcher.launch.is_running:
            self._launcher.play(paths)
        else:
            self._bags_to_play = paths
            self._launcher.launch.quit()

    def quit(self) -> None:
        """Quit all nodes, or cancel that if they are about to quit; the window stays."""
        if self.grace.is_waiting:
            self.grace.cancel()
        elif self._at_stake():
            self._ask_to_quit()
        else:
            self.grace.begin()

    def ask_to_leave(self) -> None:
        """Close the window, after a question if something would be lost."""
        is_writing = self._launcher.compare.is_writing
        stakes = ['A run that is shared is still being written.'] * is_writing + self._at_stake()
        if stakes and not self._is_leaving:
            unsaved = self._launcher.unsaved.unsaved
            self._ask(stakes, f'close without saving {listing(unsaved)}' if unsaved else 'close',
                      'close without saving' if unsaved else 'close', self._leave_without_saving)
        else:
            self.leave()

    def leave(self) -> None:
        """Quit all nodes (the recorder finishes its bag), then close, without a question.

        Unsaved edits are offered when the program starts again.
        """
        if self._is_leaving:
            return
        self._is_leaving = True
        self.grace.cancel()
        self._launcher.guard.cancel()
        self._launcher.bag.keep_open()
        if self._launcher.launch.is_idle:
            self.close_wanted.emit()
        else:
            self._launcher.launch.quit()

    def _leave_without_saving(self) -> None:
        """Discard the unsaved edits, as the operator has chosen, and close."""
        self._launcher.unsaved.discard()
        self.leave()

    def _quit_unless_lost(self) -> None:
        """Quit at the end of the grace time; ask first if something would be lost by now."""
        if self._launcher.launch.is_idle:
            return
        if self._at_stake():
            self._ask_to_quit()
        else:
            self._launcher.launch.quit()

    def _ask_to_quit(self) -> None:
        self._ask(self._at_stake('not saved, but kept in this window'), '', 'quit',
                  self._launcher.launch.quit)

    def _at_stake(self, unsaved: str = 'not saved') -> List[str]:
        """Return a sentence for each thing that would be lost or cut short, a recording last."""
        launcher, found = self._launcher, []
        if launcher.unsaved.unsaved:
            found.append(sentence(f'{unsaved}: {listing(launcher.unsaved.unsaved)}.'))
        reference = launcher.live_comparison.judged_with
        if reference:
            found.append(f'The running cell is being compared with {reference}.')
        if launcher.recording.is_recording:
            found.append('A recording is in progress.')
        return found

    def _ask(self, stakes: Sequence[str], last: str, yes: str, action: Callable[[], None]) -> None:
        is_recording = self._launcher.recording.is_recording
        acts = ['finish and keep it'] * is_recording + \
            ['quit all nodes'] * (not self._launcher.launch.is_idle or is_recording) + \
            [last] * bool(last)
        question = ask(self._window, f'{" ".join(stakes)} {sentence(listing(acts))}?',
                       f'Finish and {yes}' if is_recording and yes.islower() else sentence(yes),
                       action)
        question.setDefaultButton(QMessageBox.Cancel)

    def _go_on(self) -> None:
        self.grace.cancel()
        if self._is_leaving:
            self._patience.start()
            self._launcher.recording.after_end_of_run(self.close_wanted.emit)
        elif self._bags_to_play:
            paths, self._bags_to_play = self._bags_to_play, ()
            self._launcher.play(paths)
        else:
            self._launcher.launch.prepare()
