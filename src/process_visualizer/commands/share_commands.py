# SPDX-License-Identifier: BSD-3-Clause
"""The commands that write runs for others: ``cell share``, ``film``, ``picture`` and ``export``."""
from __future__ import annotations

import argparse
import math
import os
import re
import sys
import time
from contextlib import ExitStack
from typing import Dict, List, Optional, Sequence, Tuple

from process_visualizer.bagio.recording import Recording, recording_parts
from process_visualizer.cell.model import Cell
from process_visualizer.cell.xml_parser import XmlParser
from process_visualizer.figures import clock_seconds, clock_text
from process_visualizer.film.film import (
    ENDINGS as FILM_ENDINGS,
)
from process_visualizer.film.film import (
    VIEWS,
    Frame,
    Style,
    ViewAt,
    numbers_beside,
    write_film,
    write_picture,
)
from process_visualizer.page.export import DEFAULT_RATE_HZ, export
from process_visualizer.page.export import ENDINGS as EXPORT_ENDINGS
from process_visualizer.page.robots import PageSpan
from process_visualizer.page.shared_page import ChosenSpans, page_of
from process_visualizer.runs.comparison.comparison import incomparable
from process_visualizer.runs.comparison.good_runs import GoodRuns
from process_visualizer.runs.recorded.chosen_runs import ChosenRuns, NoCycle, recorded_cell
from process_visualizer.runs.recorded.run_reader import read_run
from process_visualizer.runs.run import DAMAGED, Run
from process_visualizer.shown_text import say
from process_visualizer.whole_file import write_text


def add_share_options(command: argparse.ArgumentParser) -> None:
    """Add the options of ``cell share``."""
    add_span_options(command, 'the page, such as seam.html')
    add_clouds_option(command)


def add_clouds_option(command: argparse.ArgumentParser) -> None:
    """Add the option that includes the clouds of depth sensors."""
    command.add_argument('--clouds', action='store_true',
                         help='with the clouds of depth sensors, thinned')


def execute_share(options: argparse.Namespace, arguments: Dict[str, str]) -> int:
    """Write the page; return 0.

    Raises:
        BagError, ConfigurationError: a recording or its configuration cannot be read.
        ValueError: an option is out of range, or the runs are too long for one page.
        OSError: the page cannot be written; no partial file is left.
    """
    chosen = chosen_spans(options, arguments)
    write_text(options.output, page_of(chosen, options.clouds))
    size, runs = os.path.getsize(options.output) / 1e6, chosen.runs
    say(f'{options.output}: {clock_text(chosen.duration_s)} of '
        f'{", ".join(it.name for it in runs[:4])}{" …" if len(runs) > 4 else ""}, {size:.1f} MB')
    return 0


_MAX_RATE_HZ = 10_000.0


def add_export_options(command: argparse.ArgumentParser) -> None:
    """Add the options of ``cell export``."""
    add_span_options(command, 'the table FILE.csv or FILE.parquet, or FILE.mcap',
                     'good runs, the first of which is the ghost in an .mcap')
    command.add_argument('--rate', metavar='HZ', type=float, default=DEFAULT_RATE_HZ,
                         help=f'rows of a table in a second (default: {DEFAULT_RATE_HZ:g})')


def execute_export(options: argparse.Namespace, arguments: Dict[str, str]) -> int:
    """Write the file; return 0.

    Raises:
        BagError, ConfigurationError: a recording or its configuration cannot be read.
        ValueError: an option is out of range, or a package is missing.
        OSError: the file cannot be written; no partial file is left.
    """
    if os.path.splitext(options.output)[1].lower() not in EXPORT_ENDINGS:
        raise ValueError(f'{options.output}: name a file that ends in {", ".join(EXPORT_ENDINGS)}')
    if not 0.0 < options.rate <= _MAX_RATE_HZ:
        raise ValueError(f'--rate {options.rate:g}: write a number above 0 and up to '
                         f'{_MAX_RATE_HZ:g}')
    chosen = chosen_spans(options, arguments)
    said = export(options.output, chosen, options.rate)
    say(f'{options.output}: {clock_text(chosen.duration_s)}, {said}')
    return 0


_MIN_SIDE, _MAX_SIDE = 160, 4096
_PROGRESS_S = 2.0


def add_film_options(command: argparse.ArgumentParser) -> None:
    """Add the options of ``cell film``."""
    add_span_options(command, 'the film: FILE.mp4 or FILE.gif; a table with the numbers of '
                              'each frame is written beside it')
    command.add_argument('--rate', metavar='HZ', type=float, default=25.0,
                         help='frames in a second (default: 25)')
    command.add_argument('--speed', metavar='TIMES', type=float, default=1.0,
                         help='seconds of the recording per second of the film; 0.25 is slow '
                              'motion')
    command.add_argument('--beside', action='store_true',
                         help='the good run at the left, at the same moment of the process')
    _add_style_options(command)


def add_picture_options(command: argparse.ArgumentParser) -> None:
    """Add the options of ``cell picture``."""
    add_span_options(command, 'the picture: FILE.png')
    command.add_argument('--at', metavar='TIME', required=True,
                         help='of the recording, such as 0:07.4')
    _add_style_options(command)


def _add_style_options(command: argparse.ArgumentParser) -> None:
    command.add_argument('--size', metavar='WxH', type=_size, default=Style().size,
                         help='in pixels (default: 1280x720)')
    command.add_argument('--view', metavar='VIEW[,VIEW@TIME …]', type=_views,
                         default=Style().views,
                         help=f'{", ".join(VIEWS)} (default: {VIEWS[0]}); in a film the camera '
                              'moves to further views at a time of the recording, or at a mark: '
                              'cell,tools@0:07.4,front@needle')
    command.add_argument('--curves', metavar='A,B', default='',
                         help='labels of the curves below; default: all that fit, those that '
                              'differed first')
    command.add_argument('--dark', action='store_true', help='light on dark')
    add_clouds_option(command)


def _style(options: argparse.Namespace) -> Style:
    return Style(options.size, options.view,
                 tuple(it for it in options.curves.split(',') if it), options.dark,
                 options.clouds, getattr(options, 'beside', False))


def execute_film(options: argparse.Namespace, arguments: Dict[str, str]) -> int:
    """Write the film and, beside it, a table with the numbers of each frame; return 0.

    Raises:
        BagError, ConfigurationError: a recording or its configuration cannot be read.
        ValueError: an option is out of range, or a program is missing or fails.
        OSError: a file cannot be written; no partial film is left.
    """
    ending = os.path.splitext(options.output)[1].lower()
    if ending not in FILM_ENDINGS:
        raise ValueError(f'{options.output}: name a file that ends in {" or ".join(FILM_ENDINGS)}')
    if not 0.1 <= options.rate <= 120.0 or not 0.001 <= options.speed <= 1000.0:
        raise ValueError('write a --rate from 0.1 to 120 and a --speed from 0.001 to 1000')
    if ending == '.mp4' and (options.size[0] % 2 or options.size[1] % 2):
        raise ValueError('the sides of an mp4 have even numbers of pixels')
    count = write_film(options.output, chosen_spans(options, arguments), _style(options),
                       options.rate, options.speed, _Progress().show)
    say(f'{options.output}: {count} frames, {clock_text(count / options.rate)}; '
        f'{numbers_beside(options.output)} has the numbers of each frame')
    return 0


def execute_picture(options: argparse.Namespace, arguments: Dict[str, str]) -> int:
    """Write one picture; return 0.

    Raises:
        BagError, ConfigurationError, ValueError, OSError: as for ``execute_film``.
    """
    if not options.output.lower().endswith('.png'):
        raise ValueError(f'{options.output}: name a file that ends in .png')
    at_s = clock_seconds(options.at)
    chosen = chosen_spans(options, arguments)
    number = next((row for row, span in enumerate(chosen.spans)
                   if span.begin_s <= at_s <= span.end_s), None)
    if number is None:
        raise ValueError('; '.join(
            f'{run.name} goes from {clock_text(span.begin_s)} to {clock_text(span.end_s)}'
            for run, span in zip(chosen.runs, chosen.spans))
            + f', and {clock_text(at_s)} is outside')
    write_picture(options.output, chosen, _style(options), Frame(number, at_s))
    say(f'{options.output}: {chosen.runs[number].name} at {clock_text(at_s)}')
    return 0


class _Progress:
    """Reports the number of finished frames and the remaining time every now and then."""

    def __init__(self) -> None:
        self._begin_s = self._reported_s = time.monotonic()

    def show(self, done: int, count: int) -> None:
        now_s = time.monotonic()
        if done == 1:
            self._begin_s = now_s  # do not count the work before the first frame
        if now_s - self._reported_s < _PROGRESS_S or done in (1, count):
            return
        self._reported_s = now_s
        left_s = (now_s - self._begin_s) / (done - 1) * (count - done)
        say(f'{done} of {count} frames, {clock_text(left_s)[:-3]} left', file=sys.stderr)


def _views(text: str) -> Tuple[ViewAt, ...]:
    found: List[ViewAt] = []
    for word in text.split(','):
        view, has_time, at = word.partition('@')
        if view not in VIEWS or bool(has_time) != bool(at) or bool(at) != bool(found):
            raise argparse.ArgumentTypeError(
                f'"{word}": write one of {", ".join(VIEWS)}, and for further views VIEW@TIME or '
                'VIEW@MARK, such as cell,tools@0:07.4')
        found.append(ViewAt(view, at))
    return tuple(found)


def _size(text: str) -> Tuple[int, int]:
    found = re.fullmatch(r'(\d{2,5})x(\d{2,5})', text)
    size: Optional[Tuple[int, int]] = None if found is None else (
        int(found.group(1)), int(found.group(2)))
    if size is None or not all(_MIN_SIDE <= it <= _MAX_SIDE for it in size):
        raise argparse.ArgumentTypeError(
            f'write width and height from {_MIN_SIDE} to {_MAX_SIDE} pixels, such as 1280x720')
    return size


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
    """Return the runs that the options specify; ``arguments`` are values for the configuration.

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
    if len(options.runs) == 1 and len(runs) > 1 and (options.begin or options.end):
        touched = _touched(runs, options.begin, options.end)
        runs = touched if good is not None or len(touched) == 1 else [
            _whole(options.runs[0], cell)]
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


def _touched(runs: Sequence[Run], begin: Optional[str], end: Optional[str]) -> List[Run]:
    """Return the runs of a recording that overlap a part of it; all runs if none does."""
    begin_s = -math.inf if begin is None else clock_seconds(begin)
    end_s = math.inf if end is None else clock_seconds(end)
    return [it for it in runs if begin_s < it.begin_s + it.duration_s and end_s > it.begin_s
            ] or list(runs)


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
    if first_s == last_s:
        raise ValueError(f'{run.name} has only one moment; nothing in it can move')
    begin_s = first_s if begin is None else clock_seconds(begin)
    end_s = last_s if end is None else clock_seconds(end)
    if not begin_s < end_s or end_s <= first_s or begin_s >= last_s:
        raise ValueError(f'{run.name} goes from {clock_text(first_s)} to {clock_text(last_s)}, '
                         f'not from {clock_text(begin_s)} to {clock_text(end_s)}')
    return PageSpan(max(begin_s, first_s), min(end_s, last_s))
