# SPDX-License-Identifier: BSD-3-Clause
"""The commands ``cell runs`` and ``cell compare``: list runs, and compare them with good runs."""
from __future__ import annotations

import argparse
import json
import sys
from collections import Counter
from typing import Any, Dict, List, Optional, Sequence, Set, Tuple

from process_visualizer.cell.xml_parser import XmlParser
from process_visualizer.figures import clock_text
from process_visualizer.page.robots import PageSpan
from process_visualizer.page.run_page import Judged
from process_visualizer.page.shared_page import shared_page
from process_visualizer.runs.comparison.comparison import Comparison, incomparable
from process_visualizer.runs.comparison.features import Drift, as_csv, drifts, phase_at
from process_visualizer.runs.comparison.good_runs import GoodRuns
from process_visualizer.runs.comparison.wording import (
    amount,
    band_text,
    began,
    nearest_text,
    quantity,
    unjudged_texts,
    verdict,
)
from process_visualizer.runs.deviation.band import RELATIVE_TOLERANCE
from process_visualizer.runs.deviation.departures import Departure
from process_visualizer.runs.recorded.chosen_runs import ChosenRuns
from process_visualizer.runs.run import DAMAGED, Run
from process_visualizer.shown_text import say
from process_visualizer.whole_file import write_text


def add_runs_options(command: argparse.ArgumentParser) -> None:
    """Add the options of ``cell runs``."""
    command.set_defaults(repeated='bags')
    command.add_argument('bags', metavar='BAG', nargs='+', help='recordings')
    command.add_argument('--json', action='store_true', help='output for programs')
    _add_config(command)


def add_compare_options(command: argparse.ArgumentParser) -> None:
    """Add the options of ``cell compare``."""
    command.set_defaults(repeated='runs')
    command.add_argument('runs', metavar='RUN', nargs='+',
                         help='a recording, or runs of it: BAG, BAG#NUMBER or BAG#FIRST-LAST')
    command.add_argument('--reference', metavar='GOOD', nargs='+', required=True,
                         help='good runs; the first is the one on whose clock runs are compared')
    command.add_argument('--band', metavar='RATE', type=float,
                         help='how often a good run may be out of range, such as 0.05')
    command.add_argument('--tolerance', metavar='SHARE', type=float, default=RELATIVE_TOLERANCE,
                         help='without a rate: how far runs may differ, as a share of the range')
    command.add_argument('--json', action='store_true', help='output for programs')
    command.add_argument('--report', metavar='FILE',
                         help='also write the page of the runs, as "cell share" does')
    command.add_argument('--csv', metavar='FILE',
                         help='also write a table: duration, least, largest and mean by phase')
    _add_config(command)


def _add_config(command: argparse.ArgumentParser) -> None:
    command.add_argument('--config', metavar='FILE',
                         help='a configuration; default: the one in each recording')


def execute_runs(options: argparse.Namespace, arguments: Dict[str, str]) -> int:
    """List the runs of recordings; return 0."""
    found = _chosen(options, arguments).runs(options.bags)
    _check_recorded(found)
    if options.json:
        say(json.dumps([_entry(run) for run in found], indent=1))
        return 0
    width = max(len(run.name) for run in found)
    for run in found:
        events = ', '.join(f'{event.name} at {clock_text(run.begin_s + event.time_s)}'
                           for event in run.events[:6])
        say(f'{run.name:{width}}  from {clock_text(run.begin_s)}, {run.duration_s:.1f} s'
            + ''.join(f', {what} {_number(value)}' for what, value in run.group + run.place)
            + (', broken off' if run.is_broken_off else '')
            + (f', {DAMAGED}' if run.is_damaged else '') + (f': {events}' if events else ''))
    return 0


def execute_compare(options: argparse.Namespace, arguments: Dict[str, str]) -> int:
    """Compare runs with good ones; return 0 if all are in range, 2 if any is not.

    Return 3 if none is out of range, but some run could not be judged completely.

    Raises:
        TooFewRuns: there are too few good runs for the requested rate.
        ValueError: the runs have nothing in common, or an option is out of range.
    """
    _check(options)
    chosen = _chosen(options, arguments)
    reference, *others = chosen.runs(options.reference)
    _check_comparable(reference, others)
    runs = _comparable(reference, chosen.runs(options.runs))
    _check_recorded([reference, *others, *runs])
    for text, _ in sorted(_absent([reference, *others, *runs])):
        say(f'cell: not judged: {text}', file=sys.stderr)
    good = GoodRuns(reference, others, options.band, options.tolerance)
    comparisons = [good.compare(run) for run in runs]
    say(as_json(good, comparisons) if options.json else as_text(good, comparisons))
    if options.csv is not None:
        write_text(options.csv, as_csv(comparisons))
    if options.report is not None:
        write_text(options.report, _report(options, arguments, good, comparisons))
    if any(it.departures for it in comparisons):
        return 2
    return 3 if any(it.why_not or it.has_gaps for it in comparisons) else 0


def _check(options: argparse.Namespace) -> None:
    if options.band is not None and not 0.0 < options.band < 1.0:
        raise ValueError(f'--band is {options.band:g}; give a rate between 0 and 1, such as 0.05')
    if not options.tolerance > 0.0:
        raise ValueError(f'--tolerance is {options.tolerance:g}; give a share such as 0.1')


def _chosen(options: argparse.Namespace, arguments: Dict[str, str]) -> ChosenRuns:
    if options.config is None:
        return ChosenRuns()
    return ChosenRuns(XmlParser(arguments).parse(options.config))


def _check_recorded(runs: Sequence[Run]) -> None:
    """Raise ValueError for configured names that no recording has, if they seem misspelled."""
    mistakes = sorted(text for text, is_mistake in _absent(runs) if is_mistake)
    if mistakes:
        raise ValueError('; '.join(mistakes))


def _absent(runs: Sequence[Run]) -> Set[Tuple[str, bool]]:
    return set.intersection(*(set(run.absent) for run in runs))


def _check_comparable(reference: Run, runs: Sequence[Run]) -> None:
    reasons: List[str] = [reason for run in runs for reason in [incomparable(reference, run)]
                          if reason is not None]
    if reasons:
        raise ValueError(reasons[0])


def _comparable(reference: Run, runs: Sequence[Run]) -> List[Run]:
    """Return the comparable runs; report the others, which are left out."""
    reasons = [incomparable(reference, run) for run in runs]
    if all(reasons):
        raise ValueError(str(reasons[0]))
    for reason in filter(None, reasons):
        say(f'cell: left out: {reason}', file=sys.stderr)
    return [run for run, reason in zip(runs, reasons) if reason is None]


def _report(options: argparse.Namespace, arguments: Dict[str, str], good: GoodRuns,
            found: Sequence[Comparison]) -> str:
    """Return the page of the comparisons, the worst first."""
    cell = None if options.config is None else XmlParser(arguments).parse(options.config)
    runs = [it.run for it in found]
    return shared_page(
        cell, [Judged(it.run, it, good.of(it.run) or good) for it in found],
        [PageSpan(it.begin_s, it.begin_s + it.duration_s) for it in runs], good,
        [f'{drift_text(it)}.' for it in drifts(found)] if len(found) > 1 else ())


def _number(value: Optional[float]) -> str:
    return 'unknown' if value is None else f'{value:g}'


def _entry(run: Run) -> Dict[str, object]:
    return {'name': run.name, 'begin_s': round(run.begin_s, 3),
            'duration_s': round(run.duration_s, 3), 'is_broken_off': run.is_broken_off,
            'is_damaged': run.is_damaged,
            'context': dict(run.group + run.place),
            'events': [{'name': it.name, 'time_s': round(run.begin_s + it.time_s, 3)}
                       for it in run.events],
            'channels': [f'{it.device} {it.label}' for it in run.channels]}


# The comparisons as text, and as JSON for programs.

_MAX_LINES = 10


def as_text(good: GoodRuns, comparisons: Sequence[Comparison]) -> str:
    """Return a line for each run; for a single one also its departures, the first one first."""
    lines = [f'reference: {good.reference.name}; band: {band_text(good.band)}']
    lines += [f'note: {note}' for note in good.notes]
    for it in comparisons:
        lines.append(f'{it.run.name}: {verdict(it)}')
        lines += [f'  note: {note}' for note in (*it.notes, *unjudged_texts(it))]
    if len(comparisons) == 1:
        lines += _table(comparisons[0])
    else:
        lines += [f'note: {drift_text(it)}' for it in drifts(comparisons)]
        causes = cause_counts(comparisons)
        if sum(causes.values()) > 1:
            lines.append('out of range first by: ' + ', '.join(
                f'{name} ({count})' for name, count in causes.items()))
        departed = sum(bool(it.departures) for it in comparisons)
        lines.append(f'{departed} of {len(comparisons)} runs out of range')
    return '\n'.join(lines)


def _table(comparison: Comparison) -> List[str]:
    found = comparison.departures
    if not found:
        nearest = nearest_text(comparison)
        return [f'nearest to leaving: {nearest}'] if nearest else []
    width = max(len(it.signal.name) for it in found[:_MAX_LINES])
    lines = [f'{number:3}  {it.signal.name:{width}}  {_since(began(comparison, it))}, {amount(it)}'
             for number, it in enumerate(found[:_MAX_LINES], start=1)]
    rest = len(found) - _MAX_LINES
    return lines + ([f'     and {rest} more'] if rest > 0 else [])


def _since(words: str) -> str:
    return words if words.startswith('between') else f'from {words}'


def as_json(good: GoodRuns, comparisons: Sequence[Comparison]) -> str:
    """Return the same as JSON: times in s from the start of each run's recording."""
    return json.dumps({
        'reference': good.reference.name,
        'band': {'runs': good.band.runs, 'rate': good.band.rate}, 'notes': list(good.notes),
        'causes': cause_counts(comparisons),
        'drifts': [{'device': it.signal.device, 'signal': it.signal.label, 'unit': it.signal.unit,
                    'per_run': it.per_run, 'since': it.since, 'text': drift_text(it)}
                   for it in drifts(comparisons)],
        'runs': [_run(it) for it in comparisons]}, indent=1)


def cause_counts(comparisons: Sequence[Comparison]) -> Dict[str, int]:
    """Return how many runs left their band first with each signal, the most frequent one first."""
    found = Counter(it.departures[0].signal.name for it in comparisons if it.departures)
    return dict(found.most_common())


def drift_text(drift: Drift) -> str:
    """Return what drifts, by how much and since when, in words."""
    verb = 'grows' if drift.per_run > 0.0 else 'falls'
    return (f'{drift.signal.name} {verb} by {quantity(drift.signal, abs(drift.per_run))} a run '
            f'since {drift.since}')


def _run(comparison: Comparison) -> Dict[str, Any]:
    run, nearest = comparison.run, comparison.nearest
    return {'name': run.name, 'begin_s': round(run.begin_s, 3),
            'duration_s': round(run.duration_s, 3), 'aligned_by': comparison.alignment.method.name,
            'is_judged': not comparison.why_not,
            'is_within': not comparison.departures and not comparison.why_not,
            'verdict': verdict(comparison), 'notes': list(comparison.notes),
            'nearest': None if nearest is None else {
                'device': nearest.signal.device, 'signal': nearest.signal.label,
                'share_of_band': round(nearest.share, 4),
                'time_s': round(run.begin_s + comparison.run_s(nearest.time_s), 3),
                'phase': phase_at(run, comparison.run_s(nearest.time_s))},
            'not_judged': [{'device': it.signal.device, 'signal': it.signal.label,
                            'from_s': round(it.begin_s, 3), 'to_s': round(it.end_s, 3),
                            'why': it.why.value}
                           for it in comparison.unjudged],
            'departures': [_departure(comparison, it) for it in comparison.departures]}


def _departure(comparison: Comparison, it: Departure) -> Dict[str, Any]:
    begin_s = comparison.run.begin_s
    return {'device': it.signal.device, 'signal': it.signal.label, 'unit': it.signal.unit,
            'kind': it.signal.kind.value,
            'onset_s': round(begin_s + comparison.run_s(it.onset_s), 3),
            'uncertainty_s': round(it.uncertainty_s, 3),
            'left_s': round(begin_s + comparison.run_s(it.left_s), 3),
            'worst_s': round(begin_s + comparison.run_s(it.worst_s), 3),
            'deviation': it.deviation, 'half_width': it.half_width, 'mean_over_s': it.signal.over_s,
            'frequency_hz': it.frequency_hz, 'text': amount(it)}
