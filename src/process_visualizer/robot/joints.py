# SPDX-License-Identifier: BSD-3-Clause
"""Positions of a robot's joints: from messages, over the last seconds, over a recording."""
from __future__ import annotations

from collections import deque
from typing import Deque, Dict, Mapping, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from process_visualizer.robot.kinematics import MAX_POSITION


class JointMatching:
    """A driver's possible names for a robot's joints, and offsets of its values."""

    def __init__(self, robot: str, joints: Sequence[str],
                 offsets: Mapping[str, float] = {}, prefix: str = '') -> None:
        """Initialize with the names.

        Args:
            robot: with ``robot``, a driver's ``elbow`` also denotes the joint ``robot/elbow``.
            joints: the measured joints, in the order of a message without names.
            offsets: [rad or m] by joint name; those of other joints are ignored.
            prefix: with ``left_``, a driver's ``left_elbow`` also denotes the joint ``elbow``.
        """
        self.joints = tuple(joints)
        self._meant: Dict[str, str] = {}
        behind = f'{robot}/'
        for name in joints:
            self._meant.setdefault(prefix + name, name)
            if name.startswith(behind):
                self._meant.setdefault(name[len(behind):], name)
        self._meant.update(zip(joints, joints))
        self._offsets = {self._meant.get(name, name): offset for name, offset in offsets.items()}

    def match(self, names: Sequence[str], positions: Sequence[float]) -> Dict[str, float]:
        """Return the positions [rad or m] of the robot's joints, without those of other robots.

        A joint whose position is NaN or beyond MAX_POSITION is left out, too. A message with names
        but without positions, such as velocities of wheels, gives nothing.

        Raises:
            ValueError: there are more or fewer names than positions.
        """
        if names and not positions:
            return {}
        names = names or self.joints
        if len(names) != len(positions):
            raise ValueError(f'{len(names)} joints and the positions {list(positions)}')
        return {joint: position + self.offset(joint)
                for name, position in zip(names, positions) if abs(position) <= MAX_POSITION
                for joint in [self._meant.get(name)] if joint is not None}

    def names(self, joint: str) -> Tuple[str, ...]:
        """Return a driver's possible names for a robot's joint; none for an unknown joint."""
        return tuple(name for name, meant in self._meant.items() if meant == joint)

    def offset(self, joint: str) -> float:
        """Return the offset added to the measured positions of a joint [rad or m]."""
        return self._offsets.get(joint, 0.0)


_STATES = 128


class _State(NamedTuple):
    time_s: float
    positions: Dict[str, float]


class JointHistory:
    """The last joint states; positions are interpolated linearly between them."""

    def __init__(self) -> None:
        """Begin without positions."""
        self._states: Deque[_State] = deque(maxlen=_STATES)
        self._last: Dict[str, float] = {}

    def add(self, time_s: float, positions: Mapping[str, float]) -> None:
        """Add positions [rad or m] of some joints by name; start over if the time goes back."""
        if self._states and time_s < self._states[-1].time_s:
            self._states.clear()
        self._last = {**self._last, **positions}
        self._states.append(_State(time_s, self._last))

    def at(self, time_s: float) -> Dict[str, float]:
        """Return the positions at a time, without extrapolation; at time 0, the last positions."""
        later: Optional[_State] = None
        for state in reversed(self._states):
            if not time_s or time_s >= state.time_s:
                return state.positions if later is None else _between(state, later, time_s)
            later = state
        return {} if later is None else later.positions


def _between(before: _State, after: _State, time_s: float) -> Dict[str, float]:
    part = (time_s - before.time_s) / (after.time_s - before.time_s)
    return {name: position + part * (after.positions[name] - position)
            for name, position in before.positions.items()}


class JointTrack(NamedTuple):
    """Positions (n, k) [rad or m] of k joints at ``times_s`` (n,), ascending; NaN where unknown."""

    joints: Tuple[str, ...]
    times_s: np.ndarray
    positions: np.ndarray

    def at(self, time_s: float) -> Optional[Dict[str, float]]:
        """Return the interpolated positions by joint at a time; None outside the known ones."""
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
    """Return a checked track.

    Raises:
        ValueError: the lengths do not match, the times decrease, or a position is so large that
            later computations would overflow.
    """
    times_s, positions = np.asarray(times_s, float), np.asarray(positions, float)
    if not joints or positions.size != len(times_s) * len(joints):
        raise ValueError(f'{positions.size} positions of {len(joints)} joints at '
                         f'{len(times_s)} times')
    if not np.isfinite(times_s).all() or (np.diff(times_s) < 0.0).any():
        raise ValueError('the times do not rise')
    if (np.abs(positions) > MAX_POSITION).any():
        raise ValueError(f'positions are out of range: at most {MAX_POSITION:g}')
    return JointTrack(joints, times_s, positions.reshape(len(times_s), len(joints)))
