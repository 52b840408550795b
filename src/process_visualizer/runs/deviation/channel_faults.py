# SPDX-License-Identifier: BSD-3-Clause
"""Faults of a channel that its own values show, and no band of means: stuck sensors, vibrations.

The values also show more exactly when a departure began: see `refined_onset`.
"""
from __future__ import annotations

from typing import Dict, Iterable, Iterator, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from process_visualizer.runs.alignment.alignment import Alignment
from process_visualizer.runs.alignment.time_map import TimeMap
from process_visualizer.runs.deviation.band import Band, SignalBand, beyond
from process_visualizer.runs.deviation.departures import Departure
from process_visualizer.runs.deviation.signals import RATE_HZ, Signal, SignalKind
from process_visualizer.runs.run import Channel, ChannelKind, Key, Run
from process_visualizer.runs.series import (
    FINE_S,
    ROUGH_S,
    data_gaps,
    fine_part,
    held_at,
    inside,
    is_sequence,
    moving_maximum,
    period_s,
)

_KINDS = {ChannelKind.VARIABLE: SignalKind.VARIABLE, ChannelKind.FORCE: SignalKind.FORCE}
_MAX_PERIOD_S = 0.1
"""Signals slower than this may repeat a value a few times by chance [s]."""
_TIMES_AS_LONG, _MIN_S = 3.0, 0.4
_AS_LONG = 0.8
_MAX_MEANS = 3.0
"""Maximum part of the time between two messages that counts, in mean intervals."""
_NEAR_ROWS = int(0.5 * RATE_HZ)
_KNOWN_S, _BESIDE_S = 0.02, 0.2


class StuckSensors:
    """Detector of stuck sensors, by how long values stay the same in good runs."""

    def __init__(self, times_s: np.ndarray, good: Iterable[Tuple[Run, TimeMap]]) -> None:
        """Set the times (t,) [s] of the reference, and the good runs with their maps."""
        self._times_s = times_s
        self._longest_s: Dict[Key, np.ndarray] = {}
        known: Dict[Key, np.ndarray] = {}
        for run, time_map in good:
            run_s = time_map.to_run(times_s)
            for channel in _measured(run.channels):
                found, is_known = _unchanged_s(channel, run_s)
                before = self._longest_s.get(channel.key, np.nan)
                self._longest_s[channel.key] = np.fmax(before, found)
                known[channel.key] = known.get(channel.key, False) | is_known
        self._at_least_s = {key: np.nan_to_num(it) for key, it in self._longest_s.items()}
        self._longest_s = {
            key: moving_maximum(np.where(known[key] | np.isnan(it), np.nan_to_num(it), np.inf),
                                _NEAR_ROWS) for key, it in self._longest_s.items()}

    def departures(self, run: Run, time_map: TimeMap) -> Iterator[Departure]:
        """Yield a departure for each stuck channel, from the last change of its value on."""
        run_s = time_map.to_run(self._times_s)
        is_there = (run_s >= 0.0) & (run_s <= run.duration_s)
        for channel in _measured(run.channels):
            usual_s = self._longest_s.get(channel.key)
            if usual_s is not None:
                held_s = np.where(is_there, _unchanged_s(channel, run_s)[0], 0.0)
                found = _departure(channel, held_s, usual_s, self._times_s, time_map, run_s)
                if found is not None and not self._is_late(channel.key, found):
                    yield found

    def _is_late(self, key: Key, found: Departure) -> bool:
        """Return whether good runs stayed the same for as long and then changed, as the band shows.

        The time before the beginning of a good run does not count.
        """
        passed_s = self._times_s - found.onset_s
        before = (passed_s > _MIN_S) & (self._times_s < found.left_s)
        return bool((self._at_least_s[key] >= _AS_LONG * passed_s)[before].any())


def explains(stuck: Departure, other: Departure) -> bool:
    """Return whether a stuck sensor explains that its channel was outside the band.

    If the value left the band when it stopped changing, it is what differed: it fell to zero. If it
    stays outside when it changes again, something else differs, too.
    """
    if other.channel != stuck.channel or other.left_s <= stuck.onset_s + _BESIDE_S:
        return False
    if stuck.back_s is None:
        return True
    until_s = stuck.back_s + max(other.signal.over_s, ROUGH_S) + _BESIDE_S
    return other.left_s <= until_s and other.back_s is not None and other.back_s <= until_s


def _departure(channel: Channel, held_s: np.ndarray, usual_s: np.ndarray, times_s: np.ndarray,
               time_map: TimeMap, run_s: np.ndarray) -> Optional[Departure]:
    limit_s = np.maximum(_TIMES_AS_LONG * usual_s, _MIN_S)
    rows = np.flatnonzero(np.nan_to_num(held_s) > limit_s)
    if not len(rows):
        return None
    first = int(rows[0])
    ends = np.flatnonzero(held_s[first:] < held_s[first])
    end = first + int(ends[0]) if len(ends) else len(held_s)
    worst = first + int((held_s[first:end] / limit_s[first:end]).argmax())
    since_s = float(time_map.to_reference(np.array([run_s[first] - held_s[first]]))[0])
    signal = Signal(channel.device, channel.label, channel.unit, _KINDS[channel.kind],
                    channel.tolerance, max_tolerance=channel.max_tolerance)
    return Departure(signal, float(times_s[first]), float(times_s[end]) if end < len(times_s)
                     else None, max(since_s, 0.0), _KNOWN_S, float(times_s[worst]),
                     float(held_s[worst]), float(limit_s[worst]),
                     f'stays exactly the same for {held_s[worst]:.2g} s '
                     f'(in good runs up to {usual_s[worst]:.2g} s)')


def _measured(channels: Sequence[Channel]) -> Iterator[Channel]:
    """Yield channels that are measured often: no states, and none that follow from the motion."""
    for channel in channels:
        if channel.kind in _KINDS and len(channel.times_s) > 1 and not is_sequence(channel) \
                and period_s(channel.times_s) <= _MAX_PERIOD_S:
            yield channel


def _unchanged_s(channel: Channel, run_s: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
    """Return how long (t,) [s] messages have had the same value at times of the run (t,).

    NaN in gaps between messages, which do not count: the value may have been another one there.
    Also return whether this is known (t,): for a value that has not changed since the first
    message, it is only a lower bound.
    """
    finite = np.isfinite(channel.values)
    times_s, values = channel.times_s[finite], channel.values[finite]
    if not len(values):
        return np.full(len(run_s), np.nan), np.zeros(len(run_s), bool)
    is_new = np.concatenate(([True], np.diff(values) != 0.0))
    changed = np.maximum.accumulate(np.where(is_new, np.arange(len(values)), 0))
    mean_s = (times_s[-1] - times_s[0]) / max(len(times_s) - 1, 1)
    seen_s = np.concatenate(([0.0], np.cumsum(np.minimum(np.diff(times_s), _MAX_MEANS * mean_s))))
    held_s = held_at(run_s, times_s, seen_s - seen_s[changed])
    return (np.where(inside(run_s, data_gaps(times_s)), np.nan, held_s),
            held_at(run_s, times_s, np.where(changed > 0, 1.0, 0.0)) > 0.0)


_ABOUT_S, _LOOK_BEFORE_S, _LOOK_BEHIND_S = 0.8, 1.5, 0.3
_MIN_OF_PART = 5
_WORSE = 8.0
"""Maximum cost of a possible moment above the lowest one: values of noise are alike."""
_BEHIND_EDGE = (0.5, 0.8, 1.1, 1.4, 1.7)


class _UsualCourse(NamedTuple):
    """The usual value and roughness (t,) of a channel at times of a run (t,) [s]."""

    times_s: np.ndarray
    value: np.ndarray
    rough: np.ndarray


def _rough_since_s(channel: Channel, about_s: float, left_s: float,
                  usual: _UsualCourse) -> Optional[Tuple[float, float]]:
    """Return since when a channel is rougher than usual, give or take how much [s of the run].

    None if that is unclear.

    Roughness covers the last half second, so it shows late when it began. The moment is chosen so
    that the squares of the fine part, relative to the usual, are most likely those of two normal
    distributions, one before and one after it. An edge is rough for half a second; the usual
    roughness after the edge counts.

    Args:
        channel: of the run.
        about_s: the beginning, give or take some tenths of a second [s of the run].
        left_s: the time at which the roughness left the band [s of the run].
        usual: the course of good runs.
    """
    inside = np.isfinite(channel.values) & (channel.times_s >= about_s - _LOOK_BEFORE_S) & (
        channel.times_s <= left_s + _LOOK_BEHIND_S)
    times_s = channel.times_s[inside]
    rows = max(FINE_S / max(period_s(times_s), 1e-9), 3.0)
    known = np.isfinite(np.stack(usual)).all(axis=0)
    if len(times_s) < 4 * _MIN_OF_PART or not known.any():
        return None
    usual_s, value, rough = (it[known] for it in usual)
    fine = fine_part(channel.values[inside] - np.interp(times_s, usual_s, value), rows)
    scale = np.min([np.interp(times_s + it * ROUGH_S, usual_s, rough) for it in _BEHIND_EDGE],
                   axis=0)
    squares = np.square(fine) * np.exp(-2.0 * scale)
    count = np.arange(1, len(squares))
    total = np.cumsum(squares)
    before, behind = total[:-1] / count, (total[-1] - total[:-1]) / count[::-1]
    cost = count * np.log(before + 1e-12) + count[::-1] * np.log(behind + 1e-12)
    cost[(behind <= before) | (times_s[1:] > left_s) | (np.abs(times_s[1:] - about_s) > _ABOUT_S)
         | (count < _MIN_OF_PART) | (count[::-1] < _MIN_OF_PART)] = np.inf
    best = int(cost.argmin())
    if not np.isfinite(cost[best]):
        return None
    possible_s = times_s[1:][cost <= cost[best] + _WORSE]
    since_s = float(times_s[best + 1])
    return since_s, float(max(since_s - possible_s[0], possible_s[-1] - since_s))


_AS_USUAL, _AS_OTHER = 0.3, 0.5
"""Maximum deviation of a usual value, and minimum of another one, as a share of the greatest.

All are counted in widths of the band, which differ with the level.
"""


def _seldom_since_s(channel: Channel, left_s: float, worst_s: float, at_s: np.ndarray,
                   limits: SignalBand) -> Optional[Tuple[float, float]]:
    """Return the last usual value and the first other one [s of the run] of a rarely sent channel.

    Something began between the two; if no value before was usual, from the start of the run on.
    None without any value. A value beside an edge that was sent before or after it may be
    both usual and not: it says nothing.

    Args:
        channel: of the run.
        left_s, worst_s: the times at which the line between two values left the band, and at which
            it was farthest outside [s of the run].
        at_s: (t,), times of the run, of the band's rows.
        limits: the band.
    """
    known = np.isfinite(limits.middle) & np.isfinite(limits.half_width) & np.isfinite(at_s)
    finite = np.isfinite(channel.values)
    times_s, values = channel.times_s[finite], channel.values[finite]
    if not known.any() or not len(times_s):
        return None
    if left_s > times_s[-1]:  # the last value holds
        times_s, values = np.append(times_s, left_s), np.append(values, values[-1])
    first = int(np.searchsorted(times_s, left_s))
    reach = int(1.5 * period_s(times_s) * RATE_HZ)
    margin = -moving_maximum(np.where(known, -limits.half_width, -np.inf), reach)
    edge = limits.half_width - margin
    low, high, width = (np.interp(times_s, at_s[known], it[known])
                        for it in (limits.middle - edge, limits.middle + edge, margin))
    outside = beyond(values, low, high) / width
    if outside[first] < 0.0:
        values, low, outside = -values, -high, -outside
    away = float(outside[first:int(np.searchsorted(times_s, worst_s)) + 1].max(
        initial=outside[first]))
    is_other = outside > _AS_OTHER * away
    while first > 0 and is_other[first - 1]:
        first -= 1
    is_usual = values - _AS_USUAL * away * width < low
    last_usual = int(np.max(np.flatnonzero(is_usual[:first]), initial=-1))
    return (float(times_s[last_usual]) if last_usual >= 0 else 0.0), float(times_s[first])


_BEFORE_S, _MIN_VALUES = 0.5, 32
_MIN_HZ, _PERIODS = 2.0, 4.0
_PEAK = 12.0
"""Minimum ratio of a peak to the usual power.

White noise rarely reaches it at any of some hundred frequencies.
"""


def _vibration_hz(channel: Channel, begin_s: float, end_s: float) -> Optional[float]:
    """Return the frequency [Hz] of a vibration between two times of a run [s]; None without one.

    This is the frequency of the highest peak of the power spectrum, if the peak is clear.
    """
    usual_s = period_s(channel.times_s)
    inside = np.isfinite(channel.values) & (channel.times_s >= begin_s - _BEFORE_S) \
        & (channel.times_s <= end_s)
    if usual_s <= 0.0 or np.count_nonzero(inside) < _MIN_VALUES:
        return None
    known_s, values = channel.times_s[inside], channel.values[inside].astype(float)
    times_s = np.arange(known_s[0], known_s[-1], usual_s)
    even = np.interp(times_s, known_s, values)
    rows = np.arange(len(even))
    even -= np.polyval(np.polyfit(rows, even, 1), rows)
    power = np.square(np.abs(np.fft.rfft(even * np.hanning(len(even)))))
    hz = np.fft.rfftfreq(len(even), usual_s)
    tells = hz >= max(_MIN_HZ, _PERIODS / (len(even) * usual_s))
    if np.count_nonzero(tells) < 8:
        return None
    peak = int(np.where(tells, power, 0.0).argmax())
    if power[peak] < _PEAK * float(np.median(power[tells])) / np.log(2.0):
        return None
    return float(hz[peak])


# The onset of a departure, from the values of the channel that has departed. A comparison finds
# departures in means, which change gradually. In the values themselves, noise begins with its first
# fast change, a signal that became too smooth lacks fast changes from then on, and one that is sent
# rarely has changed between two of its values.

_ROUGH_KNOWN_S, _ROUGH_PERIODS = 0.1, 4.0
"""Uncertainty of when a channel became rough: at least this time [s], and so many periods."""


def refined_onset(it: Departure, found: Sequence[Departure], run: Run, alignment: Alignment,
                  band: Band, times_s: np.ndarray) -> Departure:
    """Return a departure with an onset that is as exact as the channel's own values allow.

    If the value itself departs more clearly at the same time, noise is only the jump of the value:
    its onset is left as it is. ``found`` are all departures of the run, ``times_s`` (t,) the
    moments of the reference.
    """
    if it.signal.period_s:
        return _onset_of_rare_signal(it, run, alignment, band, times_s)
    channel = run.by_key.get(it.channel)
    if channel is not None:  # a value is known to within one period
        it = it._replace(uncertainty_s=max(it.uncertainty_s, period_s(channel.times_s)))
    if any(_is_jump_of(it, other) for other in found):
        return it
    return _onset_of_roughness(_onset_of_smoothness(it, alignment), run, alignment, band)


def with_frequency(it: Departure, run: Run, alignment: Alignment, end_s: float) -> Departure:
    """Return a departure; if it is noise, with the frequency of a vibration, if any.

    A departure without an end lasts to ``end_s`` of the reference [s].
    """
    channel = run.by_key.get(it.channel)
    if it.signal.kind is not SignalKind.NOISE or it.deviation < 0.0 or channel is None:
        return it
    ends_s = np.array([it.left_s, end_s if it.back_s is None else it.back_s])
    frequency_hz = _vibration_hz(channel, *alignment.time_map.to_run(ends_s).tolist())
    return it._replace(frequency_hz=frequency_hz)


def _is_jump_of(noise: Departure, value: Departure) -> bool:
    return noise.signal.kind is SignalKind.NOISE and value.signal.kind is not SignalKind.NOISE \
        and value.channel == noise.channel and value.severity > noise.severity \
        and abs(value.left_s - noise.left_s) < ROUGH_S


def _onset_of_smoothness(it: Departure, alignment: Alignment) -> Departure:
    """Return a departure; if it is too smooth, its onset is when its fast changes ended.

    Roughness is measured over ``ROUGH_S``, so it falls that long after the last fast changes.
    """
    if it.signal.kind is not SignalKind.NOISE or it.signal.over_s or it.deviation > 0.0:
        return it
    run_s = alignment.time_map.to_run(np.array([it.left_s])) - ROUGH_S
    since_s = max(float(alignment.time_map.to_reference(run_s)[0]), 0.0)
    return it._replace(onset_s=min(it.onset_s, since_s))


def _onset_of_rare_signal(it: Departure, run: Run, alignment: Alignment, band: Band,
                          times_s: np.ndarray) -> Departure:
    """Return a departure of a signal that is sent rarely: it began between two of its values."""
    if it.channel not in run.by_key:
        return it
    at_s = alignment.time_map.to_run(times_s)
    left_s, worst_s = alignment.time_map.to_run(np.array([it.left_s, it.worst_s])).tolist()
    found = _seldom_since_s(run.by_key[it.channel], left_s, worst_s, at_s, band.signals[it.signal])
    if found is None:
        return it
    ends_s = np.maximum(alignment.time_map.to_reference(np.array(found)), 0.0)
    middle_s, half_s = float(ends_s.mean()), 0.5 * float(np.ptp(ends_s))
    return it._replace(onset_s=middle_s, uncertainty_s=half_s)


def _onset_of_roughness(it: Departure, run: Run, alignment: Alignment, band: Band) -> Departure:
    """Return a departure; if it is too rough, its onset is that of its fast changes."""
    if it.signal.kind is not SignalKind.NOISE or it.deviation < 0.0:
        return it
    key = it.channel
    usual = {signal.kind is SignalKind.NOISE: limits.usual for signal, limits in
             band.signals.items() if not signal.over_s and signal.device == key[0]
             and signal.label in (key[1], it.signal.label)}
    rough, value = usual.get(True), usual.get(False)
    if rough is None or value is None or key not in run.by_key:
        return it
    at_s = alignment.time_map.to_run(np.arange(len(rough)) / RATE_HZ)
    about_s, left_s = alignment.time_map.to_run(np.array([it.onset_s, it.left_s])).tolist()
    since = _rough_since_s(run.by_key[key], about_s, left_s, _UsualCourse(at_s, value, rough))
    if since is None:
        return it
    since_s, known_s = since
    onset_s = float(alignment.time_map.to_reference(np.array([since_s]))[0])
    known_s = max(known_s, _ROUGH_KNOWN_S, _ROUGH_PERIODS * period_s(run.by_key[key].times_s))
    return it._replace(onset_s=max(onset_s, 0.0), uncertainty_s=known_s)
