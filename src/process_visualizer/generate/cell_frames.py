# SPDX-License-Identifier: BSD-3-Clause
"""Places of a cell's frames that its configuration and its models tell."""
from __future__ import annotations

from typing import Dict, Mapping, Optional, Set, Tuple

import numpy as np
import rospkg

from process_visualizer.cell.model import Cell, Device, Pose
from process_visualizer.descriptions.model_extent import ModelExtent
from process_visualizer.descriptions.robot_description import RobotDescription
from process_visualizer.generate.processor_nodes import fixed_frames
from process_visualizer.motion.kinematics import Placement
from process_visualizer.motion.rotations import quaternion_from_ypr


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
        """All frames that are known, wherever they are."""
        return {self._frame, *self._fixed, *self._owners}

    def place(self, frame: str) -> Optional[Placement]:
        """Return where a frame is in the global frame; None where nothing that is known says so."""
        found, passed = Placement(), set()
        while frame != self._frame:
            step = self._step(frame)
            if step is None or frame in passed:
                return None
            passed.add(frame)
            frame, found = step[0], step[1].then(found)
        return found

    def _step(self, frame: str) -> Optional[Tuple[str, Placement]]:
        """A frame that carries this one, and where this one is in it."""
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
