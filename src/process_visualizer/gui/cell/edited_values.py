# SPDX-License-Identifier: BSD-3-Clause
"""Numbers of devices that are edited while everything runs, and saved or reverted."""
from __future__ import annotations

import math
from typing import (
    Any,
    Callable,
    Dict,
    Generic,
    List,
    Mapping,
    Optional,
    Sequence,
    Set,
    Tuple,
    Type,
    TypeVar,
)

from PyQt5.QtCore import QObject, pyqtSignal

from process_visualizer.cell.file_edit import PoseEditError
from process_visualizer.gui.session import Session
from process_visualizer.gui.toolkit.tasks import NewestCall, Tasks

Value = TypeVar('Value')
_SAME = 5e-7  # m or rad: files have six decimals


class EditedValues(QObject, Generic[Value]):
    """A value of each device: as it is saved, or edited and not yet saved.

    One ``device`` is chosen ('': there is none); its value can be dragged in RViz while it
    ``has_marker``. ``is_saving`` while a file is written. A subclass defines what a value is.
    """

    changed = pyqtSignal()
    failed = pyqtSignal(str)
    saved = pyqtSignal(str)
    """The file now has the value of this device."""
    marker_wanted = pyqtSignal(bool)
    """Show the chosen value in RViz for dragging, or hide it."""
    moved = pyqtSignal(str, object)
    """A value was changed here, not by dragging: RViz must follow (see _target)."""

    _what, _moves_what = 'value', 'value'
    """Words for messages: the thing that is saved, and the one that is moved."""
    _refusals: Tuple[Type[Exception], ...] = (OSError, PoseEditError)
    """Errors of saving, with a text for the user."""

    def __init__(self, tasks: Tasks, line: str, move: Callable[[str, Value], Any],
                 parent: Optional[QObject] = None) -> None:
        """``move`` gives the running nodes a value (see _target); it blocks, in a line of tasks."""
        super().__init__(parent)
        self._tasks, self._line, self._move = tasks, line, move
        self._save: Optional[Callable[[str, Value], Any]] = None
        self._in_file: Dict[str, Value] = {}
        self._edited: Dict[str, Value] = {}
        self._moves: Dict[str, 'NewestCall[Tuple[str, Value]]'] = {}
        self._refused: Set[str] = set()  # devices whose nodes have not accepted the newest value
        self.device = self._wanted = ''
        self._is_running = self.is_saving = self.has_marker = False

    # Definition of a value

    def _numbers(self, value: Value) -> Tuple[float, ...]:
        """Return all numbers of a value [m, rad]."""
        raise NotImplementedError

    def _with_numbers(self, value: Value, numbers: Sequence[float]) -> Value:
        """Return a value with other numbers."""
        raise NotImplementedError

    def _target(self, name: str) -> str:
        """Return the ROS name of the thing that is moved when a device gets a value."""
        return name

    def _saved(self, name: str) -> Value:
        """Return the value of a device without unsaved changes."""
        return self._in_file[name]

    # State

    @property
    def devices(self) -> List[str]:
        """The devices that have a value."""
        return list(self._in_file)

    def value_of(self, name: str) -> Optional[Value]:
        """Return the present value of a device; None if it has none."""
        return self._edited.get(name, self._saved(name)) if name in self._in_file else None

    @property
    def unsaved(self) -> List[str]:
        """The devices whose value differs from what is saved."""
        return [name for name in self._in_file if name in self._edited]

    def is_taken(self, name: str) -> bool:
        """Return whether the running nodes have accepted all values that a device was given."""
        move = self._moves.get(name)
        return name not in self._refused and (move is None or move.wanted is None)

    def edits(self) -> Dict[str, Tuple[float, ...]]:
        """Return the numbers of unsaved values, by device."""
        return {name: self._numbers(self._edited[name]) for name in self.unsaved}

    def differs(self, name: str, numbers: Sequence[float]) -> bool:
        """Return whether a device has a value, and its present one has other numbers."""
        value = self.value_of(name)
        return value is not None and not self._is_same(value, self._with_numbers(value, numbers))

    @property
    def is_unsaved(self) -> bool:
        """Return whether the chosen value differs from what is saved."""
        return self.device in self._edited

    @property
    def can_save(self) -> bool:
        """Return whether the chosen value differs from the file, and can be written there."""
        return self._differs_from_file(self.device) and not self.is_saving \
            and self._save is not None

    @property
    def can_move(self) -> bool:
        """Return whether running nodes can accept the chosen value."""
        return self._is_running and bool(self.device)

    # Input from the program

    def set_save(self, save: Callable[[str, Value], Any]) -> None:
        """Set the function that writes the value of a device into its file; it blocks."""
        self._save = save
        self.changed.emit()

    def set_running(self, is_running: bool) -> None:
        """Set whether the nodes run; nodes that start get the values that differ from the file."""
        if is_running == self._is_running:
            return
        self._is_running = is_running
        if not is_running:
            self.show_marker(False)
        self._refused.clear()  # new nodes begin with the values of the file
        for name in filter(self._differs_from_file, self._in_file if is_running else ()):
            self._send(name)
        self.changed.emit()

    # Commands

    def choose(self, device: str) -> None:
        """Choose the device whose value is shown, also after other configurations were open."""
        self._wanted = device if device in self._in_file else self._wanted
        if device in self._in_file and device != self.device:
            had_marker = self.has_marker
            self.show_marker(False)
            self.device = device
            self.changed.emit()
            self.show_marker(had_marker)

    def set_value(self, index: int, number: float) -> None:
        """Set one number of the chosen value, by its index."""
        value = self.value_of(self.device)
        if value is not None:
            numbers = list(self._numbers(value))
            numbers[index] = number
            self.set_numbers(self.device, numbers)

    def set_to(self, name: str, value: Value) -> None:
        """Give a device a value."""
        if name in self._in_file:
            self._edit(name, value)
            self._tell_marker(name)

    def set_numbers(self, name: str, numbers: Sequence[float]) -> None:
        """Give a device the value with these numbers, if it has one."""
        value = self.value_of(name)
        if value is not None:
            self.set_to(name, self._with_numbers(value, numbers))

    def forget(self) -> None:
        """Drop unsaved values; running nodes keep them."""
        self._edited = {}
        self.changed.emit()

    def revert(self) -> None:
        """Go back to the saved value."""
        if self.device:
            self.set_to(self.device, self._saved(self.device))

    def show_marker(self, is_shown: bool) -> None:
        """Show the chosen value in RViz for dragging, or hide it."""
        if is_shown != self.has_marker and (self.can_move or not is_shown):
            self.has_marker = is_shown
            self.marker_wanted.emit(is_shown)
            self.changed.emit()

    def save(self) -> None:
        """Write the chosen value into its file."""
        save, device, value = self._save, self.device, self.value_of(self.device)
        if not self.can_save or save is None or value is None:
            return
        write, chosen = save, value
        self._set_saving(True)
        self._tasks.run('files', lambda: write(device, chosen),
                        lambda _: self._was_saved(device, chosen),
                        lambda error: self._not_saved(device, error))

    # Implementation

    def _set_in_file(self, values: Dict[str, Value]) -> None:
        """Set the values of the files; keep unsaved edits of devices that are still there."""
        self._in_file = values
        self._edited = {name: self._with_numbers(values[name], self._numbers(it))
                        for name, it in self._edited.items() if name in values}
        self._forget_equal()
        device = next((it for it in (self._wanted, self.device) if it in values),
                      next(iter(values), ''))
        if device != self.device:
            self.show_marker(False)
            self.device = device
        self.changed.emit()

    def _take_dragged(self, value: Value) -> None:
        """Accept the chosen value that was dragged in RViz, without moving it there again."""
        if self.has_marker:
            self._edit(self.device, value)

    def _edit(self, name: str, value: Value) -> None:
        before = self.value_of(name)
        if before is None or self._is_same(value, before):
            return
        self._edited[name] = value
        self._forget_equal()
        if self._is_running:
            self._send(name)
        self.changed.emit()

    def _send(self, name: str) -> None:
        """Give the nodes the present value of a device."""
        value = self.value_of(name)
        if name not in self._moves:
            self._moves[name] = NewestCall(
                self._tasks, self._line, lambda it: self._move(*it),
                lambda: self._refused.discard(name), lambda error: self._refuse(name, error))
        if value is not None:
            self._moves[name].request((self._target(name), value))

    def _refuse(self, name: str, error: Exception) -> None:
        self._refused.add(name)
        self.failed.emit(f'the {self._moves_what} of {name} was not moved: {error}')

    def _tell_marker(self, name: str) -> None:
        value = self.value_of(name)
        if name == self.device and value is not None:
            self.moved.emit(self._target(name), value)

    def _forget_equal(self) -> None:
        """Forget edits that equal the saved values."""
        self._edited = {name: it for name, it in self._edited.items()
                        if not self._is_same(it, self._saved(name))}

    def _is_same(self, one: Value, other: Value) -> bool:
        return all(abs(a - b) < _SAME for a, b in zip(self._numbers(one), self._numbers(other)))

    def _differs_from_file(self, name: str) -> bool:
        value = self.value_of(name)
        return value is not None and not self._is_same(value, self._in_file[name])

    def _set_saving(self, is_saving: bool) -> None:
        self.is_saving = is_saving
        self.changed.emit()

    def _was_saved(self, name: str, value: Value) -> None:
        self.is_saving = False
        if name in self._in_file:  # until the file is read again
            self._in_file[name] = value
        if self._is_same(self._edited.get(name, value), value):
            self._edited.pop(name, None)
        self.changed.emit()
        self.saved.emit(name)

    def _not_saved(self, name: str, error: Exception) -> None:
        self._set_saving(False)
        if not isinstance(error, self._refusals):
            raise error
        self.failed.emit(f'the {self._what} of {name} was not saved: {error}. '
                         'Your values are still here')


_NUMBERS = 6
"""The count of numbers in a pose, and in a box."""
_Edits = Dict[str, Dict[str, Tuple[float, ...]]]
"""Numbers by the kind of value ('the pose'), and by device."""


class UnsavedModel(QObject):
    """Edits of a configuration; they outlive this program, however it ends.

    Edits that were left by an earlier session, or before another configuration was opened, are
    offered when their configuration is open: nothing moves unless the operator wants it.
    """

    changed = pyqtSignal()

    def __init__(self, edited: Mapping[str, 'EditedValues[Any]'], session: Session,
                 parent: QObject) -> None:
        """``edited`` are the models of the values, by the kind of value ('the pose')."""
        super().__init__(parent)
        self._edited = edited
        self._file = ''
        self._left: Dict[str, _Edits] = {}
        for model in edited.values():
            model.changed.connect(self.changed)
        session.opened.connect(lambda: self._follow(session.file))

    @property
    def unsaved(self) -> List[str]:
        """Return the edits that are in no file."""
        return [f'{what} of {name}' for what, model in self._edited.items()
                for name in model.unsaved]

    @property
    def offered(self) -> List[str]:
        """Return the edits left unsaved in this configuration, neither restored nor discarded."""
        return [f'{what} of {name}' for what, edits in self._left.get(self._file, {}).items()
                for name, numbers in edits.items() if self._edited[what].differs(name, numbers)]

    def _follow(self, file: str) -> None:
        """Set aside the edits of the last configuration, before the models take the new devices."""
        present = self._with_edits()
        if present:
            self._left[self._file] = present
        self._file = file
        for model in self._edited.values():
            model.forget()

    def take(self) -> None:
        """Restore the offered edits."""
        for what, edits in self._left.pop(self._file, {}).items():
            for name, numbers in edits.items():
                self._edited[what].set_numbers(name, numbers)
        self.changed.emit()

    def discard_offer(self) -> None:
        """Forget the offered edits."""
        self._left.pop(self._file, None)
        self.changed.emit()

    def discard(self) -> None:
        """Forget all edits at the operator's request; running nodes keep them."""
        for model in self._edited.values():
            model.forget()
        self.changed.emit()

    def settings(self) -> Dict[str, _Edits]:
        """Return everything unsaved, for ``restore``."""
        present = self._with_edits()
        return {**self._left, **({self._file: present} if present else {})}

    def restore(self, settings: Mapping[str, Mapping[str, Mapping[str, Sequence[float]]]]) -> None:
        """Restore the edits of an earlier session.

        Raises:
            AttributeError, KeyError, TypeError, ValueError: these are not settings.
        """
        self._left = {str(file): {what: {name: _six(numbers) for name, numbers in
                                         edits.get(what, {}).items()} for what in self._edited}
                      for file, edits in settings.items()}
        self.changed.emit()

    def _with_edits(self) -> _Edits:
        """Return the edits that were left in this configuration, overridden by the present ones."""
        left = self._left.get(self._file, {})
        found = {what: {**left.get(what, {}), **model.edits()}
                 for what, model in self._edited.items()}
        return {what: edits for what, edits in found.items() if edits}


def _six(numbers: Sequence[float]) -> Tuple[float, ...]:
    found = tuple(float(it) for it in numbers)
    if len(found) != _NUMBERS or not all(map(math.isfinite, found)):
        raise ValueError(f'not {_NUMBERS} numbers')
    return found
