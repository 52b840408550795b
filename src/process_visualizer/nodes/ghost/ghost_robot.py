# SPDX-License-Identifier: BSD-3-Clause
"""A robot's picture in another run, and how far its tool is from where it is in this one."""
from __future__ import annotations

import math
from typing import List, Mapping, NamedTuple, Optional, Sequence

from geometry_msgs.msg import Point, Quaternion
from visualization_msgs.msg import Marker

from process_visualizer.clients.model_markers import set_shape
from process_visualizer.descriptions.link_visuals import LinkVisual, link_visuals
from process_visualizer.motion.joint_track import JointTrack
from process_visualizer.motion.kinematics import Kinematics, Placement
from process_visualizer.motion.rotations import Triple, quaternion_turning_x_onto
from process_visualizer.nodes.common.markers import frame_marker, text_marker
from process_visualizer.parameters.reading import Color

COLOR: Color = (0.35, 0.65, 1.0, 0.35)
DEVIATION_COLOR: Color = (1.0, 0.35, 0.85, 1.0)
EXAGGERATION = 20.0
"""An arrow is so many times as long as the deviation: a millimetre could not be seen in a cell."""
_LEAST_M = 0.0002
_LONGEST_M = 0.4
_DIAMETER_M, _TEXT_M, _ABOVE_M = 0.02, 0.06, 0.12


class Deviation(NamedTuple):
    """Where the tool is in the other run, and how far from there it is in this one [m]."""

    foot: Placement
    vector: Triple

    @property
    def length_m(self) -> float:
        """How far."""
        return math.hypot(*self.vector)


class GhostRobot:
    """Makes the markers of a robot at a time of the recording."""

    def __init__(self, device: str, urdf: str, tool: str, there: JointTrack,
                 here: Optional[JointTrack]) -> None:
        """Take the model, and the joints of the other run and of this one.

        Raises:
            ValueError: the model cannot be read.
        """
        self.device, self._tool = device, tool
        self._there, self._here = there, here
        self._kinematics, self._visuals = Kinematics(urdf), link_visuals(urdf)
        self.root = next((it for it in self._kinematics.links
                          if self._kinematics.joint(it) is None), '')

    def markers(self, time_s: float) -> List[Marker]:
        """Return the robot and its deviation; nothing where the other run has no joints."""
        positions = self._there.at(time_s)
        if positions is None:
            return []
        found = [marker for number, visual in enumerate(self._visuals)
                 for marker in self._link(number, visual, positions)]
        return found + self._deviation_markers(time_s)

    def deviation(self, time_s: float) -> Optional[Deviation]:
        """Return how far the tool is from where it was in the other run; None if not known."""
        there, here = self._place(self._there, time_s), self._place(self._here, time_s)
        if there is None or here is None:
            return None
        x, y, z = (b - a for a, b in zip(there.position, here.position))
        return Deviation(there, (x, y, z))

    def tool(self, time_s: float) -> Optional[Placement]:
        """Return where the tool is in the other run, in the root link; None if not known."""
        return self._place(self._there, time_s)

    def _place(self, track: Optional[JointTrack], time_s: float) -> Optional[Placement]:
        positions = None if track is None else track.at(time_s)
        if positions is None or not self._tool:
            return None
        return self._kinematics.placement(self._tool, self.root, positions)

    def _link(self, number: int, visual: LinkVisual, positions: Mapping[str, float]
              ) -> Sequence[Marker]:
        link = self._kinematics.placement(visual.link, self.root, positions)
        if link is None:
            return ()
        marker = frame_marker(f'{self.device}/ghost', number, self.root, COLOR)
        set_shape(marker, visual, link.then(visual.place))
        return (marker,)

    def _deviation_markers(self, time_s: float) -> List[Marker]:
        found = self.deviation(time_s)
        if found is None or found.length_m < _LEAST_M:
            return []
        namespace = f'{self.device}/deviation'
        arrow = frame_marker(namespace, 0, self.root, DEVIATION_COLOR)
        arrow.type = Marker.ARROW
        arrow.scale.x = min(EXAGGERATION * found.length_m, _LONGEST_M)
        arrow.scale.y = arrow.scale.z = _DIAMETER_M
        arrow.pose.position = Point(*found.foot.position)
        arrow.pose.orientation = Quaternion(*quaternion_turning_x_onto(found.vector))
        x, y, z = found.foot.position
        return [arrow, text_marker(namespace, self.root, (x, y, z + _ABOVE_M),
                                   f'Δ {1000.0 * found.length_m:.1f} mm', _TEXT_M,
                                   DEVIATION_COLOR)]
