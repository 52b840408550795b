# SPDX-License-Identifier: BSD-3-Clause
"""The extent of a cell, which the first view of it must show."""
from __future__ import annotations

import itertools
from typing import Dict, Mapping, Optional, Set, Tuple

import numpy as np
import rospkg

from process_visualizer.cell.model import Cell, Device, DeviceType, Pose
from process_visualizer.generate.processor_nodes import fixed_frames
from process_visualizer.robot.description import RobotDescription
from process_visualizer.robot.kinematics import Placement
from process_visualizer.robot.model_extent import ModelExtent, moved
from process_visualizer.robot.rotations import quaternion_from_ypr
from process_visualizer.robot.tool_frame import tool_frame


class CellFrames:
    """The global frame, base, tool and force frames, and the links at default joint positions."""

    def __init__(self, cell: Cell, devices: Tuple[Device, ...],
                 descriptions: Mapping[str, RobotDescription]) -> None:
        """Take the devices, and the models of those that have one."""
        self._frame = cell.frame
        self._fixed: Dict[str, Tuple[str, Placement]] = {
            frame.child: (frame.parent, _placement(Pose(frame.xyz, frame.ypr)))
            for frame in fixed_frames(cell, devices)}
        packages = rospkg.RosPack()
        self.models: Dict[str, ModelExtent] = {
            name: ModelExtent(description.text, packages)
            for name, description in descriptions.items()}
        self._owners: Dict[str, str] = {link: name for name, description in descriptions.items()
                                        for link in description.links}

    @property
    def names(self) -> Set[str]:
        """The names of the known frames."""
        return {self._frame, *self._fixed, *self._owners}

    def place(self, frame: str) -> Optional[Placement]:
        """Return the place of a frame in the global frame; None if it is unknown."""
        found, passed = Placement(), set()
        while frame != self._frame:
            step = self._step(frame)
            if step is None or frame in passed:
                return None
            passed.add(frame)
            frame, found = step[0], step[1].then(found)
        return found

    def _step(self, frame: str) -> Optional[Tuple[str, Placement]]:
        """Return a frame that carries this one, and the place of this one in it."""
        owner = self._owners.get(frame)
        if owner is None or frame in self._fixed:
            return self._fixed.get(frame)
        model = self.models[owner]
        place = model.place(frame)
        return None if place is None or frame == model.root_link else (model.root_link, place)


def _placement(pose: Pose) -> Placement:
    x, y, z, w = np.asarray(quaternion_from_ypr(pose.ypr)).tolist()
    a, b, c = pose.xyz
    return Placement((a, b, c), (x, y, z, w))


_UNKNOWN_M = 0.5
"""Assumed extent of a device without a readable model around its base."""
_ARROW_M = 0.15
"""Room for a variable's arrow and number."""
_SIGHT_M = 1.5
"""Assumed range of a depth sensor in a cell that has nothing else."""
_SIGHT_SLOPE = 0.5
_CUBE = np.array(list(itertools.product((-1.0, 1.0), repeat=3)))


def cell_extent(cell: Cell, devices: Tuple[Device, ...],
                descriptions: Mapping[str, RobotDescription]) -> Dict[str, np.ndarray]:
    """Return points (n, 3) in the global frame [m] around the visible part of each device, by name.

    These are robots with their reach, machines, regions of interest, and the places of variables. A
    depth sensor itself counts only in a cell of depth sensors, because it looks at other devices
    from far away. Scenery (a model without data) counts only up to the height of the other devices;
    a mast, for example, is cut off.
    """
    extents = _Extents(cell, devices, descriptions)
    found = {device.name: extents.of_device(device) for device in devices}
    if not any(map(len, found.values())):
        found = {device.name: extents.sight(device) for device in devices}
    return _with_scenery(found, {it.name: extents.scenery(it) for it in devices})


class _Extents:
    def __init__(self, cell: Cell, devices: Tuple[Device, ...],
                 descriptions: Mapping[str, RobotDescription]) -> None:
        self._descriptions = descriptions
        self._frames = CellFrames(cell, devices, descriptions)

    def of_device(self, device: Device) -> np.ndarray:
        """Return the points around the device's data."""
        parts = [self._around(variable.frame, _ARROW_M * _CUBE) for variable in device.variables]
        if device.roi is not None:
            corners = np.array(device.roi.center) + 0.5 * _CUBE * np.array(device.roi.size)
            parts.append(self._around(device.roi.frame, corners))
        if device.type is not DeviceType.DEPTH_SENSOR and not _is_scenery(device):
            parts.append(self._machine(device))
        return np.concatenate([np.empty((0, 3)), *parts])

    def scenery(self, device: Device) -> np.ndarray:
        """Return the model of a device that has nothing else."""
        return self._machine(device) if _is_scenery(device) else np.empty((0, 3))

    def sight(self, device: Device) -> np.ndarray:
        """Return a depth sensor and the space in front of it."""
        if device.base is None or device.type is not DeviceType.DEPTH_SENSOR:
            return np.empty((0, 3))
        depth, side = _SIGHT_M, _SIGHT_SLOPE * _SIGHT_M
        cone = np.array([(0, 0, 0), *((depth, y, z) for y in (-side, side) for z in (-side, side))])
        if device.base.frame.endswith('optical_frame'):  # REP 103: z forward there
            cone = cone[:, [1, 2, 0]]
        return self._around(device.base.frame, cone)

    def _machine(self, device: Device) -> np.ndarray:
        if device.base is None:
            return np.empty((0, 3))
        model = self._frames.models.get(device.name)
        body = np.empty((0, 3)) if model is None else model.body()
        if not len(body):
            body = _UNKNOWN_M * _CUBE
        if model is not None and device.type is DeviceType.ROBOT:
            tool = tool_frame(device, self._descriptions[device.name]).parent
            body = np.concatenate([body, model.reach(tool)])
        return self._around(device.base.frame, body)

    def _around(self, frame: str, points: np.ndarray) -> np.ndarray:
        place = self._frames.place(frame)
        return np.empty((0, 3)) if place is None else moved(place, points)


def _is_scenery(device: Device) -> bool:
    return (device.type is DeviceType.OTHER and device.model is not None
            and not device.topics and not device.variables)


def _with_scenery(found: Dict[str, np.ndarray],
                  scenery: Dict[str, np.ndarray]) -> Dict[str, np.ndarray]:
    """Add the scenery, cut off above all the rest."""
    rest = np.concatenate([np.empty((0, 3)), *found.values()])
    top = rest.max(axis=0) if len(rest) else np.full(3, np.inf)
    top[:2] = np.inf
    return {name: np.concatenate([points, np.minimum(scenery[name], top)])
            for name, points in found.items()}
