# SPDX-License-Identifier: BSD-3-Clause
"""Three usual ways to judge a run by good ones, for comparison with ours.

Each takes the good runs, and returns the channel of a run that is out of range, or None. A position
counts as three channels of each tool. The limits are those of textbooks; ``scale`` multiplies them.
"""
from __future__ import annotations

from typing import Dict, List, Optional, Protocol, Sequence, Tuple

import numpy as np

from process_visualizer.runs.alignment.alignment import common_events
from process_visualizer.runs.alignment.time_map import TimeMap, shift, time_map
from process_visualizer.runs.run import Run

_ROWS, _WARPED_ROWS = 300, 120
_SIGMAS, _LASTING = 3.0, 3
Series = Tuple[np.ndarray, np.ndarray]


class Peer(Protocol):
    """A way to judge runs."""

    def excess(self, run: Run) -> float:
        """Return the largest deviation of a run as a share of its limit."""

    def cause(self, run: Run, scale: float = 1.0) -> Optional[str]:
        """Return the channel that is out of range, or None."""


def _series(run: Run) -> Dict[str, Series]:
    found = {f'{it.device} {it.label}': (it.times_s, it.values.astype(float))
             for it in run.channels if len(it.times_s)}
    for motion in run.motions:
        for axis, values in zip('xyz', motion.positions.T):
            found[f'{motion.device} place {axis}'] = motion.times_s, values
    return found


def _at(series: Series, times_s: np.ndarray) -> np.ndarray:
    result: np.ndarray = np.interp(times_s, *series)
    return result


def _by_events(reference: Run, run: Run) -> TimeMap:
    events = common_events(reference.events, run.events)
    return time_map(events.reference_s, events.run_s) if len(events.reference_s) else shift(0.0)


class EventsAndSigmas:
    """Alignment at events; each channel within 3 standard deviations of the mean at each moment."""

    def __init__(self, good: Sequence[Run]) -> None:
        self._reference = good[0]
        self._times_s = np.linspace(0.0, good[0].duration_s, _ROWS)
        rows = [self._columns(it) for it in good]
        self._names = [it for it in rows[0] if all(it in row for row in rows)]
        values = {name: np.stack([it[name] for it in rows]) for name in self._names}
        self._mean = {name: it.mean(axis=0) for name, it in values.items()}
        self._limit = {name: _SIGMAS * it.std(axis=0, ddof=1) + 1e-9
                       for name, it in values.items()}

    def _columns(self, run: Run) -> Dict[str, np.ndarray]:
        run_s = _by_events(self._reference, run).to_run(self._times_s)
        return {name: _at(it, run_s) for name, it in _series(run).items()}

    def _lasting(self, run: Run) -> Dict[str, np.ndarray]:
        """Return the share of the limit that each channel exceeds for several rows (n,)."""
        columns = self._columns(run)
        shares = {name: np.abs(columns[name] - self._mean[name]) / self._limit[name]
                  for name in self._names if name in columns}
        return {name: np.lib.stride_tricks.sliding_window_view(it, _LASTING).min(axis=1)
                for name, it in shares.items()}

    def excess(self, run: Run) -> float:
        return max(float(it.max()) for it in self._lasting(run).values())

    def cause(self, run: Run, scale: float = 1.0) -> Optional[str]:
        first = {name: int(np.argmax(it > scale)) for name, it in self._lasting(run).items()
                 if (it > scale).any()}
        return min(first, key=lambda it: first[it]) if first else None


class WarpedDistance:
    """The distance of dynamic time warping to the nearest good run, and a threshold.

    The threshold is the largest distance of a good run to the nearest other one, plus a tenth.
    """

    def __init__(self, good: Sequence[Run]) -> None:
        rows = [_series(it) for it in good]
        self._names = [it for it in rows[0] if all(it in row for row in rows)]
        raw = np.stack([self._columns(it) for it in good])
        self._scale = raw.std(axis=(0, 1)) + 1e-9
        self._good = raw / self._scale
        away = [np.delete(self._distances(it), row).min() for row, it in enumerate(self._good)]
        self._threshold = 1.1 * max(away)

    def _columns(self, run: Run) -> np.ndarray:
        times_s, series = np.linspace(0.0, run.duration_s, _WARPED_ROWS), _series(run)
        return np.stack([_at(series[name], times_s) if name in series
                         else np.zeros(_WARPED_ROWS) for name in self._names], axis=1)

    def _distances(self, run: np.ndarray) -> np.ndarray:
        """Return the distances to each good run (g,)."""
        cost = np.square(self._good[:, :, np.newaxis, :] - run).sum(axis=3)
        count = _WARPED_ROWS
        total = np.full((len(cost), count + 1, count + 1), np.inf)
        total[:, 0, 0] = 0.0
        for diagonal in range(2 * count - 1):  # its cells follow from the two diagonals before
            i = np.arange(max(0, diagonal - count + 1), min(diagonal, count - 1) + 1)
            j = diagonal - i
            total[:, i + 1, j + 1] = cost[:, i, j] + np.minimum(
                np.minimum(total[:, i, j + 1], total[:, i + 1, j]), total[:, i, j])
        return np.sqrt(total[:, -1, -1])

    def excess(self, run: Run) -> float:
        return float(self._distances(self._columns(run) / self._scale).min() / self._threshold)

    def cause(self, run: Run, scale: float = 1.0) -> Optional[str]:
        values = self._columns(run) / self._scale
        distances = self._distances(values)
        if distances.min() <= scale * self._threshold:
            return None
        away = np.square(values - self._good[int(distances.argmin())]).sum(axis=0)
        return self._names[int(away.argmax())]


class FeatureTable:
    """Mean, minimum, maximum and duration of each part between events, each within 3 sigma."""

    def __init__(self, good: Sequence[Run]) -> None:
        self._reference = good[0]
        rows = [self._features(it) for it in good]
        self._names = [it for it in rows[0] if all(it in row for row in rows)]
        values = np.array([[it[name] for name in self._names] for it in rows])
        self._mean, self._limit = values.mean(axis=0), _SIGMAS * values.std(axis=0, ddof=1) + 1e-9

    def _features(self, run: Run) -> Dict[str, float]:
        ends_s: List[float] = [0.0, *common_events(self._reference.events, run.events).run_s,
                               run.duration_s]
        found = {f'time lost|{row}': end_s - begin_s
                 for row, (begin_s, end_s) in enumerate(zip(ends_s, ends_s[1:]))}
        for name, (times_s, values) in _series(run).items():
            for row, (begin_s, end_s) in enumerate(zip(ends_s, ends_s[1:])):
                inside = values[(times_s >= begin_s) & (times_s < end_s)]
                if len(inside):
                    found.update({f'{name}|{row} mean': float(inside.mean()),
                                  f'{name}|{row} least': float(inside.min()),
                                  f'{name}|{row} largest': float(inside.max())})
        return found

    def _shares(self, run: Run) -> np.ndarray:
        """Return the deviation of each feature as a share of its limit (f,); missing: infinite."""
        found = self._features(run)
        values = np.array([found.get(name, np.nan) for name in self._names])
        shares: np.ndarray = np.abs(values - self._mean) / self._limit
        return np.nan_to_num(shares, nan=np.inf)

    def excess(self, run: Run) -> float:
        return float(self._shares(run).max())

    def cause(self, run: Run, scale: float = 1.0) -> Optional[str]:
        shares = self._shares(run)
        if not (shares > scale).any():
            return None
        return self._names[int(shares.argmax())].partition('|')[0]


PEERS = {'event alignment, 3 sigma': EventsAndSigmas, 'DTW and a threshold': WarpedDistance,
         'table by phase, 3 sigma': FeatureTable}
