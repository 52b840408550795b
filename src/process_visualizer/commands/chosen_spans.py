# SPDX-License-Identifier: BSD-3-Clause
"""The options that choose runs, or parts of runs, for pages, films and other exports."""
from __future__ import annotations

import argparse
import os
import sys
from contextlib import ExitStack
from typing import Dict, List, Optional, Sequence

from process_visualizer.bagio.recording import Recording, recording_parts
from process_visualizer.cell.model import Cell
from process_visualizer.cell.xml_parser import XmlParser
from process_visualizer.health.figures import clock_seconds
from process_visualizer.page.robots import PageSpan
from process_visualizer.page.shared_page import ChosenSpans
from process_visualizer.runs.comparison.comparison import GoodRuns, incomparable
from process_visualizer.runs.comparison.wording import clock
from process_visualizer.runs.recorded.chosen_runs import ChosenRuns, NoCycle, recorded_cell
from process_visualizer.runs.recorded.run_reader import read_run
from process_visualizer.runs.run import DAMAGED, Run
from process_visualizer.shown_text import say


def add_span_options(command: argparse.ArgumentParser, output_help: str,
                     reference_help: str = 'good runs to compare them with') -> None:
    """Add the options for the runs, the good runs, a part of the runs, and the output file."""
    command.set_defaults(repeated='runs')
    command.add_argument('runs', metavar='RUN', nargs='+',
                         help='a recording, or one run of it: BAG or BAG#NUMBER')
    if reference_help:
        command.add_argument('--reference', metavar='GOOD', nargs='+', default=[],
                             help=reference_help)
    command.add_argument('--from', dest='begin', metavar='TIME',
                         help='of the recording, such as 0:05 or 12.5')
    command.add_argument('--to', dest='end', metavar='TIME', help='the same')
    command.add_argument('-o', '--output', metavar='FILE', required=True, help=output_help)
    command.add_argument('--config', metavar='FILE',
                         help='a configuration; default: the one in each recording')


def chosen_spans(options: argparse.Namespace, arguments: Dict[str, str]) -> ChosenSpans:
    """Return the runs that the options name; ``arguments`` are values for the configuration.

    Raises:
        BagError, ConfigurationError: a recording or its configuration cannot be read.
        ValueError: an option is out of range, or there is no folder for the output.
    """
    folder = os.path.dirname(os.path.abspath(options.output))
    if not os.path.isdir(folder):  # reported before the work begins
        raise ValueError(f'there is no folder "{folder}" for {options.output}')
    cell = None if options.config is None else XmlParser(arguments).parse(options.config)
    chosen = ChosenRuns(cell)
    good = _good_runs(chosen, getattr(options, 'reference', []))
    runs = _runs(chosen, options.runs, cell)
    for run in runs:
        if run.is_damaged:
            say(f'note: {run.name}: {DAMAGED}', file=sys.stderr)
    return ChosenSpans(cell, runs, [_span(it, options.begin, options.end) for it in runs], good)


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
    """Return the runs; a single recording without a complete run is returned as a whole."""
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


def _span(run: Run, begin: Optional[str], end: Optional[str]) -> PageSpan:
    """Return the part of a run that is shown [s of its recording].

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
