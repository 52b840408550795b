# SPDX-License-Identifier: BSD-3-Clause
"""Two runs aligned: by their motion where they have one, else by their events."""
from __future__ import annotations

from enum import Enum
from typing import NamedTuple, Tuple

from process_visualizer.runs.alignment.common_events import common_events
from process_visualizer.runs.alignment.motion_alignment import motion_alignment
from process_visualizer.runs.alignment.time_map import TimeMap, shift, time_map
from process_visualizer.runs.run import Run


class Means(Enum):
    """The basis of an alignment of two runs."""

    MOTION = 'the motion of the tools'
    EVENTS = 'their events'
    STATES = 'their states'
    ANCHORS = 'what the operator says'
    BEGIN = 'their begin'


class Alignment(NamedTuple):
    """A map from moments of a run to those of the reference, and what could not be used."""

    time_map: TimeMap
    means: Means
    notes: Tuple[str, ...] = ()


def aligned(reference: Run, run: Run) -> Alignment:
    """Return the alignment of a run with a reference; the signals that are judged play no part."""
    events = common_events(reference.events, run.events)
    by_motion = motion_alignment(reference, run, events)
    if by_motion is not None:
        return Alignment(by_motion, Means.MOTION, events.notes)
    if len(events.reference_s):
        return Alignment(time_map(events.reference_s, events.run_s), Means.EVENTS, events.notes)
    return Alignment(shift(0.0), Means.BEGIN, events.notes)
