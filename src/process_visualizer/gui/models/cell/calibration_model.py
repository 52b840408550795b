# SPDX-License-Identifier: BSD-3-Clause
"""Calibration: the base frames' poses, moved while everything runs and saved into the file."""
from __future__ import annotations

from dataclasses import replace
from typing import Any, Callable, Dict, List, Optional, Sequence, Tuple

from PyQt5.QtCore import QObject, pyqtSignal

from process_visualizer.cell.editing.pose_edit import PoseEditError
from process_visualizer.cell.model import BaseFrame, Device, Pose, Vector3
from process_visualizer.gui.models.playback.newest_call import NewestCall
from process_visualizer.gui.toolkit.tasks import Tasks

Move = Callable[[str, Vector3, Vector3], Any]
"""Moves a frame (its name, xyz [m], ypr [rad]); blocks until it is done."""
Save = Callable[[str, Pose], Any]
"""Writes the pose of a device (its name) into its file; blocks; ``PoseEditor.save``."""
_LINE = 'calibration'
_SAME = 5e-7  # m or rad: files have six decimals


class CalibrationModel(QObject):
    """The pose of the chosen device's base frame: as in the file, or edited and not yet saved."""

    changed = pyqtSignal()
    failed = pyqtSignal(str)
    saved = pyqtSignal(str)
    """The file now has the pose of this device."""
    marker_wanted = pyqtSignal(bool)
    """Show the interactive marker of the chosen frame in RViz, or hide it."""
    moved = pyqtSignal(str, object)
    """A frame (its name) was given a Pose here, not by the marker, which must follow."""

    def __init__(self, tasks: Tasks, move: Move, parent: Optional[QObject] = None) -> None:
        super().__init__(parent)
        self._tasks, self._move = tasks, move
        self._save: Optional[Save] = None
        self._devices: Dict[str, Device] = {}
        self._edited: Dict[str, Pose] = {}
        self._moves: Dict[str, 'NewestCall[Tuple[str, Pose]]'] = {}
        self._device = ''
        self._is_running = self._is_saving = self._has_marker = False

    # What is shown

    @property
    def devices(self) -> List[str]:
        """The devices that have a base frame."""
        return list(self._devices)

    @property
    def device(self) -> str:
        """The chosen device, '' if there is none."""
        return self._device

    @property
    def base(self) -> Optional[BaseFrame]:
        """The chosen device's base frame in the file."""
        return self._base(self._device) if self._device else None

    @property
    def pose(self) -> Pose:
        """The present pose: xyz in m, ypr in rad."""
        return self._edited.get(self._device, self.base.pose if self.base else Pose())

    @property
    def unsaved(self) -> List[str]:
        """The devices whose pose differs from the file."""
        return [name for name in self._devices if name in self._edited]

    @property
    def is_unsaved(self) -> bool:
        """Whether the chosen device's pose differs from the file."""
        return self._device in self._edited

    @property
    def is_saving(self) -> bool:
        """Whether a file is being written."""
        return self._is_saving

    @property
    def can_save(self) -> bool:
        """Whether there is a pose to save, and a way to save it."""
        return self.is_unsaved and not self._is_saving and self._save is not None

    @property
    def has_marker(self) -> bool:
        """Whether the frame can be dragged in RViz."""
        return self._has_marker

    @property
    def blocked_reason(self) -> str:
        """Why nothing can be moved now; '' if something can."""
        if not self._device:
            return 'No device has a base frame.'
        return '' if self._is_running else 'Launch the nodes to move frames.'

    # What the program says

    def set_save(self, save: Save) -> None:
        """Set the function that writes a pose into its file."""
        self._save = save
        self.changed.emit()

    def set_devices(self, devices: Sequence[Device]) -> None:
        """Set the devices of the configuration; unsaved edits are kept."""
        self._devices = {device.name: device for device in devices if device.base is not None}
        self._edited = {name: pose for name, pose in self._edited.items()
                        if name in self._devices and not _same(pose, self._base(name).pose)}
        if self._device not in self._devices:
            self._device = next(iter(self._devices), '')
        self.changed.emit()

    def set_running(self, is_running: bool) -> None:
        """Set whether frames are published; starting nodes get unsaved poses."""
        if is_running == self._is_running:
            return
        self._is_running = is_running
        if not is_running:
            self.show_marker(False)
        for name in self.unsaved if is_running else ():
            self._send(name, self._edited[name])
        self.changed.emit()

    # Commands

    def choose(self, device: str) -> None:
        """Choose the device whose frame is shown."""
        if device in self._devices and device != self._device:
            had_marker = self._has_marker
            self.show_marker(False)
            self._device = device
            self.changed.emit()
            self.show_marker(had_marker)

    def set_value(self, index: int, value: float) -> None:
        """Set one number of x y z [m] yaw pitch roll [rad], by its index from 0 to 5."""
        numbers = [*self.pose.xyz, *self.pose.ypr]
        numbers[index] = value
        self._edit(_pose(numbers))
        self._update_marker()

    def take_pose(self, xyz: Vector3, ypr: Vector3) -> None:
        """Accept the pose of the interactive marker, which is not moved again."""
        if self._has_marker:
            self._edit(Pose(xyz, ypr))

    def revert(self) -> None:
        """Go back to the pose in the file."""
        if self.base is not None and self.is_unsaved:
            self._edit(self.base.pose)
            self._update_marker()

    def show_marker(self, is_shown: bool) -> None:
        """Show or hide the marker for dragging the frame in RViz."""
        if is_shown != self._has_marker and (self._is_running or not is_shown):
            self._has_marker = is_shown
            self.marker_wanted.emit(is_shown)
            self.changed.emit()

    def save(self) -> None:
        """Write the chosen device's pose into its file."""
        if not self.can_save or self._save is None:
            return
        save, device, pose = self._save, self._device, self.pose
        self._is_saving = True
        self.changed.emit()
        self._tasks.run('files', lambda: save(device, pose),
                        lambda _: self._was_saved(device, pose),
                        lambda error: self._not_saved(device, error))

    # How it is done

    def _base(self, name: str) -> BaseFrame:
        base = self._devices[name].base
        assert base is not None  # set_devices accepts no others
        return base

    def _edit(self, pose: Pose) -> None:
        if not self._device or _same(pose, self.pose):
            return
        if _same(pose, self._base(self._device).pose):
            self._edited.pop(self._device, None)
        else:
            self._edited[self._device] = pose
        if self._is_running:
            self._send(self._device, pose)
        self.changed.emit()

    def _send(self, name: str, pose: Pose) -> None:
        if name not in self._moves:
            self._moves[name] = NewestCall(
                self._tasks, _LINE, lambda it: self._move(it[0], it[1].xyz, it[1].ypr),
                lambda: None, lambda error: self._not_moved(name, error))
        self._moves[name].request((self._base(name).frame, pose))

    def _update_marker(self) -> None:
        if self.base is not None:
            self.moved.emit(self.base.frame, self.pose)

    def _was_saved(self, name: str, pose: Pose) -> None:
        self._is_saving = False
        if name in self._devices:  # until the file is read again
            known = self._devices[name]
            self._devices[name] = replace(known, base=replace(self._base(name), pose=pose))
        if _same(self._edited.get(name, pose), pose):
            self._edited.pop(name, None)
        self.changed.emit()
        self.saved.emit(name)

    def _not_saved(self, device: str, error: Exception) -> None:
        self._is_saving = False
        self.changed.emit()
        if not isinstance(error, (OSError, PoseEditError)):
            raise error
        self.failed.emit(f'the pose of {device} was not saved: {error}. Your values are still here')

    def _not_moved(self, name: str, error: Exception) -> None:
        self.failed.emit(f'{name} could not be moved: {error}')


def _pose(numbers: Sequence[float]) -> Pose:
    x, y, z, yaw, pitch, roll = numbers
    return Pose((x, y, z), (yaw, pitch, roll))


def _same(one: Pose, other: Pose) -> bool:
    return all(abs(a - b) < _SAME for a, b in zip((*one.xyz, *one.ypr), (*other.xyz, *other.ypr)))


def difference(one: Pose, other: Pose) -> Tuple[float, float]:
    """Return the difference of two poses: their distance [m] and largest angle [rad]."""
    distance = sum((a - b) ** 2 for a, b in zip(one.xyz, other.xyz)) ** 0.5
    return distance, max(abs(a - b) for a, b in zip(one.ypr, other.ypr))
