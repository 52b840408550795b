# SPDX-License-Identifier: BSD-3-Clause
"""Width of the band of good runs around each signal, which good runs leave at a known rate.

At each moment, the band reaches from the lowest to the highest value that the mean of the good runs
has within 0.1 s, and beyond that by a margin: a limit times the spread of the good runs.

1. ``smoothed``: the spread at a moment is the standard deviation of the good runs around their
   mean, averaged over nearby moments, and joined with the one that is usual for the signal.
2. ``LearnedSignal.scores``: the score of a run is the greatest deviation from the other runs, in
   spreads, that lasts for three rows.
3. ``_limits``: the limit of a signal is the score that one more good run exceeds at the signal's
   share of the rate. It follows from the scores of the good runs, joined with those of signals of
   the same sort.
4. ``LearnedSignal._margin``: with few runs, which cannot show how much good runs vary, a tolerance
   is the minimum margin.

Before that, runs that are far from all others are left out (``BandLearner.outliers``).
``good_runs.py`` and ``live_comparison.py`` widen a band for what they judge.
"""
from __future__ import annotations

import math
from statistics import NormalDist
from typing import Dict, List, Mapping, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from process_visualizer.runs.deviation.signals import (
    FORCE_DIRECTION,
    RATE_HZ,
    TORQUE_DIRECTION,
    Columns,
    Signal,
    SignalKind,
    usual_signals,
)
from process_visualizer.runs.series import ROUGH_S, moving_maximum, moving_mean

# The spread of one signal of good runs around their common part, by moment and by run.

EDGE_ROWS = 5
"""Rows by which an edge may come earlier or later: 0.1 s."""
_SPREAD_ROWS = 25
_PRIOR_AT_MOMENT = 12.0
"""Weight of the usual spread of a signal, in runs at one moment."""
_WINDOW_RUNS = 3.0
"""Weight of nearby moments, in runs, for values without a window around them."""
_SHARE_OF_EDGE = 0.1
_KEPT_SHARE, _KEPT_FACTOR = 0.8, 2.28
"""Share of the deviations that counts if a run may be an outlier, and the factor for the rest."""


def envelope(usual: np.ndarray, rows: int = EDGE_ROWS) -> Tuple[np.ndarray, np.ndarray]:
    """Return the minimum and the maximum (…, t) of values within some rows before and after."""
    known = np.isfinite(usual)
    high = moving_maximum(np.where(known, usual, -np.inf), rows)
    low = -moving_maximum(np.where(known, -usual, -np.inf), rows)
    return np.where(known, low, np.nan), np.where(known, high, np.nan)


def beyond(values: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Return how far values are above ``high``, or (negative) below ``low``; 0 between them."""
    return values - np.minimum(np.maximum(values, low), high)


def common(values: np.ndarray) -> np.ndarray:
    """Return the mean (t,) of good runs (n, t); NaN where none has a value."""
    known = np.isfinite(values)
    count = known.sum(axis=0)
    total = np.where(known, values, 0.0).sum(axis=0, dtype=float)
    result: np.ndarray = np.where(count > 0, total / np.maximum(count, 1), np.nan)
    return result


def common_of_others(values: np.ndarray) -> np.ndarray:
    """Return for each run (n, t) the mean of the others."""
    known = np.isfinite(values)
    filled = np.where(known, values, 0.0)
    count = known.sum(axis=0) - known
    total = filled.sum(axis=0, dtype=float) - filled
    result: np.ndarray = np.where(count > 0, total / np.maximum(count, 1), np.nan)
    return result


def usual_square(squares: np.ndarray, robust: bool) -> np.ndarray:
    """Return the mean (t,) of squared deviations (n, t); a robust one without the largest."""
    if not robust:
        return common(squares)
    kept = max(int(np.ceil(_KEPT_SHARE * len(squares))), 1)
    ordered = np.sort(squares, axis=0)[:kept]  # NaN comes last
    return _KEPT_FACTOR * common(ordered)


def smoothed(square: np.ndarray, level: np.ndarray, runs: int, has_window: bool,
             least: float) -> np.ndarray:
    """Return the standard deviation (…, t) from the mean squares at each moment.

    Few runs say little about a single moment. So their spread is combined with the one that is
    usual for the signal: a constant part, and one that grows with the signal's level (t,). Where
    the level changes, most runs do not deviate and a few deviate much: a share of the change is
    added.
    """
    local = moving_mean(square, _SPREAD_ROWS)
    usual = _usual(local, level)
    weight = (runs - 1.0) * (1.0 if has_window else _WINDOW_RUNS)
    joined = (weight * local + _PRIOR_AT_MOMENT * usual) / (weight + _PRIOR_AT_MOMENT)
    low, high = envelope(level)
    edge = _SHARE_OF_EDGE * (high - low)
    result: np.ndarray = np.sqrt(joined + least * least + edge * edge)
    return result


def _usual(local: np.ndarray, level: np.ndarray) -> np.ndarray:
    """Return squares (…, t) as a constant and a share of the squared level, by least squares."""
    known = np.isfinite(local) & np.isfinite(level)
    count = np.maximum(known.sum(axis=-1, keepdims=True), 1)
    x = np.where(known, level * level, 0.0)
    y = np.where(known, local, 0.0)
    mean_x, mean_y = (it.sum(axis=-1, keepdims=True) / count for it in (x, y))
    away = np.where(known, x - mean_x, 0.0)
    variance = (away * away).sum(axis=-1, keepdims=True)
    slope = np.maximum((away * y).sum(axis=-1, keepdims=True), 0.0) / np.where(variance > 0.0,
                                                                               variance, 1.0)
    slope = np.minimum(slope, mean_y / np.where(mean_x > 0.0, mean_x, 1.0))
    result: np.ndarray = mean_y + slope * (level * level - mean_x)
    return result


def sustained(ratio: np.ndarray) -> np.ndarray:
    """Return for each run (n, t) the greatest value that lasts for three rows; 0 without any."""
    known = np.where(np.isfinite(ratio), ratio, 0.0)
    if known.shape[-1] < 3:
        result: np.ndarray = known.max(axis=-1)
        return result
    lasting: np.ndarray = np.minimum(np.minimum(known[..., 2:], known[..., 1:-1]), known[..., :-2])
    highest: np.ndarray = lasting.max(axis=-1)
    return highest


def student_quantile(rate: float, freedom: float) -> float:
    """Return the value that Student's t exceeds at a rate (Cornish and Fisher 1937, 3 terms)."""
    z = NormalDist().inv_cdf(1.0 - rate)
    return float(z + (z ** 3 + z) / (4.0 * freedom)
                 + (5.0 * z ** 5 + 16.0 * z ** 3 + 3.0 * z) / (96.0 * freedom ** 2))


def highest_of_runs(mean: np.ndarray, spread: np.ndarray, quantile: float) -> np.ndarray:
    """Return the score (s,) that further runs exceed as rarely as normal numbers do a quantile.

    Scores are not negative, and skewed: a gamma distribution is assumed (Wilson and Hilferty 1931).
    """
    ninth = (spread / np.maximum(mean, 1e-9)) ** 2 / 9.0
    result: np.ndarray = mean * (1.0 - ninth + quantile * np.sqrt(ninth)) ** 3
    return result


MIN_RUNS = 3
"""Minimum number of good runs for a spread, each judged by the others."""
USUAL_RATE = 0.05
"""Default rate at which a good run leaves its band."""
_ENOUGH_FOR_MEDIAN = 7
"""Number of good runs from which the median is the usual value during the search for outliers."""
_OUTLIER_RATIO = 1.8
"""A run is an outlier if it is this many times as far away as a good one may be."""
_COARSE_ROWS = 3
"""Step in rows during the search for outliers: fewer moments are enough."""
_MAX_OUTLIERS, _SHARE_OF_OUTLIERS = 0.25, 0.1
_SHARE_OF_RATE = 0.4
"""Share of the rate that is aimed at, so that it holds for most sets of good runs."""
_PRIOR_RUNS, _MIN_SCORE = 8.0, 0.2
"""Weight of the usual scores of one sort of signals, in runs, and the minimum score."""
_MIN_SPREAD: Dict[SignalKind, float] = {
    SignalKind.TIMING: 0.005, SignalKind.PLACE: 1e-4, SignalKind.NOISE: 0.05,
    SignalKind.JOINT: 2e-4}
_MIN_SHARE_OF_RANGE = 2e-3
_TOLERANCES: Dict[SignalKind, float] = {
    SignalKind.TIMING: 0.1, SignalKind.PLACE: 0.005, SignalKind.NOISE: math.log(2.5),
    SignalKind.JOINT: 0.02}
_TURNED_DEG, _TURNED_DEG_OF_ONE = 10.0, 20.0
"""Tolerances of a force's direction, with several good runs and with one.

A single run does not show how the direction of a force varies from run to run at its onset, and
two runs are hardly better.
"""
RELATIVE_TOLERANCE = 0.1
"""Default tolerance, as a share of the range of the good runs' values."""
_SHARE_OF_SIZE = 0.3
"""Minimum range of a signal, as a share of its greatest absolute value."""
_EDGE_ROWS_OF_ONE = 7
"""EDGE_ROWS for a single run, which does not show how much earlier or later an edge may come."""
_MIN_MARGIN_SHARE = 0.04
_MIN_MARGIN_SHARES: Dict[SignalKind, float] = {
    SignalKind.TIMING: 0.4, SignalKind.PLACE: 0.1, SignalKind.NOISE: 0.2, SignalKind.JOINT: 0.1}
"""Minimum margin, as a share of the tolerance of one good run, for any number of good runs."""
_NOISE_SPREADS, _CHANCE_FACTOR = 6.0, 3.5
_FEW_RUNS = 3
_SOONER_ROWS = int(ROUGH_S * RATE_HZ)
"""Rows by which the roughness of an edge, which lasts half a second, may end earlier.

Lower roughness there is not a fault: a run that lost time has less on the reference's clock.
"""
_SMOOTHER = 0.15
"""Further margin below the roughness of good runs (a logarithm): a value that is a little smoother
than usual is hardly a fault, while a constant one is much smoother."""
_TIMES_FARTHEST = 3.0
"""Maximum margin, as a multiple of the distance of the farthest good run from the others."""


class TooFewRuns(ValueError):
    """Error: there are too few good runs for a rate; the text says how many are needed."""


class SignalBand(NamedTuple):
    """The band of a signal: ``middle`` plus and minus ``half_width``, both (t,).

    ``usual`` (t,) is the mean of the good runs; ``middle`` is centered in its range within 0.1 s.
    """

    middle: np.ndarray
    half_width: np.ndarray
    usual: Optional[np.ndarray] = None


class Band(NamedTuple):
    """The bands of all signals; ``rate`` is how often a good run leaves one of them.

    Without a rate there are too few runs to support one.
    """

    signals: Mapping[Signal, SignalBand]
    runs: int
    rate: Optional[float] = None


def fewest_runs(rate: float) -> int:
    """Return how many good runs a rate needs: each of N+1 is equally likely to be the worst."""
    return max(math.ceil(1.0 / rate - 1e-9) - 1, MIN_RUNS)


def most_of(runs: int) -> int:
    """Return the maximum number of outliers among some good runs."""
    return max(int(_MAX_OUTLIERS * runs), 1)


class BandLearner:
    """Learner of the band of good runs, without outliers, and optionally without one more run."""

    def __init__(self, good: Sequence[Columns], relative: float = RELATIVE_TOLERANCE,
                 most_left_out: Optional[int] = None) -> None:
        """Set the good runs, at least one; all are on the clock of one reference.

        Args:
            good: the signals of each run.
            most_left_out: the maximum number of outliers; default: a quarter.
            relative: the tolerance of values as a share of their range with one good run; with
                more runs, less is needed.
        """
        self._count = len(good)
        self._signals = [LearnedSignal(signal, _stacked(good, signal), relative)
                         for signal in usual_signals(good) if signal.kind is not SignalKind.STATE]
        self._states = [(signal, _stacked(good, signal))
                        for signal in usual_signals(good) if signal.kind is SignalKind.STATE]
        self._kept = np.ones(self._count, bool)
        self._left_out: List[Tuple[int, Signal]] = []
        self._most_left_out = most_of(self._count) if most_left_out is None else most_left_out
        self._find_outliers()
        self._scores = self._scored(self._kept, robust=False)

    @property
    def kept(self) -> int:
        """Return the number of runs that count."""
        return int(self._kept.sum())

    def outliers(self) -> Tuple[Tuple[int, Signal], ...]:
        """Return the runs that are far from all others, and the signal in which they are.

        Such a run is left out: it would make the band so wide that it hides what it should show.
        """
        return tuple(self._left_out)

    def band(self, rate: Optional[float] = None, without: Optional[int] = None) -> Band:
        """Return the band that a further good run leaves, anywhere, at a rate.

        Each good run is judged by the others. The score of a signal is its greatest deviation over
        all times, in spreads at that time. Each signal has its own limit: the score that a further
        run exceeds at the signal's share of the rate, given the spread of the good runs' scores.

        Args:
            rate: from 0 to 1; default: about the usual one, as far as the runs allow.
            without: the number of a run that does not count because it is to be judged itself.

        Raises:
            TooFewRuns: there are fewer runs than the rate needs.
        """
        kept = self._kept.copy()
        if without is not None:
            kept[without] = False
        runs = int(kept.sum())
        given = self._count - (without is not None)
        if rate is not None and given < fewest_runs(rate):
            raise TooFewRuns(f'{given} good runs cannot support a rate of {rate:g}; '
                             f'it takes {fewest_runs(rate)}')
        scores = self._scores[:, kept]
        limits = _limits(scores, self._signals, rate or USUAL_RATE)
        found = {it.signal: it.band(kept, limit) for it, limit in zip(self._signals, limits)}
        found.update({signal: _state_band(values[kept]) for signal, values in self._states})
        return Band(found, runs, rate)

    def _scored(self, kept: np.ndarray, robust: bool) -> np.ndarray:
        scores = np.zeros((len(self._signals), self._count))
        if kept.sum() > 1:
            for row, it in enumerate(self._signals):
                scores[row, kept] = it.scores(kept, robust)
        return scores

    def _find_outliers(self) -> None:
        """Leave out the run that is farthest from the others, as long as that is an outlier."""
        robust = self._count >= _ENOUGH_FOR_MEDIAN
        scores = np.empty((0, 0))
        while self.kept > MIN_RUNS and len(self._left_out) < self._most_left_out:
            if not robust or not self._left_out:
                scores = self._scored(self._kept, robust)
            numbers = np.flatnonzero(self._kept)
            ratio = self._ratios(scores[:, numbers])
            worst = int(ratio.max(axis=0).argmax())
            if ratio[:, worst].max() <= _OUTLIER_RATIO:
                return
            signal = self._signals[int(ratio[:, worst].argmax())].signal
            self._left_out.append((int(numbers[worst]), signal))
            self._kept[numbers[worst]] = False

    def _ratios(self, scores: np.ndarray) -> np.ndarray:
        """Return the score of each run (s, n), as a multiple of what the others allow."""
        rows = np.arange(scores.shape[1])
        known = np.nan_to_num(scores)
        return np.stack([known[:, row] / self._usual_highest(scores[:, rows != row])
                         for row in rows], axis=1)

    def _usual_highest(self, scores: np.ndarray) -> np.ndarray:
        """Return the greatest usual scores (s,); one in ten of the other runs may be an outlier."""
        others = int(_SHARE_OF_OUTLIERS * (scores.shape[1] + 1) + 1e-9)
        return np.maximum(_limits(scores, self._signals, USUAL_RATE, True),
                          np.sort(np.nan_to_num(scores), axis=1)[:, -1 - others])


def learned_band(good: Sequence[Columns], rate: float) -> Band:
    """Return the band that a further good run leaves, anywhere, at a rate: see BandLearner.

    Raises:
        TooFewRuns: there are fewer runs than the rate needs.
    """
    if len(good) < fewest_runs(rate):
        raise TooFewRuns(f'{len(good)} good runs cannot support a rate of {rate:g}; '
                         f'it takes {fewest_runs(rate)}')
    return BandLearner(good).band(rate)


def _stacked(good: Sequence[Columns], signal: Signal) -> np.ndarray:
    rows = next(len(it[signal]) for it in good if signal in it)
    nothing = np.full(rows, np.nan, np.float32)
    return np.stack([it.get(signal, nothing) for it in good])


def _state_band(values: np.ndarray) -> SignalBand:
    """Return the range of good runs within 0.1 s, for display; states are judged by order."""
    low, high = envelope(np.fmin.reduce(values))[0], envelope(np.fmax.reduce(values))[1]
    return SignalBand(0.5 * (low + high), 0.5 * (high - low) + 0.5)


def _limits(scores: np.ndarray, signals: Sequence['LearnedSignal'], rate: float,
            robust: bool = False) -> np.ndarray:
    """Return the score (s,) that each signal of a further run exceeds at its share of the rate.

    Args:
        scores: (s, n) of the good runs.
        signals: (s) of the scores.
        rate: of all signals together.
        robust: allow for an outlier among the runs.
    """
    known = np.isfinite(scores)
    runs = known.sum(axis=1)
    if scores.shape[1] < 2 or not len(signals):
        return np.full(len(signals), np.nan)
    if robust:
        middle = _median(scores.T)
        spread = 1.4826 * _median(np.abs(scores - middle[:, np.newaxis]).T)
    else:
        middle = common(scores.T)
        away = np.where(known, scores - middle[:, np.newaxis], 0.0)
        spread = np.sqrt((away * away).sum(axis=1) / np.maximum(runs - 1, 1))
    tells = runs > 1
    sorts = np.array([it.sort for it in signals])
    weight = np.where(tells, runs / (runs + _PRIOR_RUNS), 0.0)
    for sort in np.unique(sorts):
        rows = sorts == sort
        if not tells[rows].any():
            continue
        alike = (float(np.median(middle[rows & tells])),
                 float(np.mean(spread[rows & tells] ** 2)))
        own = np.where(tells[rows], middle[rows], 0.0), np.where(tells[rows], spread[rows], 0.0)
        share = weight[rows]
        middle[rows] = share * own[0] + (1.0 - share) * alike[0]
        spread[rows] = np.sqrt(share * own[1] ** 2 + (1.0 - share) * alike[1])
    quantile = np.array([student_quantile(_SHARE_OF_RATE * rate / len(signals),
                                          max(it - 1.0, 0.0) + _PRIOR_RUNS) for it in runs])
    middle = np.maximum(middle, _MIN_SCORE)
    limits = highest_of_runs(middle, np.sqrt(1.0 + 1.0 / np.maximum(runs, 1)) * spread, quantile)
    return limits if robust else np.fmax(limits, np.max(np.where(known, scores, 0.0), axis=1))


class LearnedSignal:
    """The common part of good runs in one signal, and the distance of each from the others."""

    def __init__(self, signal: Signal, values: np.ndarray, relative: float) -> None:
        """Initialize with the values (runs, t)."""
        self.signal = signal
        is_exact = signal.kind in (SignalKind.PLACE, SignalKind.TIMING, SignalKind.JOINT,
                                   SignalKind.SPEED)
        self.sort = (signal.over_s > 0.0) + 2 * (signal.kind is SignalKind.NOISE) + 4 * is_exact
        self._values = values
        self._least = least_spread(signal, values)
        self._relative = relative

    def scores(self, kept: np.ndarray, robust: bool) -> np.ndarray:
        """Return the score of each kept run, judged by the others."""
        values = self._values[kept]
        if robust:
            values = values[:, ::_COARSE_ROWS]
        usual, deviation = self._deviation(values, robust)
        squares = deviation * deviation
        whole = usual_square(squares, robust)
        if robust:
            square = np.broadcast_to(whole, values.shape)
        else:
            known = np.isfinite(squares)
            count = known.sum(axis=0) - known
            total = np.where(known, squares, 0.0)
            square = np.where(count > 0, (total.sum(axis=0) - total) / np.maximum(count, 1), np.nan)
        spread = smoothed(square, usual, max(_with_values(values) - 1, 1),
                          self.signal.over_s > 0.0, self._least)
        with np.errstate(invalid='ignore'):
            found = sustained(np.abs(deviation) / spread)
        found[~np.isfinite(deviation).any(axis=1)] = np.nan  # missing data stays missing
        return found

    def band(self, kept: np.ndarray, limit: float) -> SignalBand:
        """Return the band of the kept runs, up to ``limit`` spreads."""
        values = self._values[kept]
        edge_rows = self._edge_rows
        if len(values) == 1:
            edge_rows = _EDGE_ROWS_OF_ONE * edge_rows // EDGE_ROWS
        low, high = self._range(common(values), edge_rows)
        margin = self._margin(values)
        if len(values) > 1:
            usual, deviation = self._deviation(values, False)
            spread = smoothed(common(deviation * deviation), usual, _with_values(values),
                              self.signal.over_s > 0.0, self._least)
            farthest = float(sustained(np.abs(deviation)).max())
            margin = np.maximum(margin, np.minimum(limit * spread, _TIMES_FARTHEST * farthest))
        if self.signal.max_tolerance is not None:
            margin = np.minimum(margin, self.signal.max_tolerance)
        if self.signal.kind is SignalKind.NOISE:
            low = low - _SMOOTHER
        return SignalBand(0.5 * (low + high), 0.5 * (high - low) + margin, common(values))

    @property
    def _edge_rows(self) -> int:
        """Return by how many rows an edge may come earlier or later.

        A value that is sent once a second may be measured at any time in that second.
        """
        rows = 2 * EDGE_ROWS if self.signal.kind is SignalKind.NOISE else EDGE_ROWS
        return rows + int(self.signal.period_s * RATE_HZ)

    def _deviation(self, values: np.ndarray, robust: bool) -> Tuple[np.ndarray, np.ndarray]:
        """Return the usual value (t,), and each run's distance from that of the others (n, t)."""
        if robust:
            usual = _median(values)
            return usual, beyond(values, *self._range(usual, self._edge_rows // _COARSE_ROWS + 1,
                                                      _COARSE_ROWS))
        return common(values), beyond(values, *self._range(common_of_others(values),
                                                           self._edge_rows))

    def _range(self, usual: np.ndarray, rows: int,
               step: int = 1) -> Tuple[np.ndarray, np.ndarray]:
        """Return the minimum and the maximum (…, t) of usual values at edges that may shift.

        ``usual`` has every ``step``-th row, and ``rows`` are such ones.
        """
        low, high = envelope(usual, rows)
        if self.signal.kind is SignalKind.NOISE:
            reach = _SOONER_ROWS // (2 * step)
            soon, _ = envelope(usual, reach)  # shifted, the minimum of the rows that follow
            ahead = np.concatenate((soon[..., reach:], soon[..., :reach] + np.nan), axis=-1)
            low = np.where(np.isfinite(low), np.fmin(low, ahead), np.nan)
        return low, high

    def _margin(self, values: np.ndarray) -> float:
        """Return the minimum margin around good runs, in the signal's unit.

        Many good runs show what may differ, while a single one needs a wider margin. Places deviate
        slowly, so two runs may agree by chance all the way: n runs say as much as n - 1. So do up
        to three about roughness, and any number about the direction of a force that sets in.
        """
        given = self.signal.tolerance
        if given is not None:
            return given
        freedom = max(len(values) - 1, 1)
        whole = math.hypot(signal_tolerance(self.signal, self._values, self._relative),
                           _CHANCE_FACTOR * self.signal.chance)
        least = _MIN_MARGIN_SHARES.get(self.signal.kind, _MIN_MARGIN_SHARE)
        is_exact = self.signal.kind in (SignalKind.PLACE, SignalKind.JOINT)
        is_rare = self.signal.kind is SignalKind.NOISE and len(values) <= _FEW_RUNS
        count = freedom if is_rare else len(values)
        margin = whole * max(1.0 / freedom if is_exact else 1.0 / math.sqrt(count), least)
        if self.signal.label in (FORCE_DIRECTION, TORQUE_DIRECTION):
            return max(margin, _TURNED_DEG_OF_ONE / math.sqrt(freedom))
        if len(values) > 1:
            return margin
        return max(margin, _NOISE_SPREADS * _fine_spread(values))


def _with_values(values: np.ndarray) -> int:
    """Return the number of runs (n, t) that have any value."""
    return int(np.isfinite(values).any(axis=1).sum())


def _median(values: np.ndarray) -> np.ndarray:
    """Return the median (t,) of the known values (n, t); NaN where none is known."""
    count = np.isfinite(values).sum(axis=0)
    ordered = np.sort(values, axis=0)  # NaN comes last
    columns = np.arange(values.shape[1])
    last = np.maximum(count - 1, 0)
    result: np.ndarray = 0.5 * (ordered[last // 2, columns] + ordered[(last + 1) // 2, columns])
    return result


def _fine_spread(values: np.ndarray) -> float:
    """Return the standard deviation of the noise, from second differences over 0.1 s."""
    steps = np.abs(values[:, 10:] - 2.0 * values[:, 5:-5] + values[:, :-10])
    known = steps[np.isfinite(steps)]
    return float(np.median(known)) / 0.6745 / math.sqrt(6.0) if len(known) else 0.0


def least_spread(signal: Signal, values: np.ndarray) -> float:
    """Return the spread below which runs count as equal, in the signal's unit."""
    if signal.kind in _MIN_SPREAD:
        return _MIN_SPREAD[signal.kind]
    return max(_MIN_SHARE_OF_RANGE * value_range(values), 1e-12)


def value_range(values: np.ndarray) -> float:
    """Return the difference of the greatest and the least value; 0 without any.

    The range of a signal that hardly changes counts as a share of its size.
    """
    known = values[np.isfinite(values)]
    if not len(known):
        return 0.0
    return max(float(np.ptp(known)), _SHARE_OF_SIZE * float(np.abs(known).max()))


def tolerance_band(good: Sequence[Columns], relative: float = RELATIVE_TOLERANCE) -> Band:
    """Return the band of a few good runs: what they did, their spread, and a tolerance.

    Args:
        good: at least one run, on one reference's clock.
        relative: the tolerance of values as a share of their range, where the configuration
            gives none; times, places and noise have tolerances of their own.
    """
    return BandLearner(good, relative).band()


def widened(band: SignalBand, rows: int = EDGE_ROWS) -> SignalBand:
    """Return the band from some rows before to some rows later, for signals with inexact times."""
    low, _ = envelope(band.middle - band.half_width, rows)
    _, high = envelope(band.middle + band.half_width, rows)
    return SignalBand(0.5 * (low + high), 0.5 * (high - low))


def signal_tolerance(signal: Signal, values: np.ndarray, relative: float) -> float:
    """Return how far a run may be from a single good one, in the signal's unit."""
    if signal.tolerance is not None:
        return signal.tolerance
    if signal.label in (FORCE_DIRECTION, TORQUE_DIRECTION):
        return _TURNED_DEG
    if signal.kind in _TOLERANCES:
        return _TOLERANCES[signal.kind]
    return max(relative * value_range(values), 1e-9)
