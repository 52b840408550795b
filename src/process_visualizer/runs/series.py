# SPDX-License-Identifier: BSD-3-Clause
"""Series of numbers over time: where data are missing, moving windows, and values that hold."""
from __future__ import annotations

from difflib import SequenceMatcher
from typing import List, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from process_visualizer.robot.placements import interpolated
from process_visualizer.runs.run import Channel, ChannelKind, Run

# Parts of a series in which nothing is known: data are missing there, or came late.

_MISSED, _MIN_GAP_S, _MAX_GAP_S = 5.0, 0.1, 0.5
"""Number of periods without data that make a gap, and limits to its duration [s]."""
_HELD_UP, _MIN_HELD_UP_S = 4.0, 0.025
"""Minimum pause, in periods and in s, after which data that arrive at once were held up."""
_AT_ONCE = 0.4
"""Maximum distance of values that arrive at once, as a share of a period."""
_CATCH_UP = 0.5
"""Minimum share of the messages that were due in a pause that arrive at once after it."""
_MAX_PERIOD_S = 0.1
"""Maximum period of a series for which data that were held up are recognized [s]."""
_BUNCH = 200
_TIE_S = 1e-6
"""Rounding of stamps: a gap that exceeds a limit by less does not count [s]."""
_NONE = np.empty((0, 2))


def period_s(times_s: np.ndarray) -> float:
    """Return the usual time between two values [s]; 0 with fewer than two values."""
    return median(times_s[1:] - times_s[:-1]) if len(times_s) > 1 else 0.0


def median(values: np.ndarray) -> float:
    """Return the median of some values, none of which is NaN.

    numpy's takes twice as long for the few hundred values of a channel.
    """
    middle, is_odd = divmod(len(values), 2)
    found = np.partition(values, middle if is_odd else (middle - 1, middle))
    return float(found[middle] if is_odd else 0.5 * (found[middle - 1] + found[middle]))


def data_gaps(times_s: np.ndarray, usual_s: Optional[float] = None) -> np.ndarray:
    """Return the gaps of a series, (k, 2) [s]: start and end of each.

    A driver, network or disk that was held up for a moment delivers everything afterwards, all at
    once. If messages have no stamp, it is unknown when these values were measured: they belong to
    the gap.

    Args:
        times_s: (n,), ascending.
        usual_s: the usual time between two values [s]; default: the median.
    """
    if usual_s is None:
        usual_s = period_s(times_s)
    if usual_s <= 0.0:
        return _NONE
    steps = np.diff(times_s)
    long = min(max(_MISSED * usual_s, _MIN_GAP_S), _MAX_GAP_S) + _TIE_S
    held_up = max(_HELD_UP * usual_s, _MIN_HELD_UP_S)
    found: List[Tuple[float, float]] = []
    for row in np.flatnonzero(steps > min(held_up, long)).tolist():
        behind = row + 1
        if usual_s <= _MAX_PERIOD_S:
            slow = np.flatnonzero(steps[behind:behind + _BUNCH] >= _AT_ONCE * usual_s)
            behind += int(slow[0]) if len(slow) else min(_BUNCH, len(steps) - behind)
            # The first one may arrive a little earlier than the others that were held up.
            owed = min(int(steps[row] / usual_s), _BUNCH)
            at_once = np.flatnonzero(steps[row + 1:row + 1 + owed] < _AT_ONCE * usual_s)
            if len(at_once) >= _CATCH_UP * owed:
                behind = max(behind, row + 2 + int(at_once[-1]))
        if steps[row] > long or (behind > row + 1 and steps[row] > held_up):
            found.append((float(times_s[row]), float(times_s[behind])))
    return np.array(found) if found else _NONE


def inside(times_s: np.ndarray, gaps: np.ndarray, margin_s: float = 0.0) -> np.ndarray:
    """Return which times (m,) lie in a gap, or within a margin of one (bool); NaN does not."""
    result = np.zeros(len(times_s), bool)
    with np.errstate(invalid='ignore'):
        for begin_s, end_s in gaps:
            result |= (times_s > begin_s - margin_s) & (times_s < end_s + margin_s)
    return result


def known_at(times_s: np.ndarray, known_s: np.ndarray, values: np.ndarray,
             gaps: Optional[np.ndarray] = None) -> np.ndarray:
    """Return values (m, k) at times (m,), NaN in gaps and for times that are NaN.

    Args:
        times_s: (m,), NaN for no time.
        known_s, values: the series, (n,) and (n, k).
        gaps: those of the series, if they are known already.
    """
    if gaps is None:
        gaps = data_gaps(known_s)
    found = np.full((len(times_s), values.shape[1]), np.nan)
    asked = np.isfinite(times_s)
    if len(gaps):
        asked &= ~inside(times_s, gaps)
        in_time = ~inside(known_s, gaps)
        known_s, values = known_s[in_time], values[in_time]
    found[asked] = interpolated(times_s[asked], known_s, values, np.inf)
    return found


def slow_values(times_s: np.ndarray, known_s: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Return values (m,) at times (m,) of a slow series (n,), NaN where it has none.

    Between two values there is a straight line; the first and the last value hold for five usual
    periods.
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


# Means, maxima and roughness of a series over a moving window.

ROUGH_S, FINE_S = 0.5, 0.2
_MIN_SHARE = 3e-3


def moving_mean(values: np.ndarray, rows: int) -> np.ndarray:
    """Return the means (..., n) over ``rows`` values around each along the last axis, ignoring NaN.

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
    """Return the maximum (..., n) of each value and of ``reach`` values before and after it."""
    result = values
    left = min(reach, values.shape[-1] - 1)
    step = 1
    while left > 0:  # the maxima so far, shifted by their own reach
        step = min(step, left)
        wider = result.copy()
        np.maximum(wider[..., step:], result[..., :-step], out=wider[..., step:])
        np.maximum(wider[..., :-step], result[..., step:], out=wider[..., :-step])
        np.maximum(wider[..., :step], result[..., :1], out=wider[..., :step])
        np.maximum(wider[..., -step:], result[..., -1:], out=wider[..., -step:])
        result, left, step = wider, left - step, 2 * step + 1
    return result if result is not values else values.copy()


def mean_of_last(values: np.ndarray, rows: int) -> np.ndarray:
    """Return the means (n,) of the known values among the last ``rows`` at each.

    NaN where the value is NaN, and before half of a window.
    """
    known = np.isfinite(values)
    total, count = (_running(np.where(known, it, 0.0)) for it in (values, known.astype(float)))
    end = np.arange(len(values)) + 1
    begin = np.maximum(end - rows, 0)
    number = count[end] - count[begin]
    result: np.ndarray = np.where(known & (number >= 0.5 * rows),
                                  (total[end] - total[begin]) / np.maximum(number, 1.0), np.nan)
    return result


def spans(is_true: np.ndarray) -> List[Tuple[int, int]]:
    """Return the first row of each stretch that is true (n,), and the row after it."""
    edges = np.flatnonzero(np.diff(np.concatenate(([False], is_true, [False])).astype(np.int8)))
    return [(int(first), int(behind)) for first, behind in edges.reshape(-1, 2)]


def _running(values: np.ndarray) -> np.ndarray:
    zero = np.zeros(values.shape[:-1] + (1,))
    return np.concatenate((zero, np.cumsum(values, axis=-1, dtype=float)), axis=-1)


def fine_part(values: np.ndarray, rows: float) -> np.ndarray:
    """Return the distance of values (n,) from their mean over some rows around them.

    The rows need not be a whole number: a part of one more row counts on each side. With whole
    numbers, two runs at 49.9 and 50.1 Hz would differ, as an even number has no middle.
    """
    inner, part = divmod(0.5 * (rows - 1.0), 1.0)
    narrow = 2 * int(inner) + 1
    share = part * (narrow + 2) / (narrow + 2.0 * part)
    result: np.ndarray = values - (1.0 - share) * moving_mean(values, narrow) \
        - share * moving_mean(values, narrow + 2)
    return result


def roughness(times_s: np.ndarray, values: np.ndarray, value_range: float) -> np.ndarray:
    """Return the logarithm (n,) of the RMS distance from the moving mean in the last 0.5 s.

    Args:
        times_s: (n,), ascending, about even.
        values: (n,), finite.
        value_range: anything much finer than this range counts as equally smooth.
    """
    if len(values) < 2 or times_s[-1] <= times_s[0]:
        return np.zeros(len(values))
    rate_hz = (len(values) - 1) / (times_s[-1] - times_s[0])
    fine = fine_part(values, max(FINE_S * rate_hz, 3.0))
    square = _mean_of_last(fine * fine, max(int(ROUGH_S * rate_hz), 3))
    least = max(_MIN_SHARE * value_range, 1e-12)
    result: np.ndarray = 0.5 * np.log(square + least * least)
    return result


def _mean_of_last(values: np.ndarray, rows: int) -> np.ndarray:
    """Return means of the last ``rows`` values; the first get that of the first whole window."""
    total = _running(values)
    end = np.maximum(np.arange(len(values)) + 1, min(rows, len(values)))
    begin = np.maximum(end - rows, 0)
    result: np.ndarray = np.maximum(total[end] - total[begin], 0.0) / (end - begin)
    return result


# Channels of whole numbers and bits: which value holds when.

_MAX_CHANGES, _FEW_CHANGES = 0.2, 3
"""Maximum changes of a sequence, as a share of its messages, and in number if they are few.

Whole numbers that change more often are measurements, unless they are sent on change.
"""
_MIN_ON_CHANGE_S, _UNEVEN, _REPEATED = 0.1, 3.0, 0.1
"""Minimum mean period of numbers sent on change [s], ratio of long and short steps, and maximum
share of messages that repeat the value before."""
_CYCLIC_S, _MISSED_PERIODS = 0.5, 10.0
"""Maximum period [s] of a cyclic channel, and number of periods without data that end it."""


class States(NamedTuple):
    """The values (k,) that hold one after the other, each from ``since_s`` (k,) [s] on.

    The state of a channel that is sent all the time is unknown from ``until_s`` on.
    """

    values: Tuple[float, ...]
    since_s: Tuple[float, ...]
    until_s: float = np.inf


def is_sequence(channel: Channel) -> bool:
    """Return whether a channel has states or bits: whole numbers that hold for a while.

    Numbers that are sent only when they change arrive unevenly, measurements evenly. Numbers with
    names are states in any case.
    """
    values = channel.values[np.isfinite(channel.values)]
    if channel.kind is not ChannelKind.VARIABLE or channel.unit or not len(values):
        return False
    if (values != np.rint(values)).any():
        return False
    if channel.value_names:
        return True
    changes = int(np.count_nonzero(np.diff(values)))
    return changes <= max(_MAX_CHANGES * len(values), _FEW_CHANGES) or \
        period_s(channel.times_s) > _CYCLIC_S or _is_sent_on_change(channel.times_s, changes)


def _is_sent_on_change(times_s: np.ndarray, changes: int) -> bool:
    """Return whether messages (n,) with so many changes of the value are sent only on change."""
    steps_s = np.diff(times_s)
    if not len(steps_s) or len(steps_s) - changes > max(_REPEATED * len(steps_s), 1.0):
        return False
    short_s, long_s = np.percentile(steps_s, (10, 90))
    return float(steps_s.mean()) >= _MIN_ON_CHANGE_S and bool(long_s > _UNEVEN * short_s)


def states(channel: Channel) -> States:
    """Return the values that a channel has one after the other."""
    finite = np.isfinite(channel.values)
    times_s, values = channel.times_s[finite], channel.values[finite]
    if not len(values):
        return States((), ())
    first = np.concatenate(([True], np.diff(values) != 0.0))
    usual_s = period_s(times_s)
    is_cyclic = len(values) > _MISSED_PERIODS and 0.0 < usual_s <= _CYCLIC_S and \
        not _is_sent_on_change(times_s, int(np.count_nonzero(first[1:])))
    until_s = float(times_s[-1]) + _MISSED_PERIODS * usual_s if is_cyclic else np.inf
    return States(tuple(values[first].tolist()), tuple(times_s[first].tolist()), until_s)


def edits(mine: Sequence[float], other: Sequence[float]) -> List[Tuple[str, int, int, int, int]]:
    """Return the edits that turn one order of values into the other, as ``difflib`` names them.

    Each edit is an operation, the rows of the first order, and those of the second. Of values that
    come twice, the later ones are extra: until they come, nothing is wrong.
    """
    same = next((row for row, (one, two) in enumerate(zip(mine, other)) if one != two),
                min(len(mine), len(other)))
    found = SequenceMatcher(None, mine[same:], other[same:], False).get_opcodes()
    before = [('equal', 0, same, 0, same)] if same else []
    return before + [(what, same + i, same + j, same + k, same + m)
                     for what, i, j, k, m in found]


def held_at(times_s: np.ndarray, known_s: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Return the values (m,) that hold at times (m,): the newest; before the first, the first.

    NaN for times that are NaN, or if there is no value at all.
    """
    if not len(known_s):
        return np.full(len(times_s), np.nan)
    row = np.searchsorted(known_s, np.nan_to_num(times_s, nan=-np.inf), 'right') - 1
    result: np.ndarray = np.where(np.isfinite(times_s), values[np.maximum(row, 0)], np.nan)
    return result


# Holes of a run, in which nothing at all was recorded, and gaps in the motion of its tools.

MIN_HOLE_S = 0.1
_OFTEN_S = 0.25
"""Maximum time between two messages of a topic [s] for a hole to show that some are missing."""


def holes_s_of(run: Run) -> np.ndarray:
    """Return where a run has no message at all, (k, 2) [s], though one topic usually has many.

    A state that is sent only when it changes may have changed there, too. Several slow topics
    pause together now and then; that is not a hole.
    """
    series = [it.times_s for it in run.motions] + [it.times_s for it in run.channels]
    usual_s = min((max(period_s(it), run.duration_s / len(it)) for it in series if len(it) > 1),
                  default=np.inf)
    if usual_s >= _OFTEN_S:
        return np.empty((0, 2))
    gaps = data_gaps(np.unique(np.concatenate([[0.0, run.duration_s], *series])), usual_s)
    result: np.ndarray = gaps[gaps[:, 1] - gaps[:, 0] >= MIN_HOLE_S]
    return result


def motion_gaps_s(run: Run) -> List[np.ndarray]:
    """Return the gaps in the motion of each tool that moves, (k, 2) [s].

    A run may begin or end within a hole: it is cut where its events are, which are noticed late. A
    tool that is silent there while other topics are not may just be at rest.
    """
    holes = holes_s_of(run)
    begins, ends = (bool(it.any()) for it in (holes[:, 0] <= 0.0, holes[:, 1] >= run.duration_s))
    return [data_gaps(np.unique(np.concatenate(
        ([0.0] * begins, it.times_s, [run.duration_s] * ends))))
        for it in run.motions if len(it.times_s)]
