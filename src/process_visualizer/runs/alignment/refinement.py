# SPDX-License-Identifier: BSD-3-Clause
"""A map of time made more exact than a sample, by least squares along the motion."""
from __future__ import annotations

from typing import Tuple

import numpy as np

from process_visualizer.runs.alignment.motion import Motion, moving_rows, velocities
from process_visualizer.runs.alignment.rests import with_rests
from process_visualizer.runs.alignment.time_map import TimeMap, time_map

_ROUNDS, _FIRST_ROUNDS, _PARTS = 6, 3, 8
_WINDOW_S = 0.2
_LEAST_M, _LITTLE, _CONTRADICTS_M = 1e-4, 1e-3, 2e-4
_FURTHEST_S = 0.1
"""One round moves a moment by so much at most."""


def refined(rough: TimeMap, reference: Motion, run: Motion) -> TimeMap:
    """Return a map by which the tools of the run lie where the reference's do.

    Only the shift along the direction of motion is used: what a tool is beside its path says
    nothing about time. A constant offset of a tool is no shift either; it is what is left
    when shifts have explained all that they can.
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


def _shift_s(reference: Motion, velocity: np.ndarray, moves: np.ndarray, found_s: np.ndarray,
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


def _at(times_s: np.ndarray, motion: Motion, values: np.ndarray) -> np.ndarray:
    place = np.clip(times_s * motion.rate_hz, 0.0, len(values) - 1.0)
    row = np.minimum(place.astype(np.int64), len(values) - 2)
    share = (place - row)[:, np.newaxis]
    result: np.ndarray = values[row] * (1.0 - share) + values[row + 1] * share
    return result


def _offset(difference: np.ndarray, velocity: np.ndarray) -> np.ndarray:
    """The constant offset (d,) of the tools; what came later is none.

    Only what lies beside the path tells of it, as along the path it may be time. Where a part of
    the motion contradicts, it is what all parts have in common, which is less.
    """
    offset = _beside_the_path(difference, velocity)
    for part, speed in zip(*(np.array_split(it, min(_PARTS, len(difference)))
                             for it in (difference, velocity))):
        before_m, after_m = (float(np.median(_beside(it, speed))) for it in (part, part - offset))
        if after_m > before_m + _CONTRADICTS_M:
            return _common_offset(difference)
    return offset


def _beside(difference: np.ndarray, velocity: np.ndarray) -> np.ndarray:
    """Return how far (n,) [m] differences (n, d) are beside the path."""
    along = (difference * velocity).sum(axis=1) / np.square(velocity).sum(axis=1)
    result: np.ndarray = np.linalg.norm(difference - along[:, np.newaxis] * velocity, axis=1)
    return result


def _beside_the_path(difference: np.ndarray, velocity: np.ndarray) -> np.ndarray:
    """The offset (d,) that explains most of what lies beside the path; few outliers count little.

    Sums of squares that are weighted anew three times come near to sums of distances.
    """
    direction = velocity / np.linalg.norm(velocity, axis=1)[:, np.newaxis]
    size = difference.shape[1]
    offset = np.zeros(size)
    for _ in range(3):
        weight = 1.0 / np.maximum(_beside(difference - offset, velocity), _LEAST_M)
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
    """The values (n,), each on the weighted straight line through those of a window around it.

    Where nothing has weight there are straight lines between what is known.
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
