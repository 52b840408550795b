# SPDX-License-Identifier: BSD-3-Clause
"""The points A and B between which playback is repeated."""
from __future__ import annotations

from typing import NamedTuple, Optional, Tuple

from process_visualizer.playback.timeline import MIN_LOOP_NS, NS_PER_S

SHORTEST_LOOP_S = MIN_LOOP_NS / NS_PER_S
_SAME_S = 1e-6


class LoopPoints(NamedTuple):
    """A and B [s from the beginning]; None: the beginning or the end of the recording."""

    begin_s: Optional[float] = None
    end_s: Optional[float] = None

    def bounds(self, duration_s: float) -> Tuple[float, float]:
        """Return where the loop of a recording begins and ends [s]."""
        return (0.0 if self.begin_s is None else self.begin_s,
                duration_s if self.end_s is None else self.end_s)

    def is_long_enough(self, duration_s: float) -> bool:
        """Return whether a player can repeat it."""
        begin_s, end_s = self.bounds(duration_s)
        return end_s - begin_s >= SHORTEST_LOOP_S - _SAME_S

    def with_begin(self, time_s: float) -> LoopPoints:
        """Return the points with another A; a B before it is given up: A to the end."""
        keeps_end = self.end_s is not None and self.end_s > time_s
        return LoopPoints(time_s, self.end_s if keeps_end else None)

    def with_end(self, time_s: float) -> LoopPoints:
        """Return the points with another B; if it lies before A, they change places."""
        if self.begin_s is not None and time_s < self.begin_s:
            return LoopPoints(time_s, self.begin_s)
        return LoopPoints(self.begin_s, time_s)

    def moved(self, which: str, time_s: float, duration_s: float) -> LoopPoints:
        """Return the points with 'A' or 'B' dragged to a time, as far as the other one allows."""
        begin_s, end_s = self.bounds(duration_s)
        if which == 'A':
            return self._replace(begin_s=max(min(time_s, end_s - SHORTEST_LOOP_S), 0.0))
        return self._replace(end_s=min(max(time_s, begin_s + SHORTEST_LOOP_S), duration_s))


def points_of(loop: Tuple[float, float], duration_s: float) -> LoopPoints:
    """Return the points of a player's loop: none where it is the whole recording."""
    begin_s, end_s = loop
    return LoopPoints(begin_s if begin_s > _SAME_S else None,
                      end_s if end_s < duration_s - _SAME_S else None)
