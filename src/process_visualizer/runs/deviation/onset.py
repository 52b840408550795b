# SPDX-License-Identifier: BSD-3-Clause
"""The onset of a deviation: before it left the band, it grew."""
from __future__ import annotations

from typing import NamedTuple, Optional, Tuple

import numpy as np

_BEFORE_S, _LEAST_BEFORE_S, _BEHIND_S = 4.0, 0.5, 0.4
_SMALL = 0.3
"""The deviation was small where it was this share of what it is when it leaves."""
_FEWEST_ROWS = 8
_JUMP_S, _JUMP_SHARE = 0.1, 0.6
_WORSE = 1.5
"""Moments at which a fit is so much worse than the best, per degree of freedom, are possible."""


class Onset(NamedTuple):
    """The onset of a deviation and its uncertainty [s]."""

    time_s: float
    uncertainty_s: float


def onset(times_s: np.ndarray, deviation: np.ndarray, left_row: int) -> Onset:
    """Return when a deviation began that leaves the band at a row.

    Where most of the deviation came at one jump, that is the moment. Otherwise the deviation is
    taken as constant before, and as stepping or beginning to grow evenly there; the moment is that
    of the better fit (least squares).

    Args:
        times_s: (t,), even.
        deviation: (t,), NaN where unknown; signed.
        left_row: where it leaves.
    """
    rate_hz = 1.0 / (times_s[1] - times_s[0]) if len(times_s) > 1 else 1.0
    begin = _begin(deviation, left_row, rate_hz)
    end = min(_peak(deviation, left_row, int(_BEHIND_S * rate_hz)) + 1, len(times_s))
    jump = _jump(deviation, begin, left_row, rate_hz)
    if jump is not None:
        return Onset(float(times_s[jump]), _JUMP_S)
    rows = begin + np.flatnonzero(np.isfinite(deviation[begin:end]))
    if len(rows) < _FEWEST_ROWS or left_row - rows[0] < 2:
        return Onset(float(times_s[left_row]), float(times_s[left_row] - times_s[begin]))
    x, y = times_s[rows], deviation[rows]
    errors = np.minimum(_step_errors(y), _bend_errors(x, y))
    errors[x > times_s[left_row]] = np.inf
    best = int(errors.argmin())
    allowed = errors[best] + _WORSE * errors[best] / len(x) + 1e-12
    possible = x[errors <= allowed]
    half = max(possible[-1] - x[best], x[best] - possible[0])
    return Onset(float(x[best]), float(half + 0.5 / rate_hz))


def lasting_onset(times_s: np.ndarray, deviation: np.ndarray, left_row: int, sign: float,
                  over_s: float) -> Onset:
    """Return when a deviation began that is seen only in means over a longer time.

    The moment is the one before which the mean is least, and behind which it is greatest; if
    there is none, the deviation was there from the beginning.

    Args:
        times_s, deviation: as for ``onset``.
        left_row: where the mean leaves the band.
        sign: of the mean.
        over_s: the time of the mean.
    """
    rows = np.flatnonzero(np.isfinite(deviation[:left_row + 1]))
    if len(rows) < _FEWEST_ROWS:
        return Onset(float(times_s[left_row]), over_s)
    half = int(0.5 * over_s / (times_s[1] - times_s[0]))
    size = sign * float(np.nanmean(deviation[max(left_row - half // 2, 0):left_row + half + 1]))
    excess = np.cumsum(np.concatenate(([0.0], sign * deviation[rows] - 0.5 * size)))
    first = min(int(excess.argmin()), len(rows) - 1)  # it falls before, and rises from there on
    return Onset(float(times_s[rows[first]]), min(0.25 * over_s, 0.5))


def _begin(deviation: np.ndarray, left_row: int, rate_hz: float) -> int:
    """Return the begin of the fits: as long before the last small deviation as it grew since."""
    first = max(left_row - int(_BEFORE_S * rate_hz), 0)
    away = deviation[first:left_row + 1] * np.sign(deviation[left_row])
    with np.errstate(invalid='ignore'):
        small = np.flatnonzero(away < _SMALL * away[-1])
    last_small = first + int(small[-1]) if len(small) else first
    before = max(left_row - last_small, int(_LEAST_BEFORE_S * rate_hz))
    return max(last_small - before, 0)


def _jump(deviation: np.ndarray, begin: int, left_row: int, rate_hz: float) -> Optional[int]:
    """The row of the greatest jump before the band was left, if it explains that."""
    half = max(int(0.5 * _JUMP_S * rate_hz), 1)
    rows = np.arange(max(begin, 3 * half), min(left_row + 1, len(deviation) - 3 * half))
    if not len(rows):
        return None
    known = np.nan_to_num(deviation, nan=0.0)
    total = np.concatenate(([0.0], np.cumsum(known)))
    before = total[rows - half] - total[rows - 3 * half]
    behind = total[rows + 3 * half] - total[rows + half]
    sign = np.sign(deviation[left_row])
    jumps = (behind - before) / (2 * half) * sign
    best = int(jumps.argmax())
    is_one = jumps[best] > _JUMP_SHARE * abs(deviation[left_row]) and \
        sign * before[best] / (2 * half) < _SMALL * jumps[best]  # otherwise it had begun to grow
    return int(rows[best]) if is_one else None


def _peak(deviation: np.ndarray, row: int, reach: int) -> int:
    """Return where it is greatest soon after it has left, by when it is known whether it steps."""
    after = np.nan_to_num(np.abs(deviation[row:row + reach + 1]), nan=0.0)
    return row + int(after.argmax())


def _step_errors(values: np.ndarray) -> np.ndarray:
    """The squared errors (n,) of a constant before each row and another one from it on."""
    count = np.arange(1, len(values) + 1)
    first, square = np.cumsum(values), np.cumsum(values * values)
    before = square - first * first / count
    rest = len(values) - count
    behind = (square[-1] - square) - (first[-1] - first) ** 2 / np.maximum(rest, 1)
    errors = np.full(len(values), np.inf)
    errors[1:] = before[:-1] + np.maximum(behind[:-1], 0.0)
    return errors


def _bend_errors(times_s: np.ndarray, values: np.ndarray) -> np.ndarray:
    """The squared errors (n,) of a constant up to each row and a straight line from it on."""
    rise = np.maximum(times_s[np.newaxis, :] - times_s[:, np.newaxis], 0.0)
    inner, level = _centered(rise, values)
    spread = (inner * inner).sum(axis=1)
    cross = inner @ level
    explained = np.where(spread > 0.0, cross * cross / np.where(spread > 0.0, spread, 1.0), 0.0)
    result: np.ndarray = (level * level).sum() - explained
    result[-2:] = np.inf
    return result


def _centered(rise: np.ndarray, values: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
    return rise - rise.mean(axis=1, keepdims=True), values - values.mean()
