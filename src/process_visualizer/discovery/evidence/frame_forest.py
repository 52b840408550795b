# SPDX-License-Identifier: BSD-3-Clause
"""The frames that were seen on tf, and where they are in each other."""
from __future__ import annotations

from typing import Dict, Iterable, List, Optional, Set

import numpy as np

from process_visualizer.cell.model import Pose
from process_visualizer.discovery.evidence.seen import SeenTransform
from process_visualizer.motion.kinematics import Placement
from process_visualizer.motion.rotations import matrix_from_quaternion, ypr_from_matrix

_DIGITS = 6  # of m and rad


class FrameForest:
    """Transforms as trees; one that would close a circle is left out."""

    def __init__(self, transforms: Iterable[SeenTransform]) -> None:
        self._up: Dict[str, SeenTransform] = {}
        for it in transforms:
            if it.child != it.parent and it.child not in self.path(it.parent):
                self._up[it.child] = it

    @property
    def frames(self) -> Set[str]:
        """All names."""
        return {name for it in self._up.values() for name in (it.parent, it.child)}

    def path(self, frame: str) -> List[str]:
        """Return the frame and those that carry it, up to the root of its tree."""
        found = [frame]
        while found[-1] in self._up:
            found.append(self._up[found[-1]].parent)
        return found

    def parent(self, frame: str) -> Optional[str]:
        """Return what carries a frame, or None."""
        return self._up[frame].parent if frame in self._up else None

    def transform(self, frame: str) -> SeenTransform:
        """Return the transform whose child a frame is.

        Raises:
            KeyError: the frame has no parent.
        """
        return self._up[frame]

    def children(self, parent: str) -> List[str]:
        """Return the frames that a frame carries itself."""
        return [it.child for it in self._up.values() if it.parent == parent]

    def pose(self, frame: str, base: str) -> Optional[Pose]:
        """Return where a frame is in one of those that carry it, or None."""
        path = self.path(frame)
        if base not in path:
            return None
        found = Placement()
        for name in path[:path.index(base)]:
            found = self._up[name].placement.then(found)
        return pose_of(found)


def pose_of(placement: Placement) -> Pose:
    """Return position and rotation as a configuration has them, rounded."""
    ypr = ypr_from_matrix(matrix_from_quaternion(np.asarray(placement.quaternion)))
    x, y, z = (_rounded(value) for value in placement.position)
    yaw, pitch, roll = (_rounded(float(value)) for value in ypr)
    return Pose((x, y, z), (yaw, pitch, roll))


def _rounded(value: float) -> float:
    return round(value, _DIGITS) + 0.0  # no -0.0
