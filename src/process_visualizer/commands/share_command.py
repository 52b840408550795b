# SPDX-License-Identifier: BSD-3-Clause
"""The command ``cell share``: a run as one page that any browser opens."""
from __future__ import annotations

import argparse
import os
import sys
from contextlib import ExitStack
from typing import Any, Dict, List, Optional, Sequence

from process_visualizer.bagio.recording import Recording, recording_parts
from process_visualizer.bagio.recording_calibration import saved_poses, with_saved_poses
from process_visualizer.cell.model import Cell
from process_visualizer.cell.xml_parser import XmlParser
from process_visualizer.health.figures import clock_seconds
from process_visualizer.page.html_page import PageParts, page_html
from process_visualizer.page.packed import Packed
from process_visualizer.page.robots import PageSpan
from process_visualizer.page.run_page import Judged, PageCell, run_entry
from process_visualizer.runs.comparison.comparison import GoodRuns, incomparable
from process_visualizer.runs.comparison.wording import band_text, clock
from process_visualizer.runs.recorded.chosen_runs import ChosenRuns, NoCycle, recorded_cell
from process_visualizer.runs.recorded.run_reader import read_run
from process_visualizer.runs.run import Run
from process_visualizer.shown_text import say
from process_visualizer.whole_file import write_text

MAX_S = 900.0
"""Of what one page shows: a browser has all of it in memory."""


def add_share_options(command: argparse.ArgumentParser) -> None:
    """Add the options of ``cell share``."""
    command.add_argument('runs', metavar='RUN', nargs='+',
                         help='a recording, or one run of it: BAG or BAG#NUMBER')
    command.add_argument('--reference', metavar='GOOD', nargs='+', default=[],
                         help='good runs to compare them with')
    command.add_argument('--from', dest='begin', metavar='TIME',
                         help='of the recording, such as 0:05 or 12.5')
    command.add_argument('--to', dest='end', metavar='TIME', help='the same')
    command.add_argument('-o', '--output', metavar='FILE', required=True,
                         help='the page, such as seam.html')
    command.add_argument('--config', metavar='FILE',
                         help='a configuration; default: the one in each recording')


def execute_share(options: argparse.Namespace, arguments: Dict[str, str]) -> int:
    """Write the page; return 0.

    Raises:
        BagError, ConfigurationError: a recording or its configuration cannot be read.
        ValueError: an option is out of range, or there is more than one page can show.
        OSError: the page cannot be written; nothing of it is left then.
    """
    folder = os.path.dirname(os.path.abspath(options.output))
    if not os.path.isdir(folder):  # said before the work
        raise ValueError(f'there is no folder "{folder}" for the page')
    given = None if options.config is None else XmlParser(arguments).parse(options.config)
    chosen = ChosenRuns(given)
    good = _good_runs(chosen, options.reference)
    runs = _runs(chosen, options.runs, given)
    spans = [_span(it, options.begin, options.end) for it in runs]
    shown_s = sum(it.end_s - it.begin_s for it in spans)
    if shown_s > MAX_S:
        raise ValueError(f'{clock(shown_s)} are more than one page can show; name a part of at '
                         f'most {clock(MAX_S)} with --from and --to, or a run with BAG#NUMBER')
    page = shared_page(given, runs, good, spans)
    write_text(options.output, page)
    size = os.path.getsize(options.output) / 1e6
    say(f'{options.output}: {clock(shown_s)} of {", ".join(it.name for it in runs[:4])}'
        f'{" …" if len(runs) > 4 else ""}, {size:.1f} MB')
    return 0


def shared_page(given: Optional[Cell], runs: Sequence[Run], good: Optional[GoodRuns],
                spans: Sequence[PageSpan]) -> str:
    """Return the page of some runs; without a given cell, by the configuration of the first."""
    packed = Packed()
    with ExitStack() as stack:
        recordings = {it.recording: stack.enter_context(Recording(it.recording)) for it in runs}
        first = recordings[runs[0].recording]
        cell = given if given is not None else stack.enter_context(recorded_cell(first))
        cell = with_saved_poses(cell, saved_poses(runs[0].recording[0]))
        shared = PageCell(cell, packed)
        entries = [run_entry(shared, recordings[run.recording], _judged(run, good), span, packed)
                   for run, span in zip(runs, spans)]
    return page_html(PageParts(_title(entries), _subtitle(good), entries, shared.meshes, packed,
                               () if good is None else good.notes,
                               cell=os.path.basename(cell.file)))


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


def _good_runs(chosen: ChosenRuns, names: Sequence[str]) -> Optional[GoodRuns]:
    if not names:
        return None
    reference, *others = chosen.runs(names)
    for other in others:
        reason = incomparable(reference, other)
        if reason is not None:
            raise ValueError(reason)
    return GoodRuns(reference, others)


def _runs(chosen: ChosenRuns, names: Sequence[str], given: Optional[Cell]) -> List[Run]:
    """The runs; a recording in which no run is whole is shown as it is."""
    try:
        return chosen.runs(names)
    except NoCycle as error:
        if len(names) > 1:
            raise
        say(f'note: {error}; all of it is shown', file=sys.stderr)
        return [_whole(names[0], given)]


def _whole(name: str, given: Optional[Cell]) -> Run:
    with Recording(recording_parts(name)) as recording, ExitStack() as stack:
        cell = given if given is not None else stack.enter_context(recorded_cell(recording))
        return read_run(recording, cell)


def _judged(run: Run, good: Optional[GoodRuns]) -> Judged:
    if good is None or incomparable(good.reference, run) is not None:
        return Judged(run)
    return Judged(run, good.compare(run), good.of(run) or good)


def _span(run: Run, begin: Optional[str], end: Optional[str]) -> PageSpan:
    """Return what of a run is shown [s of its recording].

    Raises:
        ValueError: a time is invalid, or is not in the run.
    """
    first_s, last_s = run.begin_s, run.begin_s + run.duration_s
    begin_s = first_s if begin is None else clock_seconds(begin)
    end_s = last_s if end is None else clock_seconds(end)
    if not begin_s < end_s or end_s <= first_s or begin_s >= last_s:
        raise ValueError(f'{run.name} goes from {clock(first_s)} to {clock(last_s)}, not from '
                         f'{clock(begin_s)} to {clock(end_s)}')
    return PageSpan(max(begin_s, first_s), min(end_s, last_s))
