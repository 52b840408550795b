# SPDX-License-Identifier: BSD-3-Clause
"""Observations of a running or recorded cell."""
from __future__ import annotations

from dataclasses import dataclass
from typing import Dict, Iterable, List, NamedTuple, Optional, Set, Tuple

import numpy as np

from process_visualizer.cell.model import Pose
from process_visualizer.robot.kinematics import Placement
from process_visualizer.robot.rotations import matrix_from_quaternion, ypr_from_matrix


class Source(NamedTuple):
    """One publisher's topic: its type as ``package/Type``, and some of its messages as bytes."""

    topic: str
    type: str
    definition: str
    publisher: str
    messages: Tuple[bytes, ...]


class SeenNumber(NamedTuple):
    """A number in the messages of a topic: the path of its field, and the range of its values.

    ``is_counter``: the number increased from each message to the next.
    """

    path: str
    low: float
    high: float
    is_counter: bool = False
    is_whole: bool = False

    @property
    def changes(self) -> bool:
        """Return whether the number changed."""
        return self.low < self.high


@dataclass(frozen=True)
class SeenTopic:
    """A topic: ``frames`` are from its headers, ``joints`` are the names in its joint states.

    ``length`` is the length of its array ``data``, if it has one and the length is constant.
    """

    name: str
    type: str
    publishers: Tuple[str, ...] = ()
    frames: Tuple[str, ...] = ()
    joints: Tuple[str, ...] = ()
    length: Optional[int] = None
    numbers: Tuple[SeenNumber, ...] = ()


class SeenTransform(NamedTuple):
    """A transform on tf: the child's pose in its parent; names without a leading slash.

    ``topic`` is the topic on which it was sent; ``changes``: it changed.
    """

    parent: str
    child: str
    placement: Placement
    topic: str = ''
    changes: bool = False


class SeenDescription(NamedTuple):
    """A robot description: the namespace of its parameter or topic (such as ``/arm``), its URDF."""

    namespace: str
    text: str


@dataclass(frozen=True)
class Seen:
    """The observations; ``where`` is a text that names the observed cell or recording.

    If ``is_moment``, only a moment was observed; numbers may change by any amount later.
    """

    where: str
    topics: Tuple[SeenTopic, ...] = ()
    transforms: Tuple[SeenTransform, ...] = ()
    descriptions: Tuple[SeenDescription, ...] = ()
    remarks: Tuple[str, ...] = ()
    is_moment: bool = False


_DIGITS = 6  # of m and rad


class FrameForest:
    """Transforms as trees; a transform that would close a loop is left out."""

    def __init__(self, transforms: Iterable[SeenTransform]) -> None:
        self._up: Dict[str, SeenTransform] = {}
        for it in transforms:
            if it.child != it.parent and it.child not in self.path(it.parent):
                self._up[it.child] = it

    @property
    def frames(self) -> Set[str]:
        """The names of the frames."""
        return {name for transform in self._up.values()
                for name in (transform.parent, transform.child)}

    def path(self, frame: str) -> List[str]:
        """Return the frame and its ancestors, up to the root of its tree."""
        found = [frame]
        while found[-1] in self._up:
            found.append(self._up[found[-1]].parent)
        return found

    def parent(self, frame: str) -> Optional[str]:
        """Return the parent of a frame, or None."""
        return self._up[frame].parent if frame in self._up else None

    def transform(self, frame: str) -> SeenTransform:
        """Return the transform from a frame's parent to the frame.

        Raises:
            KeyError: the frame has no parent.
        """
        return self._up[frame]

    def children(self, parent: str) -> List[str]:
        """Return the direct children of a frame."""
        return [it.child for it in self._up.values() if it.parent == parent]

    def pose(self, frame: str, base: str) -> Optional[Pose]:
        """Return the pose of a frame in one of its ancestors, or None."""
        path = self.path(frame)
        if base not in path:
            return None
        found = Placement()
        for name in path[:path.index(base)]:
            found = self._up[name].placement.then(found)
        return pose_of(found)


def pose_of(placement: Placement) -> Pose:
    """Return the pose in the form used in configurations, rounded."""
    ypr = ypr_from_matrix(matrix_from_quaternion(np.asarray(placement.quaternion)))
    x, y, z = (_rounded(value) for value in placement.position)
    yaw, pitch, roll = (_rounded(float(value)) for value in ypr)
    return Pose((x, y, z), (yaw, pitch, roll))


def _rounded(value: float) -> float:
    return round(value, _DIGITS) + 0.0  # no -0.0
