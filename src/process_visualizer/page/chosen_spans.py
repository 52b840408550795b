# SPDX-License-Identifier: BSD-3-Clause
"""Runs, or parts of them, that are to leave the machine: as a page, a film or a table."""
from __future__ import annotations

from typing import List, NamedTuple, Optional, Tuple

from process_visualizer.cell.model import Cell
from process_visualizer.page.robots import PageSpan
from process_visualizer.page.run_page import Judged
from process_visualizer.runs.comparison.comparison import GoodRuns, incomparable
from process_visualizer.runs.run import Run


class ChosenSpans(NamedTuple):
    """Runs with the part of each recording that is meant, and the good runs if there are any.

    ``cell`` is the one that was given; None: that of each recording. ``known`` are runs that have
    been compared already.
    """

    cell: Optional[Cell]
    runs: List[Run]
    spans: List[PageSpan]
    good: Optional[GoodRuns] = None
    known: Tuple[Judged, ...] = ()

    @property
    def duration_s(self) -> float:
        """The length of all spans."""
        return sum(it.end_s - it.begin_s for it in self.spans)

    def judged(self, run: Run) -> Judged:
        """Return a run with what comes of holding it against the good runs, if there are any."""
        for it in self.known:
            if it.run is run:
                return it
        if self.good is None or incomparable(self.good.reference, run) is not None:
            return Judged(run)
        return Judged(run, self.good.compare(run), self.good.of(run) or self.good)
