# SPDX-License-Identifier: BSD-3-Clause
"""Phase of a run in progress: an alignment that knows nothing of the future."""
from __future__ import annotations

import math
from typing import Sequence

import numpy as np

_NOISE_M = 0.005
"""So far apart may tools be at the same moment of two good runs."""
_MOST_DISTANCES = 9.0
"""In squares of the noise: a robot that is somewhere else altogether says no more than that."""
_UNEVEN = 0.05
"""What it costs that a row is passed over, or is stayed at."""
_EVENT = 4.0 * _UNEVEN
"""What it costs that an event of the run is a row away from the same event of the reference."""
_CLEAR = 0.6 * _MOST_DISTANCES
"""So much more another alignment costs that is clearly wrong: a place tells two apart at once."""
_SAME_S = 0.25
"""Rows that are closer together than this need not be told apart to know where a run is."""
_FURTHEST_S = 3.0
"""Of an event that is further away than this, it counts only that it is far away."""


class PhaseTracker:
    """Finds the row of the reference at which a run is now, by its place and its events.

    On-line time warping (Dixon 2005): of each row it knows what the best alignment costs that ends
    there. It never goes back; rows that are passed over, or stayed at, cost a little, so that a
    pause of the one or of the other is found as such.
    """

    def __init__(self, reference: np.ndarray, period_s: float) -> None:
        """Take the places (n, d) [m] of the reference at even times; NaN where unknown.

        There it is taken to go straight on: a row that any place fits would hold the run.
        """
        self._reference = _filled(reference)
        self._halves = _half_steps(self._reference)
        self._squares = np.maximum(np.einsum('ij,ij->i', self._halves, self._halves), 1e-18)
        self._period_s = period_s
        self._rows = np.arange(len(reference), dtype=float)
        self._costs = np.zeros(len(reference))
        self._left_s = 0.0
        self._row = 0

    @property
    def duration_s(self) -> float:
        """Return when the last row of the reference is."""
        return self._period_s * (len(self._rows) - 1)

    @property
    def phase_s(self) -> float:
        """The time of the reference [s] to which the run has come."""
        return self._period_s * self._row + self._left_s

    @property
    def is_decided(self) -> bool:
        """Return whether the run is here, before the reference's end, and clearly nowhere else."""
        other = np.abs(self._rows - self._row) * self._period_s > _SAME_S
        is_clear = self._costs[self._row] + _CLEAR < self._costs[other].min(initial=np.inf)
        return bool(is_clear) and self.phase_s + _SAME_S < self.duration_s

    def restart(self) -> None:
        """Forget where the run was: it may be anywhere."""
        self._costs = np.zeros(len(self._rows))
        self._left_s = 0.0

    def begin_at(self, time_s: float) -> None:
        """Take that the run is at a time of the reference [s], and nowhere else."""
        self._costs = np.full(len(self._rows), np.inf)
        self._left_s, self._row = 0.0, self._nearest(time_s)
        self._costs[self._row] = 0.0

    def take_event(self, times_s: Sequence[float]) -> None:
        """Take that an event has come that the reference has at some times [s]."""
        away = np.full(len(self._rows), np.inf)
        for time_s in times_s:
            away = np.minimum(away, np.abs(self._rows - self._nearest(time_s)))
        if len(times_s):
            self._costs += _EVENT * np.minimum(away, _FURTHEST_S / self._period_s)
            self._row = int(self._costs.argmin())

    def advance(self, elapsed_s: float, place: np.ndarray) -> None:
        """Take where the run is, (d,) [m], NaN where unknown, and how long after the last time."""
        self._left_s += elapsed_s
        rows = math.floor(self._left_s / self._period_s + 0.5)
        if rows < 1:
            return
        self._left_s -= rows * self._period_s
        rows = min(rows, len(self._rows))
        costs = self._moved(rows) + rows * self._distances(place)
        self._costs = costs - costs.min()
        self._row = int(self._costs.argmin())

    def distance_m(self, place: np.ndarray, time_s: float) -> float:
        """Return how far a place is from the reference's at a time; NaN if one is unknown."""
        away = place - self._reference[self._nearest(time_s)]
        away = away[np.isfinite(away)]
        return float(np.sqrt(np.sum(away * away))) if len(away) else math.nan

    def _nearest(self, time_s: float) -> int:
        return int(min(max(round(time_s / self._period_s), 0), len(self._rows) - 1))

    def _moved(self, rows: int) -> np.ndarray:
        """Return what it costs to come to each row, so many rows further on if all goes evenly."""
        before = np.concatenate((np.full(rows, np.inf), self._costs[:-rows]))
        before[-1] = min(before[-1], self._costs[-rows:].min())  # the reference has ended
        passed = np.minimum.accumulate(before - _UNEVEN * self._rows) + _UNEVEN * self._rows
        for stayed in range(1, rows + 1):
            later = self._costs[:len(self._costs) - rows + stayed]
            passed[rows - stayed:] = np.minimum(passed[rows - stayed:], later + _UNEVEN * stayed)
        result: np.ndarray = passed
        return result

    def _distances(self, place: np.ndarray) -> np.ndarray:
        """From the piece of the path around each row, so that the rows' own places do not count."""
        away = place - self._reference
        away[~np.isfinite(away)] = 0.0
        share = (np.einsum('ij,ij->i', away, self._halves) / self._squares).clip(-1.0, 1.0)
        away -= share[:, np.newaxis] * self._halves
        result: np.ndarray = np.minimum(np.einsum('ij,ij->i', away, away) / _NOISE_M ** 2,
                                        _MOST_DISTANCES)
        return result


def _filled(places: np.ndarray) -> np.ndarray:
    """The places (n, d), between known ones where they are unknown; a column without any stays."""
    rows, columns = np.arange(len(places)), []
    for column in places.T:
        known = np.isfinite(column)
        columns.append(np.interp(rows, rows[known], column[known]) if known.any() else column)
    return np.stack(columns, axis=1)


def _half_steps(places: np.ndarray) -> np.ndarray:
    """Half of the way from the row before to the one behind, per row (n, d); 0 where unknown."""
    around = np.concatenate((places[:1], places, places[-1:]))
    halves: np.ndarray = np.nan_to_num((around[2:] - around[:-2]) / 4.0)
    return halves
