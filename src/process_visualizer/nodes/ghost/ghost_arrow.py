# SPDX-License-Identifier: BSD-3-Clause
"""A quantity of another run as a thin arrow beside that of this one."""
from __future__ import annotations

import math
from typing import Optional, Sequence

from visualization_msgs.msg import Marker

from process_visualizer.motion.ghost_style import (
    BESIDE_M,
    GHOST_ARROW_COLOR,
    GHOST_ARROW_DIAMETER_M,
)
from process_visualizer.motion.joint_track import JointTrack
from process_visualizer.motion.kinematics import Placement
from process_visualizer.motion.rotations import Triple, rotated
from process_visualizer.motion.variables import sideways
from process_visualizer.nodes.common.markers import frame_marker, shape_as_arrow
from process_visualizer.nodes.ghost.ghost_robot import GhostRobot


class GhostArrow:
    """Makes the marker of an arrow at a time of the recording."""

    def __init__(self, name: str, frame: str, foot_frame: str, foot: Triple,
                 vectors: JointTrack) -> None:
        """Take what a GhostArrow message has; ``vectors`` has x, y and z [m] over time."""
        self._name, self._vectors = name, vectors
        self._frame, self._foot_frame, self._foot = frame, foot_frame, foot

    def marker(self, robots: Sequence[GhostRobot], time_s: float) -> Optional[Marker]:
        """Return the arrow, beside the ghosts; None where there is none."""
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

    def _drawn(self, frame: str, foot: Triple, vector: Triple) -> Marker:
        length_m = math.hypot(*vector)
        x, y, z = (a + BESIDE_M * b for a, b in zip(foot, sideways(
            [part / length_m for part in vector])))
        marker = frame_marker(f'{self._name}/ghost', 0, frame, GHOST_ARROW_COLOR)
        shape_as_arrow(marker, (x, y, z), vector, length_m, GHOST_ARROW_DIAMETER_M)
        return marker
