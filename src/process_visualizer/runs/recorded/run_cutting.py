# SPDX-License-Identifier: BSD-3-Clause
"""The runs of a recording: its cycles, by what the configuration says a run is."""
from __future__ import annotations

from typing import Optional, Tuple

import numpy as np

from process_visualizer.cell.model import RunSpan
from process_visualizer.runs.event import Cycle, cycles
from process_visualizer.runs.run import Context, Run, part_of


class NoCycle(ValueError):
    """A recording has none; the text says which event is missing."""


def cut_into_runs(whole: Run, span: Optional[RunSpan]) -> Tuple[Run, ...]:
    """Return the cycles of a recording, named NAME#1, NAME#2 …; without a span, all as one run.

    What belongs to a run before its begin and behind its end is cut off where the recording ends.

    Raises:
        NoCycle: the recording does not contain a whole one.
    """
    if span is None:
        return (whole,)
    begins = [event.time_s for event in whole.events if event.name == span.begin]
    ends = [event.time_s for event in whole.events if event.name == span.end]
    found = tuple(Cycle(*it) for it in zip(begins, begins[1:])
                  if it[1] - it[0] >= span.shortest_s) if span.begin == span.end \
        else cycles(begins, ends, span.shortest_s)
    if not found:
        missing = next((name for name, times in ((span.begin, begins), (span.end, ends))
                        if not times), None)
        raise NoCycle(f'{whole.name} holds no whole run: ' + (
            f'"{missing}" does not occur' if missing is not None
            else f'no "{span.end}" follows a "{span.begin}"'))
    return tuple(_run(whole, span, cycle, f'{whole.name}#{number}')
                 for number, cycle in enumerate(found, start=1))


def _run(whole: Run, span: RunSpan, cycle: Cycle, name: str) -> Run:
    after_s = 0.0 if cycle.is_broken_off else span.after_s
    part = part_of(whole, max(cycle.begin_s - span.before_s, 0.0),
                   min(cycle.end_s + after_s, whole.duration_s), name)
    return part._replace(is_broken_off=cycle.is_broken_off, context=_context(part, span.group),
                         place=_context(part, span.place))


def _context(run: Run, what: str) -> Context:
    return ((what, _usual_value(run, what)),) if what else ()


def _usual_value(run: Run, what: str) -> Optional[float]:
    """The value that a run has most often of a channel, by its label or topic."""
    for channel in run.channels:
        if what.strip('/') in (channel.label, channel.topic.strip('/')):
            values = channel.values[np.isfinite(channel.values)]
            found, counts = np.unique(values, return_counts=True)
            return float(found[counts.argmax()]) if len(found) else None
    return None
