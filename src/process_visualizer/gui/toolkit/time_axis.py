# SPDX-License-Identifier: BSD-3-Clause
"""Time axes: the place of a moment, the moments of ticks, and the shown part."""
from __future__ import annotations

import math
from typing import List, NamedTuple

from process_visualizer.figures import clock_text

_STEPS_S = (0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 15.0, 30.0,
            60.0, 120.0, 300.0, 600.0, 900.0, 1800.0, 3600.0, 7200.0, 21600.0, 43200.0, 86400.0)


class TimeAxis(NamedTuple):
    """A part of a recording on a line: ``duration_s`` on ``width`` pixels, from ``left`` on.

    ``begin_s`` is the moment at the left end.
    """

    duration_s: float
    left: float
    width: float
    begin_s: float = 0.0

    @property
    def right(self) -> float:
        """The right end of the line [px]."""
        return self.left + self.width

    def x(self, time_s: float) -> float:
        """Return the place of a time [px]; outside the line if it is not shown."""
        if self.duration_s <= 0.0:
            return self.left
        return self.left + self.width * (time_s - self.begin_s) / self.duration_s

    def time_s(self, x: float) -> float:
        """Return the time at a place [px], limited to the ends of the line."""
        if self.width <= 0.0:
            return self.begin_s
        return self.begin_s + min(max((x - self.left) / self.width, 0.0), 1.0) * self.duration_s

    def tick_step_s(self, least_px: float) -> float:
        """Return the smallest round time between ticks that are at least ``least_px`` apart."""
        if self.width <= 0.0 or self.duration_s <= 0.0:
            return _STEPS_S[-1]
        least_s = least_px * self.duration_s / self.width
        return next((step_s for step_s in _STEPS_S if step_s >= least_s), _STEPS_S[-1])

    def ticks(self, least_px: float) -> List[float]:
        """Return the times [s] of ticks at least ``least_px`` apart, multiples of their step."""
        step_s = self.tick_step_s(least_px)
        first = math.ceil(self.begin_s / step_s - 1e-9)
        last = math.floor((self.begin_s + self.duration_s) / step_s + 1e-9)
        return [index * step_s for index in range(first, last + 1)]


def tick_label(time_s: float, step_s: float) -> str:
    """Return a time as m:ss, with as many decimals as the step between ticks needs."""
    text = clock_text(time_s, 3)
    if step_s >= 1.0:
        return text[:-4]
    kept = 1 if step_s >= 0.1 else 2 if step_s >= 0.01 else 3
    return text[:len(text) - 3 + kept]


_EDGE_SHARE = 0.1  # of the shown time: a moment scrolled into view is this far from the edge
MIN_S = 1.0
"""Minimum length of the shown part [s], so that nobody gets lost between two messages."""


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
        """Return the part scaled by a factor; the moment ``around_s`` stays at its place."""
        duration_s = _limited(self.duration_s * factor, MIN_S, self.length_s)
        share = (around_s - self.begin_s) / self.duration_s if self.duration_s > 0.0 else 0.0
        return self.part(around_s - share * duration_s, duration_s)

    def beginning_at(self, begin_s: float) -> ShownTime:
        """Return a part of the same length that begins at another moment, within the recording."""
        return self.part(begin_s, self.duration_s)

    def showing(self, time_s: float) -> ShownTime:
        """Return a part of the same length, moved only if a moment is out of view."""
        if self.contains(time_s):
            return self
        edge_s = _EDGE_SHARE * self.duration_s
        is_behind = time_s < self.begin_s
        return self.beginning_at(time_s - (self.duration_s - edge_s if is_behind else edge_s))

    def part(self, begin_s: float, duration_s: float) -> ShownTime:
        """Return another part of the recording, as close to the wanted one as possible."""
        duration_s = _limited(duration_s, MIN_S, self.length_s)
        return ShownTime(_limited(begin_s, 0.0, self.length_s - duration_s), duration_s,
                         self.length_s)


def whole(length_s: float) -> ShownTime:
    """Return the whole of a recording as the shown part."""
    return ShownTime(0.0, length_s, length_s)


def _limited(value: float, least: float, most: float) -> float:
    return max(min(value, most), min(least, most))
