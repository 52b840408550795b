# SPDX-License-Identifier: BSD-3-Clause
"""Moments of the reference on the timeline of a recording whose runs were held against it."""
from __future__ import annotations

from enum import Enum
from typing import List, NamedTuple, Sequence, Tuple

from process_visualizer.runs.alignment.anchors import Anchor
from process_visualizer.runs.comparison.comparison import Comparison
from process_visualizer.runs.run import Run

_SAME_S = 1e-6


class MomentKind(Enum):
    """The kind of a moment of the reference."""

    EVENT = 'event'
    DEPARTURE = 'departure'
    ANCHOR = 'anchor'


class Moment(NamedTuple):
    """A moment of the reference [s], and where in the recording [s] a run has it.

    ``run`` is the number of the run among those that were compared.
    """

    position_s: float
    kind: MomentKind
    label: str
    run: int
    reference_s: float


class AnchoredRun(NamedTuple):
    """The result for a run, its number, and what the operator said of its alignment."""

    number: int
    comparison: Comparison
    anchors: Tuple[Anchor, ...] = ()


def timeline_moments(reference: Run, runs: Sequence[AnchoredRun]) -> Tuple[Moment, ...]:
    """Return the reference's events, each run's departures and anchors, in the order of time."""
    return tuple(sorted((it for run in runs for it in _moments(reference, run)),
                        key=lambda it: it.position_s))


def _moments(reference: Run, run: AnchoredRun) -> List[Moment]:
    comparison, anchored = run.comparison, [it.reference_s for it in run.anchors]
    wanted = [(it.time_s, MomentKind.EVENT, it.name) for it in reference.events]
    wanted += [(it.onset_s, MomentKind.DEPARTURE, it.signal.name) for it in comparison.departures]
    found = [_moment(run, reference_s, MomentKind.ANCHOR if any(
        abs(reference_s - it) < _SAME_S for it in anchored) else kind, label)
        for reference_s, kind, label in wanted]
    labelled = [it.reference_s for it in found]
    found += [_moment(run, it, MomentKind.ANCHOR, 'anchor') for it in anchored
              if not any(abs(it - other) < _SAME_S for other in labelled)]
    begin_s, end_s = comparison.run.begin_s, comparison.run.begin_s + comparison.run.duration_s
    return [it for it in found if begin_s <= it.position_s <= end_s]


def _moment(run: AnchoredRun, reference_s: float, kind: MomentKind, label: str) -> Moment:
    comparison = run.comparison
    return Moment(comparison.run.begin_s + comparison.run_s(reference_s), kind, label, run.number,
                  reference_s)
