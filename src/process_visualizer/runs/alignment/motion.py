# SPDX-License-Identifier: BSD-3-Clause
"""The motion of all tools of a run at evenly spaced times."""
from __future__ import annotations

from typing import NamedTuple, Sequence, Tuple

import numpy as np

from process_visualizer.runs.run import Run, ToolMotion
from process_visualizer.runs.series import known_at, moving_maximum

_MIN_SPEED_M_S = 0.002
_SHARE_OF_FASTEST, _AROUND_S = 0.5, 0.5
_NOISE_S = 0.1
"""Time before and after over which speed is averaged [s], so that noise at rest is not motion."""


class ToolsMotion(NamedTuple):
    """Positions (n, 3 k) [m] of k tools, NaN where unknown, at ``rate_hz`` from time 0."""

    positions: np.ndarray
    rate_hz: float

    @property
    def times_s(self) -> np.ndarray:
        """The times (n,) of the rows [s]."""
        return np.arange(len(self.positions)) / self.rate_hz


def common_motions(reference: Run, run: Run, rate_hz: float) -> Tuple[ToolsMotion, ToolsMotion]:
    """Return the motions of the tools that both runs have; without any, they have no columns."""
    names = [it.device for it in reference.motions if len(it.times_s)
             and any(other.device == it.device and len(other.times_s) for other in run.motions)]
    return _motion(reference, names, rate_hz), _motion(run, names, rate_hz)


def _motion(run: Run, names: Sequence[str], rate_hz: float) -> ToolsMotion:
    times_s = np.arange(int(run.duration_s * rate_hz) + 1) / rate_hz
    by_name = {it.device: it for it in run.motions}
    columns = [_at(times_s, by_name[name]) for name in names]
    return ToolsMotion(np.hstack([np.empty((len(times_s), 0)), *columns]), rate_hz)


def _at(times_s: np.ndarray, motion: ToolMotion) -> np.ndarray:
    return known_at(times_s, motion.times_s, motion.positions)


def velocities(motion: ToolsMotion) -> np.ndarray:
    """Return the velocities (n, 3 k) [m/s]."""
    if len(motion.positions) < 2:
        return np.zeros_like(motion.positions)
    result: np.ndarray = np.gradient(motion.positions, axis=0) * motion.rate_hz
    return result


def _speed(motion: ToolsMotion) -> np.ndarray:
    positions, rows = motion.positions, np.arange(len(motion.positions))
    reach = max(int(_NOISE_S * motion.rate_hz), 1)
    begin, end = np.maximum(rows - reach, 0), np.minimum(rows + reach, len(rows) - 1)
    way = positions[end] - positions[begin]
    passed_s = np.maximum(end - begin, 1) / motion.rate_hz
    result: np.ndarray = np.sqrt(np.nansum(way * way, axis=1)) / passed_s
    return result


def moving_rows(motion: ToolsMotion) -> np.ndarray:
    """Return the rows (n,) (bool) in which the motion shows the time.

    Where a tool comes to rest, a small difference in position corresponds to a large one in time.
    So only rows count that are at least half as fast as the fastest motion around them.
    """
    speed = _speed(motion)
    fastest = moving_maximum(speed, int(_AROUND_S * motion.rate_hz))
    result: np.ndarray = speed > np.maximum(_SHARE_OF_FASTEST * fastest, _MIN_SPEED_M_S)
    return result
