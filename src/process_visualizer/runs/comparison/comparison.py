# SPDX-License-Identifier: BSD-3-Clause
"""A run held against good ones."""
from __future__ import annotations

from typing import Iterable, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from process_visualizer.runs.alignment.alignment import Alignment, Means
from process_visualizer.runs.alignment.anchors import Anchor, aligned_at
from process_visualizer.runs.deviation.band import (
    RELATIVE_TOLERANCE,
    Band,
    BandLearner,
    TooFewRuns,
    fewest_runs,
    tolerance_band,
)
from process_visualizer.runs.deviation.departures import Departure, departures, spans
from process_visualizer.runs.deviation.signals import Columns, Signal, SignalKind, grid_s, signals
from process_visualizer.runs.run import Run, fingerprint

USUAL_RATE = 0.05
"""How often a good run leaves its band, where no rate was asked for and enough are there."""
_LEAST_SHARE = 0.8
"""Of the reference, or of the run: if less than that has a counterpart in the other, it is told."""

_FOLLOWING = (SignalKind.TIMING, SignalKind.NOISE)
_FOLLOWING_LABELS = ('tool sideways', 'tool up')
"""They have data where another signal of theirs has."""
_MIN_UNJUDGED_ROWS, _MIN_KNOWN = 10, 0.1
_MIN_LONGER_S, _MIN_PACE = 0.1, 0.02
"""From so much on, also as a share of the reference, a different pace is reported."""


class Unjudged(NamedTuple):
    """A signal of which the run has no data from one time of the recording to another [s].

    One that comes ``too_seldom`` is judged nowhere.
    """

    signal: Signal
    begin_s: float
    end_s: float
    too_seldom: bool = False


class Comparison(NamedTuple):
    """What came of a run: its signals on the reference's clock, and where they left a band."""

    run: Run
    alignment: Alignment
    columns: Columns
    band: Band
    departures: Tuple[Departure, ...]
    notes: Tuple[str, ...]
    unjudged: Tuple[Unjudged, ...] = ()

    def run_s(self, reference_s: float) -> float:
        """Return the time of the run [s from its begin] that belongs to one of the reference."""
        return float(self.alignment.time_map.to_run(np.array([reference_s]))[0])


class GoodRuns:
    """Good runs on the clock of one of them, the reference, and the band that they span."""

    def __init__(self, reference: Run, others: Iterable[Run] = (), rate: Optional[float] = None,
                 tolerance: float = RELATIVE_TOLERANCE) -> None:
        """Take the runs.

        Args:
            reference: on whose clock runs are compared.
            others: good runs besides it; they are not kept.
            rate: how often a good run leaves the band; default: 0.05 if there are enough runs,
                otherwise the band is what the good runs did and a tolerance around it.
            tolerance: as a share of the range, for signals without one of their own.

        Raises:
            TooFewRuns: a rate was asked for that so few runs cannot support.
            ValueError: the reference has nothing to compare.
        """
        if not reference.channels and not reference.motions:
            raise ValueError(f'{reference.name} has no variable, force or motion to compare')
        self.reference = reference
        self.times_s = grid_s(reference)
        self._tolerance = tolerance
        self._others: List[Tuple[str, bytes]] = []  # name and fingerprint
        self._good = [self._columns(reference)[1]]
        known = {fingerprint(reference)}
        for run in others:
            own = fingerprint(run)
            if own in known:  # the same twice would look like two that agree
                continue
            known.add(own)
            self._others.append((run.name, own))
            self._good.append(self._columns(run)[1])
        if rate is None and len(self._others) > fewest_runs(USUAL_RATE):
            rate = USUAL_RATE
        self._rate = rate
        self._learner = None if rate is None else self._learned(rate)
        self.band = self._band(None)
        self.notes = self._outstanding()

    def compare(self, run: Run, anchors: Sequence[Anchor] = ()) -> Comparison:
        """Return where a run leaves the band; if it is one of the good runs, the others' band.

        ``anchors`` are moments that belong together because the operator says so.
        """
        alignment, columns = self._columns(run, anchors)
        own_print = fingerprint(run)
        own = next((number for number, (_, other) in enumerate(self._others)
                    if own_print == other), None)
        band = self.band if own is None else self._band(own)
        found = departures(self.times_s, columns, band)
        notes = [*alignment.notes, *self._notes(run, alignment, columns)]
        return Comparison(run, alignment, columns, band, found, tuple(notes),
                          _unjudged(run, alignment, self.times_s, columns, band))

    def _outstanding(self) -> Tuple[str, ...]:
        """What is told of the good runs themselves."""
        if self._learner is None:
            return ()
        return tuple(f'{self._others[run][0]} stands out from the other good runs '
                     f'({signal.name}); without it the band would be narrower'
                     for run, signal in self._learner.outstanding())

    def _columns(self, run: Run,
                 anchors: Sequence[Anchor] = ()) -> Tuple[Alignment, Columns]:
        alignment = aligned_at(self.reference, run, anchors)
        return alignment, signals(self.reference, run, alignment.time_map)

    def _learned(self, rate: float) -> BandLearner:
        """What the good runs but the reference teach; it has their signals from then on."""
        count = len(self._others)
        if count < fewest_runs(rate):
            raise TooFewRuns(f'{count} good runs beside the reference cannot support a rate of '
                             f'{rate:g}; it takes {fewest_runs(rate)}')
        learner = BandLearner(self._good[1:])
        self._good.clear()
        return learner

    def _band(self, without: Optional[int]) -> Band:
        if self._learner is not None and self._rate is not None:
            return self._learner.band(self._rate, without)
        good = [it for number, it in enumerate(self._good) if number - 1 != without]
        return tolerance_band(good, self._tolerance)

    def _notes(self, run: Run, alignment: Alignment, columns: Columns) -> List[str]:
        notes = []
        if fingerprint(run) == fingerprint(self.reference):
            notes.append('it is the reference itself')
        if alignment.means is not Means.MOTION:
            notes.append(f'aligned by {alignment.means.value}: there is no motion that both have')
        else:
            notes += _pace(alignment)
        notes += self._missing(run)
        known = {run.configuration, self.reference.configuration} - {''}
        if len(known) > 1:
            notes.append('it was recorded with another configuration than the reference')
        return notes + self._uncovered(run, alignment, columns)

    def _uncovered(self, run: Run, alignment: Alignment, columns: Columns) -> List[str]:
        covered = np.isfinite(np.stack(list(columns.values()))).any(axis=0)
        if covered.mean() < _LEAST_SHARE:
            return [f'it covers {covered.mean():.0%} of the reference']
        ends_s = np.clip(alignment.time_map.to_run(self.times_s[[0, -1]]), 0.0, run.duration_s)
        compared_s = float(ends_s[1] - ends_s[0])
        if compared_s < _LEAST_SHARE * run.duration_s:
            return [f'{compared_s:.1f} s of its {run.duration_s:.1f} s are compared: the reference '
                    'is no longer']
        return []

    def _missing(self, run: Run) -> List[str]:
        mine, theirs = (list(it.by_key) for it in (self.reference, run))
        notes = []
        for only, where in (([key for key in mine if key not in theirs], 'the reference'),
                            ([key for key in theirs if key not in mine], 'the run')):
            if only:
                names = ', '.join(' '.join(key) for key in only[:4])
                more = f' and {len(only) - 4} more' if len(only) > 4 else ''
                notes.append(f'only {where} has {names}{more}')
        return notes


def _unjudged(run: Run, alignment: Alignment, times_s: np.ndarray, columns: Columns,
              band: Band) -> Tuple[Unjudged, ...]:
    """Return where the good runs have data of a channel or tool, and the run has none."""
    run_s = alignment.time_map.to_run(times_s)
    is_there = (run_s >= 0.0) & (run_s <= run.duration_s)
    found = []
    for signal, limits in band.signals.items():
        if signal.kind in _FOLLOWING or signal.label in _FOLLOWING_LABELS:
            continue
        known = np.isfinite(limits.middle)
        if known.mean() < _MIN_KNOWN:
            found.append(Unjudged(signal, run.begin_s, run.begin_s + run.duration_s, True))
            continue
        missing = is_there & known
        if signal in columns:
            missing &= np.isnan(columns[signal])
        for begin, end in spans(missing):
            if end - begin >= _MIN_UNJUDGED_ROWS:
                found.append(Unjudged(signal, run.begin_s + float(run_s[begin]),
                                      run.begin_s + float(run_s[end - 1])))
    return tuple(sorted(found, key=lambda it: it.begin_s))


def _pace(alignment: Alignment) -> List[str]:
    """Return how much longer or shorter the motion took, if that is worth a word."""
    reference_s, run_s = (float(it[-1] - it[0]) for it in alignment.time_map)
    longer_s = run_s - reference_s
    if reference_s <= 0.0 or abs(longer_s) < max(_MIN_LONGER_S, _MIN_PACE * reference_s):
        return []
    return [f'its motion took {abs(longer_s):.2f} s ({100 * abs(longer_s) / reference_s:.1f} %) '
            f'{"longer" if longer_s > 0 else "less"} than in the reference']


def incomparable(reference: Run, run: Run) -> Optional[str]:
    """Return why two runs cannot be compared, or None."""
    if not set(reference.by_key) & set(run.by_key):
        return (f'{run.name} has no channel of {reference.name}; they are of different cells, or '
                'devices have other names')
    return None
