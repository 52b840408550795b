# SPDX-License-Identifier: BSD-3-Clause
"""Joints of a robot over a time that can be gone through in any order."""
from __future__ import annotations

from typing import Dict, NamedTuple, Optional, Tuple

import numpy as np


class JointTrack(NamedTuple):
    """Positions (n, k) [rad or m] of k joints at ``times_s`` (n,), rising; NaN: there are none."""

    joints: Tuple[str, ...]
    times_s: np.ndarray
    positions: np.ndarray

    def at(self, time_s: float) -> Optional[Dict[str, float]]:
        """Return the positions by joint at a time, between two known ones; None elsewhere."""
        row = int(np.searchsorted(self.times_s, time_s, side='right'))
        first, last = max(row - 1, 0), min(row, len(self.times_s) - 1)
        if last < 0 or not self.times_s[0] <= time_s <= self.times_s[-1]:
            return None
        span_s = self.times_s[last] - self.times_s[first]
        share = (time_s - self.times_s[first]) / span_s if span_s > 0.0 else 0.0
        if share == 0.0:
            found = self.positions[first]
        else:
            found = (1.0 - share) * self.positions[first] + share * self.positions[last]
        return dict(zip(self.joints, found.tolist())) if np.isfinite(found).all() else None


def joint_track(joints: Tuple[str, ...], times_s: np.ndarray,
                positions: np.ndarray) -> JointTrack:
    """Return a track after a check.

    Raises:
        ValueError: the lengths do not fit, or the times do not rise.
    """
    times_s, positions = np.asarray(times_s, float), np.asarray(positions, float)
    if not joints or positions.size != len(times_s) * len(joints):
        raise ValueError(f'{positions.size} positions of {len(joints)} joints at '
                         f'{len(times_s)} times')
    if not np.isfinite(times_s).all() or (np.diff(times_s) < 0.0).any():
        raise ValueError('the times do not rise')
    return JointTrack(joints, times_s, positions.reshape(len(times_s), len(joints)))
