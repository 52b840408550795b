# SPDX-License-Identifier: BSD-3-Clause
"""Decides which signals of a running cell leave their band, and after how long it is reported."""
from __future__ import annotations

import json
from typing import (
    Collection,
    Dict,
    FrozenSet,
    List,
    Mapping,
    NamedTuple,
    Optional,
    Sequence,
    Tuple,
)

import numpy as np

from process_visualizer.bagio.json_text import finite_number, parsed_json
from process_visualizer.runs.comparison.good_runs import GoodRuns
from process_visualizer.runs.comparison.timeline_bands import SHOWN, TimelineBand
from process_visualizer.runs.comparison.wording import quantity
from process_visualizer.runs.deviation.band import SignalBand, beyond, widened
from process_visualizer.runs.deviation.departures import outside, outside_since
from process_visualizer.runs.deviation.signals import (
    FORCE_DIRECTION,
    MEAN_ROWS,
    RATE_HZ,
    TORQUE_DIRECTION,
    Signal,
    SignalKind,
    near_gaps,
)
from process_visualizer.runs.run import Key
from process_visualizer.runs.series import data_gaps, inside, moving_mean, period_s, spans

_LIVE_MARGIN = 1.25
"""Width of a live band, as a multiple of that of recordings: its moments and values are less exact,
and a recording is judged again."""
_NEWEST_S = 1.5
"""Maximum age of a value that says something about now [s]."""
_REPORTED_AFTER_S = 0.2
"""Minimum time out of the band that is reported [s]."""
_MAX_STEP_S = 0.06
_SWINGS_S = 0.1
"""Time for which a value may be back in range within one departure [s]."""
_AROUND_GAPS_S = 0.15
"""Time around a gap in which means and speeds lack values [s]."""
_COMPLETE_AFTER_S = 0.5
"""Age from which on a mean has all its values [s]."""
_MIN_SHARE = 0.45
"""Minimum number of columns with values in twice the time of a mean, as a share of the usual one.

At a rate like that of the columns, half of them have two values, and the others none."""
_MISSED, _MIN_GAP_S = 5.0, 0.2
"""Number of usual periods without values that make a gap, and minimum duration of one [s].

A robot at rest has a speed only every 0.1 s.
"""
_MAX_LACKING = 0.5
"""Share of the time in gaps from which on a variable is one that is sent when it changes."""
_MAX_BANDS_TEXT = 200_000
_RESTART_S, _SETTLES_S = 1.0, 0.5
"""Silence of a channel after which its driver has probably been restarted, and time after it in
which nothing is judged, as robots begin to move then [s]."""
OPEN_BEGIN_S = 3.0
"""Part of the reference that may be missing at the beginning of a run that was seen whole [s]."""
_AT_END_S = 0.5
"""Time before the end of the reference in which nothing is judged [s]."""
_FOUND_AGAIN_S = 2.5
"""Time after a long gap [s] in which it is found whether the run goes on: see LiveAlignment."""
_MOMENT = 'anything'
"""What is not judged while the moment in the reference is unknown."""
_MIN_PACE = 0.5
"""Minimum pace of a run, as a share of the reference's, while its moment is unknown."""


class LiveDeparture(NamedTuple):
    """A channel that is out of the band now, by ``beyond`` [its unit]; below 0: under it.

    ``since_s`` is on the clock of its values.
    """

    signal: Signal
    since_s: float
    beyond: float


class LiveComparison:
    """Comparison of live values with the band of good runs at corresponding moments.

    The channels of live curves are judged: variables, forces and speeds. Directions have no curve,
    and are judged only in recordings. As moments of the reference are found while they pass, the
    band covers 0.1 s before to 0.1 s after them.
    """

    def __init__(self, good: GoodRuns) -> None:
        self.name = good.reference.name
        self._times_s = good.times_s
        self._signals = {(signal.device, signal.label): signal for signal in good.band.signals
                         if signal.kind in SHOWN and not signal.over_s
                         and signal.label not in (FORCE_DIRECTION, TORQUE_DIRECTION)}
        limits = {key: widened(good.band.signals[it]) for key, it in self._signals.items()}
        self._limits = {key: it._replace(half_width=_LIVE_MARGIN * it.half_width)
                        for key, it in limits.items()}

    @property
    def keys(self) -> Tuple[Key, ...]:
        """The channels that can be judged."""
        return tuple(self._signals)

    def band(self, key: Key, values: np.ndarray, reference_s: np.ndarray,
             column_s: float) -> Optional[TimelineBand]:
        """Return the band of a channel at moments of the reference (n,), for drawing it.

        ``values`` (n,) are those of the running cell, one per ``column_s`` [s]. None if the channel
        has no band, or not at these moments.
        """
        limits = self._limits_at(key, reference_s)
        if limits is None or not np.isfinite(limits.middle).any():
            return None
        means = _means(self._signals[key], column_s * np.arange(len(values)), values, column_s)
        return TimelineBand(limits.middle - limits.half_width, limits.middle + limits.half_width,
                            outside(means, limits))

    def departures(self, times_s: np.ndarray, values: Mapping[Key, np.ndarray],
                   reference_s: np.ndarray) -> Tuple[LiveDeparture, ...]:
        """Return the channels that are out of their band at the last time, in the order of leaving.

        Args:
            times_s: (n,) of the values, even, at the rate of the band; the last one is now.
            values: (n,) of each channel, NaN where it has none.
            reference_s: (n,) the corresponding moments of the reference.
        """
        found = [self._departure(key, times_s, values[key], reference_s)
                 for key in self._signals if key in values]
        return tuple(sorted((it for it in found if it is not None), key=lambda it: it.since_s))

    def certain(self, times_s: np.ndarray, values: Mapping[Key, np.ndarray],
                reference_s: np.ndarray, motions_s: Sequence[np.ndarray]) -> np.ndarray:
        """Return moments of the reference (n,), NaN where those of the run are uncertain.

        They are near gaps in the motion of all tools, and where its messages came late. After a
        long gap in all values the process may have begun anew, which is found only when it has
        moved; so is where a run is that is followed from the middle. At the end, robots that rest
        may have been there for some time. Each of ``motions_s`` (m,) is when a tool's positions
        were measured; the rest is as for ``departures``.
        """
        near = []
        known_s = times_s[np.any([np.isfinite(it) for it in values.values()], axis=0)]
        for motion_s in motions_s:
            if times_s[-1] - motion_s[-1] > _RESTART_S:  # the gap has not ended
                motion_s = np.append(motion_s, times_s[-1])
            gaps = data_gaps(motion_s)
            after = [(begin_s, end_s + _FOUND_AGAIN_S) for begin_s, end_s in gaps
                     if end_s - begin_s > _RESTART_S and not np.any(
                         (known_s > begin_s + _AROUND_GAPS_S) & (known_s < end_s - _AROUND_GAPS_S))]
            near.append(near_gaps(times_s, motion_s, gaps)
                        | inside(times_s, np.array(after).reshape(-1, 2)))
        unsure = _just_found(reference_s)
        with np.errstate(invalid='ignore'):
            unsure |= reference_s > self._times_s[-1] - _AT_END_S
        if near:
            unsure |= np.logical_and.reduce(near)
        return np.where(unsure, np.nan, reference_s)

    def lost(self, times_s: np.ndarray, values: Mapping[Key, np.ndarray]) -> FrozenSet[Key]:
        """Return the channels whose values are too old to say anything about now.

        Times and values are as for ``departures``.
        """
        recent = times_s >= times_s[-1] - _NEWEST_S
        return frozenset(
            key for key, signal in self._signals.items() if key not in values
            or not np.isfinite(_means(signal, times_s, values[key])[recent]).any())

    def without_band(self, reference_s: float) -> FrozenSet[Key]:
        """Return the channels that have no band at a moment of the reference [s]."""
        limits = {key: self._limits_at(key, np.array([reference_s])) for key in self._signals}
        return frozenset(key for key, it in limits.items()
                         if it is None or not np.isfinite(it.middle).all())

    def unjudged_s(self, times_s: np.ndarray, values: Mapping[Key, np.ndarray],
                   reference_s: np.ndarray, since_s: float,
                   expected: Collection[Key] = ()) -> Dict[str, float]:
        """Return the time [s] in which channels were not judged for lack of values, by name.

        Channels without any values count if they are ``expected``; others have no live curve.

        Times after ``judged_until_s`` are left out, as later values complete them, and so are times
        before ``since_s``. The rest is as for ``departures``.
        """
        is_asked = (times_s > since_s) & (times_s <= self.judged_until_s(times_s, reference_s))
        found = {}
        for key, signal in self._signals.items():
            if key not in values and key not in expected:
                continue
            limits = self._limits_at(key, reference_s)
            has_band = is_asked & (False if limits is None else np.isfinite(limits.middle))
            lacks = _lacks_values(signal, times_s, values[key]) if key in values else has_band
            rows = np.count_nonzero(has_band & lacks)
            if rows:
                found[signal.name] = rows / RATE_HZ
        rows = np.count_nonzero(is_asked & _unknown_moments(reference_s))
        return {**found, _MOMENT: rows / RATE_HZ} if rows else found

    @staticmethod
    def judged_until_s(times_s: np.ndarray, reference_s: np.ndarray) -> float:
        """Return the end of the time that ``unjudged_s`` and ``passed`` judge [s].

        On a busy computer the moments of the reference arrive late, too: what follows the last
        known moment is judged when the next ones have arrived.
        """
        known = np.flatnonzero(np.isfinite(reference_s))
        last_s = float(times_s[known[-1]]) if len(known) else -np.inf
        return min(float(times_s[-1]) - _COMPLETE_AFTER_S, last_s)

    def known_s(self, times_s: np.ndarray, values: Mapping[Key, np.ndarray]) -> Optional[float]:
        """Return the time of the newest value of all channels; None without any.

        Times and values are as for ``departures``.
        """
        known = [np.isfinite(values[key]) for key in self._signals if key in values]
        rows = np.flatnonzero(np.any(known, axis=0)) if known else np.zeros(0, int)
        return float(times_s[rows[-1]]) if len(rows) else None

    def passed(self, times_s: np.ndarray, values: Mapping[Key, np.ndarray],
               reference_s: np.ndarray, since_s: float) -> Tuple[LiveDeparture, ...]:
        """Return the departures that ended after ``since_s``, up to ``judged_until_s``.

        A departure may come and go between two judgments. The rest is as for ``departures``.
        """
        found, until_s = [], self.judged_until_s(times_s, reference_s)
        for key in self._signals:
            if key not in values:
                continue
            rows, away = self._beyond(key, times_s, values[key], reference_s)
            for begin, end in _merged(spans(away != 0.0), times_s[rows]):
                ended_s = times_s[rows[end - 1]]
                if end < len(rows) and since_s < ended_s <= until_s and \
                        _lasting_s(times_s[rows], begin, end) >= _REPORTED_AFTER_S:
                    worst = begin + int(np.abs(away[begin:end]).argmax())
                    found.append(LiveDeparture(self._signals[key], float(times_s[rows[begin]]),
                                               float(away[worst])))
        return tuple(found)

    def _departure(self, key: Key, times_s: np.ndarray, values: np.ndarray,
                   reference_s: np.ndarray) -> Optional[LiveDeparture]:
        rows, away = self._beyond(key, times_s, values, reference_s)
        if not len(rows) or times_s[rows[-1]] < times_s[-1] - _NEWEST_S:
            return None
        since = outside_since(away != 0.0)
        if since is None or _lasting_s(times_s[rows], since, len(rows)) < _REPORTED_AFTER_S:
            return None
        return LiveDeparture(self._signals[key], float(times_s[rows[since]]),
                             float(away[np.flatnonzero(away)[-1]]))

    def _beyond(self, key: Key, times_s: np.ndarray, values: np.ndarray,
                reference_s: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
        """Return the rows (k,) of this run that can be judged, and how far they are out; 0: in."""
        limits = self._limits_at(key, reference_s)
        assert limits is not None
        deviation = _means(self._signals[key], times_s, values) - limits.middle
        rows = _of_this_run(np.flatnonzero(np.isfinite(deviation)), reference_s)
        half_width = limits.half_width[rows]
        return rows, beyond(deviation[rows], -half_width, half_width)

    def _limits_at(self, key: Key, reference_s: np.ndarray) -> Optional[SignalBand]:
        limits = self._limits.get(key)
        if limits is None:
            return None
        return SignalBand(*(np.interp(reference_s, self._times_s, it, np.nan, np.nan)
                            for it in limits[:2]))


def _merged(found: Sequence[Tuple[int, int]], times_s: np.ndarray) -> List[Tuple[int, int]]:
    """Return spans of rows, joined where a value is back in range only for a moment."""
    merged: List[Tuple[int, int]] = []
    for begin, end in found:
        if merged and times_s[begin] - times_s[merged[-1][1] - 1] <= _SWINGS_S:
            begin = merged.pop()[0]
        merged.append((begin, end))
    return merged


def _lasting_s(times_s: np.ndarray, begin: int, end: int) -> float:
    """Return how long judged rows from ``begin`` to before ``end`` last [s]; gaps do not count."""
    steps_s = np.diff(times_s)
    if not len(steps_s):
        return 0.0
    longest_s = max(_MAX_STEP_S, 1.5 * float(np.median(steps_s)))
    return float(np.minimum(steps_s[begin:end - 1], longest_s).sum())


def _means(signal: Signal, times_s: np.ndarray, values: np.ndarray,
           step_s: float = 1.0 / RATE_HZ) -> np.ndarray:
    """Return means over 0.1 s (n,), as those of the band; NaN where values are missing.

    On a busy computer messages are lost or late. Means of the remaining ones are rougher than those
    of good runs, and speeds there are those of a longer time.
    """
    means = moving_mean(values, max(round(MEAN_ROWS / RATE_HZ / step_s), 1))
    means[_lacks_values(signal, times_s, values, step_s)] = np.nan
    return means


def _lacks_values(signal: Signal, times_s: np.ndarray, values: np.ndarray,
                  step_s: float = 1.0 / RATE_HZ) -> np.ndarray:
    """Return where (n,) a channel lacks values that it usually has.

    A variable that lacks them most of the time is sent when it changes: it lacks none.
    """
    known = np.isfinite(values)
    known_s = times_s[known]
    usual_s = period_s(known_s)
    is_steady = signal.kind in (SignalKind.FORCE, SignalKind.SPEED)
    if usual_s <= 0.0:
        return ~known & is_steady
    edges_s = np.append(known_s, times_s[-1])
    begins = np.flatnonzero(np.diff(edges_s) > max(_MISSED * usual_s, _MIN_GAP_S))
    lacks = inside(times_s, np.stack([edges_s[begins], edges_s[begins + 1]], axis=1),
                   _AROUND_GAPS_S)
    again_s = edges_s[begins + 1][edges_s[begins + 1] - edges_s[begins] > _RESTART_S]
    lacks |= inside(times_s, np.stack([again_s, again_s + _SETTLES_S], axis=1), 0.0)
    if signal.kind is SignalKind.FORCE and usual_s < 2.0 * step_s:
        rows = max(round(MEAN_ROWS / RATE_HZ / step_s), 1)
        counts = moving_mean(known.astype(float), 2 * rows)
        lacks |= counts < _MIN_SHARE * np.median(counts[known])
    since_first = lacks[int(known.argmax()):]
    if not is_steady and since_first.mean() > _MAX_LACKING:
        return np.zeros(len(values), bool)
    result: np.ndarray = lacks
    return result


def _unknown_moments(reference_s: np.ndarray) -> np.ndarray:
    """Return where (n,) no moment of the reference is known within one run.

    A run continues meanwhile, while another run may begin at any moment.
    """
    unknown = np.isnan(reference_s)
    for begin, end in spans(unknown):
        is_within = begin > 0 and end < len(unknown)
        passed_s = reference_s[end] - reference_s[begin - 1] if is_within else -np.inf
        unknown[begin:end] = passed_s >= _MIN_PACE * (end - begin + 1) / RATE_HZ
    return unknown


def _just_found(reference_s: np.ndarray) -> np.ndarray:
    """Return the rows (n,) in which a run that was not seen from its beginning was just found."""
    unknown, found = np.isnan(reference_s), np.zeros(len(reference_s), bool)
    for begin, end in spans(unknown):
        if end < len(found) and end - begin >= _RESTART_S * RATE_HZ \
                and reference_s[end] > OPEN_BEGIN_S:
            found[end:end + int(_FOUND_AGAIN_S * RATE_HZ)] = True
    return found


class LiveBands(NamedTuple):
    """The bands of channels over the last seconds, in columns (n,) that last ``step_s`` [s] each.

    The first column begins at ``begin_s``, on the recorder's clock [s since the epoch].
    """

    begin_s: float
    step_s: float
    channels: Mapping[Key, TimelineBand]

    def text(self) -> str:
        """Return the input of `live_bands`."""
        return json.dumps({'begin_s': self.begin_s, 'step_s': self.step_s, 'channels': [
            [*key, _numbers(it.low), _numbers(it.high), ''.join('01'[int(is_out)] for is_out in
                                                                 it.departed)]
            for key, it in self.channels.items()]}, allow_nan=False)


def _numbers(values: np.ndarray) -> List[Optional[float]]:
    return [float(f'{it:.6g}') if np.isfinite(it) else None for it in values.tolist()]


def live_bands(text: str) -> LiveBands:
    """Return the bands whose ``text`` is given.

    Raises:
        ValueError: the text does not contain bands.
    """
    if len(text) > _MAX_BANDS_TEXT:
        raise ValueError('it is too long')
    try:
        found = parsed_json(text)
        step_s, channels = finite_number(found['step_s']), {}
        if step_s <= 0.0:
            raise ValueError('columns have no duration')
        for device, label, low, high, departed in found['channels']:
            columns = [np.array(it, float) for it in (low, high)]  # None is NaN
            if not columns[0].shape == columns[1].shape == (len(departed),):
                raise ValueError('columns differ in length')
            channels[str(device), str(label)] = TimelineBand(
                columns[0], columns[1], np.array([it == '1' for it in departed], bool))
        return LiveBands(finite_number(found['begin_s']), step_s, channels)
    except (KeyError, TypeError, AttributeError, OverflowError) as error:
        raise ValueError(f'not the bands of a running cell: {error}') from error


def _of_this_run(rows: np.ndarray, reference_s: np.ndarray) -> np.ndarray:
    """Return the rows after the last moment at which the reference started again.

    Until the new run has rows that can be judged, there are none: those before are of another run.
    """
    known = np.flatnonzero(np.isfinite(reference_s))
    back = np.flatnonzero(np.diff(reference_s[known]) < 0.0)
    return rows[rows >= known[back[-1] + 1]] if len(back) else rows


def departure_text(departure: LiveDeparture, now_s: float) -> str:
    """Return which channel is out of the band, how far, and for how long."""
    return f'{departure.signal.name} {beyond_text(departure)} {lasting_text(departure, now_s)}'


def lasting_text(departure: LiveDeparture, now_s: float) -> str:
    """Return how long a channel has been out of the band, at a time of its values' clock [s]."""
    return f'for {max(now_s - departure.since_s, 0.0):.1f} s'


def beyond_text(departure: LiveDeparture) -> str:
    """Return how far a channel is over or under the band."""
    side = 'above' if departure.beyond >= 0.0 else 'below'
    return f'{quantity(departure.signal, departure.beyond, sign=True, digits=2)} {side} range'
