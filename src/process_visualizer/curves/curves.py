# SPDX-License-Identifier: BSD-3-Clause
"""Small curves of the process variables over a whole recording, for the timeline."""
from __future__ import annotations

from typing import Callable, Dict, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from process_visualizer.bags.record_batches import record_batches
from process_visualizer.bags.recording import Recording
from process_visualizer.cell.model import Color, Device, WarningLimits
from process_visualizer.curves.curve_sources import (
    CurveSource,
    Quantity,
    curve_sources,
    plain_color,
)
from process_visualizer.curves.number_columns import NumberColumns, Numbers, joined_numbers
from process_visualizer.curves.source_locators import (
    SourceLocators,
    measured_s,
    source_locators,
)
from process_visualizer.motion.velocity.speed_series import speeds

MOST_PER_COLUMN, MOST_MESSAGES = 500, 750_000
"""Messages of a topic that are read for each column of its curve, on average, and at all."""
_FEWEST_COLUMNS, _MOST_COLUMNS, _COLUMN_S = 1500, 72_000, 0.05


class Curve(NamedTuple):
    """A process variable over a recording; ``color`` is red green blue from 0 to 1.

    One column per part of the recording, all as long: ``times_s`` is its middle in s from the
    beginning, ``low`` and ``high`` the least and greatest value in it, NaN where there is none.
    ``limits`` are those of the configuration.
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


class ReadingCancelled(Exception):
    """The curves are not wanted any more."""


class _Series(NamedTuple):
    """What is collected for a source: for each of its parts, by connection number."""

    source: CurveSource
    locators: SourceLocators
    parts: Tuple[Dict[int, NumberColumns], ...]


def columns_for(duration_s: float) -> int:
    """Return how many columns show a recording in detail where it is looked at closely."""
    return min(max(_FEWEST_COLUMNS, int(duration_s / _COLUMN_S)), _MOST_COLUMNS)


def read_curves(paths: Sequence[str], devices: Sequence[Device], columns: Optional[int] = None,
                on_progress: Optional[Callable[[float], None]] = None,
                is_cancelled: Callable[[], bool] = lambda: False) -> Tuple[Curve, ...]:
    """Return the curves of devices; of what the recording does not have there is none.

    Only the parts of the files that hold wanted messages are read (of compressed bags, the chunks).
    Of a topic with more than MOST_MESSAGES (an hour at 125 Hz has 450 000), or MOST_PER_COLUMN for
    each column, as many are read, evenly spread: a peak between them may be missed.
    Messages that cannot be read or do not fit are left out.

    Args:
        paths: the bags of one recording.
        devices: see curve_sources.
        columns: how many columns each curve has; without it see columns_for.
        on_progress: is told the part that is done, 0 to 1.
        is_cancelled: is asked often.

    Raises:
        ReadingCancelled: is_cancelled() has become true.
        BagError: a file cannot be read as a bag.
    """
    with Recording(paths) as recording:
        series = [found for source in curve_sources(devices)
                  for found in [_series(recording, source, devices)]
                  if found.locators.connections]
        columns = columns or columns_for((recording.end_ns - recording.begin_ns) / 1e9)
        _collect(recording, series, min(columns * MOST_PER_COLUMN, MOST_MESSAGES),
                 on_progress or _ignore, is_cancelled)
        curves = [_curve(recording, it, columns) for it in _colored(series)]
    return tuple(curve for curve in curves if np.isfinite(curve.high).any())


def _ignore(_fraction: float) -> None:
    pass


def _series(recording: Recording, source: CurveSource, devices: Sequence[Device]) -> _Series:
    locators = source_locators(recording, source, devices)
    return _Series(source, locators, tuple(
        {number: NumberColumns(locator) for number, locator in part.items()}
        for part in locators.parts))


def _collect(recording: Recording, series: Sequence[_Series], most: int,
             on_progress: Callable[[float], None], is_cancelled: Callable[[], bool]) -> None:
    """Read the messages and hand them to the series."""
    index = recording.index
    parts = [part for it in series for part in it.parts]
    chosen = [_spread(index.positions_of(tuple(part)), most) for part in parts]
    positions = np.unique(np.concatenate(chosen)) if chosen else np.empty(0, np.int64)
    done = 0
    for batch in record_batches(recording, positions):
        if is_cancelled():
            raise ReadingCancelled
        number_of = index.connection[batch.positions]
        for part in parts:
            for number, columns in part.items():
                columns.add(batch, np.flatnonzero(number_of == number))
        done += len(batch.positions)
        on_progress(done / len(positions))


def _spread(positions: np.ndarray, most: int) -> np.ndarray:
    """At most so many of the positions, evenly spread."""
    if len(positions) <= most:
        return positions
    return positions[np.linspace(0, len(positions) - 1, most).astype(np.int64)]


def _colored(series: Sequence[_Series]) -> List[_Series]:
    """The series, with a colour each for those that have none of their own."""
    plain = [it.source.topic for it in series if it.source.plain]
    return [it._replace(source=it.source._replace(color=plain_color(plain.index(it.source.topic))))
            if it.source.plain else it for it in series]


def _curve(recording: Recording, series: _Series, columns: int) -> Curve:
    parts = [joined_numbers(tuple(it.numbers() for it in part.values())) for part in series.parts]
    with np.errstate(over='ignore', invalid='ignore'):  # of numbers that are no measurements
        times_s, values = _values(recording, series.source.quantity,
                                  series.locators.joined(recording, parts))
    is_finite = np.isfinite(values)
    times_s, values = times_s[is_finite], values[is_finite]
    duration_s = (recording.end_ns - recording.begin_ns) / 1e9
    low, high = column_limits(times_s, values, duration_s, columns)
    middles_s = (np.arange(columns) + 0.5) * (duration_s / columns)
    source = series.source
    return Curve(source.device, source.label, source.unit, source.color, source.topic,
                 middles_s, low, high, source.limits)


def _values(recording: Recording, quantity: Quantity,
            numbers: Numbers) -> Tuple[np.ndarray, np.ndarray]:
    """Times [s from the beginning] and values of a series."""
    if quantity is Quantity.SPEED:
        return speeds(measured_s(recording, numbers), numbers.values)
    times_s = (recording.index.time_ns[numbers.positions] - recording.begin_ns) / 1e9
    if quantity is Quantity.NUMBER:
        return times_s, numbers.values[:, 0]
    return times_s, np.sqrt((numbers.values * numbers.values).sum(axis=1))


def column_limits(times_s: np.ndarray, values: np.ndarray, duration_s: float,
                  columns: int) -> Tuple[np.ndarray, np.ndarray]:
    """Return the least and the greatest value (columns,) of each part of a duration.

    Args:
        times_s: (n,), of any order; what lies outside counts to the nearer end.
        values: (n,).
        duration_s: is divided into so many columns of the same length.
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
