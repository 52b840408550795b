# SPDX-License-Identifier: BSD-3-Clause
"""Launches a choice once no other node publishes topics that would be mixed with it."""
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
    """Asks if other nodes are in the way, and looks again until the question is answered.

    Commands return at once.
    """

    asked = pyqtSignal(str, object)
    """The nodes in the way, and the mode to launch."""
    settled = pyqtSignal()
    """The question no longer needs an answer."""
    changed = pyqtSignal()
    """It has started or stopped looking."""

    def __init__(self, tasks: Tasks, launch: Callable[[Choice], None],
                 look: Callable[[Choice], Others] = others_before,
                 parent: Optional[QObject] = None) -> None:
        """``launch`` starts a choice; ``look`` finds nodes in the way, and blocks."""
        super().__init__(parent)
        self._tasks, self._launch, self._look = tasks, launch, look
        self._choice: Optional[Choice] = None
        self._reported = ''
        self._timer = QTimer(self, interval=PERIOD_MS, singleShot=True)
        self._timer.timeout.connect(self._begin_look)

    @property
    def is_waiting(self) -> bool:
        """Return whether a launch is waiting."""
        return self._choice is not None

    @property
    def is_looking(self) -> bool:
        """Return whether it is still unknown if the choice can be launched."""
        return self._choice is not None and not self._reported

    def launch(self, choice: Choice) -> None:
        """Launch a choice, at once if no node is in the way."""
        self.cancel()
        self._choice = choice
        self.changed.emit()
        self._begin_look()

    def launch_all_the_same(self) -> None:
        """Launch in spite of other nodes."""
        choice = self._choice
        self.cancel()
        if choice is not None:
            self._launch(choice)

    def cancel(self) -> None:
        """Cancel the launch."""
        self._choice, self._reported = None, ''
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
            return  # it was cancelled in the meantime
        if not others:
            self.launch_all_the_same()
            return
        text = mixture_text(choice.mode, others)
        if text != self._reported:
            self._reported = text
            self.changed.emit()
            self.asked.emit(text, choice.mode)
        self._timer.start()
