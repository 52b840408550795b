# SPDX-License-Identifier: BSD-3-Clause
"""Parts of the process that only one of two runs has: a missing step, or one that comes twice.

A clock that only runs faster or slower would spread such a part over its surroundings. So the clock
of the other run stops there.
"""
from __future__ import annotations

from typing import List, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from process_visualizer.runs.alignment.motion import ToolsMotion, common_motions
from process_visualizer.runs.alignment.time_map import TimeMap
from process_visualizer.runs.run import Run
from process_visualizer.runs.series import States, edits, is_sequence, states

_STANDS_STILL_S = 0.02
"""Duration of a standstill [s]: as short as the steps of the comparison, with no moment between."""
_MIN_S, _EXPLAINED = 0.3, 0.6
"""Minimum duration of a part named by states, and the share of it that must be lost around it.

A part below these limits comes from a wrong message.
"""
_MAX_STATES, _MIN_STATES = 1000, 3
_ROUGH_HZ, _MAX_ROWS = 5.0, 1500
_UNLIKE = 0.02
"""Mean square distance, as a share of the motion's variance, from which parts are looked for."""
_COSTS, _LATER = 1.0, 0.3
"""Cost of a skipped part, as the same share; the second number is the discount for a late part."""
_MAX_STEP, _MAX_LONGER = 3, 3.0
_FREE_S = 3.0
_EXACT_HZ, _SLIDE_S, _MAX_SLIDE_S, _AROUND_S, _SHIFT_ROWS = 50.0, 0.8, 5.0, 0.8, 30
_NEAR_ROWS, _STILL_M = 15, 1e-4
_ALIKE_M, _ALIKE_S, _REST_S = 0.002, 0.3, 0.8
"""Tools that are this near for this long are at the same place."""


class SkippedPart(NamedTuple):
    """Corresponding moments [s] before and after the part; one of the clocks stops."""

    reference_s: Tuple[float, float]
    run_s: Tuple[float, float]


def skipped_parts(reference: Run, run: Run, rough: TimeMap) -> List[SkippedPart]:
    """Return the parts that only one of two runs has, by their states, or else by the motion.

    Args:
        reference, run: the two that are compared.
        rough: the time map without such parts.
    """
    return _by_states(reference, run, rough) or _by_motion(reference, run, rough)


def _by_states(reference: Run, run: Run, rough: TimeMap) -> List[SkippedPart]:
    theirs = run.by_key
    pairs = [(states(it), states(theirs[it.key])) for it in reference.channels
             if it.key in theirs and is_sequence(it) and is_sequence(theirs[it.key])]
    pairs = [it for it in pairs if it[0].values != it[1].values
             and len(it[0].values) >= _MIN_STATES
             and max(len(order.values) for order in it) <= _MAX_STATES]
    for mine, other in sorted(pairs, key=lambda it: -len(it[0].values)):
        found = different_parts(mine, other, reference.duration_s, run.duration_s)
        kept = [it for it in found if _is_explained(it, rough, reference, run)]
        if kept:
            return kept
    return []


def different_parts(mine: States, other: States, reference_end_s: float,
                    run_end_s: float) -> List[SkippedPart]:
    """Return the parts in which one of two orders has extra states."""
    mine_s, other_s = [*mine.since_s, reference_end_s], [*other.since_s, run_end_s]
    found = []
    for what, i, j, k, m in edits(mine.values, other.values):
        if what == 'insert' and i > 0:
            moment_s, part_s = _extra_states_s(mine_s, i, other_s, (k, m),
                                               other.values[k - 1] == other.values[m - 1])
            found.append(SkippedPart(_still(moment_s), part_s))
        elif what == 'delete' and k > 0:
            moment_s, part_s = _extra_states_s(other_s, k, mine_s, (i, j),
                                               mine.values[i - 1] == mine.values[j - 1])
            found.append(SkippedPart(part_s, _still(moment_s)))
    return found


def _extra_states_s(shorter_s: Sequence[float], row: int, longer_s: Sequence[float],
                    rows: Tuple[int, int], goes_on: bool) -> Tuple[float, Tuple[float, float]]:
    """Return when extra states come, in the order without them and in the one with them.

    A state that continues after them was interrupted: by then it had lasted for a while, and the
    rest of it comes last.
    """
    begin, end = rows
    if not goes_on:
        return shorter_s[row], (longer_s[begin], longer_s[end])
    took_s = shorter_s[row] - shorter_s[row - 1]
    before_s = min(longer_s[begin] - longer_s[begin - 1], took_s)
    end_s = max(longer_s[end] - (took_s - before_s), longer_s[end - 1])
    return shorter_s[row - 1] + before_s, (longer_s[begin], end_s)


def _still(time_s: float) -> Tuple[float, float]:
    step = round(time_s / _STANDS_STILL_S)
    return (step - 1) * _STANDS_STILL_S, step * _STANDS_STILL_S


def _is_explained(part: SkippedPart, rough: TimeMap, reference: Run, run: Run) -> bool:
    """Return whether about as much time was lost or gained around a part as it takes."""
    lost_s = float(np.ptp(part.run_s) - np.ptp(part.reference_s))
    if abs(lost_s) < _MIN_S:
        return False
    begin_s, end_s = (part.reference_s[0] - abs(lost_s) - 1.0,
                      part.reference_s[1] + abs(lost_s) + 1.0)
    run_begin_s, run_end_s = rough.to_run(np.array([begin_s, end_s]))
    if begin_s <= 0.0:  # the ends correspond, whatever is skipped there
        begin_s = run_begin_s = 0.0
    if end_s >= reference.duration_s:
        end_s, run_end_s = reference.duration_s, run.duration_s
    return bool((run_end_s - run_begin_s - end_s + begin_s) / lost_s > _EXPLAINED)


def _by_motion(reference: Run, run: Run, rough: TimeMap) -> List[SkippedPart]:
    shorter_s, longer_s = sorted((reference.duration_s, run.duration_s))
    if longer_s > _MAX_LONGER * shorter_s:
        return []
    rate_hz = min(_ROUGH_HZ, _MAX_ROWS / max(longer_s, 1.0))
    mine, theirs = common_motions(reference, run, rate_hz)
    spread = float(np.nansum(np.nanvar(mine.positions, axis=0))) if len(mine.positions) else 0.0
    if not spread > 0.0 or _unlike(mine, theirs, rough) < _UNLIKE * spread:
        return []
    found = _jump(mine, theirs, _COSTS * spread)
    other = _jump(theirs, mine, _COSTS * spread)
    if found is None and other is None:
        return []
    if other is None or (found is not None and found[0] <= other[0]):
        assert found is not None
        moment_s, part_s = _exact(reference, run, *(it / rate_hz for it in (found[1], *found[2])))
        return [SkippedPart(_still(moment_s), part_s)]
    moment_s, part_s = _exact(run, reference, *(it / rate_hz for it in (other[1], *other[2])))
    return [SkippedPart(part_s, _still(moment_s))]


def _exact(shorter: Run, longer: Run, moment_s: float, begin_s: float,
           end_s: float) -> Tuple[float, Tuple[float, float]]:
    """Return the exact moment at which a part is skipped, and the part in the longer run.

    Before the moment, both go the same way; after it, the shorter run goes as the longer one does
    after the part. This may hold for a range of moments, such as where a tool hardly moves, or
    where either of two repetitions may be the extra one. Then the last rest in the range is chosen:
    until then nothing is wrong.
    """
    mine, theirs = common_motions(shorter, longer, _EXACT_HZ)
    took_s = end_s - begin_s
    slides = np.arange(-int(_SLIDE_S * _EXACT_HZ), int(min(_SLIDE_S + took_s, _MAX_SLIDE_S)
                                                       * _EXACT_HZ) + 1)
    rows = np.arange(slides[0] - int(_AROUND_S * _EXACT_HZ),
                     slides[-1] + int(_AROUND_S * _EXACT_HZ) + 1)
    here = _at(mine, moment_s, rows)
    shifts = np.arange(-_SHIFT_ROWS, _SHIFT_ROWS + 1, 2)
    before, behind = (np.stack([np.square(np.nan_to_num(here - _at(theirs, at_s, rows + it))).sum(
        axis=1) for it in shifts]) for at_s in (begin_s, end_s))
    until = np.cumsum(before, axis=1)[:, slides - rows[0]]
    since = np.cumsum(behind[:, ::-1], axis=1)[:, ::-1][:, slides - rows[0]]
    costs = until[:, np.newaxis] + since
    least = costs.min(axis=2)
    first, second = np.unravel_index(int(least.argmin()), least.shape)
    alike = least[first, second] + _ALIKE_M ** 2 * _ALIKE_S * _EXACT_HZ
    likely = slides[costs[first, second] <= alike]
    last = likely[likely > likely[-1] - _REST_S * _EXACT_HZ]
    slide_s = _slowest_s(mine, moment_s, last)
    near = np.arange(-_NEAR_ROWS, _NEAR_ROWS + 1)
    begin_s, end_s = (at_s + slide_s + int(shifts[row]) / _EXACT_HZ
                      for at_s, row in ((begin_s, first), (end_s, second)))
    return (moment_s + slide_s, (begin_s + _slowest_s(theirs, begin_s, near),
                                 end_s + _slowest_s(theirs, end_s, near)))


def _slowest_s(motion: ToolsMotion, time_s: float, rows: np.ndarray) -> float:
    """Return how long after a time [s] the tools are slowest, among rows counted from it."""
    way = _at(motion, time_s, rows + 2) - _at(motion, time_s, rows - 2)
    slow = np.nan_to_num(np.square(way).sum(axis=1))
    alike = rows[slow <= slow.min() + _STILL_M ** 2]
    return float(alike[int(np.abs(alike - np.median(rows)).argmin())]) / motion.rate_hz


def _at(motion: ToolsMotion, time_s: float, rows: np.ndarray) -> np.ndarray:
    """Return the positions at rows counted from a time; beyond the ends, the first or last one."""
    at = np.clip(round(time_s * motion.rate_hz) + rows, 0, len(motion.positions) - 1)
    result: np.ndarray = motion.positions[at]
    return result


def _unlike(reference: ToolsMotion, run: ToolsMotion, rough: TimeMap) -> float:
    """Return the mean square distance [m^2] of the tools at corresponding moments."""
    at = rough.to_run(reference.times_s) * run.rate_hz
    inside = (at >= 0.0) & (at <= len(run.positions) - 1)
    if not inside.any():
        return 0.0
    rows = np.arange(len(run.positions))
    there = np.column_stack([np.interp(at[inside], rows, it) for it in run.positions.T])
    away = there - reference.positions[inside]
    square = np.nansum(away * away, axis=1)
    return float(square.mean())


def _jump(reference: ToolsMotion, run: ToolsMotion,
          costs: float) -> Optional[Tuple[float, int, Tuple[int, int]]]:
    """Return the cheapest way through both that skips a part of the run; None if it costs more.

    The result is its cost, the row of the reference, and the rows of the run before and after the
    part.
    """
    away = np.nan_to_num(reference.positions[:, np.newaxis, :] - run.positions, nan=0.0)
    distance: np.ndarray = np.einsum('ijk,ijk->ij', away, away)
    count, width = distance.shape
    free = int(_FREE_S * reference.rate_hz)
    columns = np.arange(width)
    begins = np.where(columns <= free, 0.0, np.inf)
    ends = np.where(columns >= width - 1 - free, 0.0, np.inf)
    plain, jumped = begins + distance[0], np.full(width, np.inf)
    before = np.full(width, np.inf), np.full(width, np.inf)
    where = np.zeros((width, 3), np.int64)  # row, column before, column after
    where_before = where
    for row in range(1, count):
        here = distance[row]
        price = costs * (1.0 - _LATER * row / count)
        low = np.minimum.accumulate(plain)
        is_new = np.concatenate(([True], low[1:] < low[:-1]))
        lowest = np.maximum.accumulate(np.where(is_new, columns, 0))  # its column
        enter = _moved(low, _MAX_STEP + 1) + price
        next_plain, _ = _stepped(plain, before[0], distance, row)
        next_jumped, came = _stepped(jumped, before[1], distance, row)
        next_where = np.where((came == 2)[:, np.newaxis], _rows_moved(where_before, 1),
                              np.where((came == 1)[:, np.newaxis], _rows_moved(where, 2),
                                       _rows_moved(where, 1)))
        is_now = enter <= next_jumped
        origin = _moved(lowest.astype(float), _MAX_STEP + 1)
        now = np.column_stack((np.full(width, row), np.nan_to_num(origin, posinf=0.0), columns))
        next_where = np.where(is_now[:, np.newaxis], now.astype(np.int64), next_where)
        next_jumped = np.minimum(enter, next_jumped)
        before, where_before = (plain, jumped), where
        plain, jumped, where = next_plain + here, next_jumped + here, next_where
    plain, jumped = plain + ends, jumped + ends
    best = int(jumped.argmin())
    if not jumped[best] < plain.min():
        return None
    row, first, behind = (int(it) for it in where[best])
    return float(jumped[best]), row, (first, behind)


def _stepped(total: np.ndarray, before: np.ndarray, distance: np.ndarray,
             row: int) -> Tuple[np.ndarray, np.ndarray]:
    """Return the cost of each column of a row by the best even step, and that step."""
    candidates = np.stack((_moved(total, 1), _moved(total, 2),
                           _moved(before, 1) + distance[row - 1]))
    came = candidates.argmin(axis=0)
    return candidates[came, np.arange(len(total))], came


def _moved(values: np.ndarray, columns: int) -> np.ndarray:
    result = np.full(len(values), np.inf)
    result[columns:] = values[:-columns]
    return result


def _rows_moved(values: np.ndarray, columns: int) -> np.ndarray:
    result = np.zeros_like(values)
    result[columns:] = values[:-columns]
    return result


def with_parts(found: Sequence[Tuple[float, float]],
               parts: Sequence[SkippedPart]) -> List[Tuple[float, float]]:
    """Return corresponding moments, with those of parts that contradict none of them."""
    kept = sorted(found)
    for part in parts:
        pairs = list(zip(part.reference_s, part.run_s))
        if all((one[0] - other[0]) * (one[1] - other[1]) > 0.0 for one in pairs for other in kept):
            kept = sorted([*kept, *pairs])
    return kept
