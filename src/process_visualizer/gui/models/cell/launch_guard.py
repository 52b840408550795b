# SPDX-License-Identifier: BSD-3-Clause
"""Launches a choice once nobody publishes what would be mixed with it."""
from __future__ import annotations

from typing import Callable, Optional

from PyQt5.QtCore import QObject, QTimer, pyqtSignal

from process_visualizer.generate.choice import Choice
from process_visualizer.gui.toolkit.tasks import Tasks
from process_visualizer.health.mixed_sources import mixture_text, others_before
from process_visualizer.health.other_publishers import Others

LINE = 'publishers'
PERIOD_MS = 1000


class LaunchGuard(QObject):
    """Asks if somebody is in the way, and looks again until the question is answered.

    Commands return at once.
    """

    asked = pyqtSignal(str, object)
    """Who is in the way, and the mode that was to be launched."""
    settled = pyqtSignal()
    """The question needs no answer any more."""
    changed = pyqtSignal()
    """It has begun to look, or looks no more."""

    def __init__(self, tasks: Tasks, launch: Callable[[Choice], None],
                 look: Callable[[Choice], Others] = others_before,
                 parent: Optional[QObject] = None) -> None:
        """Take what launches, and what looks who is in the way; the latter blocks."""
        super().__init__(parent)
        self._tasks, self._launch, self._look = tasks, launch, look
        self._choice: Optional[Choice] = None
        self._told = ''
        self._timer = QTimer(self, interval=PERIOD_MS, singleShot=True)
        self._timer.timeout.connect(self._begin_look)

    @property
    def is_waiting(self) -> bool:
        """Whether something is to be launched and is not yet."""
        return self._choice is not None

    @property
    def is_looking(self) -> bool:
        """Whether it is not known yet if something can be launched."""
        return self._choice is not None and not self._told

    def launch(self, choice: Choice) -> None:
        """Launch a choice, at once if nobody is in the way."""
        self.cancel()
        self._choice = choice
        self.changed.emit()
        self._begin_look()

    def launch_all_the_same(self) -> None:
        """Launch, whoever is in the way."""
        choice = self._choice
        self.cancel()
        if choice is not None:
            self._launch(choice)

    def cancel(self) -> None:
        """Launch nothing."""
        self._choice, self._told = None, ''
        self._timer.stop()
        self.settled.emit()
        self.changed.emit()

    def _begin_look(self) -> None:
        choice = self._choice
        if choice is not None:
            self._tasks.run(LINE, lambda: self._look(choice),
                            lambda others: self._take(choice, others))

    def _take(self, choice: Choice, others: Others) -> None:
        if choice is not self._choice:
            return  # it was cancelled meanwhile
        if not others:
            self.launch_all_the_same()
            return
        text = mixture_text(choice.mode, others)
        if text != self._told:
            self._told = text
            self.changed.emit()
            self.asked.emit(text, choice.mode)
        self._timer.start()
