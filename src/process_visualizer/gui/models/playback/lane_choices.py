# SPDX-License-Identifier: BSD-3-Clause
"""The operator's view of the curves, for each configuration."""
from __future__ import annotations

from typing import Any, Dict, Optional

from PyQt5.QtCore import QObject, pyqtSignal

from process_visualizer.gui.models.playback.lane_choice import LaneChoice, restored_choice

_MOST_CONFIGURATIONS = 50  # that are remembered


class LaneChoices(QObject):
    """The choice for the present configuration, and those for others."""

    changed = pyqtSignal()

    def __init__(self, parent: Optional[QObject] = None) -> None:
        super().__init__(parent)
        self._choices: Dict[str, LaneChoice] = {}
        self._configuration = ''

    @property
    def choice(self) -> LaneChoice:
        """The choice for the present configuration."""
        return self._choices.get(self._configuration, LaneChoice())

    def set_configuration(self, path: str) -> None:
        """Take the choice for another configuration."""
        if path != self._configuration:
            self._configuration = path
            self.changed.emit()

    def choose(self, choice: LaneChoice) -> None:
        """Take another choice for the present configuration."""
        if choice != self.choice:
            self._choices.pop(self._configuration, None)
            self._choices[self._configuration] = choice
            self.changed.emit()

    def settings(self) -> Dict[str, Any]:
        """Return what ``restore`` needs, as numbers, texts, lists and dictionaries."""
        newest = list(self._choices.items())[-_MOST_CONFIGURATIONS:]
        return {path: choice.settings() for path, choice in newest if choice != LaneChoice()}

    def restore(self, settings: Dict[str, Any]) -> None:
        """Take the choices of an earlier run."""
        self._choices = {path: restored_choice(rows) for path, rows in settings.items()}
        self.changed.emit()
