# SPDX-License-Identifier: BSD-3-Clause
"""Means, maxima and roughness of a series over a moving window."""
from __future__ import annotations

import numpy as np

ROUGH_S = 0.5
_MEAN_S = 0.2
_LEAST_SHARE = 3e-3


def moving_mean(values: np.ndarray, rows: int) -> np.ndarray:
    """Return the means (..., n) over so many rows around each of the last axis, without NaN.

    At the ends the window is cut off; where a value is NaN, so is its mean.
    """
    known = np.isfinite(values)
    total, count = (_running(np.where(known, it, 0.0)) for it in (values, known.astype(float)))
    here = np.arange(values.shape[-1])
    begin = np.maximum(here - rows // 2, 0)
    end = np.minimum(here + (rows - 1) // 2 + 1, len(here))
    number = count[..., end] - count[..., begin]
    mean = (total[..., end] - total[..., begin]) / np.maximum(number, 1.0)
    result: np.ndarray = np.where(known, mean, np.nan)
    return result


def moving_maximum(values: np.ndarray, reach: int) -> np.ndarray:
    """Return the greatest of so many values (..., n) before and behind each, and of itself."""
    result = values
    left = min(reach, values.shape[-1] - 1)
    step = 1
    while left > 0:  # the greatest of what reaches so far already, moved by as much again
        step = min(step, left)
        wider = result.copy()
        np.maximum(wider[..., step:], result[..., :-step], out=wider[..., step:])
        np.maximum(wider[..., :-step], result[..., step:], out=wider[..., :-step])
        np.maximum(wider[..., :step], result[..., :1], out=wider[..., :step])
        np.maximum(wider[..., -step:], result[..., -1:], out=wider[..., -step:])
        result, left, step = wider, left - step, 2 * step + 1
    return result if result is not values else values.copy()


def mean_of_last(values: np.ndarray, rows: int) -> np.ndarray:
    """Return the means (n,) of what is known of so many values up to each.

    NaN where the value is, and before half of a window.
    """
    known = np.isfinite(values)
    total, count = (_running(np.where(known, it, 0.0)) for it in (values, known.astype(float)))
    end = np.arange(len(values)) + 1
    begin = np.maximum(end - rows, 0)
    number = count[end] - count[begin]
    result: np.ndarray = np.where(known & (number >= 0.5 * rows),
                                  (total[end] - total[begin]) / np.maximum(number, 1.0), np.nan)
    return result


def _running(values: np.ndarray) -> np.ndarray:
    zero = np.zeros(values.shape[:-1] + (1,))
    return np.concatenate((zero, np.cumsum(values, axis=-1, dtype=float)), axis=-1)


def roughness(times_s: np.ndarray, values: np.ndarray, value_range: float) -> np.ndarray:
    """Return the logarithm (n,) of the RMS distance from the moving mean in the last 0.5 s.

    Args:
        times_s: (n,), rising, about even.
        values: (n,), finite.
        value_range: what is much finer than this range counts as equally smooth.
    """
    if len(values) < 2 or times_s[-1] <= times_s[0]:
        return np.zeros(len(values))
    rate_hz = (len(values) - 1) / (times_s[-1] - times_s[0])
    fine = values - moving_mean(values, max(int(_MEAN_S * rate_hz), 3))
    square = _mean_of_last(fine * fine, max(int(ROUGH_S * rate_hz), 3))
    least = max(_LEAST_SHARE * value_range, 1e-12)
    result: np.ndarray = 0.5 * np.log(square + least * least)
    return result


def _mean_of_last(values: np.ndarray, rows: int) -> np.ndarray:
    """The means of so many values up to each; the first have that of the first whole window."""
    total = _running(values)
    end = np.maximum(np.arange(len(values)) + 1, min(rows, len(values)))
    begin = np.maximum(end - rows, 0)
    result: np.ndarray = np.maximum(total[end] - total[begin], 0.0) / (end - begin)
    return result
