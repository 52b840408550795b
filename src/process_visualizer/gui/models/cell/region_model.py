# SPDX-License-Identifier: BSD-3-Clause
"""The boxes that clouds are cropped to: moved while everything runs, saved into the file."""
from __future__ import annotations

from dataclasses import replace
from typing import Any, Callable, Dict, List, Optional, Sequence, Tuple

from PyQt5.QtCore import QObject, pyqtSignal

from process_visualizer.cell.editing.pose_edit import PoseEditError
from process_visualizer.cell.model import Device, RegionOfInterest
from process_visualizer.gui.models.playback.newest_call import NewestCall
from process_visualizer.gui.toolkit.tasks import Tasks

Apply = Callable[[str, RegionOfInterest], Any]
"""Gives a device (its name) a box, in the running nodes or in the file; blocks until it is done."""
_LINE = 'region'
_SAME_M = 5e-7  # files have six decimals


class RegionModel(QObject):
    """The box of the chosen depth sensor: as in the file, or edited and not yet saved."""

    changed = pyqtSignal()
    failed = pyqtSignal(str)
    saved = pyqtSignal(str)
    """The file now has the box of this device."""
    marker_wanted = pyqtSignal(bool)
    """Show the chosen box in RViz for dragging, or hide it."""
    moved = pyqtSignal(str, object)
    """The box of a device was changed here, not by dragging it: what RViz shows must follow."""

    def __init__(self, tasks: Tasks, move: Apply, parent: Optional[QObject] = None) -> None:
        super().__init__(parent)
        self._tasks = tasks
        self._moves: NewestCall[Tuple[str, RegionOfInterest]] = NewestCall(
            tasks, _LINE, lambda it: move(*it), lambda: None, self._not_moved)
        self._save: Optional[Apply] = None
        self._in_file: Dict[str, RegionOfInterest] = {}
        self._edited: Dict[str, RegionOfInterest] = {}
        self._device = ''
        self._is_running = self._is_saving = self._has_marker = False

    # What is shown

    @property
    def devices(self) -> List[str]:
        """The depth sensors with a box."""
        return list(self._in_file)

    @property
    def device(self) -> str:
        """The chosen one, '' if there is none."""
        return self._device

    @property
    def region(self) -> Optional[RegionOfInterest]:
        """The present box of the chosen device."""
        return self._edited.get(self._device, self._in_file.get(self._device))

    @property
    def is_unsaved(self) -> bool:
        """Whether the chosen box differs from the file."""
        return self._device in self._edited

    @property
    def can_save(self) -> bool:
        """Whether there is a box to save, and a way to save it."""
        return self.is_unsaved and not self._is_saving and self._save is not None

    @property
    def can_move(self) -> bool:
        """Whether nodes run that show what a box lets through."""
        return self._is_running and bool(self._device)

    @property
    def has_marker(self) -> bool:
        """Whether the box can be dragged in RViz."""
        return self._has_marker

    # What the program says

    def set_save(self, save: Apply) -> None:
        """Set the function that writes a box into its file."""
        self._save = save
        self.changed.emit()

    def set_devices(self, devices: Sequence[Device]) -> None:
        """Set the devices of the configuration; unsaved edits are kept."""
        self._in_file = {it.name: it.roi for it in devices if it.roi is not None and it.has_cloud}
        edited = {name: replace(self._in_file[name], center=it.center, size=it.size)
                  for name, it in self._edited.items() if name in self._in_file}
        self._edited = {name: it for name, it in edited.items()
                        if not _same(it, self._in_file[name])}
        if self._device not in self._in_file:
            self.show_marker(False)
            self._device = next(iter(self._in_file), '')
        self.changed.emit()

    def set_running(self, is_running: bool) -> None:
        """Set whether the nodes run; starting ones get unsaved boxes."""
        if is_running == self._is_running:
            return
        self._is_running = is_running
        if not is_running:
            self.show_marker(False)
        for edited in self._edited.items() if is_running else ():
            self._moves.request(edited)
        self.changed.emit()

    # Commands

    def choose(self, device: str) -> None:
        """Choose the device whose box is shown."""
        if device in self._in_file and device != self._device:
            had_marker = self._has_marker
            self.show_marker(False)
            self._device = device
            self.changed.emit()
            self.show_marker(had_marker)

    def set_value(self, index: int, value_m: float) -> None:
        """Set one number of the centre (0 to 2) or of the edge lengths (3 to 5)."""
        region = self.region
        if region is None:
            return
        numbers = [*region.center, *region.size]
        numbers[index] = value_m
        x, y, z, length, width, height = numbers
        self._edit(replace(region, center=(x, y, z), size=(length, width, height)))
        self._tell_marker()

    def take_dragged(self, device: str, region: RegionOfInterest) -> None:
        """Accept the box as it was dragged in RViz, where it is not moved again."""
        if self._has_marker and device == self._device:
            self._edit(region)

    def revert(self) -> None:
        """Go back to the box in the file."""
        if self.is_unsaved:
            self._edit(self._in_file[self._device])
            self._tell_marker()

    def show_marker(self, is_shown: bool) -> None:
        """Show or hide the box for dragging in RViz."""
        if is_shown != self._has_marker and (self.can_move or not is_shown):
            self._has_marker = is_shown
            self.marker_wanted.emit(is_shown)
            self.changed.emit()

    def save(self) -> None:
        """Write the chosen box into its file."""
        save, device, region = self._save, self._device, self.region
        if not self.can_save or save is None or region is None:
            return
        chosen = region
        self._is_saving = True
        self.changed.emit()
        self._tasks.run('files', lambda: save(device, chosen),
                        lambda _: self._was_saved(device, chosen), self._not_saved)

    # How it is done

    def _edit(self, region: RegionOfInterest) -> None:
        if self.region is None or _same(region, self.region):
            return
        if _same(region, self._in_file[self._device]):
            self._edited.pop(self._device, None)
        else:
            self._edited[self._device] = region
        if self._is_running:
            self._moves.request((self._device, region))
        self.changed.emit()

    def _tell_marker(self) -> None:
        if self.region is not None:
            self.moved.emit(self._device, self.region)

    def _was_saved(self, device: str, region: RegionOfInterest) -> None:
        self._is_saving = False
        if device in self._in_file:  # until the file is read again
            self._in_file[device] = region
        if _same(self._edited.get(device, region), region):
            self._edited.pop(device, None)
        self.changed.emit()
        self.saved.emit(device)

    def _not_saved(self, error: Exception) -> None:
        self._is_saving = False
        self.changed.emit()
        if not isinstance(error, (OSError, PoseEditError)):
            raise error
        self.failed.emit(f'the box was not saved: {error}. Your values are still here')

    def _not_moved(self, error: Exception) -> None:
        self.failed.emit(f'the box was not moved: {error}')


def _same(one: RegionOfInterest, other: RegionOfInterest) -> bool:
    return all(abs(a - b) < _SAME_M for a, b in zip((*one.center, *one.size),
                                                    (*other.center, *other.size)))
