# SPDX-License-Identifier: BSD-3-Clause
"""The true positions and velocities of the lower robot in the simulator."""
from __future__ import annotations

from collections import Counter

import numpy as np

from sewing_cell.cycle import SewingCycle
from sewing_cell.layout import LOWER

ROBOT = 'ur_rt_lower'
PERIOD_S = 1 / 125
SEED = 1
_MIN_DELAY_PERCENTILE = 1
_NODES = 41  # of a mean over a window


class Truth:
    """The simulator's velocities, and its time of beginning, found from the positions."""

    def __init__(self, seconds: float) -> None:
        """``seconds`` is the known duration of the simulation."""
        self._cycle = SewingCycle('good', SEED)
        times_s = np.arange(0, seconds, PERIOD_S)
        keys = _keys(self._cycle.tool_frame(LOWER, times_s)[:, :3])
        counts = Counter(keys)  # a position that occurs twice does not identify a time
        self._times = {key: time_s for key, time_s in zip(keys, times_s) if counts[key] == 1}

    def velocity(self, times_s: np.ndarray) -> np.ndarray:
        """Return velocities (n, 3) [m/s] in the robot's base frame."""
        velocity: np.ndarray = LOWER.to_base(self._cycle.truth(LOWER, times_s).velocity)
        return velocity

    def slope(self, times_s: np.ndarray, window_s: float) -> np.ndarray:
        """Return least-squares slopes (n, 3) [m/s] of true positions in windows around times [s].

        A slope is a mean of the velocity, weighted by a parabola over the window.
        """
        places = np.linspace(-1.0, 1.0, _NODES)
        weights = (1.0 - places ** 2) / (1.0 - places ** 2).sum()
        slope = np.zeros((len(times_s), 3))
        for place, weight in zip(places, weights):
            slope += weight * self.velocity(times_s + 0.5 * window_s * place)
        return slope

    def begin_s(self, arrival_s: np.ndarray, positions: np.ndarray) -> float:
        """Return the time [s] at which the simulation began, from the fastest poses (n, 3)."""
        offsets = [time_s - self._times[key] for time_s, key in zip(arrival_s, _keys(positions))
                   if key in self._times]
        return float(np.percentile(offsets, _MIN_DELAY_PERCENTILE))


def _keys(positions: np.ndarray) -> 'list[bytes]':
    return [row.tobytes() for row in positions.astype(np.float32)]
