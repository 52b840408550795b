# SPDX-License-Identifier: BSD-3-Clause
"""Decides when an event occurs: a number passes a threshold; pairs begins with ends."""
from __future__ import annotations

from typing import List, NamedTuple, Optional, Sequence, Tuple

import numpy as np

_BOUNCE_S = 0.05
"""A contact that returns within this time, and then stays where it went first, bounces [s]."""


def passages_s(times_s: np.ndarray, values: np.ndarray, threshold: float, is_above: bool,
               hysteresis: float, lasting_s: float = 0.0) -> np.ndarray:
    """Return the times [s] (k,), ascending, at which a number passes a threshold.

    The number counts as back only after it has returned by the hysteresis. A number that begins
    beyond the threshold does not pass it. Of a contact that bounces, the first passage counts.

    Args:
        times_s: (n,), ascending.
        values: (n,); NaN is skipped.
        threshold: in the unit of the values.
        is_above: above the threshold is beyond it; otherwise below.
        hysteresis: not negative, in the unit of the values.
        lasting_s: the minimum time beyond the threshold, or not beyond it, that counts.
    """
    is_known = np.isfinite(values)
    times_s, values = times_s[is_known], values[is_known]
    beyond = values - threshold if is_above else threshold - values
    state = np.where(beyond > 0.0, 1, np.where(beyond <= -hysteresis, -1, 0))
    decided = np.flatnonzero(state)
    changed = decided[1:][state[decided[1:]] != state[decided[:-1]]]
    if not len(changed):
        return np.empty(0)
    changes = _lasting(_calm(_levels(times_s[changed], state[changed] > 0)), lasting_s)
    return np.array([time_s for time_s, is_beyond in changes if is_beyond])


_Change = Tuple[float, bool]
"""The time at which a state begins, and whether it is beyond the threshold."""


def _levels(times_s: np.ndarray, is_beyond: np.ndarray) -> List[_Change]:
    return list(zip(times_s.tolist(), is_beyond.tolist()))


def _calm(changes: Sequence[_Change]) -> List[_Change]:
    """Return the changes without bouncing: a burst that ends in its first state becomes one change.

    A pulse, after which everything is as before, stays.
    """
    found: List[_Change] = []
    row = 0
    while row < len(changes):
        last = row
        while last + 1 < len(changes) and changes[last + 1][0] - changes[last][0] < _BOUNCE_S:
            last += 1
        if changes[last][1] == changes[row][1]:
            found.append(changes[row])
        else:
            found += changes[row:last + 1]
        row = last + 1
    return found


def _lasting(changes: Sequence[_Change], lasting_s: float) -> List[_Change]:
    """Return the changes to states that last long enough; shorter ones are skipped."""
    found: List[_Change] = []
    for row, (time_s, is_beyond) in enumerate(changes):
        is_long = row + 1 == len(changes) or changes[row + 1][0] - time_s >= lasting_s
        if is_long and (not found or found[-1][1] != is_beyond):
            found.append((time_s, is_beyond))
    if found and changes and found[0][1] != changes[0][1]:  # the state at the beginning
        found = found[1:]
    return found


class Passages:
    """Detector of passages for numbers that arrive one by one."""

    def __init__(self, threshold: float, is_above: bool, hysteresis: float) -> None:
        """Set the threshold as in ``passages_s``."""
        self._threshold, self._is_above, self._hysteresis = threshold, is_above, hysteresis
        self._is_beyond: Optional[bool] = None

    def take(self, value: float) -> bool:
        """Process the next number; return whether it passes the threshold."""
        beyond = value - self._threshold if self._is_above else self._threshold - value
        before = self._is_beyond
        if beyond > 0.0:
            self._is_beyond = True
        elif beyond <= -self._hysteresis:
            self._is_beyond = False
        return before is False and self._is_beyond is True


class Cycle(NamedTuple):
    """A cycle from a begin to an end [s], or to another begin if it was broken off."""

    begin_s: float
    end_s: float
    is_broken_off: bool = False


def cycles(begins_s: Sequence[float], ends_s: Sequence[float],
           shortest_s: float = 0.0) -> Tuple[Cycle, ...]:
    """Return the cycles from each begin to the first end after it.

    A begin that is followed by another one before an end is a cycle that was broken off: it ends
    there, or after the duration of the longest whole cycle. A last cycle without an end is left
    out, and so are cycles shorter than ``shortest_s``.
    """
    moments = sorted([(time_s, False) for time_s in ends_s]
                     + [(time_s, True) for time_s in begins_s])
    found: List[Cycle] = []
    open_s: Optional[float] = None
    for time_s, is_begin in moments:
        if open_s is not None and time_s - open_s >= shortest_s:
            found.append(Cycle(open_s, time_s, is_begin))
        open_s = time_s if is_begin else None
    longest_s = max((it.end_s - it.begin_s for it in found if not it.is_broken_off), default=0.0)
    return tuple(it._replace(end_s=min(it.end_s, it.begin_s + longest_s)) if it.is_broken_off
                 else it for it in found if longest_s > 0.0 or not it.is_broken_off)
