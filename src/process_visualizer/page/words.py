# SPDX-License-Identifier: BSD-3-Clause
"""Words of a page on a run: its verdict, the notes, the departures, and the moments."""
from __future__ import annotations

from typing import Any, Dict, List, Optional, Sequence

from process_visualizer.page.places import Span
from process_visualizer.runs.comparison.comparison import Comparison
from process_visualizer.runs.comparison.verdict import verdict
from process_visualizer.runs.comparison.wording import amount, moment, unjudged_texts
from process_visualizer.runs.run import Run

MOST_ROWS = 12
"""Departures of a run in its table."""


def run_words(run: Run, comparison: Optional[Comparison], notes: Sequence[str],
              span: Span) -> Dict[str, Any]:
    """Return the texts of a run, as the page has them; times are those of the recording."""
    words: Dict[str, Any] = {'name': run.name, 'begin': span.begin_s, 'end': span.end_s,
                             'state': 'plain', 'verdict': 'not held against good runs',
                             'notes': list(notes), 'departures': [], 'moments': _moments(run, span)}
    if comparison is None:
        return words
    found = comparison.departures
    state = 'plain' if comparison.why_not else 'poor' if found else 'good'
    return {**words, 'state': state, 'verdict': verdict(comparison),
            'notes': [*comparison.notes, *unjudged_texts(comparison), *notes],
            'departures': [_departure(comparison, row) for row in range(len(found[:MOST_ROWS]))],
            'more': max(len(found) - MOST_ROWS, 0)}


def _departure(comparison: Comparison, row: int) -> Dict[str, Any]:
    it, begin_s = comparison.departures[row], comparison.run.begin_s
    return {'what': it.signal.name, 'device': it.signal.device, 'label': it.signal.label,
            'began': f'{moment(comparison, it.onset_s)} ± {it.uncertainty_s:.2f} s',
            'began_s': begin_s + comparison.run_s(it.onset_s),
            'worst': moment(comparison, it.worst_s),
            'worst_s': begin_s + comparison.run_s(it.worst_s), 'amount': amount(it)}


def _moments(run: Run, span: Span) -> List[Dict[str, Any]]:
    """Events of the process and marks."""
    return [{'label': it.name, 'at': at_s} for it in run.events
            for at_s in [run.begin_s + it.time_s] if span.begin_s <= at_s <= span.end_s]
