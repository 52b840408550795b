# SPDX-License-Identifier: BSD-3-Clause
"""A running cell held against good runs: what is out of their band now, and since when."""
from __future__ import annotations

from typing import Mapping, NamedTuple, Optional, Tuple

import numpy as np

from process_visualizer.runs.comparison.comparison import GoodRuns
from process_visualizer.runs.comparison.timeline_bands import SHOWN, TimelineBand
from process_visualizer.runs.comparison.wording import quantity
from process_visualizer.runs.deviation.band import SignalBand, widened
from process_visualizer.runs.deviation.departures import outside, outside_since
from process_visualizer.runs.deviation.signals import MEAN_ROWS, RATE_HZ, Signal
from process_visualizer.runs.moving_window import moving_mean
from process_visualizer.runs.run import Key

_NEWEST_S = 1.5
"""A value that is older tells nothing about now."""
_TOLD_AFTER_S = 0.2
"""What is out for a shorter time is not told."""


class LiveDeparture(NamedTuple):
    """A channel that is out of the band now: ``beyond`` is how far [its unit], below 0: under it.

    ``since_s`` is on the clock of its values.
    """

    signal: Signal
    since_s: float
    beyond: float


class LiveComparison:
    """Judges values by the band of good runs at the moments of the reference that belong to them.

    What is judged is what the live curves have: variables, forces and speeds. As these moments are
    found while they pass, the band is that of 0.1 s before to 0.1 s later.
    """

    def __init__(self, good: GoodRuns) -> None:
        self.name = good.reference.name
        self._times_s = good.times_s
        self._signals = {(signal.device, signal.label): signal for signal in good.band.signals
                         if signal.kind in SHOWN and not signal.over_s}
        self._limits = {key: widened(good.band.signals[signal])
                        for key, signal in self._signals.items()}

    @property
    def keys(self) -> Tuple[Key, ...]:
        """The channels that can be judged."""
        return tuple(self._signals)

    def band(self, key: Key, values: np.ndarray, reference_s: np.ndarray,
             column_s: float) -> Optional[TimelineBand]:
        """Return the band of a channel at moments of the reference (n,), for drawing it.

        ``values`` (n,) are those of the running cell, one in each ``column_s``. None: it has no
        band, or not there.
        """
        limits = self._limits_at(key, reference_s)
        if limits is None or not np.isfinite(limits.middle).any():
            return None
        rows = max(round(MEAN_ROWS / RATE_HZ / column_s), 1)
        return TimelineBand(limits.middle - limits.half_width, limits.middle + limits.half_width,
                            outside(moving_mean(values, rows), limits))

    def departures(self, times_s: np.ndarray, values: Mapping[Key, np.ndarray],
                   reference_s: np.ndarray) -> Tuple[LiveDeparture, ...]:
        """Return what is out of its band at the last time, the one that left first at first.

        Args:
            times_s: (n,) of the values, even, as many a second as the band has; the last is now.
            values: (n,) of each channel, NaN where it has none.
            reference_s: (n,) the moments of the reference that belong to the times.
        """
        found = [self._departure(key, times_s, values[key], reference_s)
                 for key in self._signals if key in values]
        return tuple(sorted((it for it in found if it is not None), key=lambda it: it.since_s))

    def _departure(self, key: Key, times_s: np.ndarray, values: np.ndarray,
                   reference_s: np.ndarray) -> Optional[LiveDeparture]:
        limits = self._limits_at(key, reference_s)
        assert limits is not None
        deviation = moving_mean(values, MEAN_ROWS) - limits.middle
        rows = _of_this_run(np.flatnonzero(np.isfinite(deviation)), reference_s)
        if not len(rows) or times_s[rows[-1]] < times_s[-1] - _NEWEST_S:
            return None
        is_out = np.abs(deviation[rows]) > limits.half_width[rows]
        since = outside_since(is_out)
        if since is None or times_s[rows[-1]] - times_s[rows[since]] < _TOLD_AFTER_S:
            return None
        worst = rows[np.flatnonzero(is_out)[-1]]
        beyond = abs(deviation[worst]) - limits.half_width[worst]
        return LiveDeparture(self._signals[key], float(times_s[rows[since]]),
                             float(np.copysign(beyond, deviation[worst])))

    def _limits_at(self, key: Key, reference_s: np.ndarray) -> Optional[SignalBand]:
        limits = self._limits.get(key)
        if limits is None:
            return None
        return SignalBand(*(np.interp(reference_s, self._times_s, it, np.nan, np.nan)
                            for it in limits[:2]))


def _of_this_run(rows: np.ndarray, reference_s: np.ndarray) -> np.ndarray:
    """The rows behind the last moment at which the reference began anew."""
    back = np.flatnonzero(np.diff(reference_s[rows]) < 0.0)
    return rows[back[-1] + 1:] if len(back) else rows


def departure_text(departure: LiveDeparture, now_s: float) -> str:
    """Return which channel is how far out of the band, and since when."""
    return f'{departure.signal.name} {beyond_text(departure)} {since_text(departure, now_s)}'


def since_text(departure: LiveDeparture, now_s: float) -> str:
    """Return since when a channel is out of the band, at a time of its values' clock [s]."""
    return f'since {max(now_s - departure.since_s, 0.0):.1f} s'


def beyond_text(departure: LiveDeparture) -> str:
    """Return how far a channel is over or under the band."""
    side = 'above' if departure.beyond >= 0.0 else 'below'
    return f'{quantity(departure.signal, departure.beyond, sign=True)} {side} range'
