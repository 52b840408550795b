# SPDX-License-Identifier: BSD-3-Clause
"""The bands of compared runs on the timeline of their recording."""
from __future__ import annotations

from enum import Enum
from typing import Dict, List, NamedTuple, Sequence, Tuple

import numpy as np

from process_visualizer.runs.alignment.alignment import Anchor
from process_visualizer.runs.comparison.comparison import Comparison
from process_visualizer.runs.deviation.departures import outside
from process_visualizer.runs.deviation.signals import RATE_HZ, SignalKind
from process_visualizer.runs.run import Key, Run

SHOWN = (SignalKind.VARIABLE, SignalKind.FORCE, SignalKind.SPEED, SignalKind.STATE)
"""The kinds of signals that have curves."""


class TimelineBand(NamedTuple):
    """The band in each column of equal duration (n,) of a recording; NaN outside the runs.

    ``departed`` marks the columns in which the run is outside the band.
    """

    low: np.ndarray
    high: np.ndarray
    departed: np.ndarray


def timeline_bands(comparisons: Sequence[Comparison], duration_s: float,
                   columns: int) -> Dict[Key, TimelineBand]:
    """Return the bands by device and label; where runs overlap, the later one's.

    Args:
        comparisons: of runs of one recording.
        duration_s: the duration of the recording.
        columns: the number of columns of the recording, at least one.
    """
    middles_s = (np.arange(columns) + 0.5) * (duration_s / columns)
    found: Dict[Key, TimelineBand] = {}
    for comparison in comparisons:
        run = comparison.run
        rows = slice(*np.searchsorted(middles_s, (run.begin_s, run.begin_s + run.duration_s)))
        at_s = comparison.alignment.time_map.to_reference(middles_s[rows] - run.begin_s)
        for signal, band in comparison.band.signals.items():
            if signal.kind not in SHOWN or signal.over_s or signal not in comparison.columns:
                continue
            it = found.setdefault((signal.device, signal.label), _empty(columns))
            times_s = np.arange(len(band.middle)) / RATE_HZ  # of the group that judged the run
            is_out = outside(comparison.columns[signal], band)
            it.low[rows] = np.interp(at_s, times_s, band.middle - band.half_width, np.nan, np.nan)
            it.high[rows] = np.interp(at_s, times_s, band.middle + band.half_width, np.nan, np.nan)
            it.departed[rows] = np.interp(at_s, times_s, is_out.astype(float), 0.0, 0.0) > 0.0
    return found


def _empty(columns: int) -> TimelineBand:
    return TimelineBand(np.full(columns, np.nan), np.full(columns, np.nan),
                        np.zeros(columns, bool))


# Moments of the reference on the timeline of a recording whose runs were compared with it.

_SAME_S = 1e-6


class MomentKind(Enum):
    """The kind of a moment of the reference."""

    EVENT = 'event'
    DEPARTURE = 'departure'
    ANCHOR = 'anchor'


class ReferenceMoment(NamedTuple):
    """A moment of the reference [s], and its position in a run of the recording [s].

    ``run`` is the number of the run among those that were compared.
    """

    position_s: float
    kind: MomentKind
    label: str
    run: int
    reference_s: float


class AnchoredRun(NamedTuple):
    """The result for a run, its number, and the operator's anchors of its alignment."""

    number: int
    comparison: Comparison
    anchors: Tuple[Anchor, ...] = ()


def timeline_moments(reference: Run, runs: Sequence[AnchoredRun]) -> Tuple[ReferenceMoment, ...]:
    """Return the reference's events, each run's departures and anchors, in order of time."""
    return tuple(sorted((it for run in runs for it in _moments(reference, run)),
                        key=lambda it: it.position_s))


def _moments(reference: Run, run: AnchoredRun) -> List[ReferenceMoment]:
    comparison, anchored = run.comparison, [it.reference_s for it in run.anchors]
    wanted = [(it.time_s, MomentKind.EVENT, it.name) for it in reference.events]
    wanted += [(it.onset_s, MomentKind.DEPARTURE, it.signal.name) for it in comparison.departures]
    found = [_moment(run, reference_s, MomentKind.ANCHOR if any(
        abs(reference_s - it) < _SAME_S for it in anchored) else kind, label)
        for reference_s, kind, label in wanted]
    labeled = [it.reference_s for it in found]
    found += [_moment(run, it, MomentKind.ANCHOR, 'anchor') for it in anchored
              if not any(abs(it - other) < _SAME_S for other in labeled)]
    begin_s, end_s = comparison.run.begin_s, comparison.run.begin_s + comparison.run.duration_s
    return [it for it in found if begin_s <= it.position_s <= end_s]


def _moment(run: AnchoredRun, reference_s: float, kind: MomentKind, label: str) -> ReferenceMoment:
    comparison = run.comparison
    return ReferenceMoment(
        comparison.run.begin_s + comparison.run_s(reference_s), kind, label, run.number, reference_s
    )
