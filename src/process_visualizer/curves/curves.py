# SPDX-License-Identifier: BSD-3-Clause
"""Small curves of the process variables, and their alarms, over a whole recording."""
from __future__ import annotations

from typing import Callable, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from process_visualizer.bagio.recording import Recording
from process_visualizer.cell.model import Color, Device, Variable, WarningLimits
from process_visualizer.curves.curve_sources import Quantity, curve_sources, plain_color
from process_visualizer.curves.position_values import key_of
from process_visualizer.curves.samples import Samples, Series, found_series, read_samples, sampled
from process_visualizer.health.staleness import STALE_AFTER_S, value_holds_for_s
from process_visualizer.parameters.variable_colors import limits_of
from process_visualizer.robot.limit_alarms import limit_alarms

MAX_PER_COLUMN, MAX_MESSAGES = 500, 750_000
"""Maximum messages read from a topic: per column of its curve on average, and in total."""
_MIN_COLUMNS, _MAX_COLUMNS, _COLUMN_S = 1500, 72_000, 0.05
_MAX_INTERVALS = 5000  # intervals between messages that show how a topic is usually sent
_HELD_INTERVALS, _HELD_S = 4, 0.3  # usual intervals, or time [s], for which a column's value holds
_MISSING = 2.5  # number of usual intervals without a message that makes a gap


class Curve(NamedTuple):
    """A process variable over a recording; ``color`` is red, green, blue from 0 to 1.

    The columns divide the recording into equal parts: ``times_s`` is the middle of each [s from the
    beginning], ``low`` and ``high`` are its minimum and maximum, NaN without a value. Between its
    messages a variable holds its value. ``limits`` are the configured ones.
    """

    device: str
    label: str
    unit: str
    color: Color
    topic: str
    times_s: np.ndarray
    low: np.ndarray
    high: np.ndarray
    limits: Optional[WarningLimits] = None


def columns_for(duration_s: float) -> int:
    """Return the number of columns that show a recording in detail when zoomed in."""
    return min(max(_MIN_COLUMNS, int(duration_s / _COLUMN_S)), _MAX_COLUMNS)


def read_curves(paths: Sequence[str], devices: Sequence[Device], columns: Optional[int] = None,
                on_progress: Optional[Callable[[float], None]] = None,
                is_canceled: Callable[[], bool] = lambda: False) -> Tuple[Curve, ...]:
    """Return the curves of devices, without those whose data is not in the recording.

    Only the parts of the files that hold wanted messages are read (of compressed bags, the chunks).
    If a topic has more than MAX_MESSAGES messages (an hour at 125 Hz has 450 000), or more than
    MAX_PER_COLUMN for each column, only this many are read, evenly spread, so a peak between them
    may be missed. Messages that cannot be read or do not fit are skipped.

    Args:
        paths: the bags of one recording.
        devices: see curve_sources.
        columns: the number of columns of each curve; default: see columns_for.
        on_progress: called with the completed share, 0 to 1.
        is_canceled: called often.

    Raises:
        ReadingCanceled: is_canceled() has returned true.
        BagError: a file cannot be read as a bag.
    """
    with Recording(paths) as recording:
        series = found_series(recording, curve_sources(devices), devices)
        columns = columns or columns_for((recording.end_ns - recording.begin_ns) / 1e9)
        samples = read_samples(recording, colored(series),
                               min(columns * MAX_PER_COLUMN, MAX_MESSAGES), on_progress,
                               is_canceled)
        duration_s = (recording.end_ns - recording.begin_ns) / 1e9
    curves = [curve_of(it, duration_s, columns) for it in samples]
    return tuple(curve for curve in curves if np.isfinite(curve.high).any())


def colored(series: Sequence[Series]) -> List[Series]:
    """Return the series, with a color for each one that has none of its own."""
    plain = [it.source.topic for it in series if it.source.plain]
    return [it._replace(source=it.source._replace(color=plain_color(plain.index(it.source.topic))))
            if it.source.plain else it for it in series]


def curve_of(samples: Samples, duration_s: float, columns: int) -> Curve:
    """Return the curve of samples over a recording of some duration."""
    with np.errstate(over='ignore', invalid='ignore'):  # bogus numbers may overflow
        times_s, values = sampled(samples)
    is_finite = np.isfinite(values)
    low, high = column_limits(times_s[is_finite], values[is_finite], duration_s, columns)
    middles_s = (np.arange(columns) + 0.5) * (duration_s / columns)
    source = samples.source
    if source.quantity is Quantity.NUMBER and duration_s > 0.0:
        held = held_values(times_s, np.where(is_finite, values, np.nan), middles_s)
        for begin_s, end_s in samples.holes_s.tolist():
            held[(middles_s > begin_s) & (middles_s < end_s)] = np.nan
        low, high = (np.where(np.isnan(it), held, it) for it in (low, high))
    return Curve(source.device, source.label, source.unit, source.color, source.topic,
                 middles_s, low, high, source.limits)


def column_limits(times_s: np.ndarray, values: np.ndarray, duration_s: float,
                  columns: int) -> Tuple[np.ndarray, np.ndarray]:
    """Return the minimum and the maximum (columns,) of each part of a duration.

    Args:
        times_s: (n,), in any order; a time outside the duration counts for the nearer end.
        values: (n,).
        duration_s: the duration that is divided into columns of equal length.
    """
    low, high = np.full(columns, np.nan), np.full(columns, np.nan)
    if len(times_s):
        column = np.zeros(len(times_s), np.int64)
        if duration_s > 0.0:
            column = np.clip(times_s * (columns / duration_s), 0, columns - 1).astype(np.int64)
        order = np.argsort(column, kind='stable')
        present, begin = np.unique(column[order], return_index=True)
        low[present] = np.minimum.reduceat(values[order], begin)
        high[present] = np.maximum.reduceat(values[order], begin)
    return low, high


def held_values(times_s: np.ndarray, values: np.ndarray, at_s: np.ndarray) -> np.ndarray:
    """Return the value that holds at each of some times, NaN where the last one is stale.

    A rarely sent topic holds its value as in the scene (see ``value_holds_for_s``); a topic that is
    sent at a rate holds it only until a few messages are missing.

    Args:
        times_s: (n,), in any order.
        values: (n,), NaN where there is no measurement.
        at_s: (m,).
    """
    if not len(times_s):
        return np.full(len(at_s), np.nan)
    order = np.argsort(times_s, kind='stable')
    known_s = times_s[order]
    row = np.searchsorted(known_s, at_s, side='right') - 1
    age_s = at_s - known_s[np.maximum(row, 0)]
    result: np.ndarray = np.where((row >= 0) & (age_s <= _holds_for_s(known_s)),
                                  values[order][np.maximum(row, 0)], np.nan)
    return result


def held_columns(low: np.ndarray, high: np.ndarray,
                 column_s: float) -> Tuple[np.ndarray, np.ndarray]:
    """Return columns (n,) in which the last value of a slow topic holds between its messages.

    Only gaps much longer than usual stay empty. ``column_s`` is the duration of a column [s].
    """
    known = np.flatnonzero(~np.isnan(low))
    if len(known) < 2:
        return low, high
    longest = max(_HELD_INTERVALS * float(np.median(np.diff(known))), _HELD_S / column_s)
    held = np.maximum.accumulate(np.where(np.isnan(low), -1, np.arange(len(low))))
    holds = (held >= 0) & (np.arange(len(low)) - held <= longest)
    return np.where(holds, low[held], np.nan), np.where(holds, high[held], np.nan)


def _holds_for_s(times_s: np.ndarray) -> float:
    intervals_s = np.sort(np.diff(times_s))
    if len(intervals_s) > _MAX_INTERVALS:
        intervals_s = intervals_s[np.linspace(
            0, len(intervals_s) - 1, _MAX_INTERVALS).astype(np.int64)]
    holds_s = value_holds_for_s(intervals_s.tolist(), STALE_AFTER_S)
    if holds_s > STALE_AFTER_S:
        return holds_s
    return min(holds_s, _MISSING * float(intervals_s[int(0.95 * (len(intervals_s) - 1))]))


class RecordedAlarm(NamedTuple):
    """An alarm of a device, from its start to its end [s from the beginning]."""

    device: str
    text: str
    begin_s: float
    end_s: float


def recorded_alarms(devices: Sequence[Device],
                    curves: Sequence[Curve]) -> Tuple[RecordedAlarm, ...]:
    """Return the alarms of all variables with limits, in order of time."""
    by_key = {key_of(curve.device, curve.label, curve.topic): curve for curve in curves}
    found: List[RecordedAlarm] = []
    for device in devices:
        for variable in device.variables:
            label = variable.label or variable.topic.strip('/')
            curve = by_key.get(key_of(device.name, label, variable.topic))
            if curve is not None:
                found += _alarms(device.name, label, variable, curve)
    return tuple(sorted(found, key=lambda it: it.begin_s))


def _alarms(device: str, label: str, variable: Variable, curve: Curve) -> List[RecordedAlarm]:
    limits, unit = limits_of(variable), variable.unit
    if not limits.exist:
        return []
    is_there = np.isfinite(curve.high)
    low, high = curve.low[is_there], curve.high[is_there]
    worst = np.where(limits.excess(high) >= limits.excess(low), high, low)
    return [RecordedAlarm(device, f'{limits.sentence(label, it.extreme, unit)}, '
                          f'{limits.reach(it.extreme, unit)}', it.begin_s, it.end_s)
            for it in limit_alarms(limits, curve.times_s[is_there], worst)]
