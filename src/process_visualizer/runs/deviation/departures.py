# SPDX-License-Identifier: BSD-3-Clause
"""Decides when a signal has left the band, when that began (onset), and which left first."""
from __future__ import annotations

from typing import Callable, Dict, List, Mapping, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from process_visualizer.runs.deviation.band import EDGE_ROWS, Band, SignalBand, envelope
from process_visualizer.runs.deviation.signals import (
    FORCE_DIRECTION,
    NOISE_SUFFIX,
    TIMING_LABEL,
    TORQUE_DIRECTION,
    Signal,
    SignalKind,
    lost_s,
)
from process_visualizer.runs.series import ROUGH_S, moving_maximum, spans

# The onset of a deviation: before it left the band, it grew.

_BEFORE_S, _MIN_BEFORE_S, _BEHIND_S = 4.0, 0.5, 0.4
_SMALL = 0.3
"""A deviation is small up to this share of its size when it leaves the band."""
_MIN_ROWS, _MIN_UNKNOWN = 8, 5
_JUMP_S, _JUMP_SHARE = 0.1, 0.6
_MIN_LEVEL, _LEVEL_CHANGES = 0.2, 1.2
"""Minimum level, as a share of its maximum, for shares of it, and change that makes them useful."""
_AS_EVEN = 1.5
"""Maximum ratio of errors by the same noise, with a dozen independent values (F test)."""
_MAX_ONSET_WINDOWS = 1.25
"""Maximum time between onset and leaving the band, in windows of a mean."""
_WORSE = 3.84
"""Maximum error of a possible moment above that of the best fit, in variances (chi-squared)."""
_USUALLY_ALIKE, _MAX_CORRELATION = 5.0, 0.95
"""Usual number of rows with as much information as one, and the maximum correlation of two."""


class Onset(NamedTuple):
    """The onset of a deviation and its uncertainty [s]."""

    time_s: float
    uncertainty_s: float


def onset(times_s: np.ndarray, deviation: np.ndarray, left_row: int,
          level: Optional[np.ndarray] = None) -> Onset:
    """Return when a deviation began that leaves the band at a row.

    If it was small before a stretch of unknown values that ends where the band is left, it began
    there. If most of the deviation came in one jump, the onset is the jump. Otherwise two courses
    are fitted by least squares, and the better fit gives the onset: constant and then a step, or
    constant and then even growth. The fit covers as much time before
    the last small deviation as has passed since. If the deviation was just as steady before that, a
    fit that also covers an equally long time before the onset shows steady growth better. An error
    that is a share of its signal jumps where the signal does, although nothing begins there: so the
    same courses are fitted to the deviation as a share of the level.

    Args:
        times_s: (t,), even.
        deviation: (t,), NaN where unknown; signed.
        left_row: where it leaves.
        level: (t,) the usual level, in the deviation's unit.
    """
    rate_hz = 1.0 / (times_s[1] - times_s[0]) if len(times_s) > 1 else 1.0
    unknown = _unknown_before(deviation, left_row)
    if unknown is not None:
        begin_s, end_s = times_s[[unknown, left_row]].tolist()
        return Onset(0.5 * (begin_s + end_s), 0.5 * (end_s - begin_s))
    reach = int(_BEHIND_S * rate_hz)
    end = min(_peak(deviation, left_row, reach) + 1, len(times_s))
    share = None if level is None else _share(deviation, level, left_row, rate_hz)
    known = np.isfinite(deviation if share is None else share)
    last_small = _last_small(deviation, left_row, rate_hz)
    jump = _jump(deviation, last_small, left_row, rate_hz)
    if share is not None:
        row = left_row + int(known[left_row:].argmax())
        last_small = min(last_small, _last_small(share, row, rate_hz))
        end = max(end, min(_peak(share, row, reach) + 1, len(times_s)))
    least = int(_MIN_BEFORE_S * rate_hz)
    grew = int((left_row - last_small) / (1.0 - _SMALL))  # a part of even growth was small
    shorter = max(last_small - max(left_row - last_small, least), 0)
    longer = max(min(left_row - 2 * grew, last_small - least), 0)
    if jump is not None and (level is None or share is None or _jump(
            share, max(jump - 1, 0), left_row, rate_hz) is not None or not _is_step_of_level(
            deviation, level, jump, rate_hz)):
        return Onset(float(times_s[jump]), _JUMP_S)
    fits = [_fit(times_s, deviation, share, level, begin + np.flatnonzero(known[begin:end]),
                 left_row) for begin in (shorter, longer)]
    if fits[0] is None or fits[1] is None:
        return Onset(float(times_s[left_row]), float(times_s[left_row] - times_s[shorter]))
    found = fits[1] if fits[1].error <= _AS_EVEN * fits[0].error else fits[0]
    return Onset(found.time_s, found.uncertainty_s + 0.5 / rate_hz)


class _Fit(NamedTuple):
    """The onset by a fit, its uncertainty [s], and the squared error per row."""

    time_s: float
    uncertainty_s: float
    error: float


def _fit(times_s: np.ndarray, deviation: np.ndarray, share: Optional[np.ndarray],
         level: Optional[np.ndarray], rows: np.ndarray, left_row: int) -> Optional[_Fit]:
    """Return the best fit to some rows; None if they are too few."""
    if len(rows) < _MIN_ROWS or left_row - rows[0] < 2:
        return None
    known_s, moments_s = times_s[rows], times_s[rows[0]:min(left_row, rows[-1]) + 1]
    errors = _fit_errors(moments_s, known_s, deviation[rows], np.ones(len(rows)))
    if share is not None and level is not None:
        errors = np.minimum(errors, _fit_errors(moments_s, known_s, share[rows],
                                                np.square(level[rows])))
    best = int(errors.argmin())
    allowed = errors[best] * (1.0 + _WORSE / _independent(deviation[rows[:best + 1]], len(rows))
                              ) + 1e-12
    possible = moments_s[errors <= allowed]
    half = max(possible[-1] - moments_s[best], moments_s[best] - possible[0])
    return _Fit(float(moments_s[best]), float(half), float(errors[best]) / len(rows))


def _independent(before: np.ndarray, count: int) -> float:
    """Return the number of independent values among some, given those before an onset (n,).

    Values of smoothed signals, and of colored noise, say less than as many independent ones: as
    for noise of first order (Bartlett 1935).
    """
    if len(before) < _MIN_ROWS:
        return max(count / _USUALLY_ALIKE, 1.0)
    away = before - before.mean()
    square = float(away @ away)
    alike = float(away[1:] @ away[:-1]) / square if square > 0.0 else 0.0
    alike = min(max(alike, 0.0), _MAX_CORRELATION)
    return max(count * (1.0 - alike) / (1.0 + alike), 1.0)


def lasting_onset(times_s: np.ndarray, deviation: np.ndarray, left_row: int, sign: float,
                  over_s: float) -> Onset:
    """Return when a deviation began that shows only in means over a longer time.

    The onset is the moment with the least mean before it and the greatest mean after it; without
    one, the deviation was there from the beginning.

    Args:
        times_s, deviation: as for ``onset``.
        left_row: where the mean leaves the band.
        sign: of the mean.
        over_s: the time of the mean.
    """
    rows = np.flatnonzero(np.isfinite(deviation[:left_row + 1]))
    if len(rows) < _MIN_ROWS:
        return Onset(float(times_s[left_row]), over_s)
    half = int(0.5 * over_s / (times_s[1] - times_s[0]))
    size = sign * float(np.nanmean(deviation[max(left_row - half // 2, 0):left_row + half + 1]))
    rows = rows[rows >= left_row - int(_MAX_ONSET_WINDOWS * 2 * half)]
    if len(rows) < _MIN_ROWS:
        return Onset(float(times_s[left_row]), over_s)
    excess = np.cumsum(np.concatenate(([0.0], sign * deviation[rows] - 0.5 * size)))
    first = min(int(excess.argmin()), len(rows) - 1)  # it falls before, and rises from there on
    return Onset(float(times_s[rows[first]]), min(0.25 * over_s, 0.5))


def _unknown_before(deviation: np.ndarray, left_row: int) -> Optional[int]:
    """Return the last known row before an unknown stretch in which a deviation began, or None."""
    known = np.flatnonzero(np.isfinite(deviation[:left_row]))
    if not len(known) or left_row - known[-1] <= _MIN_UNKNOWN:
        return None
    before = float(np.median(deviation[known[-_MIN_ROWS:]]))
    is_small = before * np.sign(deviation[left_row]) < _SMALL * abs(deviation[left_row])
    return int(known[-1]) if is_small else None


def _last_small(deviation: np.ndarray, left_row: int, rate_hz: float) -> int:
    """Return the last row at which the deviation was small; without one, the first considered."""
    first = max(left_row - int(_BEFORE_S * rate_hz), 0)
    away = deviation[first:left_row + 1] * np.sign(deviation[left_row])
    with np.errstate(invalid='ignore'):
        small = np.flatnonzero(away < _SMALL * away[-1])
    return first + int(small[-1]) if len(small) else first


def _jump(deviation: np.ndarray, last_small: int, left_row: int, rate_hz: float) -> Optional[int]:
    """Return the row of the greatest jump before the band was left, if it explains the departure.

    A jump after which the deviation was small again does not.
    """
    half = max(int(0.5 * _JUMP_S * rate_hz), 1)
    rows = np.arange(max(last_small - half, 3 * half), min(left_row + 1, len(deviation) - 3 * half))
    if not len(rows):
        return None
    known = np.isfinite(deviation)
    total, count = (np.concatenate(([0.0], np.cumsum(it)))
                    for it in (np.where(known, deviation, 0.0), known))
    sign = np.sign(deviation[left_row])
    with np.errstate(invalid='ignore'):  # NaN where nothing is known
        before, behind = (sign * (total[end] - total[begin]) / (count[end] - count[begin])
                          for begin, end in ((rows - 3 * half, rows - half),
                                             (rows + half, rows + 3 * half)))
    jumps = np.nan_to_num(behind - before, nan=-np.inf)
    best = int(jumps.argmax())
    is_one = jumps[best] > _JUMP_SHARE * abs(deviation[left_row]) and \
        before[best] < _SMALL * jumps[best]  # otherwise it had begun to grow before
    return int(rows[best]) if is_one else None


def _is_step_of_level(deviation: np.ndarray, level: np.ndarray, jump: int,
                      rate_hz: float) -> bool:
    """Return whether a relative error that was there before explains a jump: the level steps."""
    half = max(int(0.5 * _JUMP_S * rate_hz), 1)
    (before, usual_before), (behind, usual) = (
        (float(np.nanmean(deviation[rows])), float(np.nanmean(level[rows])))
        for rows in (slice(jump - 3 * half, jump - half), slice(jump + half, jump + 3 * half)))
    return abs(behind) <= abs(usual) and \
        abs(behind * (usual - usual_before)) >= 0.5 * abs((behind - before) * usual)


def _peak(deviation: np.ndarray, row: int, reach: int) -> int:
    """Return the row of the greatest deviation soon after leaving, which shows whether it steps."""
    after = np.nan_to_num(np.abs(deviation[row:row + reach + 1]), nan=0.0)
    return row + int(after.argmax())


def _share(deviation: np.ndarray, level: np.ndarray, left_row: int,
           rate_hz: float) -> Optional[np.ndarray]:
    """Return the deviation as a share of the level (t,); None if the share shows nothing more.

    It shows more where the level has changed. Where the level is near zero, the share is unknown,
    as it is at the change itself, which may come a little earlier or later.
    """
    first = max(left_row - int(2.0 * _BEFORE_S * rate_hz), 0)
    end = left_row + int(_BEHIND_S * rate_hz) + 1
    size = np.where(np.isfinite(deviation), np.abs(level), 0.0)
    is_near_zero = ~(size[first:end] > _MIN_LEVEL * np.max(size[first:end], initial=0.0))
    size[first:end][is_near_zero] = 0.0
    low, high = envelope(np.where(size > 0.0, size, np.nan), 2 * EDGE_ROWS)
    with np.errstate(invalid='ignore', divide='ignore'):
        share: np.ndarray = np.where(high < _LEVEL_CHANGES * low, deviation / size, np.nan)
    share[:first] = np.nan
    known = np.isfinite(share)
    if not known[left_row:end].any():
        return None
    sizes, before = size[first:end][known[first:end]], known[first:left_row]
    was_near_zero = before.any() and is_near_zero[int(before.argmax()):left_row - first].any()
    is_of_use = was_near_zero or sizes.max() > _LEVEL_CHANGES * sizes.min()
    return share if is_of_use else None


def _fit_errors(moments_s: np.ndarray, times_s: np.ndarray, values: np.ndarray,
                weight: np.ndarray) -> np.ndarray:
    """Return the squared errors (m,) of the better fit from each moment on: step or even growth.

    Moments without a known value lie between those of the values (n,).
    """
    behind = np.searchsorted(times_s, moments_s)
    return np.minimum(_step_errors(values, weight)[behind],
                      _bend_errors(moments_s, times_s, values, weight))


def _step_errors(values: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """Return the squared errors (n,) of a constant before each row and another one from it on."""
    count = np.cumsum(weight)
    first, square = np.cumsum(weight * values), np.cumsum(weight * values * values)
    before = square - first * first / count
    rest = count[-1] - count
    behind = (square[-1] - square) - (first[-1] - first) ** 2 / np.where(rest > 0.0, rest, 1.0)
    errors = np.full(len(values), np.inf)
    errors[1:] = before[:-1] + np.maximum(behind[:-1], 0.0)
    return errors


def _bend_errors(moments_s: np.ndarray, times_s: np.ndarray, values: np.ndarray,
                 weight: np.ndarray) -> np.ndarray:
    """Return the squared errors (m,) of a constant up to each moment, then a straight line."""
    rise = np.maximum(times_s[np.newaxis, :] - moments_s[:, np.newaxis], 0.0)
    whole = weight.sum()
    inner = rise - (rise @ weight / whole)[:, np.newaxis]
    level = values - weight @ values / whole
    spread = (inner * inner) @ weight
    cross = inner @ (weight * level)
    explained = np.where(spread > 0.0, cross * cross / np.where(spread > 0.0, spread, 1.0), 0.0)
    result: np.ndarray = weight @ (level * level) - explained
    result[moments_s > times_s[max(len(times_s) - 3, 0)]] = np.inf
    return result


_LOST_ROWS = 30
"""Number of first rows for which lost time cannot be known, with a margin."""
_HAS_LEVEL = (SignalKind.VARIABLE, SignalKind.FORCE)
MIN_LASTING_ROWS = 3
"""Minimum rows outside the band for a departure."""
_BACK_ROWS = 10
"""Minimum rows inside the band to be back; after longer stretches outside it takes more."""
_SAME_TIME_S = 0.25
_ONE_EVENT_S = 2.0
_FAINT, _FAINT_SHARE = 1.5, 0.5
"""Severity below which a departure comes last beside one twice as strong: it may be chance."""
BESIDE = ('tool sideways', 'tool up')
_LESS_EXACT_S = 0.08
"""Noise covers a window, so at a jump it leaves the band before the value itself does."""
_EDGE_ROWS = 25
_EARLIER_SHARE, _SOONER_S = 0.6, 0.5
"""Minimum severity of an earlier departure, as a share of the strongest, and minimum lead [s]."""
_RANK = {kind: number for number, kind in enumerate(SignalKind)}


class Departure(NamedTuple):
    """A signal that leaves its band; times [s] are the reference's.

    The signal leaves at ``left_s`` and is back at ``back_s`` (None: never). Its deviation began at
    ``onset_s``, give or take ``uncertainty_s``. At ``worst_s`` it is ``deviation`` away from the
    middle of a band of ``half_width``, in the signal's unit. For a state, ``words`` say what is
    wrong; a state that only ``is_late`` follows from something that took longer. For time lost,
    ``in_all_s`` is the total until the signal was back. A vibration has a frequency. A place that
    ``is_on_path`` is that of a tool on a steep path, so it follows from time that was lost.
    """

    signal: Signal
    left_s: float
    back_s: Optional[float]
    onset_s: float
    uncertainty_s: float
    worst_s: float
    deviation: float
    half_width: float
    words: str = ''
    is_late: bool = False
    in_all_s: Optional[float] = None
    frequency_hz: Optional[float] = None
    is_on_path: bool = False

    @property
    def channel(self) -> Tuple[str, str]:
        """Return device and label of the channel, which has a value and noise."""
        return self.signal.device, self.signal.label.replace(NOISE_SUFFIX, '')

    @property
    def severity(self) -> float:
        """Return the distance from the middle, in half widths of the band."""
        return abs(self.deviation) / self.half_width


def departures(times_s: np.ndarray, run: Mapping[Signal, np.ndarray],
               band: Band) -> Tuple[Departure, ...]:
    """Return the first departure of each signal, the likely cause first.

    Departures are in order of onset. Of those that began together, timing comes before place,
    variables, forces, speeds, joints and noise, then the one that is farther outside. Faint
    departures come after clear ones.

    Args:
        times_s: (t,) of the reference.
        run: the signals of the run to judge.
        band: of good runs.
    """
    found = [it for signal, limits in band.signals.items()
             if signal in run and signal.kind is not SignalKind.STATE
             for it in [_departure(times_s, signal, run, band)] if it is not None]
    return ranked(_agreed(_of_channels(found)))


class Nearness(NamedTuple):
    """The nearest approach of a signal to leaving its band: its share, and the reference's time."""

    signal: Signal
    share: float
    time_s: float


def nearness(times_s: np.ndarray, run: Mapping[Signal, np.ndarray], band: Band) -> List[Nearness]:
    """Return how near each signal of a run came to leaving its band, the nearest first.

    As for departures, only values that last for three rows count.
    """
    found = []
    for signal, limits in band.signals.items():
        if signal.kind is SignalKind.STATE or signal not in run:
            continue
        with np.errstate(invalid='ignore', divide='ignore'):
            ratio = np.nan_to_num(np.abs(run[signal] - limits.middle) / limits.half_width, nan=0.0)
        if len(ratio) < MIN_LASTING_ROWS:
            continue
        lasting = np.minimum(np.minimum(ratio[2:], ratio[1:-1]), ratio[:-2])
        row = int(lasting.argmax())
        found.append(Nearness(signal, float(lasting[row]), float(times_s[row + 1])))
    return sorted(found, key=lambda it: -it.share)


def outside(values: np.ndarray, limits: SignalBand) -> np.ndarray:
    """Return where (t,) (bool) values are outside the band."""
    with np.errstate(invalid='ignore'):
        result: np.ndarray = np.abs(values - limits.middle) > limits.half_width
    return result


def outside_since(is_outside: np.ndarray) -> Optional[int]:
    """Return the row (of t) since which values are outside until the last one; None if it is not.

    Here, too, a short swing inside does not end it.
    """
    found, count = spans(is_outside), len(is_outside)
    return next((begin for begin, end in (_joined_stretches(found, it, count) for it in found)
                 if end > count - _BACK_ROWS), None)


def _departure(times_s: np.ndarray, signal: Signal, run: Mapping[Signal, np.ndarray],
               band: Band) -> Optional[Departure]:
    values, limits = run[signal], band.signals[signal]
    deviation = values - limits.middle
    found = [it for it in spans(outside(values, limits)) if it[1] - it[0] >= MIN_LASTING_ROWS]
    if not found:
        return None
    is_missing = np.isnan(values) & np.isfinite(limits.middle)
    begin, end = _joined_stretches(found, found[0], len(times_s), is_missing)
    ratio = np.nan_to_num(np.abs(deviation[begin:end]) / limits.half_width[begin:end], nan=0.0)
    worst = begin + int(ratio.argmax())
    from_usual = deviation if limits.usual is None else values - limits.usual
    width = _usual_width(limits)
    level = limits.usual / width if limits.usual is not None and signal.kind in _HAS_LEVEL else None
    since = onset(times_s, from_usual / width, begin, level)
    unsmoothed = signal._replace(over_s=0.0)
    if signal.over_s and unsmoothed in run and unsmoothed in band.signals:
        since = lasting_onset(times_s, run[unsmoothed] - band.signals[unsmoothed].middle, begin,
                              float(np.sign(deviation[begin])), signal.over_s)
    back_s = float(times_s[end]) if end < len(times_s) else None
    if signal.period_s:
        first_s = float(times_s[int(np.isfinite(values).argmax())])
        since = _between_values(since, signal.period_s, first_s, float(times_s[worst]))
    in_all_s, onset_s = None, since.time_s
    if signal.label == TIMING_LABEL:
        # where a clock stops, the moment before it counts; and the loss within half a second may
        # exceed the total. Time can be lost only once it is known: a wait may take any time
        known = int(np.max(np.flatnonzero(np.isnan(deviation[:begin])) + 1, initial=0))
        if known > _LOST_ROWS:
            onset_s = max(onset_s, float(times_s[known]))
        onset_s = min(onset_s, float(times_s[max(begin - 1, 0)]))
        in_all_s = max(float(deviation[worst]), lost_s(deviation[begin:end]), key=abs)
    left_s = max(float(times_s[begin]), onset_s) if signal.period_s else float(times_s[begin])
    return Departure(signal, left_s, back_s, onset_s, since.uncertainty_s,
                     float(times_s[worst]), float(deviation[worst]),
                     float(limits.half_width[worst]),
                     in_all_s=in_all_s)


def _between_values(since: Onset, period_s: float, first_s: float, worst_s: float) -> Onset:
    """Return an onset in a signal that is sent rarely, given when it begins and is farthest away.

    Between two values there is a straight line, which begins to deviate at the first of them.
    """
    half_s = 0.5 * period_s
    is_later = since.time_s > first_s + half_s
    return Onset(min(since.time_s + half_s, worst_s) if is_later else since.time_s,
                 max(since.uncertainty_s, half_s))


def _usual_width(limits: SignalBand) -> np.ndarray:
    """Return the width of the band around each moment, apart from edges."""
    known = np.isfinite(limits.half_width)
    narrow = -moving_maximum(np.where(known, -limits.half_width, -np.inf), _EDGE_ROWS)
    return np.where(known, narrow, np.nan)


def _joined_stretches(stretches: Sequence[Tuple[int, int]], first: Tuple[int, int],
              count: int, is_missing: Optional[np.ndarray] = None) -> Tuple[int, int]:
    """Return a stretch joined with those that follow closely, after a short swing inside.

    Rows (count,) without data do not count as inside: a departure may continue there.
    """
    begin, end = first
    for other in stretches:
        if end > other[0]:
            continue
        inside = other[0] - end - (0 if is_missing is None else
                                   int(is_missing[end:other[0]].sum()))
        if inside <= max(end - begin, _BACK_ROWS):
            end = other[1]
    return begin, min(end, count)


def _agreed(found: Sequence[Departure]) -> List[Departure]:
    """Return departures; if value and noise of a channel depart together, with one onset."""
    agreed = []
    for it in found:
        twins = [other for other in found if other.channel == it.channel
                 and abs(other.onset_s - it.onset_s) < _ONE_EVENT_S]
        tell = [other for other in twins if not _is_smoother(other)] or twins
        best = min(tell, key=lambda other: other.left_s + _LESS_EXACT_S * (
            other.signal.kind is SignalKind.NOISE))
        agreed.append(it._replace(onset_s=best.onset_s, uncertainty_s=best.uncertainty_s))
    return agreed


def _is_smoother(departure: Departure) -> bool:
    """Return whether noise is less than usual: this shows only after the last rough value."""
    return departure.signal.kind is SignalKind.NOISE and departure.deviation < 0.0


def _of_channels(found: Sequence[Departure]) -> List[Departure]:
    """Return one departure per channel: the strongest of values and means, with the first onset."""
    best: Dict[Tuple[str, str], Departure] = {}
    for it in found:
        key = it.signal.device, it.signal.label
        other = best.get(key)
        if other is None:
            best[key] = it
            continue
        strong, weak = (it, other) if _clearness(it) > _clearness(other) else (other, it)
        if _determines_onset(weak, strong):
            known_s = weak.uncertainty_s
            if weak.severity < _FAINT:  # what shows clearly only in a mean left by chance here
                known_s = max(known_s, strong.uncertainty_s)
            strong = strong._replace(onset_s=weak.onset_s, uncertainty_s=known_s,
                                     left_s=min(weak.left_s, strong.left_s))
        best[key] = strong
    return list(best.values())


def _clearness(departure: Departure) -> Tuple[bool, float]:
    """Return a sort key: clear departures without a mean are the clearest, then severity counts."""
    return (not departure.signal.over_s and departure.severity >= _FAINT, departure.severity)


def _determines_onset(it: Departure, other: Departure) -> bool:
    """Return whether ``it`` left first; a signal without a window around it is more exact."""
    if it.signal.over_s:
        return (it.severity > _EARLIER_SHARE * other.severity
                and it.left_s < other.left_s - _SOONER_S)
    return it.left_s < other.left_s + _SOONER_S or \
        other.onset_s - _ONE_EVENT_S < it.onset_s < other.onset_s


def ranked(found: Sequence[Departure],
           to_run: Callable[[np.ndarray], np.ndarray] = lambda times_s: times_s
           ) -> Tuple[Departure, ...]:
    """Return departures in the order in which they began, faint ones last.

    ``to_run`` maps times of the reference to those of the run. Where the run leaves out a part of
    the reference, departures that began together in the run are apart in the reference.
    """
    strongest = max((it.severity for it in found), default=0.0)
    faint = [it for it in found if it.severity < min(_FAINT, _FAINT_SHARE * strongest)]
    clear = [it for it in found if it not in faint]
    return tuple(_in_order(clear, to_run) + _in_order(faint, to_run))


def _size(departure: Departure) -> float:
    """Return the size by which departures are ranked; distances are compared in m."""
    return abs(departure.deviation) if departure.signal.kind is SignalKind.PLACE \
        else departure.severity


_TORQUES = {'tool torque': 'tool force', TORQUE_DIRECTION: FORCE_DIRECTION}
_CLEAR_JUMP, _WELL_KNOWN_S, _ABOUT_S = 3.0, 0.15, 0.02
"""Minimum severity of a value that a state follows, maximum uncertainty of its onset, and the part
of the state's uncertainty that does not count [s]."""
_AS_CLEAR = 0.5
"""Minimum severity of a force, as a share of the torque's, to explain the torque."""


def _rank(departure: Departure, beside: float, together: Sequence[Departure]) -> float:
    """Return the rank of a departure among those that began together.

    A tool beside its path seems early or late, too: time is not the cause if it is less clear. A
    force at the end of a tool is a torque at its sensor. A value that is sent rarely says too
    little about when it began. A state that changes just after a value has jumped follows from it.
    """
    kind, signal = departure.signal.kind, departure.signal
    if kind is SignalKind.STATE and any(
            it.signal.kind in _HAS_LEVEL and it.severity >= _CLEAR_JUMP
            and it.uncertainty_s <= _WELL_KNOWN_S and not it.signal.period_s
            and it.onset_s < departure.onset_s - departure.uncertainty_s + _ABOUT_S
            for it in together):
        return _RANK[SignalKind.FORCE] + 0.75
    force = _TORQUES.get(signal.label)
    if any(it.signal.device == signal.device and it.signal.label == force
           and it.severity >= _AS_CLEAR * departure.severity for it in together):
        return _RANK[kind] + 0.25
    if kind is SignalKind.TIMING and departure.severity < beside:
        return _RANK[SignalKind.PLACE] + 0.5
    if signal.period_s:
        return max(_RANK[kind], _RANK[SignalKind.FORCE] + 0.5)
    return _RANK[SignalKind.JOINT] if departure.is_late else _RANK[kind]


_SEEN_LATER_S = 0.5
"""Maximum time by which lost time shows later than at the place of a tool on a steep path [s]."""
_JOINT_BEFORE_S = 1.0
"""Maximum time by which a joint leaves its band before the tool that it moves [s]."""


def _began_s(it: Departure, found: Sequence[Departure]) -> float:
    """Return when a departure began; in a mean over a longer time, a clearer one may show it.

    Noise covers the last half second, and its start is no more exact than that.
    A tool leaves its path with the joints that move it, whose bands may be narrower. One that is
    only late on a steep path left it with the time that was lost, which shows later.
    A signal that is sent rarely may have begun to deviate only just before its next value.
    """
    if it.signal.period_s:
        return it.onset_s + max(it.uncertainty_s, 0.5 * it.signal.period_s)
    if it.signal.kind is SignalKind.NOISE and not it.signal.over_s:
        return min(it.left_s, it.onset_s + ROUGH_S)
    if it.is_on_path:
        return min((other.onset_s for other in found if other.signal.label == TIMING_LABEL
                    and it.onset_s <= other.onset_s <= it.onset_s + _SEEN_LATER_S),
                   default=it.onset_s)
    if it.signal.kind is SignalKind.PLACE:
        return min(other.onset_s for other in found if other is it or (
            other.signal.kind is SignalKind.JOINT and other.signal.device == it.signal.device
            and it.onset_s - _JOINT_BEFORE_S <= other.onset_s <= it.onset_s))
    inside = [other.onset_s for other in found if it.signal.over_s and not other.signal.over_s
              and other.severity > it.severity and it.onset_s < other.onset_s <= it.left_s]
    return min(inside, default=it.onset_s)


def _in_order(found: Sequence[Departure],
              to_run: Callable[[np.ndarray], np.ndarray]) -> List[Departure]:
    began_s = {id(it): _began_s(it, found) for it in found}
    began_in_run_s = dict(zip(began_s, to_run(np.array(list(began_s.values()))).tolist()))
    waiting = sorted(found, key=lambda it: began_s[id(it)])
    ordered: List[Departure] = []
    while waiting:
        first = id(waiting[0])
        together = [it for it in waiting
                    if began_s[id(it)] <= began_s[first] + _SAME_TIME_S
                    or began_in_run_s[id(it)] <= began_in_run_s[first] + _SAME_TIME_S]
        beside = max((it.severity for it in together if it.signal.label in BESIDE
                      and not it.is_on_path), default=0.0)
        ranks = {id(it): _rank(it, beside, together) for it in together}
        together.sort(key=lambda it: (ranks[id(it)], -_size(it)))
        ordered.append(together[0])
        waiting.remove(together[0])
    return ordered
