# SPDX-License-Identifier: BSD-3-Clause
"""The command ``cell cut``: copies a run, a span, or the time around an alarm to a smaller bag."""
from __future__ import annotations

import argparse
import math
import os
import sys
from contextlib import suppress
from typing import Dict, List, NamedTuple, Sequence, Tuple

from process_visualizer.bagio.bag_cut import COMPRESSIONS, CutSpan, cut
from process_visualizer.bagio.marks import read_marks
from process_visualizer.bagio.recording import Recording, recording_parts
from process_visualizer.cell.xml_parser import XmlParser
from process_visualizer.curves.curves import read_curves, recorded_alarms
from process_visualizer.health.figures import clock_seconds, clock_text
from process_visualizer.runs.recorded.chosen_runs import ChosenRuns
from process_visualizer.shown_text import say

_RUN_MARGIN_S, _MOMENT_MARGIN_S = 1.0, 5.0


class _Moment(NamedTuple):
    """A mark or alarm of a recording [s from its beginning]."""

    begin_s: float
    end_s: float
    text: str


def add_cut_options(command: argparse.ArgumentParser) -> None:
    """Add the options of ``cell cut``."""
    command.add_argument('run', metavar='RUN',
                         help='a recording, or one run of it: BAG or BAG#NUMBER')
    command.add_argument('-o', '--output', metavar='FILE', required=True, help='the new bag')
    command.add_argument('--from', dest='begin', metavar='TIME', type=_time,
                         help='from the beginning of the recording, such as 0:05')
    command.add_argument('--to', dest='end', metavar='TIME', type=_time)
    command.add_argument('--around', metavar='WHAT',
                         help='a moment: a time, or words of a mark or of an alarm')
    command.add_argument('--margin', metavar='SECONDS', type=_time,
                         help=f'more before and after (of a run {_RUN_MARGIN_S:g} s, around a '
                              f'moment {_MOMENT_MARGIN_S:g} s)')
    command.add_argument('--topics', metavar='A,B',
                         help='only these, and what the recorder adds about the cell')
    command.add_argument('--compression', choices=COMPRESSIONS, default='none')
    command.add_argument('--config', metavar='FILE',
                         help='a configuration; default: the one in the recording')


def execute_cut(options: argparse.Namespace, arguments: Dict[str, str]) -> int:
    """Write the bag; return 0, or 2 if messages of the span cannot be read.

    Raises:
        BagError: a file cannot be read or written.
        ValueError: the options do not name one span, or the recording does not have it.
    """
    chosen = ChosenRuns() if options.config is None else \
        ChosenRuns(XmlParser(arguments).parse(options.config))
    paths, begin_s, end_s = _span_s(options, chosen)
    topics = None if options.topics is None else [it for it in options.topics.split(',') if it]
    with Recording(paths) as recording:
        duration_s = (recording.end_ns - recording.begin_ns) / 1e9
        begin_s, end_s = max(begin_s, 0.0), min(end_s, duration_s)
        if begin_s > end_s:
            raise ValueError(f'{paths[0]} goes from {clock_text(0.0)} to {clock_text(duration_s)}')
        begin_ns, end_ns = (recording.begin_ns + round(it * 1e9) for it in (begin_s, end_s))
        done = cut(
            recording, CutSpan(begin_ns, end_ns), options.output, topics, options.compression
        )
    say(f'{options.output}: {clock_text(begin_s)} to {clock_text(end_s)}, '
        f'{done.message_count} messages of {len(done.topics)} topics'
        + (f', and {done.held_count} that held before' if done.held_count else ''))
    if done.lost_count:
        say(f'cell: {done.lost_count} messages of this span cannot be read; '
            f'see "cell report {paths[0]}"', file=sys.stderr)
    return 2 if done.lost_count else 0


def _time(text: str) -> float:
    try:
        return clock_seconds(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from error


def _span_s(options: argparse.Namespace,
            chosen: ChosenRuns) -> Tuple[Tuple[str, ...], float, float]:
    """Return the files of the recording, and the chosen span [s from its beginning]."""
    is_run = '#' in options.run and not os.path.exists(options.run)
    is_span = options.begin is not None or options.end is not None
    if is_run + is_span + (options.around is not None) != 1:
        raise ValueError('name one span: a run (BAG#NUMBER), --from and --to, or --around')
    if is_run:
        runs = chosen.runs([options.run])
        margin_s = _RUN_MARGIN_S if options.margin is None else options.margin
        return (runs[0].recording, min(it.begin_s for it in runs) - margin_s,
                max(it.begin_s + it.duration_s for it in runs) + margin_s)
    paths = recording_parts(options.run)
    if is_span:
        margin_s = options.margin or 0.0
        return (paths, (options.begin or 0.0) - margin_s,
                (math.inf if options.end is None else options.end) + margin_s)
    moment = _moment(paths, options.around, chosen)
    margin_s = _MOMENT_MARGIN_S if options.margin is None else options.margin
    return paths, moment.begin_s - margin_s, moment.end_s + margin_s


def _moment(paths: Tuple[str, ...], words: str, chosen: ChosenRuns) -> _Moment:
    """Return the moment of a time, or else the mark, or else the alarm with these words.

    Raises:
        ValueError: nothing matches, or more than one mark or alarm does.
    """
    with suppress(ValueError):
        return _Moment(clock_seconds(words), clock_seconds(words), words)
    with Recording(paths) as recording:
        times_s = [((it.time_ns - recording.begin_ns) / 1e9, it.label)
                   for it in read_marks(recording)]
    marks = [_Moment(time_s, time_s, label) for time_s, label in times_s]
    known, matching = marks, _with_words(words, marks)
    if not matching:
        known = marks + _alarms(paths, chosen)
        matching = _with_words(words, known)
    if len(matching) == 1:
        return matching[0]
    count = 'several marks or alarms' if matching else 'no mark or alarm'
    raise ValueError('\n'.join([
        f'{paths[0]} has {count} with "{words}"; give more words, or the time',
        *(f'  {clock_text(it.begin_s)}  {it.text}' for it in sorted(matching or known))]))


def _with_words(words: str, moments: Sequence[_Moment]) -> List[_Moment]:
    return [it for it in moments if words.casefold() in it.text.casefold()]


def _alarms(paths: Tuple[str, ...], chosen: ChosenRuns) -> List[_Moment]:
    with chosen.cell_of_recording(paths) as cell:
        found = recorded_alarms(cell.devices, read_curves(paths, cell.devices))
    return [_Moment(it.begin_s, it.end_s, f'{it.device}: {it.text}') for it in found]
