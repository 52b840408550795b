# SPDX-License-Identifier: BSD-3-Clause
"""Which curves the operator wants to see, and in which order, for each configuration."""
from __future__ import annotations

from typing import Any, Dict, FrozenSet, List, NamedTuple, Optional, Sequence, Tuple

from PyQt5.QtCore import QObject, pyqtSignal

from process_visualizer.curves.position_values import Key

_MOST_CONFIGURATIONS = 50  # that are remembered


class LaneChoice(NamedTuple):
    """The order of curves, and those that are hidden."""

    order: Tuple[Key, ...] = ()
    hidden: FrozenSet[Key] = frozenset()

    def arranged(self, keys: Sequence[Key]) -> Tuple[Key, ...]:
        """Return curves in the chosen order; those that were never arranged come last."""
        known = [key for key in self.order if key in keys]
        return tuple(known + [key for key in keys if key not in self.order])

    def shown(self, keys: Sequence[Key]) -> Tuple[Key, ...]:
        """Return the curves that are not hidden, in the chosen order."""
        return tuple(key for key in self.arranged(keys) if key not in self.hidden)

    def settings(self) -> List[Any]:
        """Return what ``restored`` needs."""
        return [[list(key), key not in self.hidden] for key in self.arranged(sorted(self.hidden))]


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

    def hide(self, key: Key) -> None:
        """Hide one more curve."""
        self.choose(self.choice._replace(hidden=self.choice.hidden | {key}))

    def settings(self) -> Dict[str, Any]:
        """Return what ``restore`` needs, as numbers, texts, lists and dictionaries."""
        newest = list(self._choices.items())[-_MOST_CONFIGURATIONS:]
        return {path: choice.settings() for path, choice in newest if choice != LaneChoice()}

    def restore(self, settings: Dict[str, Any]) -> None:
        """Take the choices of an earlier run."""
        self._choices = {path: _restored(rows) for path, rows in settings.items()}
        self.changed.emit()


def _restored(rows: Sequence[Any]) -> LaneChoice:
    keys = [(str(device), str(label), str(topic)) for (device, label, topic), _ in rows]
    hidden = [key for key, (_, is_shown) in zip(keys, rows) if not is_shown]
    return LaneChoice(tuple(keys), frozenset(hidden))
