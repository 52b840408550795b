# SPDX-License-Identifier: BSD-3-Clause
"""Poses of a frame in another one, at many times at once."""
from __future__ import annotations

from typing import NamedTuple, Optional

import numpy as np

from process_visualizer.motion.kinematics import Joint, Placement


class Placements(NamedTuple):
    """Positions (n, 3) [m] and rotations (n, 4) x y z w of any length; n may be 1.

    A rotation of length zero, which some senders leave so, turns nothing.
    """

    positions: np.ndarray
    quaternions: np.ndarray

    def then(self, inner: Placements) -> Placements:
        """Return the places, seen from outside, of what is placed in this frame."""
        return Placements(self.positions + _turned(self.quaternions, inner.positions),
                          _product(self.quaternions, inner.quaternions))

    def inverse(self) -> Placements:
        """Return the places of the outside in this frame."""
        turn = self.quaternions * (-1.0, -1.0, -1.0, 1.0)
        return Placements(-_turned(turn, self.positions), turn)


def constant(placement: Placement) -> Placements:
    """Return a place that is the same at all times."""
    return Placements(np.array([placement.position], float),
                      np.array([placement.quaternion], float))


def of_joint(joint: Joint, positions: np.ndarray) -> Placements:
    """Return where a moving joint's child is in its parent, at positions (n,) [rad or m]."""
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


def interpolated(times_s: np.ndarray, known_s: np.ndarray, values: np.ndarray,
                 longest_s: float, rotation: Optional[slice] = None) -> np.ndarray:
    """Return values (m, k) at times, on straight lines between those that are known.

    Rows are NaN before the first and behind the last known one, and between two that are further
    apart than a limit.

    Args:
        times_s: (m,).
        known_s: (n,), rising.
        values: (n, k).
        longest_s: the limit [s].
        rotation: the columns of x y z w, which go the shorter way.
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
    is_outside = (times_s < known_s[0]) | (times_s > known_s[-1]) | (span_s > longest_s)
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
