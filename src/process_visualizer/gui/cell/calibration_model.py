# SPDX-License-Identifier: BSD-3-Clause
"""Poses, boxes and tools of devices, edited while nodes run; decides which saved pose applies."""
from __future__ import annotations

import math
from dataclasses import replace
from typing import Any, Callable, Dict, Mapping, NamedTuple, Optional, Sequence, Set, Tuple

from PyQt5.QtCore import QObject, pyqtSignal

from process_visualizer.bagio.bag_errors import BagError
from process_visualizer.bagio.recording_calibration import (
    RecordingCalibration,
    read_recording_calibration,
    save_pose,
)
from process_visualizer.cell.file_edit import PoseEditError, tool_element
from process_visualizer.cell.model import (
    BaseFrame,
    Device,
    DeviceType,
    Pose,
    RegionOfInterest,
    Vector3,
)
from process_visualizer.clients.sensor_fit_client import FitError, SensorFit
from process_visualizer.figures import count_text
from process_visualizer.gui.cell.edited_values import EditedValues
from process_visualizer.gui.session import Session
from process_visualizer.gui.toolkit.tasks import Tasks
from process_visualizer.health.node_warnings import NodeWarning
from process_visualizer.robot.rotations import pose_difference

Move = Callable[[str, Vector3, Vector3], Any]
"""Moves a frame (its name, xyz [m], ypr [rad]); blocks until it is done."""


class CalibrationModel(EditedValues[Pose]):
    """The poses of the base frames; numbers are x y z [m] yaw pitch roll [rad].

    While a recording is played, poses that were saved for it take precedence over the file's.
    """

    kept = pyqtSignal()
    """The poses that are saved beside the recording have changed."""

    _what, _moves_what = 'pose', 'base frame'
    _refusals = (*EditedValues._refusals, BagError)

    def __init__(self, tasks: Tasks, move: Move, parent: Optional[QObject] = None) -> None:
        super().__init__(tasks, 'calibration',
                         lambda frame, pose: move(frame, pose.xyz, pose.ypr), parent)
        self._devices: Dict[str, Device] = {}
        self._parent = ''
        self._recording: Optional[RecordingCalibration] = None

    # State

    @property
    def chosen(self) -> Optional[Device]:
        """The chosen device itself."""
        return self._devices.get(self.device)

    @property
    def base(self) -> Optional[BaseFrame]:
        """The chosen device's base frame in the configuration's file."""
        return self._base(self.device) if self.device else None

    @property
    def pose(self) -> Pose:
        """The present pose: xyz in m, ypr in rad."""
        return self.value_of(self.device) or Pose()

    @property
    def saved_pose(self) -> Optional[Pose]:
        """Return the chosen frame's pose without unsaved changes.

        That is the pose saved for the recording that is played, else the one in the file.
        """
        return self._saved(self.device) if self.device else None

    @property
    def recording(self) -> str:
        """The recording that is played, for which poses can be saved; '' in real time."""
        return '' if self._recording is None else self._recording.bag

    @property
    def is_for_recording(self) -> bool:
        """Return whether the chosen frame has a pose that was saved for the recording."""
        return bool(self.device) and self._has_kept(self.device)

    @property
    def recorded_pose(self) -> Optional[Pose]:
        """Return the chosen frame's pose at the time of the recording; None if unknown."""
        if self._recording is None or self.base is None:
            return None
        return self._recording.recorded(self.base.frame, self._parent)

    @property
    def can_save_for_recording(self) -> bool:
        """Return whether the pose differs from what is saved, and a recording is played."""
        return self._recording is not None and self.is_unsaved and not self.is_saving

    @property
    def blocked_reason(self) -> str:
        """Return why nothing can be moved now; '' if something can."""
        if not self.device:
            return 'No device has a base frame.'
        return '' if self._is_running else 'Launch the nodes to move frames.'

    # Input from the program

    def set_devices(self, devices: Sequence[Device], parent: str = 'world') -> None:
        """Set the devices of the configuration and its global frame; unsaved edits are kept."""
        self._parent = parent
        self._devices = {it.name: it for it in devices if it.base is not None}
        self._set_in_file({it.name: it.base.pose for it in devices if it.base is not None})

    def set_recording(self, recording: Optional[RecordingCalibration]) -> None:
        """Set the played recording, or None; its saved poses take precedence over the file's.

        Unsaved edits stay, and are tried on another recording.
        """
        if recording is self._recording:
            return
        before = {name: self._edited.get(name, self._saved(name)) for name in self._devices}
        self._recording = recording
        self._forget_equal()
        for name, pose in before.items():
            if not self._is_same(pose, self._edited.get(name, self._saved(name))):
                if self._is_running:
                    self._send(name)
                self._tell_marker(name)
        self.changed.emit()

    # Commands

    def set_pose(self, name: str, pose: Pose) -> None:
        """Move the frame of a device."""
        self.set_to(name, pose)

    def take_pose(self, xyz: Vector3, ypr: Vector3) -> None:
        """Accept the pose of the interactive marker, without moving the marker again."""
        self._take_dragged(Pose(xyz, ypr))

    def take_recorded(self) -> None:
        """Move the frame to its pose when the recording was made."""
        if self.recorded_pose is not None:
            self.set_to(self.device, self.recorded_pose)

    def take_file(self) -> None:
        """Move the frame to its pose in the file."""
        if self.device:
            self.set_to(self.device, self._in_file[self.device])

    def save_for_recording(self) -> None:
        """Save the chosen device's pose beside the recording; remove it if it equals the file's."""
        if self.can_save_for_recording:
            is_other = self._differs_from_file(self.device)
            self._keep(self.device, self.pose if is_other else None)

    # Implementation

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

    def _keep(self, name: str, pose: Optional[Pose]) -> None:
        """Save a pose beside the recording, or forget the one that is there."""
        recording, frame = self._recording, self._base(name).frame
        assert recording is not None, 'a recording is played'
        self._set_saving(True)
        self._tasks.run('files', lambda: save_pose(recording.bag, frame, pose),
                        lambda saved: self._was_kept(recording.bag, saved),
                        lambda error: self._not_saved(name, error))

    def _was_kept(self, bag: str, saved: Dict[str, Pose]) -> None:
        self.is_saving = False
        if self._recording is not None and self._recording.bag == bag:
            self._recording = self._recording._replace(saved=saved)
            self._forget_equal()
        self.changed.emit()
        self.kept.emit()

    def _was_saved(self, name: str, value: Pose) -> None:
        super()._was_saved(name, value)
        if name in self._devices and self._has_kept(name):
            self._keep(name, None)  # else the pose saved for the recording would take precedence


Find = Callable[[str], SensorFit]
"""Finds the pose of a depth sensor (its name); blocks for some seconds; may raise FitError."""
_LINE = 'fit'


class FitModel(QObject):
    """Finds the pose of the device that is chosen for calibration."""

    changed = pyqtSignal()

    def __init__(self, tasks: Tasks, calibration: CalibrationModel, find: Find,
                 parent: Optional[QObject] = None) -> None:
        """``find`` is run as a task."""
        super().__init__(parent)
        self._tasks, self._calibration, self._find = tasks, calibration, find
        self._fitting = ''
        self._begun_at: Optional[Pose] = None  # None: the sensor has been moved meanwhile
        self._results: Dict[str, str] = {}
        self._refused: Dict[str, str] = {}
        calibration.changed.connect(self._follow)

    @property
    def is_offered(self) -> bool:
        """Return whether the chosen device has clouds."""
        device = self._calibration.chosen
        return device is not None and device.type is DeviceType.DEPTH_SENSOR

    @property
    def is_fitting(self) -> bool:
        """Return whether a pose is being found."""
        return bool(self._fitting)

    @property
    def can_fit(self) -> bool:
        """Return whether the pose of the chosen device can be found now."""
        return self.is_offered and not self._fitting and not self._calibration.blocked_reason

    @property
    def text(self) -> str:
        """Return the chosen device's result, or why there is none; '' without a fit to report."""
        name = self._calibration.device
        return self._results.get(name) or self._refused.get(name, '')

    @property
    def is_refused(self) -> bool:
        """Return whether the text says why nothing was found."""
        return self._calibration.device in self._refused

    def fit(self) -> None:
        """Find the pose of the chosen device, and move it there."""
        if not self.can_fit:
            return
        name = self._fitting = self._calibration.device
        self._begun_at = self._calibration.value_of(name)
        self._results.pop(name, None)
        self._refused.pop(name, None)
        self._tasks.run(_LINE, lambda: self._find(name), lambda it: self._take(name, it),
                        lambda error: self._refuse(name, error))
        self.changed.emit()

    def _take(self, name: str, found: SensorFit) -> None:
        self._fitting = ''
        before = self._begun_at
        if name in self._calibration.devices and not self._calibration.blocked_reason:
            if before is None:
                self._refused[name] = (f'{name} was moved during the fit, so the result is not '
                                       'used. Fit again.')
            else:
                self._results[name] = _described(found, before)
                self._calibration.set_pose(name, found.pose)
        self.changed.emit()

    def _refuse(self, name: str, error: Exception) -> None:
        self._fitting = ''
        if not isinstance(error, FitError):
            self.changed.emit()
            raise error
        self._refused[name] = f'{name} stays where it is: {error}.'
        self.changed.emit()

    def _follow(self) -> None:
        """Drop results of poses that were saved or reverted, and a fit whose pose has changed."""
        if self._fitting and self._calibration.value_of(self._fitting) != self._begun_at:
            self._begun_at = None
        for name in [it for it in self._results if it not in self._calibration.unsaved]:
            del self._results[name]
        self.changed.emit()


def _described(found: SensorFit, before: Pose) -> str:
    text = (f'Fit: moved by {pose_difference(before, found.pose)}; the cloud is '
            f'{1000.0 * found.residual_m:.1f} mm from the models (before: '
            f'{1000.0 * found.before_m:.1f} mm; {count_text(found.points, "point")}).')
    if found.left_out:
        text += f' It is not known where {", ".join(found.left_out)} was.'
    return text


Apply = Callable[[str, RegionOfInterest], Any]
"""Gives a device (its name) a box in the running nodes; blocks until it is done."""


class RegionModel(EditedValues[RegionOfInterest]):
    """The boxes of the depth sensors that have one; numbers are center and edge lengths [m]."""

    _what = _moves_what = 'box'

    def __init__(self, tasks: Tasks, move: Apply, parent: Optional[QObject] = None) -> None:
        super().__init__(tasks, 'region', move, parent)

    @property
    def region(self) -> Optional[RegionOfInterest]:
        """The present box of the chosen device."""
        return self.value_of(self.device)

    def set_devices(self, devices: Sequence[Device]) -> None:
        """Set the devices of the configuration; unsaved edits are kept."""
        self._set_in_file({it.name: it.roi for it in devices
                           if it.roi is not None and it.has_cloud})

    def take_dragged(self, device: str, region: RegionOfInterest) -> None:
        """Accept the box that was dragged in RViz, without moving it there again."""
        if device == self.device:
            self._take_dragged(region)

    def _numbers(self, value: RegionOfInterest) -> Tuple[float, ...]:
        return (*value.center, *value.size)

    def _with_numbers(self, value: RegionOfInterest,
                      numbers: Sequence[float]) -> RegionOfInterest:
        x, y, z, length, width, height = numbers
        return replace(value, center=(x, y, z), size=(length, width, height))


class RecordingCalibrationModel(QObject):
    """The poses that were stored in a recording and beside it; None until they are read."""

    changed = pyqtSignal()
    failed = pyqtSignal(str)

    def __init__(self, tasks: Tasks, session: Session, parent: Optional[QObject] = None) -> None:
        super().__init__(parent)
        self._tasks = tasks
        self._paths: Tuple[str, ...] = ()
        self._value: Optional[RecordingCalibration] = None
        session.recording_changed.connect(lambda: self._follow(session.paths))

    @property
    def value(self) -> Optional[RecordingCalibration]:
        """Return what was read last."""
        return self._value

    def _follow(self, paths: Tuple[str, ...]) -> None:
        if paths != self._paths:
            self._paths, self._value = paths, None
            self.changed.emit()
            self.read_again()

    def read_again(self) -> None:
        """Read the poses again, as some may have been saved."""
        wanted = self._paths
        if wanted:
            self._tasks.run('files', lambda: read_recording_calibration(wanted),
                            lambda it: self._take(wanted, it),
                            lambda error: self._refuse(wanted, error))

    def _take(self, wanted: Tuple[str, ...], value: RecordingCalibration) -> None:
        if wanted == self._paths:
            self._value = value
            self.changed.emit()

    def _refuse(self, wanted: Tuple[str, ...], error: Exception) -> None:
        if not isinstance(error, BagError):
            raise error
        if wanted == self._paths:
            self.failed.emit(f'{error}. The frames have the poses in the configuration.')


# Offers to write a robot's learned tool frame into the configuration.

class LearnedTool(NamedTuple):
    """The frame of a robot's poses, in words, and as it would be written."""

    device: str
    text: str
    frame: str
    pose: Pose
    file: str

    @property
    def element(self) -> str:
        """The element for the file."""
        return tool_element(self.frame, self.pose)


class ToolModel(QObject):
    """Offers one tool after another; an answered question is not repeated."""

    changed = pyqtSignal()
    failed = pyqtSignal(str)
    saved = pyqtSignal(str)
    """The file now has the tool of this device."""

    def __init__(self, tasks: Tasks, session: Session, parent: Optional[QObject] = None) -> None:
        super().__init__(parent)
        self._tasks, self._session = tasks, session
        self._answered: Set[str] = set()
        self._learned: Dict[str, LearnedTool] = {}
        self.is_saving = False
        session.cell_changed.connect(lambda: self._keep(self._learned))

    @property
    def offered(self) -> Optional[LearnedTool]:
        """The tool in the present question."""
        return next((it for name, it in self._learned.items() if name not in self._answered), None)

    def take_warnings(self, warnings: Mapping[str, Sequence[NodeWarning]]) -> None:
        """Set the present warnings of the nodes of each device (its name)."""
        found: Dict[str, LearnedTool] = {}
        for device in self._session.devices:
            for warning in warnings.get(device.name, ()):
                tool = _tool(warning.values)
                if tool is not None:
                    found[device.name] = LearnedTool(device.name, warning.text, *tool,
                                                     device.location.file)
        self._keep(found)

    def dismiss(self) -> None:
        """Leave the file as it is."""
        if self.offered is not None:
            self._answered.add(self.offered.device)
            self.changed.emit()

    def write(self) -> None:
        """Write the offered tool into the file."""
        offered, editor = self.offered, self._session.editor
        if offered is None or editor is None or self.is_saving:
            return
        save = editor.save_tool
        device, frame, pose = offered.device, offered.frame, offered.pose
        self.is_saving = True
        self.changed.emit()
        self._tasks.run('files', lambda: save(device, frame, pose),
                        lambda _: self._was_saved(device), self._not_saved)

    def _keep(self, learned: Mapping[str, LearnedTool]) -> None:
        before = self.offered
        without = {device.name for device in self._session.devices if device.tool is None}
        self._learned = {name: it for name, it in learned.items() if name in without}
        if self.offered != before:
            self.changed.emit()

    def _was_saved(self, device: str) -> None:
        self.is_saving = False
        self._answered.add(device)
        self.changed.emit()
        self.saved.emit(device)

    def _not_saved(self, error: Exception) -> None:
        self.is_saving = False
        self.changed.emit()
        if not isinstance(error, (OSError, PoseEditError)):
            raise error
        self.failed.emit(f'the tool was not written: {error}')


def _tool(values: Mapping[str, str]) -> Optional[Tuple[str, Pose]]:
    """Return frame and pose from the report of a node; None if it has no tool."""
    xyz, ypr = _vector(values.get('tool_xyz', '')), _vector(values.get('tool_ypr', ''))
    frame = values.get('tool_frame', '')
    return None if not frame or xyz is None or ypr is None else (frame, Pose(xyz, ypr))


def _vector(text: str) -> Optional[Vector3]:
    try:
        x, y, z = map(float, text.split())
    except ValueError:
        return None
    return (x, y, z) if all(map(math.isfinite, (x, y, z))) else None
