# SPDX-License-Identifier: BSD-3-Clause
"""Moments of the reference that belong to the last minutes of the running cell."""
from __future__ import annotations

import math
from typing import List, Optional

import numpy as np

_LONGEST_GAP_S = 0.5
"""Between phases that are further apart nothing is known."""


class PhaseHistory:
    """Takes phases as they come; between two of a run the reference goes on evenly."""

    def __init__(self, kept_s: float) -> None:
        self._kept_s = kept_s
        self._times_s: List[float] = []
        self._reference_s: List[float] = []

    @property
    def last_s(self) -> float:
        """The time of the last one [s]; minus infinity before there is any."""
        return self._times_s[-1] if self._times_s else -math.inf

    def add(self, time_s: float, reference_s: Optional[float]) -> None:
        """Take which moment of the reference belongs to a time [s]; None: none."""
        if time_s < self.last_s:  # the clock was set back
            self._times_s.clear()
            self._reference_s.clear()
        self._times_s.append(time_s)
        self._reference_s.append(math.nan if reference_s is None else reference_s)
        if self._times_s[0] < time_s - 2.0 * self._kept_s:
            old = int(np.searchsorted(self._times_s, time_s - self._kept_s))
            del self._times_s[:old], self._reference_s[:old]

    def at(self, times_s: np.ndarray) -> np.ndarray:
        """Return the moments of the reference [s] (n,) at times (n,); NaN where there is none."""
        if len(self._times_s) < 2:
            return np.full(len(times_s), np.nan)
        known_s, reference_s = np.array(self._times_s), np.array(self._reference_s)
        behind = np.clip(np.searchsorted(known_s, times_s), 1, len(known_s) - 1)
        step_s = reference_s[behind] - reference_s[behind - 1]
        gap_s = known_s[behind] - known_s[behind - 1]
        share = (times_s - known_s[behind - 1]) / np.where(gap_s > 0.0, gap_s, 1.0)
        with np.errstate(invalid='ignore'):
            is_known = ((share >= 0.0) & (share <= 1.0) & (step_s >= 0.0)  # below 0: another run
                        & (gap_s <= _LONGEST_GAP_S))
        result: np.ndarray = np.where(is_known, reference_s[behind - 1] + share * step_s, np.nan)
        return result
