# SPDX-License-Identifier: BSD-3-Clause
"""The result of comparing a run: where it left the band, what was not judged, how bad it is."""
from __future__ import annotations

import math
from typing import NamedTuple, Optional, Tuple

import numpy as np

from process_visualizer.runs.alignment.alignment import Alignment
from process_visualizer.runs.comparison.unjudged import Missing, Unjudged
from process_visualizer.runs.deviation.band import Band
from process_visualizer.runs.deviation.departures import Departure, Nearness, nearness
from process_visualizer.runs.deviation.signals import RATE_HZ, Columns
from process_visualizer.runs.run import Run

_MAX_UNJUDGED_SHARE = 0.25
"""Maximum share of a run without data in which a fault would hardly be hidden."""


class Comparison(NamedTuple):
    """The result for a run: its signals on the reference's clock, and where they left a band.

    ``why_not`` says why the run was not judged; empty if it was.
    """

    run: Run
    alignment: Alignment
    columns: Columns
    band: Band
    departures: Tuple[Departure, ...]
    notes: Tuple[str, ...]
    unjudged: Tuple[Unjudged, ...] = ()
    why_not: str = ''

    @property
    def has_gaps(self) -> bool:
        """Return whether the run lacks data somewhere where good runs have data."""
        return any(it.why is not Missing.SELDOM for it in self.unjudged)

    @property
    def unjudged_s(self) -> float:
        """Return the total time during which some signal was not judged for lack of data [s]."""
        total_s, until_s = 0.0, -math.inf
        for it in sorted(self.unjudged, key=lambda it: it.begin_s):
            if it.why is not Missing.SELDOM:
                total_s += max(it.end_s - max(it.begin_s, until_s), 0.0)
                until_s = max(until_s, it.end_s)
        return total_s

    @property
    def is_judged_in_part(self) -> bool:
        """Return whether so much was not judged that "in range" would be misleading."""
        return self.unjudged_s > _MAX_UNJUDGED_SHARE * self.run.duration_s

    @property
    def nearest(self) -> Optional[Nearness]:
        """Return the signal that came nearest to leaving its band; None if nothing was judged."""
        rows = max((len(it) for it in self.columns.values()), default=0)
        found = nearness(np.arange(rows) / RATE_HZ, self.columns, self.band)
        return found[0] if found else None

    @property
    def badness(self) -> float:
        """Return the distance from the usual in half widths of the band; up to 1 is in range."""
        nearest = self.nearest
        return max([it.severity for it in self.departures]
                   + ([] if nearest is None else [min(nearest.share, 1.0)]), default=0.0)

    def run_s(self, reference_s: float) -> float:
        """Return the time of the run [s from its start] that corresponds to the reference's."""
        return float(self.alignment.time_map.to_run(np.array([reference_s]))[0])


def incomparable(reference: Run, run: Run) -> Optional[str]:
    """Return why two runs cannot be compared, or None."""
    if not set(reference.by_key) & set(run.by_key):
        return (f'{run.name} has no channel of {reference.name}; they are of different cells, or '
                'devices have other names')
    return None
