# SPDX-License-Identifier: BSD-3-Clause
"""Signals of a run on the reference's clock, and where its moments are unknown (late data)."""
from __future__ import annotations

import math
from enum import Enum
from typing import Dict, List, Mapping, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from process_visualizer.runs.alignment.time_map import TimeMap
from process_visualizer.runs.run import Channel, ChannelKind, Run, ToolForce, ToolMotion
from process_visualizer.runs.series import (
    ROUGH_S,
    data_gaps,
    held_at,
    inside,
    is_sequence,
    known_at,
    mean_of_last,
    motion_gaps_s,
    moving_maximum,
    moving_mean,
    period_s,
    roughness,
    slow_values,
    spans,
)

_MIN_SPEED_M_S = 0.005


def path_axes(positions: np.ndarray, rate_hz: float) -> np.ndarray:
    """Return unit vectors (n, 3, 3): along the path, sideways (left), up; in the positions' frame.

    Up is z; along is the horizontal direction of the path. Where the tool rests or moves straight
    up or down, it is that of the nearest moment at which the tool moves horizontally.

    Args:
        positions: (n, 3) [m], with z up; NaN where unknown.
        rate_hz: of the rows.
    """
    along = np.column_stack((_directions(positions[:, :2], rate_hz), np.zeros(len(positions))))
    up = np.tile((0.0, 0.0, 1.0), (len(positions), 1))
    return np.stack((along, np.cross(up, along), up), axis=1)


def _directions(positions: np.ndarray, rate_hz: float) -> np.ndarray:
    """Return unit vectors (n, k) of the motion along positions (n, k)."""
    without = np.tile(np.eye(positions.shape[1])[0], (len(positions), 1))
    if len(positions) < 2:
        return without
    velocity = np.gradient(positions, axis=0) * rate_hz
    speed = np.linalg.norm(velocity, axis=1)
    moving = np.flatnonzero(speed > _MIN_SPEED_M_S)  # not where it is NaN
    if not len(moving):
        return without
    behind = np.searchsorted(moving, np.arange(len(positions)))
    later = moving[np.minimum(behind, len(moving) - 1)]
    earlier = moving[np.maximum(behind - 1, 0)]
    here = np.arange(len(positions))
    nearest = np.where(np.abs(later - here) <= np.abs(here - earlier), later, earlier)
    result: np.ndarray = velocity[nearest] / speed[nearest, np.newaxis]
    return result


def steepness(motion: ToolMotion, times_s: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
    """Return the horizontal and the vertical part (t,) of a tool's direction at even times (t,)."""
    way = _directions(known_at(times_s, motion.times_s, motion.positions), RATE_HZ)
    return np.hypot(way[:, 0], way[:, 1]), way[:, 2]


def tool_speed(motion: ToolMotion, times_s: np.ndarray) -> np.ndarray:
    """Return the maximum speed (t,) [m/s] of a tool within 0.1 s of even times (t,) [s]."""
    steps = np.diff(known_at(times_s, motion.times_s, motion.positions), axis=0, prepend=np.nan)
    speed = np.nan_to_num(np.sqrt((steps * steps).sum(axis=1)) * RATE_HZ)
    return moving_maximum(speed, MEAN_ROWS)


RATE_HZ = 50.0
MEAN_ROWS = int(0.1 * RATE_HZ)
"""Rows over which each value is averaged."""
_LOST_WITHIN_S = 0.5
_SLOW_S, _FEW = 0.25, 4
"""A channel with a longer period, or fewer values, is slow: it has no means and no noise."""
_MAX_PERIOD_S = 5.0
"""Maximum period of a slow channel [s]; one that is sent more rarely is sent on change."""
_TURN_ROWS, _MIN_TURNED = int(0.3 * RATE_HZ), 0.3
"""Rows over which a direction is averaged, and the minimum force as a share of the greatest."""
_NEAR_WAIT_S = 0.1
_STANDS = 0.1
"""A clock this slow is stopped; by motion, one clock is at least a third as fast as the other."""
_CUT_S = 0.1
"""Part of the reference [s] from which on a run that lacks it is cut off at its beginning."""
_NEAR_GAP_S = 0.4
"""Time around a gap in the motion in which the moment of the reference is uncertain [s].

Limited to the length of the gap if no message was late, as a short gap can be bridged."""
_MIN_KNOWN = int(0.5 * RATE_HZ)
"""Minimum rows of known motion before the first gap, and after the last."""
TIMING_LABEL, SLOWER_LABEL, NOISE_SUFFIX = 'time lost', 'pace', ' noise'
FORCE_DIRECTION, TORQUE_DIRECTION = 'tool force direction', 'tool torque direction'


class SignalKind(Enum):
    """The kind of a signal: of those that depart together, the one named first is the cause."""

    STATE = 'state'
    TIMING = 'timing'
    PLACE = 'place'
    VARIABLE = 'variable'
    FORCE = 'force'
    SPEED = 'speed'
    JOINT = 'joint'
    NOISE = 'noise'


_OVER_S: Dict[SignalKind, Tuple[float, ...]] = {
    SignalKind.VARIABLE: (1.0, 4.0), SignalKind.FORCE: (1.0, 4.0), SignalKind.NOISE: (2.0,)}
_KINDS = {ChannelKind.VARIABLE: SignalKind.VARIABLE, ChannelKind.FORCE: SignalKind.FORCE,
          ChannelKind.SPEED: SignalKind.SPEED, ChannelKind.JOINT: SignalKind.JOINT}


class Signal(NamedTuple):
    """One compared quantity; ``device`` is empty for signals of the whole run.

    ``tolerance`` and ``max_tolerance`` are the configured ones, if any. With ``over_s``, the signal
    is the mean over that many past seconds. A signal that is sent rarely has a ``period_s``: what
    happened between two values is known only when the second one comes. ``chance`` is the spread
    that noise has by chance, as it is computed from few values.
    """

    device: str
    label: str
    unit: str
    kind: SignalKind
    tolerance: Optional[float] = None
    over_s: float = 0.0
    max_tolerance: Optional[float] = None
    period_s: float = 0.0
    chance: float = 0.0

    @property
    def name(self) -> str:
        """Device and label, as people read them."""
        return f'{self.device} {self.label}'.strip()


Columns = Dict[Signal, np.ndarray]
"""Values (t,) of each signal, NaN where the run has none; float32, as there may be many."""


def grid_s(reference: Run) -> np.ndarray:
    """Return the times (t,) [s] of the reference at which runs are compared."""
    return np.arange(int(reference.duration_s * RATE_HZ) + 1) / RATE_HZ


ChannelColumns = Mapping[Tuple[str, str], Columns]
"""The columns of each channel, by its key."""


def own_columns(reference: Run) -> ChannelColumns:
    """Return the columns of a reference's own channels, which are the same for all runs."""
    times_s, waits = grid_s(reference), _waits(reference, grid_s(reference), _NEAR_WAIT_S)
    found = {it.key: _channel(it, it, times_s) for it in reference.channels}
    for columns in found.values():
        _without_noise(columns, waits)
    return found


def signals(reference: Run, run: Run, time_map: TimeMap, usual: Optional[TimeMap] = None,
            own: Optional[ChannelColumns] = None) -> Columns:
    """Return the signals of a run on the reference's clock.

    A tool's place is relative to the reference's, along its path, sideways (to the left) and up.
    *Time lost* is the time that the run needed for the last half second of the reference, minus
    its usual time for half a second. That usual time, relative to half a second, shows how much
    slower the run is. With ``usual``, the map of a run that goes the same way, the time needed by
    that run counts instead of the half second: the map to another way is less exact, and equally so
    for both. Noise is the natural logarithm of the roughness of a channel: 0.7 more is twice as
    rough. Lasting deviations show in means over longer times. States have the value that holds.
    ``own`` are the reference's own columns, if they are known already.
    """
    times_s = grid_s(reference)
    run_s = time_map.to_run(times_s)
    run_s = np.where((run_s >= 0.0) & (run_s <= run.duration_s), run_s, np.nan)
    others = {motion.device: motion for motion in run.motions}
    unsure = unknown_moments(reference, run, times_s, run_s)
    found = _timing(times_s, run_s, times_s if usual is None else usual.to_run(times_s), unsure,
                    _waits(reference, times_s, 0.0))
    run_s = np.where(unsure | _passed_over(run_s), np.nan, run_s)
    for motion in reference.motions:
        if motion.device in others and len(motion.times_s) and len(others[motion.device].times_s):
            found.update(_places(motion, others[motion.device], times_s, run_s))
    for label, mine, others_of in ((FORCE_DIRECTION, reference.forces, run.forces),
                                   (TORQUE_DIRECTION, reference.torques, run.torques)):
        by_device = {it.device: it for it in others_of}
        for force in mine:
            if force.device in by_device:
                angle = _direction(force, by_device[force.device], times_s, run_s)
                found[Signal(force.device, label, '°', SignalKind.FORCE)] = angle
    theirs, waits = run.by_key, _waits(reference, times_s, _NEAR_WAIT_S)
    if own is None:
        own = own_columns(reference)
    for channel in reference.channels:
        if channel.key in theirs:
            values = _channel(channel, theirs[channel.key], run_s)
            _without_noise(values, waits)
            found.update(values if _is_slow(channel) else _with_means(own[channel.key], values))
    return {signal: values.astype(np.float32) for signal, values in found.items()}


def _without_noise(columns: Columns, waits: np.ndarray) -> None:
    """Remove the noise in waits, which have no common clock, before its means are computed."""
    for signal, values in columns.items():
        if signal.kind is SignalKind.NOISE:
            values[waits] = np.nan


def unknown_moments(reference: Run, run: Run, times_s: np.ndarray,
                    run_s: np.ndarray) -> np.ndarray:
    """Return where (t,) (bool) missing data of all tools make the moment of the run uncertain.

    A short piece of motion before the first gap, or after the last, does not show which it is.

    Args:
        times_s, run_s: (t,), times of the reference, and those of the run that correspond to them.
    """
    found = np.zeros(len(times_s), bool)
    for moments_s, whole in ((times_s, reference), (run_s, run)):
        near = [near_gaps(moments_s, it.times_s, gaps) for it, gaps in zip(
            (it for it in whole.motions if len(it.times_s)), motion_gaps_s(whole))]
        if near:
            found |= np.logical_and.reduce(near)
    pieces = spans(~found & (run_s >= 0.0) & (run_s <= run.duration_s))
    for begin, end in (pieces[0], pieces[-1]) if len(pieces) > 1 else ():
        if end - begin < _MIN_KNOWN:
            found[begin:end] = True
    return found


def near_gaps(moments_s: np.ndarray, times_s: np.ndarray, gaps: np.ndarray) -> np.ndarray:
    """Return which moments (m,) lie in one of the gaps (k, 2) of a series, or near one (bool)."""
    if not len(gaps):
        return np.zeros(len(moments_s), bool)
    begin_s, end_s = gaps.T
    is_late = np.array([np.count_nonzero((times_s > begin) & (times_s <= end)) > 1
                        for begin, end in gaps])  # values that arrived at once belong to the gap
    near_s = np.where(is_late, _NEAR_GAP_S, np.minimum(end_s - begin_s, _NEAR_GAP_S))
    return inside(moments_s, np.column_stack((begin_s - near_s, end_s + near_s)))


def _passed_over(run_s: np.ndarray) -> np.ndarray:
    """Return where (t,) (bool) the run skips a part of the reference: its clock stops."""
    stands = np.zeros(len(run_s) + 1, bool)
    with np.errstate(invalid='ignore'):
        stands[1:-1] = np.diff(run_s) < _STANDS / RATE_HZ
    return stands[1:] & stands[:-1]


def _waits(reference: Run, times_s: np.ndarray, behind_s: float) -> np.ndarray:
    """Return where (t,) (bool) the process may take any time."""
    found = np.zeros(len(times_s), bool)
    for begin_s, end_s in reference.waits_s:
        found |= (times_s >= begin_s - _NEAR_WAIT_S) & (times_s <= end_s + behind_s)
    return found


def _timing(times_s: np.ndarray, run_s: np.ndarray, usual_s: np.ndarray, unsure: np.ndarray,
            waits: np.ndarray) -> Columns:
    """Return the time lost in the last half second, and how much slower the whole run was.

    The duration of a wait is not judged, but what follows its end is, such as a robot that starts
    late.
    """
    rows, here = int(_LOST_WITHIN_S * RATE_HZ), np.arange(len(times_s))
    last_wait = np.maximum.accumulate(np.where(waits, here, -1))
    begin = np.maximum(here - rows, last_wait + 1)
    is_known = (here >= rows) & (here > begin) & \
        ~(moving_maximum(unsure.astype(float), rows) > 0.0)
    took_s, needed_s = (np.where(is_known, it - it[np.minimum(begin, here)], np.nan)
                        for it in (run_s, usual_s))
    with np.errstate(invalid='ignore'):
        known = np.isfinite(took_s) & (needed_s > _STANDS * (here - begin) / RATE_HZ)
    whole = known & (here - begin == rows)
    pace = float(np.median(took_s[whole] / needed_s[whole])) if whole.any() else 1.0
    half_s = float(np.median(took_s[whole])) if whole.any() else _LOST_WITHIN_S
    slower = np.where(np.isfinite(run_s), half_s / _LOST_WITHIN_S - 1.0, np.nan)
    return {Signal('', TIMING_LABEL, 's', SignalKind.TIMING): took_s - pace * needed_s,
            Signal('', SLOWER_LABEL, '', SignalKind.TIMING): slower}


def lost_s(deviation: np.ndarray) -> float:
    """Return the time lost in consecutive rows [s], from *time lost* (t,) [s].

    Each row has the time lost within the half second before it.
    """
    return float(np.nansum(deviation)) / int(_LOST_WITHIN_S * RATE_HZ)


def _places(reference: ToolMotion, run: ToolMotion, times_s: np.ndarray,
            run_s: np.ndarray) -> Columns:
    mine = known_at(times_s, reference.times_s, reference.positions)
    difference = known_at(run_s, run.times_s, run.positions) - mine
    axes = path_axes(mine, RATE_HZ)
    parts = np.einsum('tij,tj->ti', axes, difference)
    return {Signal(reference.device, label, 'm', SignalKind.PLACE): moving_mean(part, MEAN_ROWS)
            for label, part in zip(('tool along', 'tool sideways', 'tool up'), parts.T)}


def _direction(reference: ToolForce, run: ToolForce, times_s: np.ndarray,
               run_s: np.ndarray) -> np.ndarray:
    """Return the angle (t,) [°] between a force and the reference's; NaN where either is small.

    A force that turns by itself, such as while it sets in, may do so up to 0.1 s earlier or later:
    the nearest direction of the reference within that time counts.
    """
    mine, theirs = (moving_mean(known_at(at_s, it.times_s, it.vectors.astype(float)).T, _TURN_ROWS)
                    for it, at_s in ((reference, times_s), (run, run_s)))
    size, other = np.sqrt((mine * mine).sum(axis=0)), np.sqrt((theirs * theirs).sum(axis=0))
    known = size[np.isfinite(size)]
    least = _MIN_TURNED * float(known.max()) if len(known) else np.inf
    with np.errstate(invalid='ignore', divide='ignore'):
        unit = mine / size
        cosines = [(_later(unit, rows) * theirs).sum(axis=0) / other
                   for rows in range(-MEAN_ROWS, MEAN_ROWS + 1)]
        cosine = np.fmax.reduce(cosines)
        angle: np.ndarray = np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))
        angle[~((size > least) & (other > least))] = np.nan
    return angle


def _later(columns: np.ndarray, rows: int) -> np.ndarray:
    """Return columns (k, t) as they are some rows later, NaN beyond their ends."""
    result = np.full_like(columns, np.nan)
    count = columns.shape[1]
    result[:, max(-rows, 0):count - max(rows, 0)] = columns[:, max(rows, 0):count - max(-rows, 0)]
    return result


def _channel(reference: Channel, run: Channel, run_s: np.ndarray) -> Columns:
    finite = np.isfinite(run.values)
    times_s, values = run.times_s[finite], run.values[finite]
    signal = Signal(reference.device, reference.label, reference.unit, _KINDS[reference.kind],
                    reference.tolerance, max_tolerance=reference.max_tolerance)
    if not len(reference.values) and is_sequence(run):
        return {}  # such as a counter that was first sent at the end of the first run
    if is_sequence(reference):
        return {Signal(reference.device, reference.label, '', SignalKind.STATE): held_at(
            run_s, times_s, values)}
    if _is_slow(reference):
        usual_s = round(min(period_s(reference.times_s), _MAX_PERIOD_S), 1)
        return {signal._replace(period_s=usual_s): slow_values(run_s, times_s, values)}
    gaps = data_gaps(times_s)
    value = moving_mean(_without_islands(
        known_at(run_s, times_s, values[:, np.newaxis], gaps)[:, 0]), MEAN_ROWS)
    if reference.kind.is_motion:
        return {signal: value}
    theirs = reference.values[np.isfinite(reference.values)]
    rough = roughness(times_s, values, float(np.ptp(theirs)) if len(theirs) else 0.0)
    noise = Signal(reference.device, reference.label + NOISE_SUFFIX, '', SignalKind.NOISE,
                   chance=round(math.sqrt(0.5 * period_s(reference.times_s) / ROUGH_S), 3))
    unknown = inside(run_s, gaps, ROUGH_S)
    if len(times_s) and not run_s[0] >= times_s[0] - _CUT_S:  # cut, or NaN: not known to be whole
        with np.errstate(invalid='ignore'):  # the first half second has the roughness after it
            unknown |= run_s < times_s[0] + ROUGH_S
    rough_s = np.where(unknown, np.nan, run_s)
    return {signal: value, noise: known_at(rough_s, times_s, rough[:, np.newaxis], gaps)[:, 0]}


def _without_islands(values: np.ndarray) -> np.ndarray:
    """Return values (t,) without those between two gaps that are fewer than two means need.

    A force may swing within such a time, and the mean of a part of a swing is not that of all.
    """
    known = spans(np.isfinite(values))
    for begin, end in known[1:-1]:
        if end - begin < 2 * MEAN_ROWS:
            values[begin:end] = np.nan
    return values


def _is_slow(channel: Channel) -> bool:
    return period_s(channel.times_s) > _SLOW_S or len(channel.times_s) < _FEW


def _with_means(reference: Columns, found: Columns) -> Columns:
    """Return the signals of a channel and their means over longer times."""
    means: Columns = {}
    for signal, values in found.items():
        for over_s in _OVER_S.get(signal.kind, ()):
            rows = int(over_s * RATE_HZ)
            if rows < len(values):
                means[signal._replace(over_s=over_s)] = _mean_beside(
                    reference.get(signal, values), values, rows)
    return {**found, **means}


def _mean_beside(reference: np.ndarray, values: np.ndarray, rows: int) -> np.ndarray:
    """Return the mean (n,) of the reference over some rows, plus the values' mean distance from it.

    Only rows that both have count. Where one has no data, the other one may have an edge, and the
    values beside the gap say less about the run than all that is known in the window.
    """
    result: np.ndarray = mean_of_last(reference, rows) + mean_of_last(values - reference, rows)
    return result


def usual_signals(columns: Sequence[Mapping[Signal, np.ndarray]]) -> List[Signal]:
    """Return the signals that most runs have, in order of appearance."""
    counts: Dict[Signal, int] = {}
    for it in columns:
        for signal in it:
            counts[signal] = counts.get(signal, 0) + 1
    return [signal for signal, count in counts.items() if 2 * count > len(columns)]
