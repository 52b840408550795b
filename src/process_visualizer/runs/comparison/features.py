# SPDX-License-Identifier: BSD-3-Clause
"""Numbers of runs for a table, and their growth from run to run."""
from __future__ import annotations

import csv
import io
from typing import Dict, Iterator, List, NamedTuple, Sequence, Tuple

import numpy as np

from process_visualizer.runs.comparison.comparison import Comparison
from process_visualizer.runs.deviation.signals import Signal, SignalKind
from process_visualizer.runs.run import Run

# Numbers for a table: the duration of each phase of a run, and each channel's values in it.

WHOLE = 'whole run'
_HEAD = ('run', 'begin_s', 'verdict', 'phase', 'duration_s', 'device', 'channel', 'unit', 'least',
         'largest', 'mean')


class Stretch(NamedTuple):
    """A named part of a run [s from its start]."""

    name: str
    begin_s: float
    end_s: float


def stretches(run: Run) -> List[Stretch]:
    """Return the configured phases of a run, else those between its events, and the whole run."""
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
    """Return a row for each run, phase and channel; the first row names the columns.

    The numbers are empty where a channel has no value in a phase.
    """
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
            numbers = [f'{it:.6g}' for it in (values.min(), values.max(), values.mean())
                       ] if len(values) else ['', '', '']
            yield (run.name, f'{run.begin_s:.3f}', judged, stretch.name,
                   f'{stretch.end_s - stretch.begin_s:.3f}', channel.device, channel.label,
                   channel.unit, *numbers)


# Drift: growth or fall from run to run of one recording, before any run is out of range.

_MIN_RUNS, _MIN_RISING = 8, 6
_SURE = 6.0
"""Minimum slope of a drift, in multiples of its uncertainty: many signals and starts are tried."""
_MIN_SHARE = 0.25
"""Minimum change in total, as a share of the band's half width; less need not be reported."""
_KINDS = (SignalKind.VARIABLE, SignalKind.FORCE, SignalKind.PLACE, SignalKind.NOISE)


class Drift(NamedTuple):
    """A signal that changes by ``per_run`` from run to run, since the run named ``since``."""

    signal: Signal
    per_run: float
    since: str
    runs: int


def drifts(comparisons: Sequence[Comparison]) -> List[Drift]:
    """Return the drifts over the runs of each recording, the largest in terms of its band first.

    The mean distance of a run from the middle of the band is assumed to be constant up to some run,
    and to change evenly from there on (least squares).
    """
    recordings: Dict[Tuple[str, ...], List[Comparison]] = {}
    for it in comparisons:
        if it.columns:
            recordings.setdefault(it.run.recording, []).append(it)
    found: List[Tuple[float, Drift]] = []
    for runs in recordings.values():
        runs.sort(key=lambda it: it.run.begin_s)
        if len(runs) >= _MIN_RUNS:
            found += _of_recording(runs)
    return [it for _, it in sorted(found, key=lambda it: -it[0])]


def _of_recording(runs: Sequence[Comparison]) -> List[Tuple[float, Drift]]:
    found = []
    for signal in runs[0].band.signals:
        if signal.kind not in _KINDS or signal.over_s or not all(
                signal in it.columns and signal in it.band.signals for it in runs):
            continue
        away = np.array([_mean_away(it, signal) for it in runs])
        if not np.isfinite(away).all():
            continue
        row, slope, sureness = _bend(away)
        width = float(np.nanmedian(runs[0].band.signals[signal].half_width))
        share = abs(slope) * (len(away) - 1 - row) / max(width, 1e-12)
        if sureness > _SURE and share > _MIN_SHARE:
            found.append((share, Drift(signal, slope, runs[row].run.name, len(away) - row)))
    return found


def _mean_away(comparison: Comparison, signal: Signal) -> float:
    away = comparison.columns[signal] - comparison.band.signals[signal].middle
    known = away[np.isfinite(away)]
    return float(known.mean()) if len(known) else float('nan')


def _bend(values: np.ndarray) -> Tuple[int, float, float]:
    """Return the row from which values (n,) change evenly, the slope, and slope per uncertainty."""
    rows = np.arange(len(values), dtype=float)
    best = (0, 0.0, 0.0)
    least = np.inf
    for row in range(len(values) - _MIN_RISING + 1):
        rise = np.maximum(rows - row, 0.0)
        centered = rise - rise.mean()
        spread = float(centered @ centered)
        slope = float(centered @ values) / spread
        left = values - values.mean() - slope * centered
        square = float(left @ left)
        if square < least:
            noise = np.sqrt(max(square, 1e-24) / max(len(values) - 3, 1))
            least, best = square, (row, slope, abs(slope) * float(np.sqrt(spread)) / noise)
    return best
