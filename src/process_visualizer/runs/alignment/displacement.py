# SPDX-License-Identifier: BSD-3-Clause
"""The same path at another place: the turn and shift of a run's tools."""
from __future__ import annotations

import math
from typing import NamedTuple, Optional, Tuple

import numpy as np

from process_visualizer.runs.alignment.alignment import common_events, motion_alignment
from process_visualizer.runs.alignment.motion import (
    ToolsMotion,
    common_motions,
    moving_rows,
    velocities,
)
from process_visualizer.runs.alignment.slope_limited_warp import band_around, warp
from process_visualizer.runs.alignment.time_map import TimeMap, time_map
from process_visualizer.runs.run import Run
from process_visualizer.runs.series import moving_maximum

_HZ, _FIT_HZ, _MAX_ROWS = 5.0, 25.0, 1500
_SKIPPED, _SMOOTH_S = 0.02, 0.4
_TURNS = 5
_KEPT_SHARE = 0.8
"""Share of the moments that is fitted; others may be where the way to the place differs."""
_MAX_APART_M, _MIN_ROWS = 0.015, 25
_NEAR_MOTION_S = 0.5
"""Time around motions that is fitted [s].

The positions at which tools stop show where along the path they are; long rests add nothing.
"""
_MIN_SHARE = 0.8
"""Minimum share of the motion that must be the same."""
_SAME_M, _SAME_RAD = 2e-4, 1e-3
_SMALL_M, _SMALL_RAD = 1e-3, 2e-3


class Displacement(NamedTuple):
    """A turn about the vertical, then a shift (3,) [m], from a run's tools to the reference's."""

    turn_rad: float
    shift_m: np.ndarray

    def moved(self, positions: np.ndarray) -> np.ndarray:
        """Return positions (n, 3) [m] of the run, moved to where they would be in the reference."""
        sine, cosine = math.sin(self.turn_rad), math.cos(self.turn_rad)
        turn = np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])
        result: np.ndarray = positions @ turn.T + self.shift_m
        return result

    def of_run(self, run: Run) -> Run:
        """Return a run with its tools moved."""
        return run._replace(motions=tuple(it._replace(positions=self.moved(it.positions))
                                          for it in run.motions))

    def text(self, reference: Run) -> str:
        """Return in words where the run's path is, compared with the middle of the reference's."""
        middle = np.concatenate([it.positions for it in reference.motions])
        middle = middle[np.isfinite(middle).all(axis=1)].mean(axis=0, keepdims=True)
        there = Displacement(-self.turn_rad, np.zeros(3)).moved(middle - self.shift_m)
        x, y, z = 1000.0 * (there - middle)[0]
        return (f'its path is that of the reference, shifted by {x:+.0f}, {y:+.0f}, {z:+.0f} mm '
                f'(x, y, z) and turned by {-math.degrees(self.turn_rad):+.1f}°')

    @property
    def is_small(self) -> bool:
        """Return whether the displacement is too small to be reported."""
        return abs(self.turn_rad) < _SMALL_RAD and bool(np.abs(self.shift_m).max() < _SMALL_M)


def displacement(reference: Run, run: Run) -> Optional[Displacement]:
    """Return the displacement that makes a run's path the reference's; None if none does.

    Speed and height of the tools do not depend on where the path is, so they give the first time
    map. Then displacement (least squares of what fits best) and map improve each other in turn, as
    in iterative closest points (Besl and McKay 1992).
    """
    found_map = _by_speed_and_height(reference, run)
    found: Optional[Displacement] = None
    for _ in range(_TURNS):
        if found_map is None:
            return None
        before, found = found, _fitted(reference, run, found_map)
        if found is None or before is not None and _is_same(before, found):
            break
        moved = found.of_run(run)
        found_map = motion_alignment(reference, moved, common_events(reference.events, run.events))
    if found is None or found_map is None:
        return None
    mine, theirs = _pairs(reference, found.of_run(run), found_map)
    apart_m = np.sqrt(np.square(mine - theirs).sum(axis=1))
    return found if len(mine) and np.mean(apart_m < _MAX_APART_M) >= _MIN_SHARE else None


def _is_same(one: Displacement, other: Displacement) -> bool:
    return bool(abs(one.turn_rad - other.turn_rad) < _SAME_RAD
                and np.abs(one.shift_m - other.shift_m).max() < _SAME_M)


def _by_speed_and_height(reference: Run, run: Run) -> Optional[TimeMap]:
    """Return the time map by quantities that do not depend on the place."""
    size_s = math.sqrt(max(reference.duration_s, 0.1) * max(run.duration_s, 0.1))
    motions = common_motions(reference, run, min(_HZ, _MAX_ROWS / size_s))
    if not all(it.positions.shape[1] and moving_rows(it).any() for it in motions):
        return None
    mine, theirs = (_features(it) for it in motions)
    scale = np.nanstd(mine, axis=0)
    mine, theirs = (it / np.where(scale > 0.0, scale, 1.0) for it in (mine, theirs))
    even = len(theirs) / len(mine)
    middle = np.arange(len(mine)) * even
    rows, columns = warp(mine, theirs, band_around(middle, np.full(len(mine), 0.3 * len(theirs))),
                         _SKIPPED * mine.shape[1])
    if len(rows) < 2:
        return None
    return time_map(rows / motions[0].rate_hz, columns / motions[1].rate_hz)


def _features(motion: ToolsMotion) -> np.ndarray:
    """Return horizontal speed, vertical speed and height of each tool (n, 3 k)."""
    count = motion.positions.shape[1] // 3
    speed = velocities(motion).reshape(-1, count, 3)
    height = motion.positions.reshape(-1, count, 3)[:, :, 2]
    level = np.nanmedian(height, axis=0)
    return np.concatenate((np.hypot(speed[:, :, 0], speed[:, :, 1]), speed[:, :, 2],
                           height - level), axis=1)


def _pairs(reference: Run, run: Run, found: TimeMap) -> Tuple[np.ndarray, np.ndarray]:
    """Return the tools' positions (n, 3) [m] at the same moments of both runs, near motions."""
    mine, theirs = common_motions(reference, run, _FIT_HZ)
    rows = np.rint(found.to_run(mine.times_s) * _FIT_HZ)
    tells = moving_maximum(moving_rows(mine).astype(float), int(_NEAR_MOTION_S * _FIT_HZ)) > 0.0
    inside = (rows >= 0) & (rows < len(theirs.positions)) & tells
    one = mine.positions[inside].reshape(-1, 3)
    other = theirs.positions[rows[inside].astype(int)].reshape(-1, 3)
    known = np.isfinite(one).all(axis=1) & np.isfinite(other).all(axis=1)
    return one[known], other[known]


def _fitted(reference: Run, run: Run, found: TimeMap) -> Optional[Displacement]:
    mine, theirs = _pairs(reference, run, found)
    kept = np.ones(len(mine), bool)
    best: Optional[Displacement] = None
    for _ in range(_TURNS):
        if np.count_nonzero(kept) < _MIN_ROWS:
            return None
        best = _least_squares(mine[kept], theirs[kept])
        away = np.square(mine - best.moved(theirs)).sum(axis=1)
        kept = away <= np.quantile(away, _KEPT_SHARE)
    return best


def _least_squares(mine: np.ndarray, theirs: np.ndarray) -> Displacement:
    """Return the least-squares displacement (Umeyama 1991, in the plane)."""
    here, there = mine - mine.mean(axis=0), theirs - theirs.mean(axis=0)
    turn = math.atan2(float((there[:, 0] * here[:, 1] - there[:, 1] * here[:, 0]).sum()),
                      float((there[:, 0] * here[:, 0] + there[:, 1] * here[:, 1]).sum()))
    turned = Displacement(turn, np.zeros(3)).moved(theirs.mean(axis=0, keepdims=True))[0]
    return Displacement(turn, mine.mean(axis=0) - turned)
