# SPDX-License-Identifier: BSD-3-Clause
"""Pictures of one moment of two runs, and which moment it is."""
from __future__ import annotations

from typing import NamedTuple

from process_visualizer.runs.deviation.departures import Departure

_AT_MOST_S = 1.0


class ScenePair(NamedTuple):
    """Pictures (JPEG) of the reference at one of its times [s], and of the run, with a ghost."""

    reference_s: float
    good: bytes
    poor: bytes


def shown_s(departure: Departure) -> float:
    """Return the time of the reference [s] at which a departure can be seen.

    Where it began there is nothing to be seen yet: it is when it was worst, but at most a second
    after it left the band.
    """
    return min(max(departure.left_s, departure.worst_s), departure.left_s + _AT_MOST_S)
