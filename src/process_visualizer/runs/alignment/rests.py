# SPDX-License-Identifier: BSD-3-Clause
"""Rests: where the motion of two runs does not tell which moments belong together, places do.

A tool leaves its rest slowly. By time alone a rest that is longer would stretch the slow begin of
the motion behind it, and tools that are at the same place would seem to be apart. So the moments at
which the tools come into a small ball around the place of the rest, and leave it, belong together;
in the ball time runs evenly.
"""
from __future__ import annotations

import math
from typing import List, NamedTuple, Tuple

import numpy as np

from process_visualizer.runs.alignment.motion import Motion
from process_visualizer.runs.alignment.time_map import TimeMap

_RADIUS_M = 0.002
_NOISES = 3.0
"""The ball is larger than the noise by so much at least, or a tool at rest would leave it."""
_BESIDE_M = 0.01
"""A tool that is so far beside its place rests there all the same."""
_SHORTEST_S = 0.1
"""A rest, in one of the runs at least; else the tools pass slowly, and time runs evenly."""
_APART_S = 0.04
"""Points of a map are so far apart at least, so that its slope is that of the motion."""


class _Stay(NamedTuple):
    """A stay: the rows of a motion at which the tools enter the ball, and leave it."""

    begin: float
    end: float


def with_rests(found: TimeMap, is_known: np.ndarray, reference: Motion, run: Motion) -> TimeMap:
    """Return the map with points at the begin and at the end of each rest.

    Args:
        found: a point for each of some rows of the run, which follow each other.
        is_known: (n,) for these points: whether the motion tells the time there.
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


def _with_ends(motion: Motion, rows: np.ndarray) -> List[int]:
    """The rows, and before and behind them the first and last ones of which all is known."""
    whole = np.flatnonzero(np.isfinite(motion.positions).all(axis=1))
    ends = (whole[0], whole[-1]) if len(whole) else (rows[0], rows[-1])
    return [int(ends[0]), *rows.tolist(), int(ends[1])]


def _rest(reference: Motion, run: Motion, rows: Tuple[int, int],
          run_rows: Tuple[int, int]) -> List[Tuple[float, float]]:
    """The points, s, of the longest rest in a stretch of both motions; none without one."""
    parts = (reference.positions[rows[0]:rows[1] + 1], run.positions[run_rows[0]:run_rows[1] + 1])
    if not all(np.isfinite(part).all() for part in parts):
        return []
    radius_m = max(_RADIUS_M, _NOISES * max(map(_noise_m, parts)))
    stillest = [_stillest(part) for part in parts]
    places = [part[row] for part, row in zip(parts, stillest)]
    stays = [_stay(part, place, radius_m) for part, place in zip(parts, places)]
    longer = int(stays[1].end - stays[1].begin > stays[0].end - stays[0].begin)
    if stays[longer].end - stays[longer].begin < _SHORTEST_S * run.rate_hz:
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
    """The row in the middle of those between which the tools move least."""
    size = min(5, len(part) - 1)
    return int(np.linalg.norm(part[size:] - part[:-size], axis=1).argmin()) + size // 2


def _noise_m(part: np.ndarray) -> float:
    """Return the scatter of positions, by second differences, which hardly show motion."""
    if len(part) < 3:
        return 0.0
    away_m = np.linalg.norm(part[2:] - 2.0 * part[1:-1] + part[:-2], axis=1)
    return float(np.median(away_m)) / math.sqrt(6.0)


def _stay(part: np.ndarray, place: np.ndarray, radius_m: float) -> _Stay:
    """The stay around the row that is nearest to the place."""
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
