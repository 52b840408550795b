# SPDX-License-Identifier: BSD-3-Clause
"""A good run beside which a live one can be followed: its robots, and when its events come."""
from __future__ import annotations

from typing import NamedTuple, Optional, Tuple

from process_visualizer.cell.model import Cell, ProcessEvent, RunSpan
from process_visualizer.runs.comparison.ghost_tracks import GhostTrack, reference_tracks
from process_visualizer.runs.run import Run


class ReferenceEvent(NamedTuple):
    """An event that can be seen live, and when [s] the reference has it."""

    event: ProcessEvent
    times_s: Tuple[float, ...]


class LiveReference(NamedTuple):
    """``tracks`` count from the reference's begin; without any there is nothing to follow."""

    tracks: Tuple[GhostTrack, ...]
    events: Tuple[ReferenceEvent, ...] = ()
    span: Optional[RunSpan] = None


def live_reference(cell: Cell, run: Run) -> LiveReference:
    """Return what is needed to follow live robots beside a run; loads the robots' models.

    Marks are no events here: nobody has set them yet. A span between them is left out.
    """
    events = tuple(ReferenceEvent(event, tuple(it.time_s for it in run.events
                                               if it.name == event.name))
                   for event in cell.events)
    names = {event.name for event in cell.events}
    span = cell.run
    if span is not None and not {span.begin, span.end} <= names:
        span = None
    return LiveReference(reference_tracks(cell, run), events, span)
