# SPDX-License-Identifier: BSD-3-Clause
"""Moments of the process: when a number passes a threshold."""
from __future__ import annotations

from typing import List, Optional, Sequence, Tuple

import numpy as np

Span = Tuple[float, float]


def passages_s(times_s: np.ndarray, values: np.ndarray, threshold: float, is_above: bool,
               hysteresis: float) -> np.ndarray:
    """Return when a number comes to lie beyond a threshold [s] (k,), rising.

    It counts as having left only when it is back by the hysteresis. A number that begins beyond
    the threshold does not come to lie there.

    Args:
        times_s: (n,), rising.
        values: (n,); NaN is passed over.
        threshold: in the unit of the values.
        is_above: beyond means above; otherwise below.
        hysteresis: not negative, in the unit of the values.
    """
    is_known = np.isfinite(values)
    times_s, values = times_s[is_known], values[is_known]
    beyond = values - threshold if is_above else threshold - values
    state = np.where(beyond > 0.0, 1, np.where(beyond <= -hysteresis, -1, 0))
    decided = np.flatnonzero(state)
    entered = decided[1:][(state[decided[1:]] > 0) & (state[decided[:-1]] < 0)]
    return times_s[entered]


class Passages:
    """The same of numbers that come one by one."""

    def __init__(self, threshold: float, is_above: bool, hysteresis: float) -> None:
        """Take what ``passages_s`` takes."""
        self._threshold, self._is_above, self._hysteresis = threshold, is_above, hysteresis
        self._is_beyond: Optional[bool] = None

    def take(self, value: float) -> bool:
        """Take the next number; return whether with it the event comes."""
        beyond = value - self._threshold if self._is_above else self._threshold - value
        before = self._is_beyond
        if beyond > 0.0:
            self._is_beyond = True
        elif beyond <= -self._hysteresis:
            self._is_beyond = False
        return before is False and self._is_beyond is True


def cycles(begins_s: Sequence[float], ends_s: Sequence[float]) -> Tuple[Span, ...]:
    """Return the spans [s] from each begin to the first end behind it.

    A begin that is followed by another one before the end is a cycle that was broken off: it is
    left out, as is the last one without an end.
    """
    moments = sorted([(time_s, False) for time_s in ends_s]
                     + [(time_s, True) for time_s in begins_s])
    found: List[Span] = []
    open_s = None
    for time_s, is_begin in moments:
        if is_begin:
            open_s = time_s
        elif open_s is not None:
            found.append((open_s, time_s))
            open_s = None
    return tuple(found)
