# SPDX-License-Identifier: BSD-3-Clause
"""Parts of a series in which nothing is known: data are missing there, or came late."""
from __future__ import annotations

from typing import List, Tuple

import numpy as np

from process_visualizer.motion.placements import interpolated

_MISSED, _MIN_GAP_S, _MAX_GAP_S = 5.0, 0.1, 0.5
"""Data are missing where so many periods have nothing, if that is neither so short nor so long."""
_HELD_UP, _MIN_HELD_UP_S = 4.0, 0.025
"""Data were held up where so many periods have nothing, and what follows comes at once."""
_AT_ONCE = 0.4
"""Of a period; what comes so closely together was held up."""
_MAX_PERIOD_S = 0.1
"""Of a series of slower ones it is not told whether they were held up."""
_BUNCH = 200
_NONE = np.empty((0, 2))


def period_s(times_s: np.ndarray) -> float:
    """Return the usual time between two values [s]; 0 of fewer than two values."""
    return float(np.median(np.diff(times_s))) if len(times_s) > 1 else 0.0


def data_gaps(times_s: np.ndarray) -> np.ndarray:
    """Return the gaps of a series, (k, 2) [s]: begin and end of each.

    A driver, network or disk that was held up for a moment delivers afterwards what it owes,
    all at once. Where messages carry no stamp, nobody knows when these values were measured: they
    belong to the gap.

    Args:
        times_s: (n,), rising.
    """
    usual_s = period_s(times_s)
    if usual_s <= 0.0:
        return _NONE
    steps = np.diff(times_s)
    long = min(max(_MISSED * usual_s, _MIN_GAP_S), _MAX_GAP_S)
    held_up = max(_HELD_UP * usual_s, _MIN_HELD_UP_S)
    found: List[Tuple[float, float]] = []
    for row in np.flatnonzero(steps > min(held_up, long)).tolist():
        behind = row + 1
        if usual_s <= _MAX_PERIOD_S:
            slow = np.flatnonzero(steps[behind:behind + _BUNCH] >= _AT_ONCE * usual_s)
            behind += int(slow[0]) if len(slow) else min(_BUNCH, len(steps) - behind)
        if steps[row] > long or (behind > row + 1 and steps[row] > held_up):
            found.append((float(times_s[row]), float(times_s[behind])))
    return np.array(found) if found else _NONE


def inside(times_s: np.ndarray, gaps: np.ndarray, margin_s: float = 0.0) -> np.ndarray:
    """Return which times (m,) lie in a gap (bool), or so near to one; those that are NaN do not."""
    result = np.zeros(len(times_s), bool)
    with np.errstate(invalid='ignore'):
        for begin_s, end_s in gaps:
            result |= (times_s > begin_s - margin_s) & (times_s < end_s + margin_s)
    return result


def known_at(times_s: np.ndarray, known_s: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Return values (m, k) at times (m,), NaN in gaps and where the time is.

    Args:
        times_s: (m,), NaN where there is no such time.
        known_s, values: the series, (n,) and (n, k).
    """
    gaps = data_gaps(known_s)
    found = np.full((len(times_s), values.shape[1]), np.nan)
    asked = np.isfinite(times_s) & ~inside(times_s, gaps)
    late = inside(known_s, gaps)
    found[asked] = interpolated(times_s[asked], known_s[~late], values[~late], np.inf)
    return found


def slow_values(times_s: np.ndarray, known_s: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Return values (m,) at times (m,) of a series (n,) that comes seldom, NaN where it has none.

    Between two values there is a straight line; the first and the last hold as long as the series
    usually has none.
    """
    if not len(known_s):
        return np.full(len(times_s), np.nan)
    found = np.interp(times_s, known_s, values)
    usual_s = period_s(known_s)
    if usual_s <= 0.0:
        return np.where(np.isfinite(times_s), found, np.nan)
    longest_s = _MISSED * usual_s
    behind = np.searchsorted(known_s, np.nan_to_num(times_s, nan=-np.inf))
    before_s = known_s[np.maximum(behind - 1, 0)]
    after_s = known_s[np.minimum(behind, len(known_s) - 1)]
    with np.errstate(invalid='ignore'):
        is_near = np.minimum(np.abs(times_s - before_s), np.abs(after_s - times_s)) <= longest_s
        is_near &= (after_s - before_s) <= longest_s
    result: np.ndarray = np.where(is_near, found, np.nan)
    return result
