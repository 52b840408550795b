# SPDX-License-Identifier: BSD-3-Clause
"""The result of comparing a run: where it left the band, what was not judged, how bad it is."""
from __future__ import annotations

import math
from enum import Enum
from typing import Iterator, List, NamedTuple, Optional, Tuple

import numpy as np

from process_visualizer.runs.alignment.alignment import Alignment
from process_visualizer.runs.deviation.band import Band
from process_visualizer.runs.deviation.departures import Departure, Nearness, nearness
from process_visualizer.runs.deviation.signals import (
    FORCE_DIRECTION,
    RATE_HZ,
    TORQUE_DIRECTION,
    Columns,
    Signal,
    SignalKind,
    grid_s,
    unknown_moments,
)
from process_visualizer.runs.run import Run
from process_visualizer.runs.series import holes_s_of, moving_maximum, spans, states

_MAX_UNJUDGED_SHARE = 0.25
"""Maximum share of a run without data in which a fault would hardly be hidden."""


class Comparison(NamedTuple):
    """The result for a run: its signals on the reference's clock, and where they left a band.

    ``why_not`` says why the run was not judged; empty if it was.
    """

    run: Run
    alignment: Alignment
    columns: Columns
    band: Band
    departures: Tuple[Departure, ...]
    notes: Tuple[str, ...]
    unjudged: Tuple[Unjudged, ...] = ()
    why_not: str = ''

    @property
    def has_gaps(self) -> bool:
        """Return whether the run lacks data somewhere where good runs have data."""
        return any(it.why is not Missing.SELDOM for it in self.unjudged)

    @property
    def unjudged_s(self) -> float:
        """Return the total time during which some signal was not judged for lack of data [s]."""
        total_s, until_s = 0.0, -math.inf
        for it in sorted(self.unjudged, key=lambda it: it.begin_s):
            if it.why is not Missing.SELDOM:
                total_s += max(it.end_s - max(it.begin_s, until_s), 0.0)
                until_s = max(until_s, it.end_s)
        return total_s

    @property
    def is_judged_in_part(self) -> bool:
        """Return whether so much was not judged that "in range" would be misleading."""
        return self.unjudged_s > _MAX_UNJUDGED_SHARE * self.run.duration_s

    @property
    def nearest(self) -> Optional[Nearness]:
        """Return the signal that came nearest to leaving its band; None if nothing was judged."""
        rows = max((len(it) for it in self.columns.values()), default=0)
        found = nearness(np.arange(rows) / RATE_HZ, self.columns, self.band)
        return found[0] if found else None

    @property
    def badness(self) -> float:
        """Return the distance from the usual in half widths of the band; up to 1 is in range."""
        nearest = self.nearest
        return max([it.severity for it in self.departures]
                   + ([] if nearest is None else [min(nearest.share, 1.0)]), default=0.0)

    def run_s(self, reference_s: float) -> float:
        """Return the time of the run [s from its start] that corresponds to the reference's."""
        return float(self.alignment.time_map.to_run(np.array([reference_s]))[0])


def incomparable(reference: Run, run: Run) -> Optional[str]:
    """Return why two runs cannot be compared, or None."""
    if not set(reference.by_key) & set(run.by_key):
        return (f'{run.name} has no channel of {reference.name}; they are of different cells, or '
                'devices have other names')
    return None


# Signals and times of a run that are not judged, for lack of data at the right time.

_FOLLOWING = (SignalKind.STATE, SignalKind.TIMING, SignalKind.NOISE)
_FOLLOWING_LABELS = ('tool sideways', 'tool up')
"""Signals that have data where another signal of the same channel or tool has."""
_DIRECTIONS = (FORCE_DIRECTION, TORQUE_DIRECTION)
_MIN_UNJUDGED_ROWS, _MIN_UNJUDGED_S, _MIN_KNOWN = 10, 0.1, 0.1
_BESIDE_UNKNOWN_ROWS = int(0.3 * RATE_HZ)
"""Rows next to an unknown moment in which means are unknown as well."""


class Missing(Enum):
    """The reason why a signal is not judged, as a text."""

    DATA = 'data missing or late'
    MOTION = ('messages of the motion are missing or arrived late, so the moment of the process '
              'is unknown')
    SELDOM = 'fewer than two values a second'


class Unjudged(NamedTuple):
    """A signal that is not judged between two times of the recording [s].

    A signal sampled too rarely is not judged at all.
    """

    signal: Signal
    begin_s: float
    end_s: float
    why: Missing = Missing.DATA


def unjudged(reference: Run, run: Run, alignment: Alignment, columns: Columns,
             band: Band) -> Tuple[Unjudged, ...]:
    """Return where good runs have data for a channel or tool, and the run has none."""
    times_s = grid_s(reference)
    run_s = alignment.time_map.to_run(times_s)
    is_there = (run_s >= 0.0) & (run_s <= run.duration_s)
    is_unknown = moving_maximum(unknown_moments(reference, run, times_s, run_s).astype(float),
                                _BESIDE_UNKNOWN_ROWS) > 0.0
    found: List[Unjudged] = []
    holes_s = holes_s_of(run)
    for signal, limits in band.signals.items():
        if signal.kind is SignalKind.STATE:
            found += _unknown_states(run, signal, holes_s)
        if signal.kind in _FOLLOWING or signal.label in _FOLLOWING_LABELS or signal.over_s or (
                signal.label in _DIRECTIONS and signal in columns):
            continue
        known = np.isfinite(limits.middle)
        if known.mean() < _MIN_KNOWN:
            found.append(Unjudged(signal, run.begin_s, run.begin_s + run.duration_s,
                                  Missing.SELDOM))
            continue
        missing = is_there & known
        if signal in columns:
            missing &= np.isnan(columns[signal])
        for begin, end in spans(missing):
            if end - begin >= _MIN_UNJUDGED_ROWS and run_s[end - 1] - run_s[begin] >= \
                    _MIN_UNJUDGED_S:
                found.append(Unjudged(
                    signal, run.begin_s + float(run_s[begin]), run.begin_s + float(run_s[end - 1]),
                    Missing.MOTION if is_unknown[begin:end].all() else Missing.DATA))
    return tuple(sorted(found, key=lambda it: it.begin_s))


def _unknown_states(run: Run, signal: Signal, holes_s: np.ndarray) -> Iterator[Unjudged]:
    """Yield where a state is unknown: in holes of all data, and after its messages ended."""
    channel = run.by_key.get((signal.device, signal.label))
    if channel is not None:
        for begin_s, end_s in holes_s.tolist():
            yield Unjudged(signal, run.begin_s + begin_s, run.begin_s + end_s)
    if channel is not None and states(channel).until_s < run.duration_s:
        yield Unjudged(signal, run.begin_s + float(channel.times_s[-1]),
                       run.begin_s + run.duration_s)
