# SPDX-License-Identifier: BSD-3-Clause
"""Poses of frames relative to others at many times at once, and their chain from base to tool."""
from __future__ import annotations

from typing import Callable, Dict, Iterator, List, Mapping, NamedTuple, Optional, Tuple, Union

import numpy as np

from process_visualizer.robot.kinematics import MOVABLE, Joint, Kinematics, Placement


class Placements(NamedTuple):
    """Positions (n, 3) [m] and rotations (n, 4) x y z w of any length; n may be 1.

    A quaternion of zero, which some senders leave unset, counts as no rotation.
    """

    positions: np.ndarray
    quaternions: np.ndarray

    def then(self, inner: Placements) -> Placements:
        """Return the placements of an inner frame in the outer frame."""
        return Placements(self.positions + _turned(self.quaternions, inner.positions),
                          _product(self.quaternions, inner.quaternions))

    def inverse(self) -> Placements:
        """Return the placements of the outer frame in this frame."""
        turn = self.quaternions * (-1.0, -1.0, -1.0, 1.0)
        return Placements(-_turned(turn, self.positions), turn)


def constant(placement: Placement) -> Placements:
    """Return a placement that is the same at all times."""
    return Placements(np.array([placement.position], float),
                      np.array([placement.quaternion], float))


def of_joint(joint: Joint, positions: np.ndarray) -> Placements:
    """Return the placements of a moving joint's child at positions (n,) [rad or m]."""
    values = joint.multiplier * positions + joint.offset
    along = values[:, np.newaxis] * np.array(joint.axis)
    still = np.zeros_like(along)
    if joint.kind == 'prismatic':
        moved = Placements(along, np.column_stack((still, np.ones(len(values)))))
    else:
        half = 0.5 * values
        moved = Placements(still, np.column_stack(
            (np.sin(half)[:, np.newaxis] * np.array(joint.axis), np.cos(half))))
    return constant(joint.origin).then(moved)


def interpolated(times_s: np.ndarray, known_s: np.ndarray, values: np.ndarray, longest_s: float,
                 rotation: Optional[slice] = None, equal: float = -1.0) -> np.ndarray:
    """Return values (m, k) at times, linearly interpolated between known ones.

    Rows are NaN before the first and after the last known value, and in gaps longer than a limit.

    Args:
        times_s: (m,).
        known_s: (n,), ascending.
        values: (n, k).
        longest_s: the limit of gaps [s].
        rotation: the columns of x y z w, which are interpolated along the shorter way.
        equal: gaps between values that differ by no more than this are not limited; below 0,
            all gaps are limited.
    """
    if not len(known_s):
        return np.full((len(times_s), values.shape[1]), np.nan)
    after = np.clip(np.searchsorted(known_s, times_s), 0, len(known_s) - 1)
    before = np.maximum(np.where(known_s[after] == times_s, after, after - 1), 0)
    span_s = known_s[after] - known_s[before]
    share = np.where(span_s > 0.0, (times_s - known_s[before]) / np.where(span_s > 0, span_s, 1), 0)
    first, second = values[before], values[after].copy()
    if rotation is not None:
        against = (first[:, rotation] * second[:, rotation]).sum(axis=1) < 0.0
        second[against, rotation] *= -1.0
    found: np.ndarray = first + share[:, np.newaxis] * (second - first)
    is_far = (span_s > longest_s) & (np.abs(second - first).max(axis=1) > equal)
    is_outside = (times_s < known_s[0]) | (times_s > known_s[-1]) | is_far
    found[is_outside] = np.nan
    return found


def _turned(quaternions: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    axis, w = quaternions[:, :3], quaternions[:, 3:]
    square = (quaternions * quaternions).sum(axis=1, keepdims=True)
    scale = np.where(square > 0.0, 2.0 / np.where(square > 0.0, square, 1.0), 0.0)
    crossed = np.cross(axis, vectors)
    turned: np.ndarray = vectors + scale * (w * crossed + np.cross(axis, crossed))
    return turned


def _product(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    a, b = first[:, :3], second[:, :3]
    v, w = first[:, 3:], second[:, 3:]
    return np.hstack((v * b + w * a + np.cross(a, b), v * w - (a * b).sum(axis=1, keepdims=True)))


class SentTransform(NamedTuple):
    """A transform from messages: seven numbers, the position and x y z w."""

    parent: str
    child: str


MovingPart = Union[SentTransform, Joint]
"""A part with numbers that vary in time: (n, 7), or a joint's positions in the last column."""
Source = Union[MovingPart, Placement]


class ToolPath(NamedTuple):
    """The chains from a tool and from its base to the first frame that carries both."""

    from_tool: Tuple[Source, ...]
    from_base: Tuple[Source, ...]

    @property
    def moving(self) -> Tuple[MovingPart, ...]:
        """The moving parts between base and tool, beginning with the nearest to the tool."""
        return tuple(it for it in self.from_tool + self.from_base if not isinstance(it, Placement))

    def places(self, values: Mapping[MovingPart, np.ndarray]) -> Placements:
        """Return the placements of the tool in the base, given the numbers of the moving parts."""
        return _carried(self.from_base, values).inverse().then(_carried(self.from_tool, values))


def _carried(sources: Tuple[Source, ...], values: Mapping[MovingPart, np.ndarray]) -> Placements:
    found = constant(Placement())
    for source in sources:
        if isinstance(source, Placement):
            place = constant(source)
        elif isinstance(source, SentTransform):
            place = Placements(values[source][:, :3], values[source][:, 3:])
        else:
            place = of_joint(source, values[source][:, -1])
        found = place.then(found)
    return found


class FrameSources:
    """Sources of each frame's pose in its parent; the first source of a frame counts."""

    def __init__(self) -> None:
        """Begin without frames."""
        self._above: Dict[str, Tuple[str, Source]] = {}

    def add_sent(self, transform: SentTransform) -> None:
        """Add a frame placed by messages."""
        self._above.setdefault(transform.child, (transform.parent, transform))

    def add_fixed(self, parent: str, child: str, placement: Placement) -> None:
        """Add a frame that is fixed to its parent."""
        self._above.setdefault(child, (parent, placement))

    def add_model(self, model: Kinematics, offset: Callable[[str], float]) -> None:
        """Add the links of a model, as sent by a robot_state_publisher.

        Args:
            model: the model.
            offset: returns the offset to add to the measured positions of a joint [rad or m].
        """
        for link in model.links:
            joint = model.joint(link)
            if joint is not None:
                self._above.setdefault(link, (joint.parent, joint.origin if joint.kind == 'fixed'
                                              else joint.measured_with(offset(joint.name))))

    def path(self, base: str, tool: str) -> Optional[ToolPath]:
        """Return the path from a base to a tool; None if there is none that can be computed."""
        carriers = [base, *(parent for parent, _ in self._up(base))]
        candidates = [tool, *(parent for parent, _ in self._up(tool))]
        common = next((frame for frame in candidates if frame in carriers), None)
        if common is None:
            return None
        path = ToolPath(self._sources(tool, common), self._sources(base, common))
        is_known = all(isinstance(it, SentTransform) or it.kind in MOVABLE for it in path.moving)
        return path if is_known else None

    def _sources(self, frame: str, carrier: str) -> Tuple[Source, ...]:
        found: List[Source] = []
        for parent, source in self._up(frame):
            if frame == carrier:
                break
            found.append(source)
            frame = parent
        return tuple(found)

    def _up(self, frame: str) -> Iterator[Tuple[str, Source]]:
        """Yield the ancestors of a frame, each with the source of the pose of its child."""
        for _ in range(len(self._above)):  # recorded frames may form a circle
            if frame not in self._above:
                return
            parent, source = self._above[frame]
            yield parent, source
            frame = parent
