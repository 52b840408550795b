# SPDX-License-Identifier: BSD-3-Clause
"""Refinement of a time map to less than a sample, by least squares along the motion."""
from __future__ import annotations

import math
from typing import List, NamedTuple, Tuple

import numpy as np

from process_visualizer.runs.alignment.motion import ToolsMotion, moving_rows, velocities
from process_visualizer.runs.alignment.time_map import TimeMap, time_map
from process_visualizer.runs.series import median

# Rests: where the motion of two runs does not show which moments correspond, places do.
#
# A tool leaves its rest slowly. By time alone, a longer rest would stretch the slow beginning of
# the motion after it, and tools at the same place would seem to be apart. So the moments at which
# the tools enter a small ball around the place of the rest correspond, and so do those at which
# they leave it; in the ball, time runs evenly.

_RADIUS_M = 0.002
_NOISES = 3.0
"""Minimum radius of the ball, in multiples of the noise; else a tool at rest would leave it."""
_BESIDE_M = 0.01
"""Maximum distance between the places at which the tools of both runs rest."""
_MIN_S = 0.1
"""Minimum duration of a rest [s] in one run; else the tools pass slowly, and time runs evenly."""
_APART_S = 0.04
"""Minimum spacing of the points of a map [s], so that its slope is that of the motion."""


class _Stay(NamedTuple):
    """A stay: the rows of a motion at which the tools enter the ball and leave it."""

    begin: float
    end: float


def with_rests(
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
    radius_m = max(_RADIUS_M, _NOISES * max(map(_noise_m, parts)))
    stillest = [_stillest(part) for part in parts]
    places = [part[row] for part, row in zip(parts, stillest)]
    stays = [_stay(part, place, radius_m) for part, place in zip(parts, places)]
    longer = int(stays[1].end - stays[1].begin > stays[0].end - stays[0].begin)
    if stays[longer].end - stays[longer].begin < _MIN_S * run.rate_hz:
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


def refined(rough: TimeMap, reference: ToolsMotion, run: ToolsMotion) -> TimeMap:
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
    return with_rests(time_map(found_s, run_s), weight > 0.0, reference, run)


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
