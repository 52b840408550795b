# SPDX-License-Identifier: BSD-3-Clause
"""Decides which signals and times of a run are not judged ('no data' in a verdict)."""
from __future__ import annotations

from enum import Enum
from typing import Iterator, List, NamedTuple, Tuple

import numpy as np

from process_visualizer.runs.alignment.alignment import Alignment
from process_visualizer.runs.deviation.band import Band
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
from process_visualizer.runs.holes import holes_s_of
from process_visualizer.runs.run import Run
from process_visualizer.runs.series import moving_maximum, spans, states

_FOLLOWING = (SignalKind.STATE, SignalKind.TIMING, SignalKind.NOISE)
_FOLLOWING_LABELS = ('tool sideways', 'tool up')
"""Signals that have data where another signal of the same channel or tool has."""
_DIRECTIONS = (FORCE_DIRECTION, TORQUE_DIRECTION)
_MIN_UNJUDGED_ROWS, _MIN_UNJUDGED_S, _MIN_KNOWN = 10, 0.1, 0.1
_BESIDE_UNKNOWN_ROWS = int(0.3 * RATE_HZ)
"""Rows next to an unknown moment in which means are unknown as well."""


class Missing(Enum):
    """The reason why a signal is not judged, as a text."""

    DATA = 'no data in time'
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
