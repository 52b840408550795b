# SPDX-License-Identifier: BSD-3-Clause
"""The map of time by which the tools of a run are where those of a reference are."""
from __future__ import annotations

import math
from typing import Optional, Tuple

import numpy as np

from process_visualizer.runs.alignment.common_events import CommonEvents
from process_visualizer.runs.alignment.motion import Motion, common_motions, moving_rows
from process_visualizer.runs.alignment.refinement import refined
from process_visualizer.runs.alignment.slope_limited_warp import band_around, warp
from process_visualizer.runs.alignment.time_map import TimeMap, time_map
from process_visualizer.runs.run import Run

_MOST_ROUGH_ROWS, _ROUGH_HZ, _FINE_HZ, _REFINED_HZ = 3000, 5.0, 12.5, 50.0
_FINE_REACH_S = 1.0
_EVENT_REACH_S, _EVENT_SPREAD = 1.0, 0.35
"""So far from where events place it, a moment is looked for; farther, the farther from them."""
_SKIPPED = 0.02
"""What a skipped row costs, as a share of the variance of the reference's motion."""


def motion_alignment(reference: Run, run: Run, events: CommonEvents) -> Optional[TimeMap]:
    """Return the map of time; None where the tools do not move, or not alike.

    Rough warping finds the moment, near the events where there are some; fine warping around it
    and a least-squares refinement find it more exactly than one sample.
    """
    size_s = math.sqrt(max(reference.duration_s, 1.0) * max(run.duration_s, 1.0))
    rough_hz = min(_ROUGH_HZ, _MOST_ROUGH_ROWS / size_s)
    motions = common_motions(reference, run, rough_hz)
    if not _moves(motions[0]) or not _moves(motions[1]):
        return None
    rough = _warped(*motions, *_near_events(motions, events))
    if rough is None:
        return None
    motions = common_motions(reference, run, _FINE_HZ)
    middle = rough.to_run(motions[0].times_s) * _FINE_HZ
    reach_s = max(_FINE_REACH_S, 3.0 / rough_hz)
    fine = _warped(*motions, middle, np.full(len(middle), reach_s * _FINE_HZ))
    return None if fine is None else refined(fine, *common_motions(reference, run, _REFINED_HZ))


def _moves(motion: Motion) -> bool:
    """Return whether there is a tool, and it moves at times."""
    return motion.positions.shape[1] > 0 and bool(moving_rows(motion).any())


def _near_events(motions: Tuple[Motion, Motion],
                 events: CommonEvents) -> Tuple[np.ndarray, np.ndarray]:
    """Return where in the run a row may be: the middle and the reach, both in rows."""
    times_s, rate_hz = motions[0].times_s, motions[0].rate_hz
    if not len(events.reference_s):
        length = len(motions[1].positions)
        return np.full(len(times_s), length / 2), np.full(len(times_s), length / 2 + 1)
    middle = time_map(events.reference_s, events.run_s).to_run(times_s)
    away_s = np.abs(times_s[:, np.newaxis] - events.reference_s).min(axis=1)
    return middle * rate_hz, (_EVENT_REACH_S + _EVENT_SPREAD * away_s) * rate_hz


def _warped(reference: Motion, run: Motion, middle: np.ndarray,
            reach: np.ndarray) -> Optional[TimeMap]:
    """Return the map by the moments at which a tool moves; in between time runs evenly."""
    spread = float(np.nansum(np.nanvar(reference.positions, axis=0)))
    rows, columns = warp(reference.positions, run.positions, band_around(middle, reach),
                         _SKIPPED * spread)
    if not len(rows):
        return None
    tells = moving_rows(reference)[rows] | moving_rows(run)[np.clip(
        columns, 0, len(run.positions) - 1)]
    if np.count_nonzero(tells) < 2:
        return None
    return time_map(rows[tells] / reference.rate_hz, columns[tells] / run.rate_hz)
