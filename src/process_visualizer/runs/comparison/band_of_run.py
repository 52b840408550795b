# SPDX-License-Identifier: BSD-3-Clause
"""The band as it holds for one run: wider where that run's moments are less certain."""
from __future__ import annotations

from typing import Sequence

import numpy as np

from process_visualizer.runs.alignment.alignment import Alignment, AlignmentMethod
from process_visualizer.runs.deviation.band import EDGE_ROWS, Band, SignalBand, beyond, widened
from process_visualizer.runs.deviation.departures import BESIDE
from process_visualizer.runs.deviation.signals import (
    RATE_HZ,
    TIMING_LABEL,
    Columns,
    Signal,
    SignalKind,
    steepness,
    tool_speed,
)
from process_visualizer.runs.run import Run
from process_visualizer.runs.series import ROUGH_S, moving_maximum

OF_PLACE = (SignalKind.PLACE, SignalKind.JOINT, SignalKind.SPEED)
"""Signals that depend on the place at which a process runs."""
TIME_LOST = Signal('', TIMING_LABEL, 's', SignalKind.TIMING)
_EDGED = (SignalKind.VARIABLE, SignalKind.FORCE, SignalKind.SPEED, SignalKind.NOISE)
_EDGE_S, _MIN_WAIT_S = EDGE_ROWS / RATE_HZ, 0.1
_AROUND_ROWS, _MIN_SPEED_M_S = int(0.5 * RATE_HZ), 0.005
_BY_STATES_S = 0.08


def band_of_run(band: Band, alignment: Alignment, columns: Columns, reference: Run,
                times_s: np.ndarray) -> Band:
    """Return the band for a run, from the band of the good runs.

    Args:
        band: of the good runs of the same group and place.
        alignment, columns: of the run.
        times_s: (t,) the moments of the reference.
    """
    if alignment.means is AlignmentMethod.STATES:
        band = _wider_in_time(band, reference, times_s)
    band = _less_sure_in_waits(band, alignment, reference, times_s)
    return _less_sure_beside(band, columns, reference, times_s)


def _wider_in_time(band: Band, reference: Run, times_s: np.ndarray) -> Band:
    """Return the band for a run whose moments are known only from messages of states.

    The faster a tool moves, the less is known about where it should be.
    """
    found = dict(band.signals)
    speeds = {it.device: tool_speed(it, times_s) for it in reference.motions if len(it.times_s)}
    for signal, limits in band.signals.items():
        if signal.label == TIMING_LABEL:
            found[signal] = limits._replace(half_width=limits.half_width + _BY_STATES_S)
        elif signal.kind is SignalKind.PLACE and signal.device in speeds:
            found[signal] = limits._replace(
                half_width=limits.half_width + _BY_STATES_S * speeds[signal.device])
        elif signal.kind in OF_PLACE:
            found[signal] = widened(limits)
    return band._replace(signals=found)


def _less_sure_in_waits(band: Band, alignment: Alignment, reference: Run,
                        times_s: np.ndarray) -> Band:
    """Return the band for a run that waited less: its edges there are slower on the other clock."""
    found = dict(band.signals)
    for begin_s, end_s in reference.waits_s:
        run_s = alignment.time_map.to_run(np.array([begin_s, end_s]))
        stretch = (end_s - begin_s) / max(float(np.ptp(run_s)), _MIN_WAIT_S)
        if stretch <= 1.0:
            continue
        rows = slice(*np.searchsorted(times_s, (begin_s - stretch * _EDGE_S, end_s + _EDGE_S)))
        for signal, limits in found.items():
            if signal.kind in _EDGED:
                edge_s = _EDGE_S + (ROUGH_S if signal.kind is SignalKind.NOISE else 0.0)
                wider = widened(limits, int(stretch * edge_s * RATE_HZ) + 1)
                found[signal] = limits._replace(**{
                    name: _with_rows(getattr(limits, name), rows, getattr(wider, name))
                    for name in ('middle', 'half_width')})
    return band._replace(signals=found)


def _with_rows(values: np.ndarray, rows: slice, others: np.ndarray) -> np.ndarray:
    result = values.copy()
    result[rows] = others[rows]
    return result


def _less_sure_beside(band: Band, columns: Columns, reference: Run, times_s: np.ndarray) -> Band:
    """Return the band for a run whose tools are farther beside their paths than in good runs.

    Moments are found by the place of a tool on its path. A tool beside its path may as well be
    earlier or later, by the time it takes for that distance.
    """
    away, passed = np.zeros((2, len(times_s)))
    for motion in reference.motions:
        if not len(motion.times_s):
            continue
        outside_m = {signal.label: np.nan_to_num(beyond(
            columns[signal], limits.middle - limits.half_width,
            limits.middle + limits.half_width)) for signal, limits in band.signals.items()
            if signal.device == motion.device and signal.kind is SignalKind.PLACE
            and signal in columns}
        level, climb = steepness(motion, times_s)
        along, aside, up = (outside_m.get(label, np.zeros(len(times_s)))
                            for label in ('tool along', *BESIDE))
        away += np.square(aside) + np.square(level * up - climb * along)
        passed += np.square(tool_speed(motion, times_s))
    speed_m_s = np.sqrt(moving_maximum(passed, _AROUND_ROWS))
    unsure_s = np.where(speed_m_s > 0.0, np.sqrt(away) / np.maximum(speed_m_s, _MIN_SPEED_M_S), 0.0)
    unsure_s = moving_maximum(unsure_s, 2 * _AROUND_ROWS)
    if TIME_LOST not in band.signals or not unsure_s.any():
        return band
    limits = band.signals[TIME_LOST]
    wider = limits._replace(half_width=limits.half_width + unsure_s)
    return band._replace(signals={**band.signals, TIME_LOST: wider})


def holding(limits: SignalBand, values: Sequence[np.ndarray]) -> SignalBand:
    """Return the band of all places, widened to hold what good runs of one place did.

    The moments of these runs were found by the states of one of them, with the same error in each.
    """
    low = np.fmin.reduce([limits.middle, *values]) - limits.half_width
    high = np.fmax.reduce([limits.middle, *values]) + limits.half_width
    return SignalBand(0.5 * (low + high), 0.5 * (high - low))
