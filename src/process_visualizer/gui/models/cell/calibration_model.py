# SPDX-License-Identifier: BSD-3-Clause
"""Calibration: the base frames' poses, moved while everything runs and saved into the file."""
from __future__ import annotations

from typing import Any, Callable, Dict, Optional, Sequence, Tuple

from PyQt5.QtCore import QObject, pyqtSignal

from process_visualizer.bags.bag_errors import BagError
from process_visualizer.bags.recording_calibration import RecordingCalibration, save_pose
from process_visualizer.cell.model import BaseFrame, Device, Pose, Vector3
from process_visualizer.gui.models.cell.edited_values import EditedValues
from process_visualizer.gui.toolkit.tasks import Tasks

Move = Callable[[str, Vector3, Vector3], Any]
"""Moves a frame (its name, xyz [m], ypr [rad]); blocks until it is done."""


class CalibrationModel(EditedValues[Pose]):
    """The poses of the base frames; numbers are x y z [m] yaw pitch roll [rad].

    While a recording is played, poses that were saved for it count before those of the file.
    """

    kept = pyqtSignal()
    """What is saved beside the recording has changed."""

    _what, _moves_what = 'pose', 'base frame'
    _refusals = (*EditedValues._refusals, BagError)

    def __init__(self, tasks: Tasks, move: Move, parent: Optional[QObject] = None) -> None:
        super().__init__(tasks, 'calibration',
                         lambda frame, pose: move(frame, pose.xyz, pose.ypr), parent)
        self._devices: Dict[str, Device] = {}
        self._parent = ''
        self._recording: Optional[RecordingCalibration] = None

    # What is shown

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
        return self.value_of(self._device) or Pose()

    @property
    def saved_pose(self) -> Optional[Pose]:
        """Return where the chosen frame is without unsaved changes.

        That is where it was saved for the recording that is played, else where the file says.
        """
        return self._saved(self._device) if self._device else None

    @property
    def recording(self) -> str:
        """The recording that is played, for which poses can be saved; '' in real time."""
        return '' if self._recording is None else self._recording.bag

    @property
    def is_for_recording(self) -> bool:
        """Return whether the chosen frame has a pose that was saved for the recording."""
        return bool(self._device) and self._has_kept(self._device)

    @property
    def recorded_pose(self) -> Optional[Pose]:
        """Return the chosen frame's place at the time of the recording; None if unknown."""
        if self._recording is None or self.base is None:
            return None
        return self._recording.recorded(self.base.frame, self._parent)

    @property
    def can_save_for_recording(self) -> bool:
        """Return whether the pose differs from what is saved, and a recording is played."""
        return self._recording is not None and self.is_unsaved and not self._is_saving

    @property
    def blocked_reason(self) -> str:
        """Return why nothing can be moved now; '' if something can."""
        if not self._device:
            return 'No device has a base frame.'
        return '' if self._is_running else 'Launch the nodes to move frames.'

    # What the program says

    def set_devices(self, devices: Sequence[Device], parent: str = 'world') -> None:
        """Set the devices of the configuration and its global frame; unsaved edits are kept."""
        self._parent = parent
        self._devices = {it.name: it for it in devices if it.base is not None}
        self._set_in_file({it.name: it.base.pose for it in devices if it.base is not None})

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
            if not self._is_same(pose, self._edited.get(name, self._saved(name))):
                self._show_at_present(name)
        self.changed.emit()

    # Commands

    def set_pose(self, name: str, pose: Pose) -> None:
        """Move the frame of a device."""
        self.set_to(name, pose)

    def take_pose(self, xyz: Vector3, ypr: Vector3) -> None:
        """Accept the pose of the interactive marker, which is not moved again."""
        self._take_dragged(Pose(xyz, ypr))

    def take_recorded(self) -> None:
        """Move the frame to where it was when the recording was made."""
        if self.recorded_pose is not None:
            self.set_to(self._device, self.recorded_pose)

    def take_file(self) -> None:
        """Move the frame to where the file says."""
        if self._device:
            self.set_to(self._device, self._in_file[self._device])

    def save_for_recording(self) -> None:
        """Save the chosen device's pose beside the recording; that of the file needs no saving."""
        if self.can_save_for_recording:
            is_other = self._differs_from_file(self._device)
            self._keep(self._device, self.pose if is_other else None)

    # How it is done

    def _numbers(self, value: Pose) -> Tuple[float, ...]:
        return (*value.xyz, *value.ypr)

    def _with_numbers(self, value: Pose, numbers: Sequence[float]) -> Pose:
        x, y, z, yaw, pitch, roll = numbers
        return Pose((x, y, z), (yaw, pitch, roll))

    def _target(self, name: str) -> str:
        return self._base(name).frame

    def _saved(self, name: str) -> Pose:
        in_file = self._in_file[name]
        return in_file if self._recording is None else self._recording.saved.get(
            self._base(name).frame, in_file)

    def _base(self, name: str) -> BaseFrame:
        base = self._devices[name].base
        assert base is not None  # set_devices accepts no others
        return base

    def _has_kept(self, name: str) -> bool:
        """Return whether a pose of the device was saved for the recording."""
        return self._recording is not None and self._base(name).frame in self._recording.saved

    def _show_at_present(self, name: str) -> None:
        if self._is_running:
            self._send(name)
        self._tell_marker(name)

    def _keep(self, name: str, pose: Optional[Pose]) -> None:
        """Save a pose beside the recording, or forget the one that is there."""
        recording, frame = self._recording, self._base(name).frame
        assert recording is not None, 'a recording is played'
        self._set_saving(True)
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

    def _was_saved(self, name: str, value: Pose) -> None:
        super()._was_saved(name, value)
        if name in self._devices and self._has_kept(name):
            self._keep(name, None)  # else what was saved for the recording would count
