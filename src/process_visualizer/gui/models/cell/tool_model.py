# SPDX-License-Identifier: BSD-3-Clause
"""Offers to write a robot's learned tool frame into the configuration."""
from __future__ import annotations

import math
from typing import Callable, Dict, Mapping, NamedTuple, Optional, Sequence, Set, Tuple

from PyQt5.QtCore import QObject, pyqtSignal

from process_visualizer.cell.editing.pose_edit import PoseEditError
from process_visualizer.cell.editing.tool_edit import tool_element
from process_visualizer.cell.model import Device, Pose, Vector3
from process_visualizer.gui.toolkit.tasks import Tasks
from process_visualizer.health.node_warnings import NodeWarning

Save = Callable[[str, str, Pose], object]
"""Writes the tool of a device (its name), its pose in a frame; blocks; ``PoseEditor.save_tool``."""


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
    """Offers one tool after the other; an answered question is not repeated."""

    changed = pyqtSignal()
    failed = pyqtSignal(str)
    saved = pyqtSignal(str)
    """The file now has the tool of this device."""

    def __init__(self, tasks: Tasks, parent: Optional[QObject] = None) -> None:
        super().__init__(parent)
        self._tasks = tasks
        self._save: Optional[Save] = None
        self._devices: Dict[str, Device] = {}
        self._answered: Set[str] = set()
        self._learned: Dict[str, LearnedTool] = {}
        self.is_saving = False

    @property
    def offered(self) -> Optional[LearnedTool]:
        """The tool in the present question."""
        return next((it for name, it in self._learned.items() if name not in self._answered), None)

    def set_devices(self, devices: Sequence[Device], save: Optional[Save]) -> None:
        """Set the configuration's devices, and the function that writes into its files."""
        self._devices, self._save = {device.name: device for device in devices}, save
        self._keep(self._learned)

    def take_warnings(self, warnings: Mapping[str, Sequence[NodeWarning]]) -> None:
        """Set the present warnings of the nodes of each device (its name)."""
        found: Dict[str, LearnedTool] = {}
        for name, own in warnings.items():
            for warning in own:
                device, tool = self._devices.get(name), _tool(warning.values)
                if device is not None and tool is not None:
                    found[name] = LearnedTool(name, warning.text, *tool, device.location.file)
        self._keep(found)

    def dismiss(self) -> None:
        """Leave the file as it is."""
        if self.offered is not None:
            self._answered.add(self.offered.device)
            self.changed.emit()

    def write(self) -> None:
        """Write the offered tool into the file."""
        offered, save = self.offered, self._save
        if offered is None or save is None or self.is_saving:
            return
        device, frame, pose = offered.device, offered.frame, offered.pose
        self.is_saving = True
        self.changed.emit()
        self._tasks.run('files', lambda: save(device, frame, pose),
                        lambda _: self._was_saved(device), self._not_saved)

    def _keep(self, learned: Mapping[str, LearnedTool]) -> None:
        before = self.offered
        self._learned = {name: it for name, it in learned.items()
                         if name in self._devices and self._devices[name].tool is None}
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
