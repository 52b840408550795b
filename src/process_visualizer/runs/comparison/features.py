# SPDX-License-Identifier: BSD-3-Clause
"""Numbers for a table: how long each phase of a run took, and what each channel had in it."""
from __future__ import annotations

import csv
import io
from typing import Iterator, List, NamedTuple, Sequence, Tuple

import numpy as np

from process_visualizer.runs.comparison.comparison import Comparison
from process_visualizer.runs.run import Run

WHOLE = 'whole run'
_HEAD = ('run', 'begin_s', 'verdict', 'phase', 'duration_s', 'device', 'channel', 'unit', 'least',
         'largest', 'mean')


class Stretch(NamedTuple):
    """A part of a run [s from its begin] with a name."""

    name: str
    begin_s: float
    end_s: float


def stretches(run: Run) -> List[Stretch]:
    """Return the configured phases of a run, else those between its events, and the whole of it."""
    found = [Stretch(phase.name, *it) for phase in run.phases
             for it in run.between_s(phase.begin, phase.end)]
    if not found:
        ends = sorted(run.events, key=lambda it: it.time_s)
        found = [Stretch(f'{one.name} to {other.name}', one.time_s, other.time_s)
                 for one, other in zip(ends, ends[1:])]
    return [*sorted(found, key=lambda it: it.begin_s), Stretch(WHOLE, 0.0, run.duration_s)]


def phase_at(run: Run, time_s: float) -> str:
    """Return the name of the shortest stretch in which a time of the run [s] lies."""
    inside = [it for it in stretches(run) if it.begin_s <= time_s <= it.end_s]
    return min(inside, key=lambda it: it.end_s - it.begin_s).name if inside else WHOLE


def as_csv(comparisons: Sequence[Comparison]) -> str:
    """Return a row for each run, phase and channel; the first row names the columns."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator='\n')
    writer.writerow(_HEAD)
    for it in comparisons:
        writer.writerows(_rows(it))
    return text.getvalue()


def _rows(comparison: Comparison) -> Iterator[Tuple[str, ...]]:
    run = comparison.run
    judged = 'not judged' if comparison.why_not else \
        'out of range' if comparison.departures else 'in range'
    for stretch in stretches(run):
        for channel in run.channels:
            inside = (channel.times_s >= stretch.begin_s) & (channel.times_s <= stretch.end_s)
            values = channel.values[inside & np.isfinite(channel.values)].astype(float)
            numbers = (values.min(), values.max(), values.mean()) if len(values) else ()
            yield (run.name, f'{run.begin_s:.3f}', judged, stretch.name,
                   f'{stretch.end_s - stretch.begin_s:.3f}', channel.device, channel.label,
                   channel.unit, *(f'{it:.6g}' for it in numbers))
