# SPDX-License-Identifier: BSD-3-Clause
"""Runs, or parts of runs, to be shared, and their page."""
from __future__ import annotations

import os
from contextlib import ExitStack
from typing import Any, Dict, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from process_visualizer.bagio.recording import Recording
from process_visualizer.bagio.recording_calibration import saved_poses, with_saved_poses
from process_visualizer.cell.model import Cell
from process_visualizer.figures import clock_text
from process_visualizer.page.html_page import PageParts, page_html
from process_visualizer.page.packed import Packed
from process_visualizer.page.robots import PageSpan
from process_visualizer.page.run_page import Judged, PageCell, run_entry, run_words
from process_visualizer.runs.comparison.comparison import incomparable
from process_visualizer.runs.comparison.good_runs import GoodRuns
from process_visualizer.runs.comparison.wording import band_text
from process_visualizer.runs.recorded.chosen_runs import recorded_cell
from process_visualizer.runs.run import Run

MAX_S = 900.0
"""Maximum duration that one page shows [s]; a browser keeps all of it in memory."""


class ChosenSpans(NamedTuple):
    """Runs with the chosen part of each recording, and the good runs, if there are any.

    ``cell`` is the given cell; None: that of each recording. ``known`` are runs that have already
    been compared.
    """

    cell: Optional[Cell]
    runs: List[Run]
    spans: List[PageSpan]
    good: Optional[GoodRuns] = None
    known: Tuple[Judged, ...] = ()

    @property
    def duration_s(self) -> float:
        """The total duration of all spans."""
        return sum(it.end_s - it.begin_s for it in self.spans)

    def judged(self, run: Run) -> Judged:
        """Return a run with its comparison with the good runs, if there are any."""
        for it in self.known:
            if it.run is run:
                return it
        if self.good is None or incomparable(self.good.reference, run) is not None:
            return Judged(run)
        return Judged(run, self.good.compare(run), self.good.of(run) or self.good)


def page_of(chosen: ChosenSpans, with_clouds: bool = False, worst_first: bool = True) -> str:
    """Return the page of all chosen runs, in their order or the worst first.

    Raises:
        ValueError: the runs are too long for one page.
    """
    if chosen.duration_s > MAX_S:
        raise ValueError(f'{clock_text(chosen.duration_s)} are more than one page can show; name a '
                         f'part of at most {clock_text(MAX_S)} with --from and --to, or a run with '
                         'BAG#NUMBER')
    return shared_page(chosen.cell, [chosen.judged(it) for it in chosen.runs], chosen.spans,
                       chosen.good, with_clouds=with_clouds, worst_first=worst_first)


def shared_page(given: Optional[Cell], judged: Sequence[Judged], spans: Sequence[PageSpan],
                good: Optional[GoodRuns], notes: Sequence[str] = (),
                with_clouds: bool = False, worst_first: bool = True) -> str:
    """Return the page of some runs; those that do not fit are only listed.

    Args:
        given: the cell; without one, the configuration of the first recording is used.
        judged: the runs.
        spans: the shown part of each run.
        good: the good runs that the runs were compared with.
        notes: further notes for the top of the page.
        with_clouds: whether the clouds of depth sensors are shown.
        worst_first: whether the runs are sorted.
    """
    packed = Packed()
    order = list(range(len(judged)))
    if worst_first:
        order.sort(key=lambda it: judged[it].badness, reverse=True)
    ends_s = np.cumsum([spans[it].end_s - spans[it].begin_s for it in order])
    drawn = max(int(np.searchsorted(ends_s, MAX_S, side='right')), 1)
    with ExitStack() as stack:
        paths = dict.fromkeys(judged[it].run.recording for it in order[:drawn])
        recordings = {it: stack.enter_context(Recording(it)) for it in paths}
        first = next(iter(paths))
        cell = given if given is not None \
            else stack.enter_context(recorded_cell(recordings[first]))
        cell = with_saved_poses(cell, saved_poses(first[0]))
        shared = PageCell(cell, packed)
        entries = [run_entry(shared, recordings[judged[it].run.recording], judged[it], spans[it],
                             packed, with_clouds) for it in order[:drawn]]
        listed = [run_words(judged[it].run, judged[it].comparison, (), spans[it])
                  for it in order[drawn:]]
    return page_html(PageParts(_title([*entries, *listed]), _subtitle(good), entries,
                               shared.meshes, packed,
                               (*(() if good is None else good.notes), *notes), listed,
                               os.path.basename(cell.file)))


def _title(entries: Sequence[Dict[str, Any]]) -> str:
    if len(entries) == 1:
        return str(entries[0]['name'])
    poor = sum(it['state'] == 'poor' for it in entries)
    return f'{poor} of {len(entries)} runs out of range' if poor else f'{len(entries)} runs'


def _subtitle(good: Optional[GoodRuns]) -> str:
    if good is None:
        return 'Without a reference there is no verdict.'
    return (f'Reference: {good.reference.name}, {good.reference.duration_s:.1f} s. '
            f'Band: {band_text(good.band)}.')
