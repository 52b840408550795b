# SPDX-License-Identifier: BSD-3-Clause
"""Moments of two runs that belong together because the operator says so."""
from __future__ import annotations

from typing import Callable, List, NamedTuple, Sequence, Tuple

import numpy as np

from process_visualizer.runs.alignment.alignment import Alignment, Means, aligned
from process_visualizer.runs.alignment.common_events import common_events
from process_visualizer.runs.alignment.skipped_parts import skipped_parts, with_parts
from process_visualizer.runs.alignment.time_map import time_map
from process_visualizer.runs.run import Run, part_of

_LEAST_APART_S = 0.05


class Anchor(NamedTuple):
    """A moment of the reference, and the one of the run that belongs to it [s]."""

    reference_s: float
    run_s: float


def with_anchor(anchors: Sequence[Anchor], added: Anchor) -> Tuple[Anchor, ...]:
    """Return anchors in the order of time; those that contradict the added one are left out."""
    kept = [it for it in anchors
            if (it.reference_s - added.reference_s) * (it.run_s - added.run_s) > 0.0
            and min(abs(it.reference_s - added.reference_s),
                    abs(it.run_s - added.run_s)) >= _LEAST_APART_S]
    return tuple(sorted([*kept, added]))


def aligned_at(reference: Run, run: Run, anchors: Sequence[Anchor]) -> Alignment:
    """Return the alignment that goes through anchors; between two of them, that of the parts.

    Args:
        reference, run: to align.
        anchors: both of their times rise, as those of ``with_anchor``.
    """
    if not anchors:
        return _aligned_in_parts(reference, run)
    return _joined(reference, run, anchors, _aligned_in_parts)


def _aligned_in_parts(reference: Run, run: Run) -> Alignment:
    """The alignment, in which a part that only one of the runs has stands for itself."""
    found = aligned(reference, run)
    if not reference.motions or not run.motions:
        return found
    parts = skipped_parts(reference, run, found.time_map)
    anchors = [Anchor(*it) for it in with_parts([], parts)
               if 0.0 < it[0] < reference.duration_s and 0.0 < it[1] < run.duration_s]
    return _joined(reference, run, anchors, aligned) if anchors else found


def _joined(reference: Run, run: Run, anchors: Sequence[Anchor],
            align: Callable[[Run, Run], Alignment]) -> Alignment:
    corners = [Anchor(0.0, 0.0), *anchors, Anchor(reference.duration_s, run.duration_s)]
    points, is_moving = list(anchors), False
    for begin, end in zip(corners, corners[1:]):
        found = align(part_of(reference, begin.reference_s, end.reference_s, reference.name),
                      part_of(run, begin.run_s, end.run_s, run.name))
        is_moving |= found.means is Means.MOTION
        if found.means is not Means.BEGIN:  # where a part begins, is an anchor, or nothing
            points += _inside(found, begin, end)
    points.sort()
    alignment = time_map(*np.array(points, float).T)
    notes = common_events(reference.events, run.events).notes
    return Alignment(alignment, Means.MOTION if is_moving else Means.ANCHORS, notes)


def _inside(found: Alignment, begin: Anchor, end: Anchor) -> List[Anchor]:
    """The points of a part's map, as far as they contradict neither corner."""
    reference_s = found.time_map.reference_s + begin.reference_s
    run_s = found.time_map.run_s + begin.run_s
    kept = ((reference_s > begin.reference_s) & (reference_s < end.reference_s)
            & (run_s > begin.run_s) & (run_s < end.run_s))
    return [Anchor(*it) for it in zip(reference_s[kept].tolist(), run_s[kept].tolist())]
