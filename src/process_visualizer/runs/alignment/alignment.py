# SPDX-License-Identifier: BSD-3-Clause
"""Alignment of two runs: by their motion if both have one, else by their events."""
from __future__ import annotations

import math
from enum import Enum
from typing import Callable, Dict, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from process_visualizer.runs.alignment.motion import ToolsMotion, common_motions, moving_rows
from process_visualizer.runs.alignment.refinement import refined
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
from process_visualizer.runs.holes import motion_gaps_s
from process_visualizer.runs.run import Run, RunEvent, part_of
from process_visualizer.runs.series import (
    States,
    edits,
    inside,
    is_sequence,
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
    return None if fine is None else refined(fine, *common_motions(reference, run, _REFINED_HZ))


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
    means: AlignmentMethod
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
    if found.means is not AlignmentMethod.MOTION:
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
        is_moving |= found.means is AlignmentMethod.MOTION
        if (
            found.means is not AlignmentMethod.BEGIN
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
        if found.means is AlignmentMethod.MOTION:
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
