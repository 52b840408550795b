# SPDX-License-Identifier: BSD-3-Clause
"""The bands of compared runs on the timeline of their recording."""
from __future__ import annotations

from typing import Dict, NamedTuple, Sequence

import numpy as np

from process_visualizer.runs.comparison.comparison import Comparison
from process_visualizer.runs.deviation.departures import outside
from process_visualizer.runs.deviation.signals import RATE_HZ, SignalKind
from process_visualizer.runs.run import Key

SHOWN = (SignalKind.VARIABLE, SignalKind.FORCE, SignalKind.SPEED, SignalKind.STATE)
"""What has curves."""


class TimelineBand(NamedTuple):
    """The band in each of the columns of equal time (n,) of a recording; NaN outside of the runs.

    ``departed`` tells in which columns the run is outside of it.
    """

    low: np.ndarray
    high: np.ndarray
    departed: np.ndarray


def timeline_bands(times_s: np.ndarray, comparisons: Sequence[Comparison], duration_s: float,
                   columns: int) -> Dict[Key, TimelineBand]:
    """Return the bands by device and label; where runs overlap, the later one's.

    Args:
        times_s: (t,) those of the reference's clock.
        comparisons: of runs of one recording.
        duration_s: of the recording, which has so many columns.
        columns: at least one.
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
            times_s = np.arange(len(band.middle)) / RATE_HZ  # of runs of another group, another one
            is_out = outside(comparison.columns[signal], band)
            it.low[rows] = np.interp(at_s, times_s, band.middle - band.half_width, np.nan, np.nan)
            it.high[rows] = np.interp(at_s, times_s, band.middle + band.half_width, np.nan, np.nan)
            it.departed[rows] = np.interp(at_s, times_s, is_out.astype(float), 0.0, 0.0) > 0.0
    return found


def _empty(columns: int) -> TimelineBand:
    return TimelineBand(np.full(columns, np.nan), np.full(columns, np.nan),
                        np.zeros(columns, bool))
