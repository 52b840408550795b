# SPDX-License-Identifier: BSD-3-Clause
"""The time of measurement of a message: its own stamp where it is usable, else its arrival."""
from __future__ import annotations

import math

USABLE_WITHIN_S = 1.0  # of the arrival; further away is another computer's clock


class MeasuringTime:
    """Chooses between the stamps and the arrival times of one topic."""

    def __init__(self) -> None:
        self._last_stamp_s = -math.inf
        self._standing = False

    @property
    def standing(self) -> bool:
        """Return whether the last stamp was no later than the one before, which stamps must be."""
        return self._standing

    def wall_s(self, stamp_s: float, arrival_s: float) -> float:
        """Return the wall time [s] of a message; a stamp of 0 is none."""
        if not stamp_s or abs(arrival_s - stamp_s) > USABLE_WITHIN_S:
            self._standing = False
            return arrival_s
        self._standing = stamp_s <= self._last_stamp_s
        self._last_stamp_s = stamp_s
        return arrival_s if self._standing else stamp_s
