# SPDX-License-Identifier: BSD-3-Clause
"""A robot as it was in another run, and the deviation of this run's tool from it."""
from __future__ import annotations

import math
from typing import Dict, List, Mapping, NamedTuple, Optional, Protocol, Sequence

from visualization_msgs.msg import Marker

from process_visualizer.clients.model_markers import set_shape
from process_visualizer.nodes.common.markers import frame_marker, shape_as_arrow, text_marker
from process_visualizer.robot.arrows import (
    BESIDE_M,
    DEVIATION_COLOR,
    DEVIATION_DIAMETER_M,
    EXAGGERATION,
    GHOST_ARROW_COLOR,
    GHOST_ARROW_DIAMETER_M,
    GHOST_COLOR,
    MAX_DEVIATION_M,
    MIN_DEVIATION_M,
    sideways,
)
from process_visualizer.robot.joints import JointTrack
from process_visualizer.robot.kinematics import Kinematics, Placement
from process_visualizer.robot.rotations import Triple, rotated
from process_visualizer.robot.visuals import LinkVisual, link_visuals

_TEXT_M, _ABOVE_M = 0.06, 0.12


class Deviation(NamedTuple):
    """The tool's position in the other run, and the vector from it to the tool in this run [m]."""

    foot: Placement
    vector: Triple

    @property
    def length_m(self) -> float:
        """Return the distance [m]."""
        return math.hypot(*self.vector)


class Joints(Protocol):
    """Joints over time."""

    def at(self, time_s: float) -> Optional[Dict[str, float]]:
        """Return the positions [rad or m] by joint; None if unknown."""


class GhostRobot:
    """Makes the markers of a robot at a time of the recording."""

    def __init__(self, device: str, urdf: str, tool: str, there: JointTrack,
                 here: Optional[Joints]) -> None:
        """``there`` are the joints of the other run, ``here`` those of this run.

        Raises:
            ValueError: the model cannot be read.
        """
        self.device, self._tool = device, tool
        self._there, self._here = there, here
        self._kinematics, self._visuals = Kinematics(urdf), link_visuals(urdf)
        self.root = next((it for it in self._kinematics.links
                          if self._kinematics.joint(it) is None), '')

    def markers(self, time_s: float) -> List[Marker]:
        """Return the robot and its deviation; no markers where the other run has no joints.

        The deviation is shown as a number whenever it is known, and as an arrow if it is large
        enough.
        """
        positions = self._there.at(time_s)
        if positions is None:
            return []
        found = [marker for number, visual in enumerate(self._visuals)
                 for marker in self._link(number, visual, positions)]
        return found + self._deviation_markers(time_s)

    def deviation(self, time_s: float) -> Optional[Deviation]:
        """Return the deviation of the tool from the other run; None if unknown."""
        there = self.tool(time_s)
        here = None if self._here is None else self.tool_at(self._here.at(time_s))
        if there is None or here is None:
            return None
        x, y, z = (b - a for a, b in zip(there.position, here.position))
        return Deviation(there, (x, y, z))

    def tool(self, time_s: float) -> Optional[Placement]:
        """Return the tool's pose in the other run, in the root link; None if unknown."""
        return self.tool_at(self._there.at(time_s))

    @property
    def end_s(self) -> float:
        """The last time at which the other run has joints."""
        return float(self._there.times_s[-1]) if len(self._there.times_s) else 0.0

    def has_link(self, name: str) -> bool:
        """Return whether a frame is one of the robot's links."""
        return name in self._kinematics.links

    def link(self, name: str, time_s: float) -> Optional[Placement]:
        """Return a link's pose in the other run, in the root link; None if unknown."""
        positions = self._there.at(time_s)
        return None if positions is None else self._kinematics.placement(
            name, self.root, positions)

    def tool_at(self, positions: Optional[Mapping[str, float]]) -> Optional[Placement]:
        """Return the tool's pose in the root link for given positions of the joints [rad or m]."""
        if positions is None or not self._tool:
            return None
        return self._kinematics.placement(self._tool, self.root, positions)

    def _link(self, number: int, visual: LinkVisual, positions: Mapping[str, float]
              ) -> Sequence[Marker]:
        link = self._kinematics.placement(visual.link, self.root, positions)
        if link is None:
            return ()
        marker = frame_marker(f'{self.device}/ghost', number, self.root, GHOST_COLOR)
        set_shape(marker, visual, link.then(visual.place))
        return (marker,)

    def _deviation_markers(self, time_s: float) -> List[Marker]:
        found = self.deviation(time_s)
        if found is None:
            return []
        namespace = f'{self.device}/deviation'
        x, y, z = found.foot.position
        markers = [text_marker(namespace, self.root, (x, y, z + _ABOVE_M),
                               f'Δ {1000.0 * found.length_m:.1f} mm', _TEXT_M, DEVIATION_COLOR)]
        if found.length_m >= MIN_DEVIATION_M:
            arrow = frame_marker(namespace, 0, self.root, DEVIATION_COLOR)
            shape_as_arrow(arrow, found.foot.position, found.vector,
                           min(EXAGGERATION * found.length_m, MAX_DEVIATION_M),
                           DEVIATION_DIAMETER_M)
            markers.insert(0, arrow)
        return markers


class GhostArrow:
    """Makes the marker of an arrow at a time of the recording."""

    def __init__(self, name: str, frame: str, foot_frame: str, foot: Triple,
                 vectors: JointTrack) -> None:
        """Initialize with a GhostArrow's contents; ``vectors`` has x, y and z [m] over time."""
        self._name, self._vectors = name, vectors
        self._frame, self._foot_frame, self._foot = frame, foot_frame, foot

    def marker(self, robots: Sequence[GhostRobot], time_s: float) -> Optional[Marker]:
        """Return the arrow, moved with the ghost that has its frame; None if there is no arrow."""
        vector = self._vectors.at(time_s)
        if vector is None:
            return None
        robot = next((it for it in robots if it.has_link(self._foot_frame)), None)
        frame, turn, foot = self._frame, Placement(), Placement(self._foot)
        if robot is not None:
            places = robot.link(self._frame, time_s), robot.link(self._foot_frame, time_s)
            if places[0] is None or places[1] is None:
                return None
            frame, turn, foot = robot.root, places[0], places[1].then(foot)
        return self._drawn(frame, foot.position,
                           rotated(turn.quaternion, (vector['x'], vector['y'], vector['z'])))

    def _drawn(self, frame: str, foot: Triple, vector: Triple) -> Optional[Marker]:
        length_m = math.hypot(*vector)
        if length_m == 0.0:
            return None  # it has no direction
        x, y, z = (a + BESIDE_M * b for a, b in zip(foot, sideways(
            [part / length_m for part in vector])))
        marker = frame_marker(f'{self._name}/ghost', 0, frame, GHOST_ARROW_COLOR)
        shape_as_arrow(marker, (x, y, z), vector, length_m, GHOST_ARROW_DIAMETER_M)
        return marker
