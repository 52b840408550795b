# SPDX-License-Identifier: BSD-3-Clause
"""The runs of a recording: its cycles, by what the configuration says a run is."""
from __future__ import annotations

from typing import Optional, Tuple

from process_visualizer.cell.model import RunSpan
from process_visualizer.runs.event import cycles
from process_visualizer.runs.run import Run, part_of


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
    found = tuple(zip(begins, begins[1:])) if span.begin == span.end else cycles(begins, ends)
    if not found:
        missing = next((name for name, times in ((span.begin, begins), (span.end, ends))
                        if not times), None)
        raise NoCycle(f'{whole.name} holds no whole run: ' + (
            f'"{missing}" does not occur' if missing is not None
            else f'no "{span.end}" follows a "{span.begin}"'))
    return tuple(
        part_of(whole, max(begin_s - span.before_s, 0.0),
                min(end_s + span.after_s, whole.duration_s), f'{whole.name}#{number}')
        for number, (begin_s, end_s) in enumerate(found, start=1))
