# SPDX-License-Identifier: BSD-3-Clause
"""Nodes whose topics are mixed with those of the running cell."""
from __future__ import annotations

from typing import Callable, Collection, Optional, Tuple

import rosgraph
from PyQt5.QtCore import QObject, QTimer, pyqtSignal

from process_visualizer.cell.model import Mode
from process_visualizer.generate.choice import Choice
from process_visualizer.gui.models.cell.launch_guard import LINE, PERIOD_MS
from process_visualizer.gui.toolkit.tasks import Tasks
from process_visualizer.health.mixed_sources import others_beside
from process_visualizer.health.other_publishers import Others, described


class MixtureModel(QObject):
    """Looks every second while nodes run; the player reports its own topics."""

    changed = pyqtSignal()
    begun = pyqtSignal()
    """This model has seen a new publisher."""

    def __init__(self, tasks: Tasks, own_nodes: Callable[[], Collection[str]],
                 look: Callable[[Choice, Collection[str]], Others] = others_beside,
                 parent: Optional[QObject] = None) -> None:
        """``own_nodes`` returns names of launched nodes; ``look`` finds others and blocks."""
        super().__init__(parent)
        self._tasks, self._own_nodes, self._look = tasks, own_nodes, look
        self._choice: Optional[Choice] = None
        self._others: Others = ()
        self._player_sentences: Tuple[str, ...] = ()
        self._timer = QTimer(self, interval=PERIOD_MS)
        self._timer.timeout.connect(self._begin_look)
        self._is_looking = False

    @property
    def mode(self) -> Optional[Mode]:
        """The mode of the running nodes; None if there are none."""
        return None if self._choice is None else self._choice.mode

    @property
    def sentences(self) -> Tuple[str, ...]:
        """Return who publishes what; empty if there is no mixture."""
        return (*described(self._others), *self._player_sentences)

    def follow(self, choice: Optional[Choice]) -> None:
        """Watch a running choice; None: nothing is running any more."""
        if choice is self._choice:
            return
        self._choice = choice
        if choice is None:
            self._timer.stop()
            self._others, self._player_sentences = (), ()
            self.changed.emit()
        else:
            self._timer.start()

    def take_player(self, sentences: Tuple[str, ...]) -> None:
        """Set what the player reports about other publishers of its topics."""
        if sentences != self._player_sentences and self._choice is not None:
            self._player_sentences = sentences
            self.changed.emit()

    def _begin_look(self) -> None:
        choice, own = self._choice, frozenset(self._own_nodes())
        if choice is not None and not self._is_looking:
            self._is_looking = True
            self._tasks.run(LINE, lambda: self._look(choice, own),
                            lambda others: self._take(choice, others), self._keep_result)

    def _take(self, choice: Choice, others: Others) -> None:
        self._is_looking = False
        if choice is not self._choice or others == self._others:
            return
        new, self._others = set(others) - set(self._others), others
        self.changed.emit()
        if new:
            self.begun.emit()

    def _keep_result(self, error: Exception) -> None:
        """Keep the last result: another model reports a master that does not answer."""
        self._is_looking = False
        if not isinstance(error, (rosgraph.MasterException, OSError)):
            raise error
