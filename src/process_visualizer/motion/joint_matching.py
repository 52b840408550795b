# SPDX-License-Identifier: BSD-3-Clause
"""Matching of positions in a driver's message to joints; joint_proc has the same, in C++."""
from __future__ import annotations

import math
from typing import Dict, Mapping, Sequence, Tuple


class JointMatching:
    """The names that a driver may have for a robot's joints, and what is added to its values."""

    def __init__(self, robot: str, joints: Sequence[str],
                 offsets: Mapping[str, float] = {}, prefix: str = '') -> None:
        """Take the names.

        Args:
            robot: a driver's ``elbow`` also stands for the joint ``robot/elbow``.
            joints: those that have a measurement, in the order of a message without names.
            offsets: [rad or m] by the joints' names; those of other joints do not count.
            prefix: a driver's ``left_elbow`` also stands for the joint ``elbow`` with ``left_``.
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
        """Return the positions [rad or m] of the robot's joints; other robots' are left out.

        A joint whose position is NaN or infinite is left out, too. A message with names and
        without positions, such as velocities of wheels, says nothing.

        Raises:
            ValueError: there are more or fewer names than positions.
        """
        if names and not positions:
            return {}
        names = names or self.joints
        if len(names) != len(positions):
            raise ValueError(f'{len(names)} joints and the positions {list(positions)}')
        return dict(self._measured(name, position) for name, position in zip(names, positions)
                    if name in self._meant and math.isfinite(position))

    def names(self, joint: str) -> Tuple[str, ...]:
        """Return what a driver may call one of the robot's joints; nothing for another one."""
        return tuple(name for name, meant in self._meant.items() if meant == joint)

    def offset(self, joint: str) -> float:
        """Return what is added to the measured positions of a joint [rad or m]."""
        return self._offsets.get(joint, 0.0)

    def _measured(self, name: str, position: float) -> Tuple[str, float]:
        joint = self._meant[name]
        return joint, position + self.offset(joint)
