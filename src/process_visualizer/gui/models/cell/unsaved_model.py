# SPDX-License-Identifier: BSD-3-Clause
"""Values that were edited and not saved, and are kept until somebody takes or discards them."""
from __future__ import annotations

import math
from typing import Any, Dict, List, Mapping, Sequence, Tuple

from PyQt5.QtCore import QObject, pyqtSignal

from process_visualizer.gui.models.cell.edited_values import EditedValues

_NUMBERS = 6
"""Of a pose, and of a box."""
_Edits = Dict[str, Dict[str, Tuple[float, ...]]]
"""By what they are of ('the pose'), and by device."""


class UnsavedModel(QObject):
    """Edits of a configuration; they outlive this program, however it ends.

    What an earlier session left, or what was edited before another configuration was opened, is
    offered when its configuration is open: nothing moves unless the operator wants it.
    """

    changed = pyqtSignal()

    def __init__(self, edited: Mapping[str, 'EditedValues[Any]'], parent: QObject) -> None:
        """``edited`` are the models of the values, by what one of them is ('the pose')."""
        super().__init__(parent)
        self._edited = edited
        self._file = ''
        self._left: Dict[str, _Edits] = {}
        for model in edited.values():
            model.changed.connect(self.changed)

    @property
    def unsaved(self) -> List[str]:
        """Return what is edited and in no file."""
        return [f'{what} of {name}' for what, model in self._edited.items()
                for name in model.unsaved]

    @property
    def offered(self) -> List[str]:
        """Return the edits left unsaved in this configuration, neither taken nor discarded yet."""
        return [f'{what} of {name}' for what, edits in self._left.get(self._file, {}).items()
                for name, numbers in edits.items() if self._edited[what].differs(name, numbers)]

    def set_file(self, file: str) -> None:
        """Set the configuration before its devices are set; what is edited stays with the last."""
        if file == self._file:
            return
        self._keep()
        self._file = file
        for model in self._edited.values():
            model.forget()

    def take(self) -> None:
        """Edit what is offered as it was left."""
        for what, edits in self._left.pop(self._file, {}).items():
            for name, numbers in edits.items():
                self._edited[what].set_numbers(name, numbers)
        self.changed.emit()

    def discard_offer(self) -> None:
        """Forget what is offered."""
        self._left.pop(self._file, None)
        self.changed.emit()

    def discard(self) -> None:
        """Forget what is edited, because the operator said so; nodes that run are not moved."""
        for model in self._edited.values():
            model.forget()
        self.changed.emit()

    def settings(self) -> Dict[str, _Edits]:
        """Return everything unsaved, for ``restore``."""
        present = self._with_edits()
        return {**self._left, **({self._file: present} if present else {})}

    def restore(self, settings: Mapping[str, Mapping[str, Mapping[str, Sequence[float]]]]) -> None:
        """Take what an earlier session left.

        Raises:
            AttributeError, KeyError, TypeError, ValueError: these are not settings.
        """
        self._left = {str(file): {what: {name: _six(numbers) for name, numbers in
                                         edits.get(what, {}).items()} for what in self._edited}
                      for file, edits in settings.items()}
        self.changed.emit()

    def _keep(self) -> None:
        present = self._with_edits()
        if present:
            self._left[self._file] = present

    def _with_edits(self) -> _Edits:
        """Return what was left in this configuration, and over it what is edited."""
        left = self._left.get(self._file, {})
        found = {what: {**left.get(what, {}), **model.edits()}
                 for what, model in self._edited.items()}
        return {what: edits for what, edits in found.items() if edits}


def _six(numbers: Sequence[float]) -> Tuple[float, ...]:
    found = tuple(float(it) for it in numbers)
    if len(found) != _NUMBERS or not all(map(math.isfinite, found)):
        raise ValueError(f'not {_NUMBERS} numbers')
    return found
