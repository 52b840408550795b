# SPDX-License-Identifier: BSD-3-Clause
"""The place of a robot's arrows: in which frame, turned how, and beginning where."""
from __future__ import annotations

import math
from collections import deque
from typing import Deque, NamedTuple, Optional, Sequence

import numpy as np

from process_visualizer.motion.kinematics import Placement
from process_visualizer.motion.rotations import (
    NO_ROTATION,
    Quaternion,
    Triple,
    Vector,
    conjugate,
    rotated,
    rotation_vector_between,
)

MOTION_S = 0.1
"""Poses and joint states of one moment may come so far apart; a moving tool is elsewhere then."""
_SAMPLES = 15
_NOTHING: Triple = (0.0, 0.0, 0.0)


class ToolPlace(NamedTuple):
    """A frame to draw in, its rotation in the base frame, and the tool's position in both."""

    frame: str
    quaternion: Quaternion  # x y z w
    foot: Vector  # (3,) [m] in the frame: where arrows begin
    position: Vector  # (3,) [m] in the base frame

    def in_frame(self, vector: Vector) -> Triple:
        """Return a vector (3,) of the base frame in this one."""
        return rotated(conjugate(self.quaternion), vector)


class Difference(NamedTuple):
    """The difference between the reported pose of a tool and the model's: in the tool frame."""

    offset: Triple  # (3,) [m]
    angle: float  # rad; NaN without a reported orientation

    def distance_m(self) -> float:
        """Return the distance of the two positions [m]."""
        return math.hypot(*self.offset)


class ToolDifference:
    """The reported poses of a tool beside those of its model: what differs, and for how long.

    A pose and the joint states of the same moment come one after the other, and a jump (of
    playback) brings one before the other; so the median of some samples counts.
    """

    def __init__(self) -> None:
        """Begin without samples."""
        self._samples: Deque[Sequence[float]] = deque(maxlen=_SAMPLES)

    def add(self, model: Placement, position: Vector, quaternion: Optional[Quaternion]) -> None:
        """Compare one reported position (3,) [m], and orientation if there is one."""
        offset = rotated(conjugate(model.quaternion),
                         [a - b for a, b in zip(position, model.position)])
        angle = math.nan if quaternion is None else math.hypot(
            *rotation_vector_between(model.quaternion, quaternion))
        self._samples.append((*offset, angle))

    def is_settled(self) -> bool:
        """Return whether there are enough samples to speak of it."""
        return len(self._samples) == _SAMPLES

    def median(self) -> Difference:
        """Return the difference in the middle of the last samples."""
        if not self._samples:
            return Difference(_NOTHING, math.nan)
        x, y, z, angle = np.median(np.array(self._samples), axis=0).tolist()
        return Difference((x, y, z), angle)


def base_place(base_frame: str, position: Vector) -> ToolPlace:
    """Return the place at a reported position, where no frame is known that moves with the tool."""
    return ToolPlace(base_frame, NO_ROTATION, position, position)
