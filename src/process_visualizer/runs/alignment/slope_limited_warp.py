# SPDX-License-Identifier: BSD-3-Clause
"""Dynamic time warping with limits to its slope (Sakoe and Chiba 1978), inside a band.

One clock never runs faster than three times the other. The ends are free: rows that one series has
before or after the other are skipped.
"""
from __future__ import annotations

from typing import List, NamedTuple, Tuple

import numpy as np

_STEPS: Tuple[Tuple[int, int], ...] = ((1, 1), (1, 2), (2, 1), (1, 3), (3, 1))
"""Steps in rows of the reference and of the run; of equally good ones, the first is chosen."""
_MAX_STEP_ROWS = max(rows for rows, _ in _STEPS)
_BEGIN = len(_STEPS)
_MAX_SHIFT = 64
"""Maximum shift of a band from one row to the next three; a larger one breaks the path."""
_BLOCK_CELLS = 200_000
_UNEVEN = 0.02
"""Cost of an uneven step, as a share of the cost of a skipped row."""


class WarpBand(NamedTuple):
    """The rows of the run that may correspond to a row of the reference.

    These are ``width`` rows from ``first[i]`` on, except those farther than ``reach[i]`` from the
    middle.
    """

    first: np.ndarray
    width: int
    reach: np.ndarray


def band_around(middle: np.ndarray, reach: np.ndarray) -> WarpBand:
    """Return the band of the rows within a reach of the middle; both (n,) in rows."""
    half = int(np.ceil(reach.max()))
    return WarpBand(np.rint(middle).astype(np.int64) - half, 2 * half + 1, reach)


def warp(reference: np.ndarray, run: np.ndarray, band: WarpBand,
         skipped: float) -> Tuple[np.ndarray, np.ndarray]:
    """Return the rows (k,), (k,) of the best path through the squared distances; empty without one.

    Args:
        reference: (n, d); NaN where unknown.
        run: (m, d); NaN as in the reference.
        band: of n rows.
        skipped: cost of a row of the reference that corresponds to no row of the run. Rows
            without data cost the same; otherwise the path would prefer gaps.
    """
    search = _Search(band, len(run), skipped)
    for begin in range(0, len(reference), _block_rows(band)):
        block = slice(begin, begin + _block_rows(band))
        for costs in _costs(reference[block], run, band, block, skipped):
            search.add_row(costs)
    return search.path()


def _block_rows(band: WarpBand) -> int:
    return max(_BLOCK_CELLS // band.width, 1)


def _costs(reference: np.ndarray, run: np.ndarray, band: WarpBand, block: slice,
           unknown: float) -> np.ndarray:
    """Return the costs of some rows in all columns; infinite outside the run and the reach."""
    columns = np.arange(band.width)
    places = band.first[block, np.newaxis] + columns
    inside = (places >= 0) & (places < len(run))
    inside &= np.abs(columns - band.width // 2) <= np.ceil(band.reach[block, np.newaxis])
    near = run[np.clip(places, 0, len(run) - 1)]
    difference = near - reference[:, np.newaxis, :]
    is_known = np.isfinite(difference)
    difference[~is_known] = 0.0
    costs = np.einsum('ijk,ijk->ij', difference, difference)
    costs[~is_known.any(axis=2)] = unknown
    return np.where(inside, costs, np.inf)


class _Search:
    """The search for the best path to each cell of the rows so far."""

    def __init__(self, band: WarpBand, run_rows: int, skipped: float) -> None:
        self._band, self._run_rows, self._skipped = band, run_rows, skipped
        self._padding = _MAX_SHIFT + 3
        self._begins_at = {(rows, columns): self._shifts(rows, columns) for rows, columns in (
            *_STEPS, *((back, 0) for back in range(1, _MAX_STEP_ROWS)))}
        self._came_from = np.empty((len(band.first), band.width), np.int8)
        self._candidates = np.empty((len(_STEPS) + 1, band.width))
        self._width = band.width
        self._columns = np.arange(band.width)
        self._totals: List[np.ndarray] = []  # of the last rows, the newest first
        self._costs: List[np.ndarray] = []
        self._best, self._end = np.inf, (-1, -1)
        self._row = 0

    def add_row(self, costs: np.ndarray) -> None:
        """Add the costs of the next row."""
        candidates = self._candidates
        for number, (rows, columns) in enumerate(_STEPS):
            self._step(candidates[number], rows, columns)
        candidates[1:_BEGIN] += _UNEVEN * self._skipped
        self._begins(candidates[_BEGIN])
        best = candidates.argmin(axis=0)
        self._came_from[self._row] = best
        total = candidates[best, self._columns] + costs
        self._look_for_end(total)
        self._totals = [self._padded(total), *self._totals[:2]]
        self._costs = [self._padded(costs), *self._costs[:1]]
        self._row += 1

    def _step(self, found: np.ndarray, rows: int, columns: int) -> None:
        """Write into ``found`` the costs of arriving by a step, without the cells themselves."""
        if rows > len(self._totals):
            found[:] = np.inf
            return
        found[:] = self._shifted(self._totals[rows - 1], rows, columns)
        for back in range(1, rows):  # skipped rows belong to the column where the step ends
            found += self._shifted(self._costs[back - 1], back, 0)

    def _padded(self, values: np.ndarray) -> np.ndarray:
        padded = np.full(len(values) + 2 * self._padding, np.inf)
        padded[self._padding:-self._padding] = values
        return padded

    def _shifts(self, rows: int, columns: int) -> List[int]:
        """Return for each row where, in an earlier padded one, its columns begin."""
        first = self._band.first
        moved = np.zeros(len(first), np.int64)
        moved[rows:] = first[rows:] - first[:-rows] - columns
        shifts: List[int] = (self._padding + moved.clip(-self._padding, self._padding)).tolist()
        return shifts

    def _shifted(self, padded: np.ndarray, rows: int, columns: int) -> np.ndarray:
        """Return the values of an earlier row, shifted to the columns of this one."""
        begin = self._begins_at[rows, columns][self._row]
        return padded[begin:begin + self._width]

    def _begins(self, found: np.ndarray) -> None:
        """Write the costs of paths that begin in the reference's first row, or in the run's.

        A path that begins in the run's first row skips rows of the reference.
        """
        found[:] = np.inf if self._row else 0.0
        column = -int(self._band.first[self._row])
        if 0 <= column < self._band.width:
            found[column] = self._row * self._skipped

    def _look_for_end(self, total: np.ndarray) -> None:
        """Check paths that end here: in the reference's last row, or in the run's."""
        left = len(self._band.first) - 1 - self._row
        column = int(total.argmin()) if left == 0 \
            else self._run_rows - 1 - int(self._band.first[self._row])
        if 0 <= column < self._band.width and total[column] + left * self._skipped < self._best:
            self._best = total[column] + left * self._skipped
            self._end = self._row, column

    def path(self) -> Tuple[np.ndarray, np.ndarray]:
        """Return the rows of both series on the best path."""
        if self._end[0] < 0:
            return np.empty(0, np.int64), np.empty(0, np.int64)
        return _path(self._came_from, self._band, self._end)


def _path(came_from: np.ndarray, band: WarpBand,
          end: Tuple[int, int]) -> Tuple[np.ndarray, np.ndarray]:
    row, column = end[0], end[1] + int(band.first[end[0]])
    rows, columns = [row], [column]
    while True:
        number = int(came_from[row, column - int(band.first[row])])
        if number == _BEGIN:
            break
        row, column = row - _STEPS[number][0], column - _STEPS[number][1]
        rows.append(row)
        columns.append(column)
    return np.array(rows[::-1]), np.array(columns[::-1])
