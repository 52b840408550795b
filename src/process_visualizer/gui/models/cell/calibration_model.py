# SPDX-License-Identifier: BSD-3-Clause
"""Calibration: the base frames' poses, moved while everything runs and saved into the file."""
from __future__ import annotations

from dataclasses import replace
from typing import Any, Callable, Dict, List, Optional, Sequence, Tuple

from PyQt5.QtCore import QObject, pyqtSignal

from process_visualizer.bags.bag_errors import BagError
from process_visualizer.bags.recording_calibration import RecordingCalibration, save_pose
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
    """The pose of the chosen device's base frame: as it is saved, or edited and not yet saved.

    While a recording is played, poses that were saved for it count before those of the file.
    """

    changed = pyqtSignal()
    failed = pyqtSignal(str)
    saved = pyqtSignal(str)
    """The file now has the pose of this device."""
    kept = pyqtSignal()
    """What is saved beside the recording has changed."""
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
        self._device, self._parent = '', ''
        self._recording: Optional[RecordingCalibration] = None
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
    def chosen(self) -> Optional[Device]:
        """The chosen device itself."""
        return self._devices.get(self._device)

    @property
    def base(self) -> Optional[BaseFrame]:
        """The chosen device's base frame in the configuration's file."""
        return self._base(self._device) if self._device else None

    @property
    def pose(self) -> Pose:
        """The present pose: xyz in m, ypr in rad."""
        return self.pose_of(self._device) or Pose()

    @property
    def saved_pose(self) -> Optional[Pose]:
        """Where the chosen frame is without unsaved changes.

        That is where it was saved for the recording that is played, else where the file says.
        """
        return self._saved(self._device) if self._device else None

    @property
    def recording(self) -> str:
        """The recording that is played, for which poses can be saved; '' in real time."""
        return '' if self._recording is None else self._recording.bag

    @property
    def is_for_recording(self) -> bool:
        """Whether the chosen frame has a pose that was saved for the recording."""
        return self._recording is not None and self.base is not None \
            and self.base.frame in self._recording.saved

    @property
    def recorded_pose(self) -> Optional[Pose]:
        """Where the chosen frame was when the recording was made; None if that is not known."""
        if self._recording is None or self.base is None:
            return None
        return self._recording.recorded(self.base.frame, self._parent)

    def pose_of(self, name: str) -> Optional[Pose]:
        """The present pose of a device; None if it has none."""
        return self._edited.get(name, self._saved(name)) if name in self._devices else None

    @property
    def unsaved(self) -> List[str]:
        """The devices whose pose differs from what is saved."""
        return [name for name in self._devices if name in self._edited]

    @property
    def is_unsaved(self) -> bool:
        """Whether the chosen device's pose differs from what is saved."""
        return self._device in self._edited

    @property
    def is_saving(self) -> bool:
        """Whether a file is being written."""
        return self._is_saving

    @property
    def can_save(self) -> bool:
        """Whether the pose differs from the file, and can be written there."""
        return self.base is not None and not _same(self.pose, self.base.pose) \
            and not self._is_saving and self._save is not None

    @property
    def can_save_for_recording(self) -> bool:
        """Whether the pose differs from what is saved, and a recording is played."""
        return self._recording is not None and self.is_unsaved and not self._is_saving

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

    def set_devices(self, devices: Sequence[Device], parent: str = 'world') -> None:
        """Set the devices of the configuration and its global frame; unsaved edits are kept."""
        self._parent = parent
        self._devices = {device.name: device for device in devices if device.base is not None}
        self._forget_equal()
        if self._device not in self._devices:
            self._device = next(iter(self._devices), '')
        self.changed.emit()

    def set_recording(self, recording: Optional[RecordingCalibration]) -> None:
        """Set the recording that is played (None: none), whose saved poses count before the file's.

        Unsaved edits stay: they are tried on another recording.
        """
        if recording is self._recording:
            return
        before = {name: self._edited.get(name, self._saved(name)) for name in self._devices}
        self._recording = recording
        self._forget_equal()
        for name, pose in before.items():
            present = self._edited.get(name, self._saved(name))
            if not _same(pose, present):
                self._show_at(name, present)
        self.changed.emit()

    def set_running(self, is_running: bool) -> None:
        """Set whether frames are published; starting nodes get what differs from the file."""
        if is_running == self._is_running:
            return
        self._is_running = is_running
        if not is_running:
            self.show_marker(False)
        for name in self._devices if is_running else ():
            pose = self.pose_of(name)
            if pose is not None and not _same(pose, self._base(name).pose):
                self._send(name, pose)
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
        self.set_pose(self._device, _pose(numbers))

    def set_pose(self, name: str, pose: Pose) -> None:
        """Move the frame of a device."""
        if name not in self._devices:
            return
        self._edit(name, pose)
        if name == self._device:
            self._update_marker()

    def take_pose(self, xyz: Vector3, ypr: Vector3) -> None:
        """Accept the pose of the interactive marker, which is not moved again."""
        if self._has_marker:
            self._edit(self._device, Pose(xyz, ypr))

    def revert(self) -> None:
        """Go back to the pose that is saved."""
        if self.saved_pose is not None:
            self.set_pose(self._device, self.saved_pose)

    def take_recorded(self) -> None:
        """Move the frame to where it was when the recording was made."""
        if self.recorded_pose is not None:
            self.set_pose(self._device, self.recorded_pose)

    def take_file(self) -> None:
        """Move the frame to where the file says."""
        if self.base is not None:
            self.set_pose(self._device, self.base.pose)

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

    def save_for_recording(self) -> None:
        """Save the chosen device's pose beside the recording; that of the file needs no saving."""
        if self.can_save_for_recording and self.base is not None:
            is_files = _same(self.pose, self.base.pose)
            self._keep(self._device, None if is_files else self.pose)

    # How it is done

    def _show_at(self, name: str, pose: Pose) -> None:
        if self._is_running:
            self._send(name, pose)
        if name == self._device:
            self._update_marker()

    def _saved(self, name: str) -> Pose:
        base = self._base(name)
        return base.pose if self._recording is None else self._recording.saved.get(
            base.frame, base.pose)

    def _forget_equal(self) -> None:
        """Forget edits of devices that are gone, and those that are saved."""
        self._edited = {name: pose for name, pose in self._edited.items()
                        if name in self._devices and not _same(pose, self._saved(name))}

    def _keep(self, name: str, pose: Optional[Pose]) -> None:
        """Save a pose beside the recording, or forget the one that is there."""
        recording, frame = self._recording, self._base(name).frame
        assert recording is not None, 'a recording is played'
        self._is_saving = True
        self.changed.emit()
        self._tasks.run('files', lambda: save_pose(recording.bag, frame, pose),
                        lambda saved: self._was_kept(recording.bag, saved),
                        lambda error: self._not_saved(name, error))

    def _was_kept(self, bag: str, saved: Dict[str, Pose]) -> None:
        self._is_saving = False
        if self._recording is not None and self._recording.bag == bag:
            self._recording = self._recording._replace(saved=saved)
            self._forget_equal()
        self.changed.emit()
        self.kept.emit()

    def _base(self, name: str) -> BaseFrame:
        base = self._devices[name].base
        assert base is not None  # set_devices accepts no others
        return base

    def _edit(self, name: str, pose: Pose) -> None:
        before = self.pose_of(name)
        if before is None or _same(pose, before):
            return
        self._edited[name] = pose
        self._forget_equal()
        if self._is_running:
            self._send(name, pose)
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
            if self._recording is not None and self._base(name).frame in self._recording.saved:
                self._keep(name, None)  # else what was saved for the recording would count
        if _same(self._edited.get(name, pose), pose):
            self._edited.pop(name, None)
        self.changed.emit()
        self.saved.emit(name)

    def _not_saved(self, device: str, error: Exception) -> None:
        self._is_saving = False
        self.changed.emit()
        if not isinstance(error, (OSError, PoseEditError, BagError)):
            raise error
        self.failed.emit(f'the pose of {device} was not saved: {error}. Your values are still here')

    def _not_moved(self, name: str, error: Exception) -> None:
        self.failed.emit(f'{name} could not be moved: {error}')


def _pose(numbers: Sequence[float]) -> Pose:
    x, y, z, yaw, pitch, roll = numbers
    return Pose((x, y, z), (yaw, pitch, roll))


def _same(one: Pose, other: Pose) -> bool:
    return all(abs(a - b) < _SAME for a, b in zip((*one.xyz, *one.ypr), (*other.xyz, *other.ypr)))
