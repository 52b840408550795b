# SPDX-License-Identifier: BSD-3-Clause
"""The part of a recording that the timeline shows."""
from __future__ import annotations

from typing import NamedTuple

_EDGE_SHARE = 0.1  # of the shown time: distance from the edge for a moment that was out of sight
SHORTEST_S = 1.0
"""The shortest part, so that nobody gets lost between two messages."""


class ShownTime(NamedTuple):
    """A part of a recording of ``length_s``: from ``begin_s`` on, ``duration_s`` long."""

    begin_s: float
    duration_s: float
    length_s: float

    @property
    def end_s(self) -> float:
        """The last moment that is shown."""
        return self.begin_s + self.duration_s

    @property
    def is_all(self) -> bool:
        """Return whether the whole recording is shown."""
        return self.duration_s >= self.length_s

    def contains(self, time_s: float) -> bool:
        """Return whether a moment is shown."""
        return self.begin_s <= time_s <= self.end_s

    def zoomed(self, factor: float, around_s: float) -> ShownTime:
        """The part scaled by a factor; the moment ``around_s`` stays at its place."""
        duration_s = _limited(self.duration_s * factor, SHORTEST_S, self.length_s)
        share = (around_s - self.begin_s) / self.duration_s if self.duration_s > 0.0 else 0.0
        return self.part(around_s - share * duration_s, duration_s)

    def beginning_at(self, begin_s: float) -> ShownTime:
        """A part of the same length from another moment on, within the recording."""
        return self.part(begin_s, self.duration_s)

    def showing(self, time_s: float) -> ShownTime:
        """Return a part of the same length, moved only if a moment is out of sight."""
        if self.contains(time_s):
            return self
        edge_s = _EDGE_SHARE * self.duration_s
        is_behind = time_s < self.begin_s
        return self.beginning_at(time_s - (self.duration_s - edge_s if is_behind else edge_s))

    def part(self, begin_s: float, duration_s: float) -> ShownTime:
        """Another part of the same recording, as close to the wanted one as possible."""
        duration_s = _limited(duration_s, SHORTEST_S, self.length_s)
        return ShownTime(_limited(begin_s, 0.0, self.length_s - duration_s), duration_s,
                         self.length_s)


def whole(length_s: float) -> ShownTime:
    """All of a recording."""
    return ShownTime(0.0, length_s, length_s)


def _limited(value: float, least: float, most: float) -> float:
    return max(min(value, most), min(least, most))
