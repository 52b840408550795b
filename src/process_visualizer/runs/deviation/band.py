# SPDX-License-Identifier: BSD-3-Clause
"""What good runs do: a band around each signal that a good run leaves at a stated rate."""
from __future__ import annotations

import math
from typing import Dict, Mapping, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from process_visualizer.runs.deviation.signals import (
    RATE_HZ,
    Columns,
    Signal,
    SignalKind,
    common_signals,
)
from process_visualizer.runs.moving_window import moving_maximum, moving_mean

FEWEST_RUNS = 3
"""Good runs of which a spread can be known, each from the others."""
_SPREAD_S = 0.5
_SHARE_OF_MEAN_SPREAD = 0.25
_HIGH_SCORE = 1.5
"""A high score is so many deviations above the mean of the logarithms."""
_OUTSTANDING = 5.0
"""So many times its usual score a signal of a good run never reaches."""
_LEAST_SPREAD: Dict[SignalKind, float] = {
    SignalKind.TIMING: 0.005, SignalKind.PLACE: 1e-4, SignalKind.NOISE: 0.05,
    SignalKind.JOINT: 2e-4}
_LEAST_SHARE_OF_RANGE = 2e-3
_TOLERANCES: Dict[SignalKind, float] = {
    SignalKind.TIMING: 0.1, SignalKind.PLACE: 0.005, SignalKind.NOISE: math.log(4.0),
    SignalKind.JOINT: 0.02}
_TIME_TOLERANCE_S = 0.1
RELATIVE_TOLERANCE = 0.1
"""Of the range of the good runs' values, where the configuration gives no tolerance."""


class TooFewRuns(ValueError):
    """So few good runs cannot support a rate; the text says how many could."""


class SignalBand(NamedTuple):
    """The values of good runs: in the middle, and half as wide as ``half_width``; both (t,)."""

    middle: np.ndarray
    half_width: np.ndarray


class Band(NamedTuple):
    """The bands of all signals; ``rate`` is how often a good run leaves one of them.

    Without a rate the bands are tolerances.
    """

    signals: Mapping[Signal, SignalBand]
    runs: int
    rate: Optional[float] = None


def fewest_runs(rate: float) -> int:
    """Return how many good runs a rate needs: of N+1 equal runs each is the worst once."""
    return max(math.ceil(1.0 / rate - 1e-9) - 1, FEWEST_RUNS)


class BandLearner:
    """Learns the band of good runs, also with one of them left out."""

    def __init__(self, good: Sequence[Columns]) -> None:
        """Take at least two runs on one reference's clock."""
        self._count = len(good)
        self._signals = [LearnedSignal(signal, np.stack([it[signal] for it in good]))
                         for signal in common_signals(tuple(good))]
        self._scores = np.stack([it.scores for it in self._signals])  # (signals, runs)

    def outstanding(self) -> Tuple[Tuple[int, Signal], ...]:
        """Return the runs that are far from all others, and the signal in which they are.

        Such a run makes the band so wide that it hides what it should show.
        """
        usual = np.maximum(np.median(self._scores, axis=1), 1.0)
        ratio = self._scores / usual[:, np.newaxis]
        return tuple((int(run), self._signals[int(ratio[:, run].argmax())].signal)
                     for run in np.flatnonzero(ratio.max(axis=0) > _OUTSTANDING))

    def band(self, rate: float, without: Optional[int] = None) -> Band:
        """Return the band that a further good run leaves, anywhere, at a rate.

        Each good run is judged by the others; a run's score is its greatest deviation over all
        times and signals, in spreads, and in the high scores of the signal. The band is as wide as
        the quantile of these scores that leaves ``rate`` (Vovk et al. 2005, conformal prediction;
        Barber et al. 2021, the jackknife).

        Args:
            rate: from 0 to 1.
            without: the number of a run that is to be judged itself, and so does not count.

        Raises:
            TooFewRuns: there are fewer runs than the rate needs.
        """
        scores = self._scores if without is None else np.delete(self._scores, without, axis=1)
        runs = scores.shape[1]
        if runs < fewest_runs(rate):
            raise TooFewRuns(f'{runs} good runs cannot support a rate of {rate:g}; '
                             f'it takes {fewest_runs(rate)}')
        usual = _usual(scores)
        left_out = np.stack([_usual(np.delete(scores, run, axis=1)) for run in range(runs)], axis=1)
        highest = np.sort((scores / left_out).max(axis=0))[::-1]
        limit = float(highest[int(rate * (runs + 1) + 1e-9) - 1])
        return Band({it.signal: it.band(limit * float(high), without)
                     for it, high in zip(self._signals, usual)}, runs, rate)


def learned_band(good: Sequence[Columns], rate: float) -> Band:
    """Return the band that a further good run leaves, anywhere, at a rate: see BandLearner.

    Raises:
        TooFewRuns: there are fewer runs than the rate needs.
    """
    if len(good) < fewest_runs(rate):
        raise TooFewRuns(f'{len(good)} good runs cannot support a rate of {rate:g}; '
                         f'it takes {fewest_runs(rate)}')
    return BandLearner(good).band(rate)


def _usual(scores: np.ndarray) -> np.ndarray:
    """A high score of each signal (s,), by which those with frequent outliers have wider bands."""
    logarithms = np.log(np.maximum(scores, 1.0))
    result: np.ndarray = np.exp(logarithms.mean(axis=1)
                                + _HIGH_SCORE * logarithms.std(axis=1, ddof=1))
    return result


class LearnedSignal:
    """Mean and spread of a signal of good runs, and each run's score by the others."""

    def __init__(self, signal: Signal, values: np.ndarray) -> None:
        """Take the values (runs, t)."""
        self.signal = signal
        self._values = values
        known = np.isfinite(values)
        count = known.sum(axis=0)
        self._center = np.where(known, values, 0.0).sum(axis=0, dtype=float) / np.maximum(count, 1)
        away = np.where(known, values - self._center, 0.0)
        self._sums = count, away.sum(axis=0), (away * away).sum(axis=0)
        self._least = least_spread(signal, values)
        self.scores = np.array([_score(row, *self._mean_and_spread(number))
                                for number, row in enumerate(values)])

    def band(self, limit: float, without: Optional[int] = None) -> SignalBand:
        """Return the band of so many spreads."""
        mean, spread = self._mean_and_spread(without)
        return SignalBand(mean, limit * spread)

    def _mean_and_spread(self, without: Optional[int]) -> Tuple[np.ndarray, np.ndarray]:
        count, total, squares = self._sums
        if without is not None:
            row = self._values[without]
            known = np.isfinite(row)
            away = np.where(known, row - self._center, 0.0)
            count, total, squares = count - known, total - away, squares - away * away
        mean, spread = _mean_and_spread(count, total, squares, self._least)
        return self._center + mean, spread


def _mean_and_spread(count: np.ndarray, total: np.ndarray, squares: np.ndarray,
                     least: float) -> Tuple[np.ndarray, np.ndarray]:
    number = np.maximum(count, 1)
    mean = np.where(count > 1, total / number, np.nan)
    variance = np.maximum(squares - total * total / number, 0.0) / np.maximum(count - 1, 1)
    smooth = moving_mean(np.where(count > 1, variance, np.nan), int(_SPREAD_S * RATE_HZ))
    known = smooth[np.isfinite(smooth)]
    whole = float(known.mean()) if len(known) else 0.0
    spread = np.sqrt(smooth * (1.0 + 1.0 / number) + _SHARE_OF_MEAN_SPREAD ** 2 * whole
                     + least * least)
    return mean, spread


def _score(values: np.ndarray, mean: np.ndarray, spread: np.ndarray) -> float:
    deviation = np.abs(values - mean) / spread
    return float(np.nanmax(deviation)) if np.isfinite(deviation).any() else 0.0


def least_spread(signal: Signal, values: np.ndarray) -> float:
    """Return below which spread runs count as equal, in the signal's unit."""
    if signal.kind in _LEAST_SPREAD:
        return _LEAST_SPREAD[signal.kind]
    return max(_LEAST_SHARE_OF_RANGE * value_range(values), 1e-12)


def value_range(values: np.ndarray) -> float:
    """Return the difference of the greatest and the least value; 0 without any."""
    known = values[np.isfinite(values)]
    return float(np.ptp(known)) if len(known) else 0.0


def tolerance_band(good: Sequence[Columns], relative: float = RELATIVE_TOLERANCE) -> Band:
    """Return the band of what good runs did 0.1 s before to 0.1 s later, and a tolerance beyond.

    Args:
        good: at least one run, on one reference's clock.
        relative: the tolerance of values as a share of their range, where the configuration
            gives none; times, places and noise have tolerances of their own.
    """
    found = {}
    for signal in common_signals(tuple(good)):
        values = np.stack([it[signal] for it in good])
        low = -_greatest_around(-np.fmin.reduce(values))
        high = _greatest_around(np.fmax.reduce(values))
        found[signal] = SignalBand(0.5 * (low + high), 0.5 * (high - low)
                                   + signal_tolerance(signal, values, relative))
    return Band(found, len(good))


def widened(band: SignalBand) -> SignalBand:
    """Return the band of 0.1 s before to 0.1 s later, for what is known no better in time."""
    low = -_greatest_around(band.half_width - band.middle)
    high = _greatest_around(band.middle + band.half_width)
    return SignalBand(0.5 * (low + high), 0.5 * (high - low))


def _greatest_around(values: np.ndarray) -> np.ndarray:
    """The greatest value (t,) within the tolerance of time; NaN where the value itself is."""
    known = np.isfinite(values)
    around = moving_maximum(np.where(known, values, -np.inf), int(_TIME_TOLERANCE_S * RATE_HZ))
    result: np.ndarray = np.where(known, around, np.nan)
    return result


def signal_tolerance(signal: Signal, values: np.ndarray, relative: float) -> float:
    """Return how far a run may be from good ones, in the signal's unit."""
    if signal.tolerance is not None:
        return signal.tolerance
    if signal.kind in _TOLERANCES:
        return _TOLERANCES[signal.kind]
    return max(relative * value_range(values), 1e-9)
