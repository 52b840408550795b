# SPDX-License-Identifier: BSD-3-Clause
"""Alignment of two runs: by their motion if both have one, else by their events."""
from __future__ import annotations

import math
from enum import Enum
from typing import Callable, Dict, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from process_visualizer.runs.alignment.motion import (
    ToolsMotion,
    common_motions,
    moving_rows,
    velocities,
)
from process_visualizer.runs.alignment.skipped_parts import (
    different_parts,
    skipped_parts,
    with_parts,
)
from process_visualizer.runs.alignment.slope_limited_warp import band_around, warp
from process_visualizer.runs.alignment.time_map import (
    TimeMap,
    shift,
    time_map,
)
from process_visualizer.runs.run import Run, RunEvent, part_of
from process_visualizer.runs.series import (
    States,
    edits,
    inside,
    is_sequence,
    median,
    motion_gaps_s,
    spans,
    states,
)

_MIN_ROUGH_ROWS, _MAX_ROUGH_ROWS = 50, 3000
_ROUGH_HZ, _FINE_HZ, _REFINED_HZ = 5.0, 12.5, 50.0
_FINE_REACH_S = 1.0
_EVENT_REACH_S, _EVENT_SPREAD = 1.0, 0.35
"""Search range [s] around the moment by events, and its growth per second to the next event."""
_SKIPPED = 0.02
"""Cost of a skipped row, as a share of the variance of the reference's motion."""


def motion_alignment(reference: Run, run: Run, events: CommonEvents) -> Optional[TimeMap]:
    """Return the time map by the tools' motion; None if they do not move, or not alike.

    Rough warping finds each moment, near the events if there are any; fine warping around it and a
    least-squares refinement locate it more precisely than one sample.
    """
    size_s = math.sqrt(max(reference.duration_s, 0.1) * max(run.duration_s, 0.1))
    rough_hz = min(max(_ROUGH_HZ, min(_MIN_ROUGH_ROWS / size_s, _REFINED_HZ)),
                   _MAX_ROUGH_ROWS / size_s)
    motions = common_motions(reference, run, rough_hz)
    if not _moves(motions[0]) or not _moves(motions[1]):
        return None
    rough = _warped(*motions, *_near_events(motions, events))
    if rough is None:
        return None
    fine_hz = max(_FINE_HZ, rough_hz)
    motions = common_motions(reference, run, fine_hz)
    middle = rough.to_run(motions[0].times_s) * fine_hz
    reach_s = max(_FINE_REACH_S, 3.0 / rough_hz)
    fine = _warped(*motions, middle, np.full(len(middle), reach_s * fine_hz))
    return None if fine is None else _refined(fine, *common_motions(reference, run, _REFINED_HZ))


def _moves(motion: ToolsMotion) -> bool:
    """Return whether there is a tool that moves at times."""
    return motion.positions.shape[1] > 0 and bool(moving_rows(motion).any())


def _near_events(motions: Tuple[ToolsMotion, ToolsMotion],
                 events: CommonEvents) -> Tuple[np.ndarray, np.ndarray]:
    """Return where in the run each row may be: the middle and the reach, both in rows."""
    times_s, rate_hz = motions[0].times_s, motions[0].rate_hz
    if not len(events.reference_s):
        length = len(motions[1].positions)
        return np.full(len(times_s), length / 2), np.full(len(times_s), length / 2 + 1)
    middle = time_map(events.reference_s, events.run_s).to_run(times_s)
    away_s = np.abs(times_s[:, np.newaxis] - events.reference_s).min(axis=1)
    return middle * rate_hz, (_EVENT_REACH_S + _EVENT_SPREAD * away_s) * rate_hz


def _warped(reference: ToolsMotion, run: ToolsMotion, middle: np.ndarray,
            reach: np.ndarray) -> Optional[TimeMap]:
    """Return the map through the moments at which a tool moves; time runs evenly in between."""
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


# Refinement of a time map to less than a sample, by least squares along the motion.

# Rests: where the motion of two runs does not show which moments correspond, places do.
#
# A tool leaves its rest slowly. By time alone, a longer rest would stretch the slow beginning of
# the motion after it, and tools at the same place would seem to be apart. So the moments at which
# the tools enter a small ball around the place of the rest correspond, and so do those at which
# they leave it; in the ball, time runs evenly.

_RADIUS_M = 0.002
_RADIUS_NOISES = 3.0
"""Minimum radius of the ball, in multiples of the noise; else a tool at rest would leave it."""
_BESIDE_M = 0.01
"""Maximum distance between the places at which the tools of both runs rest."""
_MIN_REST_S = 0.1
"""Minimum duration of a rest [s] in one run; else the tools pass slowly, and time runs evenly."""
_APART_S = 0.04
"""Minimum spacing of the points of a map [s], so that its slope is that of the motion."""


class _Stay(NamedTuple):
    """A stay: the rows of a motion at which the tools enter the ball and leave it."""

    begin: float
    end: float


def _with_rests(
    found: TimeMap, is_known: np.ndarray, reference: ToolsMotion, run: ToolsMotion
) -> TimeMap:
    """Return the map, with points at the beginning and the end of each rest.

    Args:
        found: a point for each of several consecutive rows of the run.
        is_known: (n,) for these points: whether the motion shows the time there.
        reference, run: motions at the same rate.
    """
    known = np.flatnonzero(is_known)
    if not len(known):
        return found
    corners, run_corners = (
        _with_ends(motion, np.rint(times_s[known] * motion.rate_hz).astype(np.int64))
        for motion, times_s in ((reference, found.reference_s), (run, found.run_s)))
    points: List[Tuple[float, float]] = []
    for rows, run_rows in zip(zip(corners, corners[1:]), zip(run_corners, run_corners[1:])):
        if min(rows[1] - rows[0], run_rows[1] - run_rows[0]) > _APART_S * run.rate_hz:
            points += _rest(reference, run, rows, run_rows)
    both = np.vstack([np.column_stack([found.reference_s[known], found.run_s[known]]),
                      np.array(points).reshape(-1, 2)])
    return TimeMap(*both[np.lexsort((both[:, 0], both[:, 1]))].T)


def _with_ends(motion: ToolsMotion, rows: np.ndarray) -> List[int]:
    """Return the rows, with the first and last fully known ones before and after them."""
    whole = np.flatnonzero(np.isfinite(motion.positions).all(axis=1))
    ends = (whole[0], whole[-1]) if len(whole) else (rows[0], rows[-1])
    return [int(ends[0]), *rows.tolist(), int(ends[1])]


def _rest(reference: ToolsMotion, run: ToolsMotion, rows: Tuple[int, int],
          run_rows: Tuple[int, int]) -> List[Tuple[float, float]]:
    """Return the points [s] of the longest rest in a stretch of both motions; empty without one."""
    parts = (reference.positions[rows[0]:rows[1] + 1], run.positions[run_rows[0]:run_rows[1] + 1])
    if not all(np.isfinite(part).all() for part in parts):
        return []
    radius_m = max(_RADIUS_M, _RADIUS_NOISES * max(map(_noise_m, parts)))
    stillest = [_stillest(part) for part in parts]
    places = [part[row] for part, row in zip(parts, stillest)]
    stays = [_stay(part, place, radius_m) for part, place in zip(parts, places)]
    longer = int(stays[1].end - stays[1].begin > stays[0].end - stays[0].begin)
    if stays[longer].end - stays[longer].begin < _MIN_REST_S * run.rate_hz:
        return []
    other = parts[1 - longer]
    is_beside = np.linalg.norm(places[0] - places[1]) <= _BESIDE_M
    nearest = stillest[1 - longer] if is_beside else \
        int(np.linalg.norm(other - places[longer], axis=1).argmin())
    stay = _stay(other, other[nearest], radius_m)
    in_run, there = (stays[1], stay) if longer else (stay, stays[0])
    apart = _APART_S * run.rate_hz
    found = []
    for row, run_row in ((there.begin, in_run.begin), (there.end, in_run.end)):
        inside = (apart <= row <= len(parts[0]) - 1 - apart
                  and apart <= run_row <= len(parts[1]) - 1 - apart)
        if inside:
            found.append(((rows[0] + row) / reference.rate_hz,
                          (run_rows[0] + run_row) / run.rate_hz))
    return found


def _stillest(part: np.ndarray) -> int:
    """Return the row in the middle of the window in which the tools move least."""
    size = min(5, len(part) - 1)
    return int(np.linalg.norm(part[size:] - part[:-size], axis=1).argmin()) + size // 2


def _noise_m(part: np.ndarray) -> float:
    """Return the scatter of positions [m] from second differences, which hardly show motion."""
    if len(part) < 3:
        return 0.0
    away_m = np.linalg.norm(part[2:] - 2.0 * part[1:-1] + part[:-2], axis=1)
    return median(away_m) / math.sqrt(6.0)


def _stay(part: np.ndarray, place: np.ndarray, radius_m: float) -> _Stay:
    """Return the stay around the row that is nearest to the place."""
    away_m = np.linalg.norm(part - place, axis=1)
    nearest = int(away_m.argmin())
    radius_m += away_m[nearest]
    outside = np.flatnonzero(away_m > radius_m)
    before, behind = outside[outside < nearest], outside[outside > nearest]

    def crossing(row: int, inner: int) -> float:
        share = (away_m[row] - radius_m) / (away_m[row] - away_m[inner])
        return float(row + share * (inner - row))

    return _Stay(crossing(before[-1], before[-1] + 1) if len(before) else 0.0,
                 crossing(behind[0], behind[0] - 1) if len(behind) else len(part) - 1.0)


_ROUNDS, _FIRST_ROUNDS, _PARTS = 6, 3, 8
_WINDOW_S = 0.2
_MIN_M, _LITTLE, _CONTRADICTS_M = 1e-4, 1e-3, 2e-4
_FURTHEST_S = 0.1
"""Maximum shift of a moment in one round [s]."""


def _refined(rough: TimeMap, reference: ToolsMotion, run: ToolsMotion) -> TimeMap:
    """Return a map by which the tools of the run lie where the reference's do.

    Only the shift along the direction of motion is used: the distance of a tool from its path says
    nothing about time. A constant offset of a tool says nothing either; it is what is left when
    shifts have explained all that they can.
    """
    times_s = run.times_s
    inside = (times_s >= rough.run_s[0]) & (times_s <= rough.run_s[-1])
    run_s, positions = times_s[inside], run.positions[inside]
    if len(run_s) < 3:
        return rough
    found_s = rough.to_reference(run_s)
    velocity, moves = velocities(reference), moving_rows(reference)
    for number in range(_ROUNDS):
        shift_s, weight = _shift_s(reference, velocity, moves, found_s, positions,
                                   number >= _FIRST_ROUNDS)
        moved_s = found_s + np.clip(shift_s, -_FURTHEST_S, _FURTHEST_S)
        found_s = np.maximum.accumulate(_smooth(run_s, moved_s, weight, found_s))
    return _with_rests(time_map(found_s, run_s), weight > 0.0, reference, run)


def _shift_s(reference: ToolsMotion, velocity: np.ndarray, moves: np.ndarray, found_s: np.ndarray,
             positions: np.ndarray, has_offset: bool) -> Tuple[np.ndarray, np.ndarray]:
    """Return the shift (n,) [s] of each moment of the run in the reference, and weights (n,)."""
    there, speed = (_at(found_s, reference, values) for values in (reference.positions, velocity))
    difference = positions - there
    known = np.isfinite(difference) & np.isfinite(speed)
    difference, speed = np.where(known, difference, 0.0), np.where(known, speed, 0.0)
    nearest = np.rint(found_s * reference.rate_hz).astype(np.int64)
    moving = moves[np.clip(nearest, 0, len(moves) - 1)]
    weight = (speed * speed).sum(axis=1) * moving
    moving &= weight > 0.0
    if has_offset and moving.any():
        difference = difference - _offset(difference[moving], speed[moving])
    along = (speed * difference).sum(axis=1)
    return np.where(moving, along / np.where(moving, weight, 1.0), 0.0), weight


def _at(times_s: np.ndarray, motion: ToolsMotion, values: np.ndarray) -> np.ndarray:
    place = np.clip(times_s * motion.rate_hz, 0.0, len(values) - 1.0)
    row = np.minimum(place.astype(np.int64), len(values) - 2)
    share = (place - row)[:, np.newaxis]
    result: np.ndarray = values[row] * (1.0 - share) + values[row + 1] * share
    return result


def _offset(difference: np.ndarray, velocity: np.ndarray) -> np.ndarray:
    """Return the constant offset (d,) of the tools; a deviation that came later is not one.

    Only components beside the path count, as along the path they may come from time. If a part of
    the motion contradicts, the offset is what all parts have in common, which is less.
    """
    offset = _beside_the_path(difference, velocity)
    for part, speed in zip(*(np.array_split(it, min(_PARTS, len(difference)))
                             for it in (difference, velocity))):
        before_m, after_m = (median(_beside(it, speed)) for it in (part, part - offset))
        if after_m > before_m + _CONTRADICTS_M:
            return _common_offset(difference)
    return offset


def _beside(difference: np.ndarray, velocity: np.ndarray) -> np.ndarray:
    """Return how far (n,) [m] differences (n, d) are beside the path."""
    along = (difference * velocity).sum(axis=1) / np.square(velocity).sum(axis=1)
    result: np.ndarray = np.linalg.norm(difference - along[:, np.newaxis] * velocity, axis=1)
    return result


def _beside_the_path(difference: np.ndarray, velocity: np.ndarray) -> np.ndarray:
    """Return the offset (d,) that explains most beside the path; few outliers count little.

    Least squares with weights renewed three times approximate least distances.
    """
    direction = velocity / np.linalg.norm(velocity, axis=1)[:, np.newaxis]
    size = difference.shape[1]
    offset = np.zeros(size)
    for _ in range(3):
        weight = 1.0 / np.maximum(_beside(difference - offset, velocity), _MIN_M)
        along = (difference * direction).sum(axis=1)[:, np.newaxis]
        beside = difference - along * direction
        matrix = weight.sum() * np.eye(size) - (weight[:, np.newaxis] * direction).T @ direction
        offset = np.linalg.solve(matrix + _LITTLE * weight.sum() * np.eye(size),
                                 (weight[:, np.newaxis] * beside).sum(axis=0))
    return offset


def _common_offset(difference: np.ndarray) -> np.ndarray:
    parts = np.array_split(difference, min(_PARTS, len(difference)))
    medians = np.stack([np.median(part, axis=0) for part in parts])
    low, high = medians.min(axis=0), medians.max(axis=0)
    result: np.ndarray = np.where(low > 0.0, low, np.where(high < 0.0, high, 0.0))
    return result


def _smooth(run_s: np.ndarray, values_s: np.ndarray, weight: np.ndarray,
            otherwise_s: np.ndarray) -> np.ndarray:
    """Return values (n,), each on the weighted straight line through those in a window around it.

    Where nothing has weight, values are interpolated linearly.
    """
    here = np.arange(len(run_s))
    reach = int(round(0.5 * _WINDOW_S / (run_s[1] - run_s[0])))
    begin, end = np.maximum(here - reach, 0), np.minimum(here + reach + 1, len(here))
    away_s = values_s - run_s  # small numbers, for the precision of running sums
    sums = [_window_sums(weight * it, begin, end) for it in (
        np.ones(len(here)), here, here * here, away_s, here * away_s)]
    count, first, second, value, cross = sums
    spread = count * second - first * first
    known = (weight > 0.0) & (spread > 1e-6 * count * count)
    slope = (count * cross - first * value) / np.where(known, spread, 1.0)
    smooth = (value - slope * first) / np.where(known, count, 1.0) + slope * here
    if np.count_nonzero(known) < 2:
        return otherwise_s
    result: np.ndarray = run_s + np.interp(here, here[known], smooth[known])
    return result


def _window_sums(values: np.ndarray, begin: np.ndarray, end: np.ndarray) -> np.ndarray:
    total = np.concatenate(([0.0], np.cumsum(values)))
    result: np.ndarray = total[end] - total[begin]
    return result


# The events that two runs have in common, as points of a map of time.

class CommonEvents(NamedTuple):
    """Times [s] (k,) of the same events in both runs, both ascending, and notes on others."""

    reference_s: np.ndarray
    run_s: np.ndarray
    notes: Tuple[str, ...] = ()


def common_events(reference: Sequence[RunEvent], run: Sequence[RunEvent]) -> CommonEvents:
    """Return the events that both runs have equally often and in the same order.

    A mark that an operator set in only one of them is not an event that the other one lacks.
    """
    first, second = _by_name(reference), _by_name(run)
    marks = {it.name for it in (*reference, *run) if it.is_mark}
    notes, pairs = [], []
    for name in sorted(set(first) | set(second)):
        mine, others = first.get(name, []), second.get(name, [])
        if len(mine) == len(others):
            pairs += list(zip(mine, others))
        elif name not in marks:
            here = f'{_times(len(others))} here' if others else 'not here'
            there = f'{_times(len(mine))} in' if mine else 'not in'
            notes.append(f'the event "{name}" occurs {there} the reference, but {here}; it is '
                         'ignored' if mine else f'the event "{name}" occurs {here}, but {there} '
                         'the reference; it is ignored')
    pairs.sort()
    kept = _longest_rising([it[1] for it in pairs])
    if len(kept) < len(pairs):
        notes.append(f'{len(pairs) - len(kept)} of {len(pairs)} events occur in a different order '
                     'than in the reference; they are ignored')
    chosen = np.array([pairs[row] for row in kept], float).reshape(-1, 2)
    return CommonEvents(chosen[:, 0], chosen[:, 1], tuple(notes))


def _by_name(events: Sequence[RunEvent]) -> Dict[str, List[float]]:
    found: Dict[str, List[float]] = {}
    for event in sorted(events, key=lambda it: it.time_s):
        found.setdefault(event.name, []).append(event.time_s)
    return found


def _times(count: int) -> str:
    return {0: 'never', 1: 'once', 2: 'twice'}.get(count, f'{count} times')


def _longest_rising(values: Sequence[float]) -> List[int]:
    """Return the indices of a longest subsequence that does not fall."""
    length, before = [1] * len(values), [-1] * len(values)
    for here, value in enumerate(values):
        for earlier in range(here):
            if values[earlier] <= value and length[earlier] + 1 > length[here]:
                length[here], before[here] = length[earlier] + 1, earlier
    place = int(np.argmax(length)) if values else -1
    found = []
    while place >= 0:
        found.append(place)
        place = before[place]
    return found[::-1]


class AlignmentMethod(Enum):
    """The basis of an alignment of two runs."""

    MOTION = 'the motion of the tools'
    EVENTS = 'their events'
    STATES = 'their states'
    ANCHORS = 'moments that the operator has set'
    BEGIN = 'their start'


class Alignment(NamedTuple):
    """A map between moments of a run and of the reference, and notes on what could not be used."""

    time_map: TimeMap
    method: AlignmentMethod
    notes: Tuple[str, ...] = ()


def aligned(reference: Run, run: Run) -> Alignment:
    """Return the alignment of a run with a reference; the judged signals do not influence it."""
    events = _dated_events(reference, run)
    by_motion = motion_alignment(reference, run, events)
    if by_motion is not None:
        return Alignment(by_motion, AlignmentMethod.MOTION, events.notes)
    if len(events.reference_s):
        return Alignment(
            time_map(events.reference_s, events.run_s), AlignmentMethod.EVENTS, events.notes
        )
    return Alignment(shift(0.0), AlignmentMethod.BEGIN, events.notes)


_MIN_GAP_S, _AFTER_GAP_S = 0.3, 0.1


def _dated_events(reference: Run, run: Run) -> CommonEvents:
    """Return the common events without those in gaps, which may have happened long before.

    A threshold that was passed in a gap is noticed with the first message after it.
    """
    events = common_events(reference.events, run.events)
    is_dated = ~(_in_gaps(reference, events.reference_s) | _in_gaps(run, events.run_s))
    return events._replace(reference_s=events.reference_s[is_dated], run_s=events.run_s[is_dated])


def _in_gaps(run: Run, times_s: np.ndarray) -> np.ndarray:
    """Return which times (n,) are in a gap of the motion of all tools, or just after one."""
    found = np.zeros(len(times_s), bool)
    gaps = motion_gaps_s(run)
    if gaps and len(times_s):
        found[:] = np.logical_and.reduce([inside(times_s, np.column_stack((
            it[:, 0], it[:, 1] + _AFTER_GAP_S))[it[:, 1] - it[:, 0] >= _MIN_GAP_S]) for it in gaps])
    return found


# Moments of two runs that correspond because the operator says so.

_MIN_APART_S = 0.05


class Anchor(NamedTuple):
    """A moment of the reference, and the corresponding one of the run [s]."""

    reference_s: float
    run_s: float


def with_anchor(anchors: Sequence[Anchor], added: Anchor) -> Tuple[Anchor, ...]:
    """Return anchors with one more, in order of time; those that contradict it are left out."""
    kept = [it for it in anchors
            if (it.reference_s - added.reference_s) * (it.run_s - added.run_s) > 0.0
            and min(abs(it.reference_s - added.reference_s),
                    abs(it.run_s - added.run_s)) >= _MIN_APART_S]
    return tuple(sorted([*kept, added]))


def aligned_at(reference: Run, run: Run, anchors: Sequence[Anchor]) -> Alignment:
    """Return the alignment through anchors; the parts between them are aligned by themselves.

    Args:
        reference, run: to align.
        anchors: ascending in both times, as from ``with_anchor``.
    """
    found = _joined(reference, run, anchors, _aligned_in_parts) if anchors \
        else _aligned_in_parts(reference, run)
    if found.method is not AlignmentMethod.MOTION:
        return found
    return found._replace(time_map=_with_states(reference, run, found.time_map))


def _aligned_in_parts(reference: Run, run: Run) -> Alignment:
    """Return the alignment; a part that only one of the runs has is kept apart."""
    found = aligned(reference, run)
    if not reference.motions or not run.motions:
        return found
    parts = skipped_parts(reference, run, found.time_map)
    anchors = [Anchor(*it) for it in with_parts([], parts)
               if 0.0 < it[0] < reference.duration_s and 0.0 < it[1] < run.duration_s]
    return _joined(reference, run, anchors, aligned) if anchors else found


def _joined(reference: Run, run: Run, anchors: Sequence[Anchor],
            align: Callable[[Run, Run], Alignment]) -> Alignment:
    corners = [Anchor(0.0, 0.0), *anchors, Anchor(reference.duration_s, run.duration_s)]
    points, is_moving = list(anchors), False
    for begin, end in zip(corners, corners[1:]):
        found = align(part_of(reference, begin.reference_s, end.reference_s, reference.name),
                      part_of(run, begin.run_s, end.run_s, run.name))
        is_moving |= found.method is AlignmentMethod.MOTION
        if (
            found.method is not AlignmentMethod.BEGIN
        ):  # the beginning of a part is an anchor already, or gives no information
            points += _inside(found, begin, end)
    points.sort()
    alignment = time_map(*np.array(points, float).T)
    notes = common_events(reference.events, run.events).notes
    return Alignment(
        alignment, AlignmentMethod.MOTION if is_moving else AlignmentMethod.ANCHORS, notes
    )


def _inside(found: Alignment, begin: Anchor, end: Anchor) -> List[Anchor]:
    """Return the points of a part's map that contradict neither corner."""
    reference_s = found.time_map.reference_s + begin.reference_s
    run_s = found.time_map.run_s + begin.run_s
    kept = ((reference_s > begin.reference_s) & (reference_s < end.reference_s)
            & (run_s > begin.run_s) & (run_s < end.run_s))
    return [Anchor(*it) for it in zip(reference_s[kept].tolist(), run_s[kept].tolist())]


_Pair = Tuple[float, float]
_MIN_COMMON, _ALIKE = 4, 0.6
_SAME_PLACE_M = 0.02
_MIN_LOST_S, _BETWEEN_S = 0.15, 0.01
"""Minimum change of a rest's duration; a smaller one may come from the pace alone."""


def aligned_by_states(reference: Run, run: Run) -> Optional[Alignment]:
    """Return the alignment by the beginnings of states and events; None if they are too few.

    The path to another place is different, so the motion does not show which moments correspond.
    Where one of the runs has extra states, the clock of the other stops.
    """
    orders = _common_orders(reference, run)
    if orders is None:
        return None
    mine, other, found = orders
    events = common_events(reference.events, run.events)
    corners = [pair for part in different_parts(mine, other, reference.duration_s, run.duration_s)
               for pair in zip(part.reference_s, part.run_s)]
    rising: List[_Pair] = []
    for pair in sorted([*found, *corners,
                        *zip(events.reference_s.tolist(), events.run_s.tolist())]):
        if not rising or _is_between(pair, rising[-1], None):
            rising.append(pair)
    found_map = time_map(*np.array(_with_common_motion(reference, run, rising)).T)
    return Alignment(_with_states(reference, run, found_map), AlignmentMethod.STATES, events.notes)


def _with_common_motion(reference: Run, run: Run, corners: List[_Pair]) -> List[_Pair]:
    """Return the corners; where the tools go the same way, with moments by the motion instead."""
    mine, theirs = common_motions(reference, run, _REFINED_HZ)
    rows = [np.clip(np.rint(_REFINED_HZ * np.array(times_s)).astype(int), 0, len(it.positions) - 1)
            for it, times_s in zip((mine, theirs), zip(*corners))]
    away_m = np.abs(mine.positions[rows[0]] - theirs.positions[rows[1]]).max(axis=1, initial=0.0)
    points = corners
    for begin, end in spans(away_m < _SAME_PLACE_M):
        first, last = corners[begin], corners[end - 1]
        if first == last:
            continue
        found = aligned(part_of(reference, first[0], last[0], ''),
                        part_of(run, first[1], last[1], ''))
        if found.method is AlignmentMethod.MOTION:
            inner = zip((found.time_map.reference_s + first[0]).tolist(),
                        (found.time_map.run_s + first[1]).tolist())
            points = [it for it in points if not first < it < last]
            points += [it for it in inner if _is_between(it, first, last)]
    return sorted(points)


def _with_states(reference: Run, run: Run, found: TimeMap) -> TimeMap:
    """Return the map, with moments of states and events in rests that are longer or shorter.

    In a rest, the motion does not show the time. The rest's beginning and end are enough, unless
    the process waited there: then states show the time within the rest. Before the first and after
    the last motion, events do.
    """
    orders = _common_orders(reference, run)
    events = _dated_events(reference, run)
    at_events = list(zip(events.reference_s.tolist(), events.run_s.tolist()))
    points = list(zip(found.reference_s.tolist(), found.run_s.tolist()))
    begin = next((it for it in at_events if _is_between(it, None, points[0])), None)
    end = next((it for it in at_events[::-1] if _is_between(it, points[-1], None)), None)
    corners = [*([begin] if begin else []), *points, *([end] if end else [])]
    moments = sorted([*at_events, *(orders[2] if orders else [])])
    added: List[_Pair] = []
    for first, last in zip(corners, corners[1:]):
        if abs((last[1] - first[1]) - (last[0] - first[0])) < _MIN_LOST_S:
            continue
        rest = [first]
        for it in moments:
            if _is_between(it, rest[-1], last):
                rest.append(it)
        added += [*rest, last]
    return time_map(*np.array(sorted({*points, *added})).T) if added else found


def _is_between(pair: _Pair, first: Optional[_Pair], last: Optional[_Pair]) -> bool:
    return all((first is None or pair[row] > first[row] + _BETWEEN_S)
               and (last is None or pair[row] < last[row] - _BETWEEN_S) for row in (0, 1))


def _common_orders(reference: Run, run: Run) -> Optional[Tuple[States, States, List[_Pair]]]:
    """Return the states of the channel with most in common, and when these begin [s of both]."""
    theirs = run.by_key
    best: Optional[Tuple[States, States, List[_Pair]]] = None
    for channel in reference.channels:
        if channel.key in theirs and is_sequence(channel) and is_sequence(theirs[channel.key]):
            mine, other = states(channel), states(theirs[channel.key])
            found = _common(mine, other)
            if len(found) >= _MIN_COMMON and (best is None or len(found) > len(best[2])):
                best = mine, other, found
    return best


def _common(mine: States, other: States) -> List[_Pair]:
    """Return when states begin [s of both] that both have in the same order; empty if few."""
    found = [pair for what, i, j, k, m in edits(mine.values, other.values) if what == 'equal'
             for pair in zip(mine.since_s[i:j], other.since_s[k:m])]
    if len(found) < _ALIKE * max(len(mine.values), len(other.values)):
        return []
    return [it for it in found if it[0] > 0.0 and it[1] > 0.0]
