# SPDX-License-Identifier: BSD-3-Clause
"""Comparisons as text, and as JSON for programs."""
from __future__ import annotations

import json
from collections import Counter
from typing import Any, Dict, List, Sequence

from process_visualizer.runs.comparison.comparison import Comparison
from process_visualizer.runs.comparison.features import Drift, drifts, phase_at
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
from process_visualizer.runs.deviation.departures import Departure

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
            'duration_s': round(run.duration_s, 3), 'aligned_by': comparison.alignment.means.name,
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
