# SPDX-License-Identifier: BSD-3-Clause
"""Departures of a run from the band, and which signal left it first."""
from __future__ import annotations

from typing import Callable, Dict, List, Mapping, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from process_visualizer.runs.deviation.band import Band, SignalBand
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
"""The deviation was small where it was this share of what it is when it leaves."""
_MIN_ROWS = 8
_JUMP_S, _JUMP_SHARE = 0.1, 0.6
_WORSE = 1.5
"""Moments at which a fit is so much worse than the best, per degree of freedom, are possible."""


class Onset(NamedTuple):
    """The onset of a deviation and its uncertainty [s]."""

    time_s: float
    uncertainty_s: float


def onset(times_s: np.ndarray, deviation: np.ndarray, left_row: int) -> Onset:
    """Return when a deviation began that leaves the band at a row.

    Where most of the deviation came at one jump, that is the moment. Otherwise, from as long before
    the last small deviation as it grew since, the deviation is
    taken as constant before, and as stepping or beginning to grow evenly there; the moment is that
    of the better fit (least squares).

    Args:
        times_s: (t,), even.
        deviation: (t,), NaN where unknown; signed.
        left_row: where it leaves.
    """
    rate_hz = 1.0 / (times_s[1] - times_s[0]) if len(times_s) > 1 else 1.0
    last_small = _last_small(deviation, left_row, rate_hz)
    begin = max(last_small - max(left_row - last_small, int(_MIN_BEFORE_S * rate_hz)), 0)
    end = min(_peak(deviation, left_row, int(_BEHIND_S * rate_hz)) + 1, len(times_s))
    jump = _jump(deviation, last_small, left_row, rate_hz)
    if jump is not None:
        return Onset(float(times_s[jump]), _JUMP_S)
    rows = begin + np.flatnonzero(np.isfinite(deviation[begin:end]))
    if len(rows) < _MIN_ROWS or left_row - rows[0] < 2:
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
    if len(rows) < _MIN_ROWS:
        return Onset(float(times_s[left_row]), over_s)
    half = int(0.5 * over_s / (times_s[1] - times_s[0]))
    size = sign * float(np.nanmean(deviation[max(left_row - half // 2, 0):left_row + half + 1]))
    excess = np.cumsum(np.concatenate(([0.0], sign * deviation[rows] - 0.5 * size)))
    first = min(int(excess.argmin()), len(rows) - 1)  # it falls before, and rises from there on
    return Onset(float(times_s[rows[first]]), min(0.25 * over_s, 0.5))


def _last_small(deviation: np.ndarray, left_row: int, rate_hz: float) -> int:
    """Return the last row at which the deviation was small; if none, the first that counts."""
    first = max(left_row - int(_BEFORE_S * rate_hz), 0)
    away = deviation[first:left_row + 1] * np.sign(deviation[left_row])
    with np.errstate(invalid='ignore'):
        small = np.flatnonzero(away < _SMALL * away[-1])
    return first + int(small[-1]) if len(small) else first


def _jump(deviation: np.ndarray, last_small: int, left_row: int, rate_hz: float) -> Optional[int]:
    """The row of the greatest jump before the band was left, if it explains that.

    What was small again afterwards does not.
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
        before[best] < _SMALL * jumps[best]  # otherwise it had begun to grow
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
    inner, level = rise - rise.mean(axis=1, keepdims=True), values - values.mean()
    spread = (inner * inner).sum(axis=1)
    cross = inner @ level
    explained = np.where(spread > 0.0, cross * cross / np.where(spread > 0.0, spread, 1.0), 0.0)
    result: np.ndarray = (level * level).sum() - explained
    result[-2:] = np.inf
    return result


MIN_LASTING_ROWS = 3
"""What is outside for fewer rows is no departure."""
_BACK_ROWS = 10
"""What is inside for fewer rows is not back; longer stretches outside need more."""
_SAME_TIME_S = 0.25
_ONE_EVENT_S = 2.0
_FAINT, _FAINT_SHARE = 1.5, 0.5
"""A departure so faint comes last beside one that is twice as strong: it may be chance."""
BESIDE = ('tool sideways', 'tool up')
_LESS_EXACT_S = 0.08
"""Noise of a time around a jump leaves before the value itself does."""
_EDGE_ROWS = 25
_EARLIER_SHARE, _SOONER_S = 0.6, 0.5
"""Of the strongest departure of a channel; one that left earlier must not be fainter."""
_RANK = {kind: number for number, kind in enumerate(SignalKind)}


class Departure(NamedTuple):
    """A signal that leaves its band; times [s] are the reference's.

    It leaves at ``left_s``, ``back_s`` is when it is back (None: not again), and the deviation
    began at ``onset_s``, give or take ``uncertainty_s``. At ``worst_s`` it is ``deviation`` away
    from the middle of a band of ``half_width``, in the signal's unit. Of a state, ``words`` say
    what is wrong; one that only ``is_late`` follows from what took longer. Of time that was lost,
    ``in_all_s`` is how much it was until the signal was back. Noise that is a vibration has a
    frequency.
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

    @property
    def severity(self) -> float:
        """Return how many times as far from the middle as the band is wide."""
        return abs(self.deviation) / self.half_width


def departures(times_s: np.ndarray, run: Mapping[Signal, np.ndarray],
               band: Band) -> Tuple[Departure, ...]:
    """Return the first departure of each signal, the likely cause first.

    They are in the order in which they began; of those that began together, timing comes before
    place, variables, forces, speeds, joints and noise, then the one that is farther outside.
    Faint ones come after clear ones.

    Args:
        times_s: (t,) of the reference.
        run: the signals of the run to judge.
        band: what good runs do.
    """
    found = [it for signal, limits in band.signals.items()
             if signal in run and signal.kind is not SignalKind.STATE
             for it in [_departure(times_s, signal, run, band)] if it is not None]
    return ranked(_agreed(_of_channels(found)))


class Nearness(NamedTuple):
    """The nearest approach of a run to leaving its band: time of the reference, and share."""

    signal: Signal
    share: float
    time_s: float


def nearness(times_s: np.ndarray, run: Mapping[Signal, np.ndarray], band: Band) -> List[Nearness]:
    """Return how near each signal of a run came to leaving its band, the nearest first.

    As in what is a departure, only what lasts for three rows counts.
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
    """Return where (t,) (bool) values are outside of the band."""
    with np.errstate(invalid='ignore'):
        result: np.ndarray = np.abs(values - limits.middle) > limits.half_width
    return result


def outside_since(is_outside: np.ndarray) -> Optional[int]:
    """Return since which row (of t) values are outside, at the last one; None if they are not.

    Here, too, what swings back for a moment is not back.
    """
    found, count = spans(is_outside), len(is_outside)
    return next((begin for begin, end in (_for_good(found, it, count) for it in found)
                 if end > count - _BACK_ROWS), None)


def _departure(times_s: np.ndarray, signal: Signal, run: Mapping[Signal, np.ndarray],
               band: Band) -> Optional[Departure]:
    values, limits = run[signal], band.signals[signal]
    deviation = values - limits.middle
    found = [it for it in spans(outside(values, limits)) if it[1] - it[0] >= MIN_LASTING_ROWS]
    if not found:
        return None
    begin, end = _for_good(found, found[0], len(times_s))
    ratio = np.nan_to_num(np.abs(deviation[begin:end]) / limits.half_width[begin:end], nan=0.0)
    worst = begin + int(ratio.argmax())
    from_usual = deviation if limits.usual is None else values - limits.usual
    since = onset(times_s, from_usual / _usual_width(limits), begin)
    single = signal._replace(over_s=0.0)
    if signal.over_s and single in run and single in band.signals:
        since = lasting_onset(times_s, run[single] - band.signals[single].middle, begin,
                              float(np.sign(deviation[begin])), signal.over_s)
    back_s = float(times_s[end]) if end < len(times_s) else None
    in_all_s, onset_s = None, since.time_s
    if signal.label == TIMING_LABEL:
        # where a clock stands still, the moment before is meant; and within half a second it may
        # be more than at the end
        onset_s = min(onset_s, float(times_s[max(begin - 1, 0)]))
        in_all_s = max(float(deviation[worst]), lost_s(deviation[begin:end]), key=abs)
    return Departure(signal, float(times_s[begin]), back_s, onset_s, since.uncertainty_s,
                     float(times_s[worst]), float(deviation[worst]),
                     float(limits.half_width[worst]),
                     in_all_s=in_all_s)


def _usual_width(limits: SignalBand) -> np.ndarray:
    """Return the width of the band around each moment, apart from edges."""
    known = np.isfinite(limits.half_width)
    narrow = -moving_maximum(np.where(known, -limits.half_width, -np.inf), _EDGE_ROWS)
    return np.where(known, narrow, np.nan)


def _for_good(stretches: Sequence[Tuple[int, int]], first: Tuple[int, int],
              count: int) -> Tuple[int, int]:
    """The stretch with those that follow it closely: what swings back for a moment is not back."""
    begin, end = first
    for other in stretches:
        if end <= other[0] <= end + max(end - begin, _BACK_ROWS):
            end = other[1]
    return begin, min(end, count)


def _agreed(found: Sequence[Departure]) -> List[Departure]:
    """Value and noise of a channel that depart together began when the first of them says."""
    agreed = []
    for it in found:
        twins = [other for other in found if _channel(other) == _channel(it)
                 and abs(other.onset_s - it.onset_s) < _ONE_EVENT_S]
        best = min(twins, key=lambda other: other.left_s + _LESS_EXACT_S * (
            other.signal.kind is SignalKind.NOISE))
        agreed.append(it._replace(onset_s=best.onset_s, uncertainty_s=best.uncertainty_s))
    return agreed


def _channel(departure: Departure) -> Tuple[str, str]:
    signal = departure.signal
    return signal.device, signal.label.replace(NOISE_SUFFIX, '')


def _of_channels(found: Sequence[Departure]) -> List[Departure]:
    """One departure of each channel: the strongest of its values and means, since the first."""
    best: Dict[Tuple[str, str], Departure] = {}
    for it in found:
        key = it.signal.device, it.signal.label
        other = best.get(key)
        if other is None:
            best[key] = it
            continue
        strong, weak = (it, other) if _clearness(it) > _clearness(other) else (other, it)
        if _tells_onset(weak, strong):
            strong = strong._replace(onset_s=weak.onset_s, uncertainty_s=weak.uncertainty_s,
                                     left_s=min(weak.left_s, strong.left_s))
        best[key] = strong
    return list(best.values())


def _clearness(departure: Departure) -> Tuple[bool, float]:
    """Return what is seen without a mean, and clearly, is told as such."""
    return (not departure.signal.over_s and departure.severity >= _FAINT, departure.severity)


def _tells_onset(it: Departure, other: Departure) -> bool:
    """Return whether it left first; a signal without a window around it is more exact."""
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
    the reference, what began together in the run is apart in the reference.
    """
    strongest = max((it.severity for it in found), default=0.0)
    faint = [it for it in found if it.severity < min(_FAINT, _FAINT_SHARE * strongest)]
    clear = [it for it in found if it not in faint]
    return tuple(_in_order(clear, to_run) + _in_order(faint, to_run))


def _size(departure: Departure) -> float:
    """Return what is greater comes first: distances are compared as such."""
    return abs(departure.deviation) if departure.signal.kind is SignalKind.PLACE \
        else departure.severity


_TORQUES = {'tool torque': 'tool force', TORQUE_DIRECTION: FORCE_DIRECTION}
_AS_CLEAR = 0.5
"""A force that is at least so clear, in terms of the torque, explains it."""


def _rank(departure: Departure, beside: float, together: Sequence[Departure]) -> float:
    """Its place among what began together.

    A tool beside its path seems early or late, too: time is not the cause where it is less clear.
    A force at the end of a tool is a torque at its sensor.
    """
    kind, signal = departure.signal.kind, departure.signal
    force = _TORQUES.get(signal.label)
    if any(it.signal.device == signal.device and it.signal.label == force
           and it.severity >= _AS_CLEAR * departure.severity for it in together):
        return _RANK[kind] + 0.25
    if kind is SignalKind.TIMING and departure.severity < beside:
        return _RANK[SignalKind.PLACE] + 0.5
    return _RANK[SignalKind.JOINT] if departure.is_late else _RANK[kind]


def _began_s(it: Departure, found: Sequence[Departure]) -> float:
    """Return its begin; a mean over a longer time may be clearer elsewhere in it.

    Noise is that of the last half second, and is dated no better beside other signals.
    """
    if it.signal.kind is SignalKind.NOISE and not it.signal.over_s:
        return min(it.left_s, it.onset_s + ROUGH_S)
    inside = [other.onset_s for other in found if it.signal.over_s and not other.signal.over_s
              and other.severity > it.severity and it.onset_s < other.onset_s <= it.left_s]
    return min(inside, default=it.onset_s)


def _in_order(found: Sequence[Departure],
              to_run: Callable[[np.ndarray], np.ndarray]) -> List[Departure]:
    began_s = {id(it): _began_s(it, found) for it in found}
    began_in_run_s = dict(zip(began_s, to_run(np.array(list(began_s.values()))).tolist()))
    waiting = sorted(found, key=lambda it: began_s[id(it)])
    ranked: List[Departure] = []
    while waiting:
        first = id(waiting[0])
        together = [it for it in waiting
                    if began_s[id(it)] <= began_s[first] + _SAME_TIME_S
                    or began_in_run_s[id(it)] <= began_in_run_s[first] + _SAME_TIME_S]
        beside = max((it.severity for it in together if it.signal.label in BESIDE), default=0.0)
        ranks = {id(it): _rank(it, beside, together) for it in together}
        together.sort(key=lambda it: (ranks[id(it)], -_size(it)))
        ranked.append(together[0])
        waiting.remove(together[0])
    return ranked
