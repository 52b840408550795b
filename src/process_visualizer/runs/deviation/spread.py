# SPDX-License-Identifier: BSD-3-Clause
"""The spread of one signal of good runs: around their common part, by place and by run."""
from __future__ import annotations

from statistics import NormalDist
from typing import NamedTuple, Tuple

import numpy as np

from process_visualizer.runs.moving_window import moving_maximum, moving_mean

EDGE_ROWS = 5
"""An edge may come so many rows earlier or later: 0.1 s."""
_SPREAD_ROWS = 25
_ROWS_ALIKE = 12.0
"""The spread that is usual for a signal counts as much as so many runs at one place."""
_WINDOW_RUNS = 3.0
"""Of values without a window around them, the moments near by tell as much as so many runs."""
_SHARE_OF_EDGE = 0.1
_KEPT_SHARE, _OF_KEPT = 0.8, 2.28
"""Where one run may be none, the largest deviations do not count; the rest counts for them."""


class Spread(NamedTuple):
    """The common part of good runs at each time (t,), and the spread of a single one.

    ``low`` and ``high`` are the least and the greatest of what is usual within 0.1 s.
    """

    low: np.ndarray
    high: np.ndarray
    deviation: np.ndarray


def envelope(usual: np.ndarray, rows: int = EDGE_ROWS) -> Tuple[np.ndarray, np.ndarray]:
    """Return the least and the greatest (…, t) of values so many rows before and behind."""
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
    return _OF_KEPT * common(ordered)


def smoothed(square: np.ndarray, level: np.ndarray, runs: int, has_window: bool,
             least: float) -> np.ndarray:
    """Return the standard deviation (…, t) out of mean squares at each place.

    Few runs tell little of a single place. So what they say is joined with what is usual for the
    signal: a spread that is constant, and one that grows with the signal's level (t,). Where that
    changes, most runs deviate by nothing and a few by much: there is a part of the change more.
    """
    local = moving_mean(square, _SPREAD_ROWS)
    usual = _usual(local, level)
    weight = (runs - 1.0) * (1.0 if has_window else _WINDOW_RUNS)
    joined = (weight * local + _ROWS_ALIKE * usual) / (weight + _ROWS_ALIKE)
    low, high = envelope(level)
    edge = _SHARE_OF_EDGE * (high - low)
    result: np.ndarray = np.sqrt(joined + least * least + edge * edge)
    return result


def _usual(local: np.ndarray, level: np.ndarray) -> np.ndarray:
    """The squares as a constant and a share of the squared level, by least squares; (…, t)."""
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
    """Return for each run (n, t) the greatest of what lasts for three rows; 0 without any."""
    known = np.where(np.isfinite(ratio), ratio, 0.0)
    if known.shape[-1] < 3:
        result: np.ndarray = known.max(axis=-1)
        return result
    lasting: np.ndarray = np.minimum(np.minimum(known[..., 2:], known[..., 1:-1]), known[..., :-2])
    highest: np.ndarray = lasting.max(axis=-1)
    return highest


def student_quantile(rate: float, freedom: float) -> float:
    """Return what Student's t exceeds at a rate (Cornish and Fisher 1937, three terms)."""
    z = NormalDist().inv_cdf(1.0 - rate)
    return float(z + (z ** 3 + z) / (4.0 * freedom)
                 + (5.0 * z ** 5 + 16.0 * z ** 3 + 3.0 * z) / (96.0 * freedom ** 2))


def highest_of_runs(mean: np.ndarray, spread: np.ndarray, quantile: float) -> np.ndarray:
    """Return what the scores (s,) of further runs exceed as rarely as a normal number a quantile.

    Scores are not negative, and skew: they are taken as gamma distributed (Wilson and Hilferty
    1931).
    """
    ninth = (spread / np.maximum(mean, 1e-9)) ** 2 / 9.0
    result: np.ndarray = mean * (1.0 - ninth + quantile * np.sqrt(ninth)) ** 3
    return result
