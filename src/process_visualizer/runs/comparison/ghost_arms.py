# SPDX-License-Identifier: BSD-3-Clause
"""The robots of a cell with the frames that the configuration fixes to their links."""
from __future__ import annotations

from typing import List, NamedTuple, Optional, Tuple

from process_visualizer.cell.model import Cell, Device, Pose
from process_visualizer.descriptions.robot_description import RobotDescription
from process_visualizer.descriptions.tool_frame import tool_frame
from process_visualizer.motion.kinematics import Kinematics, Placement
from process_visualizer.motion.rotations import quaternion_from_ypr
from process_visualizer.runs.comparison.ghost_models import Models


class Arm(NamedTuple):
    """A robot, its links and frames, the one that carries all, and its tool frame."""

    device: Device
    kinematics: Kinematics
    root: str
    tool: str

    def fixed(self, frame: str) -> Optional[Tuple[str, Placement]]:
        """Return a link of the model, and where a frame is in it; None for other frames."""
        if not self.kinematics.connects(frame, self.root):
            return None
        link = self.kinematics.fixed_to(frame, self.root)
        place = self.kinematics.connection(frame, link, {})
        return None if place is None else (link, place)


def arms(cell: Cell, models: Models) -> Tuple[Arm, ...]:
    """Return the robots that have a model."""
    return tuple(_arm(it, models[it.name]) for it in cell.devices if it.name in models)


def _arm(device: Device, description: RobotDescription) -> Arm:
    kinematics = Kinematics(description.text)
    roots: List[str] = [it for it in kinematics.links if kinematics.joint(it) is None]
    tool = tool_frame(device, description)
    if tool.frame != tool.parent:
        kinematics.fix(tool.parent, tool.frame, _placement(tool.pose))
    if device.force is not None:
        kinematics.fix(device.force.parent_frame, device.force.frame, _placement(device.force.pose))
    return Arm(device, kinematics, roots[0] if roots else '', tool.frame)


def _placement(pose: Pose) -> Placement:
    x, y, z, w = (float(it) for it in quaternion_from_ypr(pose.ypr))
    return Placement(pose.xyz, (x, y, z, w))
