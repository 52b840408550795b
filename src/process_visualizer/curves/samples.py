# SPDX-License-Identifier: BSD-3-Clause
"""Numbers of process variables over a whole recording, read in bulk."""
from __future__ import annotations

from functools import partial
from typing import Callable, Dict, List, Mapping, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from process_visualizer.bagio.number_places import Locator
from process_visualizer.bagio.recording import Recording, record_batches
from process_visualizer.cell.model import Device
from process_visualizer.curves.curve_sources import CurveSource, Quantity
from process_visualizer.curves.number_columns import NumberColumns, Numbers, joined_numbers
from process_visualizer.curves.source_locators import (
    SourceLocators,
    certain,
    dated,
    measured_s,
    source_locators,
)
from process_visualizer.health.staleness import STALE_AFTER_S
from process_visualizer.robot.recorded_velocity import speeds
from process_visualizer.ros_names import JOINT_STATE


class ReadingCanceled(Exception):
    """The caller canceled reading."""


class Series(NamedTuple):
    """A source, and the locators of its numbers in the messages of a recording."""

    source: CurveSource
    locators: SourceLocators


class Samples(NamedTuple):
    """The numbers of a source: ``values`` (n, k) at ``times_s`` (n,) from the recording's start.

    For a tool, these are its positions x y z in its base, at the times of measurement, ascending;
    for a force or torque, its components; for a lag, the desired and the actual position of a
    joint. ``holes_s`` (m, 2) are the holes of the recording.
    """

    source: CurveSource
    times_s: np.ndarray
    values: np.ndarray
    holes_s: np.ndarray = np.empty((0, 2))


def found_series(recording: Recording, sources: Sequence[CurveSource],
                 devices: Sequence[Device]) -> List[Series]:
    """Return the series of those sources that a recording has; may load the devices' models."""
    found = [Series(source, source_locators(recording, source, devices)) for source in sources]
    return [it for it in found if it.locators.connections]


def read_samples(recording: Recording, series: Sequence[Series], most: Optional[int] = None,
                 on_progress: Optional[Callable[[float], None]] = None,
                 is_canceled: Callable[[], bool] = lambda: False,
                 by_stamp: bool = False) -> List[Samples]:
    """Return the numbers of some series, in the order of the series.

    Only the parts of the files that hold wanted messages are read (of compressed bags, the chunks).
    Messages that cannot be read or do not fit are skipped.

    Args:
        recording: to read.
        series: of this recording.
        most: the maximum number of messages read from a topic, evenly spread; default: all.
        on_progress: called with the completed share, 0 to 1.
        is_canceled: called often.
        by_stamp: whether numbers get the time of their message's stamp, if it has a plausible one,
            instead of the time of recording. Numbers without stamps are left out where their delay
            is unknown; see ``dated``.

    Raises:
        ReadingCanceled: is_canceled() has returned true.
        BagError: a file cannot be read as a bag.
    """
    columns = [tuple({number: NumberColumns(locator) for number, locator in part.items()}
                     for part in one.locators.parts) for one in series]
    _collect(recording, [part for parts in columns for part in parts], most,
             on_progress or (lambda _: None), is_canceled)
    holes_s = recording.holes(STALE_AFTER_S)
    return [_samples(recording, one, parts, by_stamp, holes_s)
            for one, parts in zip(series, columns)]


def part_numbers(recording: Recording, part: Mapping[int, Locator]) -> Numbers:
    """Return all numbers of a part of a source, in the order of the recording.

    Args:
        recording: to read.
        part: locators of the numbers, by connection.

    Raises:
        BagError: a file cannot be read as a bag.
    """
    columns = {number: NumberColumns(locator) for number, locator in part.items()}
    _collect(recording, [columns], None, lambda _: None, lambda: False)
    return joined_numbers(tuple(it.numbers() for it in columns.values()))


def sampled(samples: Samples) -> Tuple[np.ndarray, np.ndarray]:
    """Return times [s] (m,) and the numbers (m,) of samples that a curve shows."""
    if samples.source.quantity is Quantity.SPEED:
        return speeds(samples.times_s, samples.values)
    if samples.source.quantity is Quantity.NUMBER:
        return samples.times_s, samples.values[:, 0]
    if samples.source.quantity is Quantity.LAG:
        return samples.times_s, _difference(samples)
    return samples.times_s, np.sqrt((samples.values * samples.values).sum(axis=1))


def _difference(samples: Samples) -> np.ndarray:
    """Return the first numbers minus the second ones; for angles, within half a turn."""
    ahead: np.ndarray = samples.values[:, 0] - samples.values[:, 1]
    if samples.source.unit != 'rad':
        return ahead
    result: np.ndarray = np.remainder(ahead + np.pi, 2.0 * np.pi) - np.pi
    return result


def _collect(recording: Recording, parts: Sequence[Dict[int, NumberColumns]], most: Optional[int],
             on_progress: Callable[[float], None], is_canceled: Callable[[], bool]) -> None:
    """Read the messages and pass them to the columns."""
    index = recording.index
    chosen = [_spread(index.positions_of(tuple(part)), most, all(
        index.connections[number].type == JOINT_STATE for number in part)) for part in parts]
    positions = np.unique(np.concatenate(chosen)) if chosen else np.empty(0, np.int64)
    done = 0
    for batch in record_batches(recording, positions):
        if is_canceled():
            raise ReadingCanceled
        number_of = index.connection[batch.positions]
        for part in parts:
            for number, columns in part.items():
                columns.add(batch, np.flatnonzero(number_of == number))
        done += len(batch.positions)
        on_progress(done / len(positions))


_GOLDEN = 0.6180339887498949


def _spread(positions: np.ndarray, most: Optional[int], may_take_turns: bool) -> np.ndarray:
    """Return a limited number of the positions, evenly spread.

    If messages ``may_take_turns``, as joint states of several groups of joints do, the spacing
    varies: otherwise every second or third message would always be of the same group.
    """
    if most is None or len(positions) <= most:
        return positions
    if not may_take_turns:
        return positions[np.linspace(0, len(positions) - 1, most).astype(np.int64)]
    turn = np.arange(most)
    places = (turn + turn * _GOLDEN % 1.0) * (len(positions) / (most + 1.0))
    return positions[np.unique(places.astype(np.int64))]


def _samples(recording: Recording, series: Series,
             parts: Sequence[Dict[int, NumberColumns]], by_stamp: bool,
             holes_s: np.ndarray) -> Samples:
    numbers = [joined_numbers(tuple(column.numbers() for column in part.values()))
               for part in parts]
    with np.errstate(over='ignore', invalid='ignore'):  # bogus numbers may overflow
        joined = series.locators.joined(partial(measured_s, recording), numbers)
    if series.source.quantity is Quantity.SPEED:
        joined = certain(recording, joined)
        times_s = measured_s(recording, joined)
    elif by_stamp:
        joined, times_s = dated(recording, joined)
    else:
        times_s = (recording.index.time_ns[joined.positions] - recording.begin_ns) / 1e9
    return Samples(series.source, times_s - series.source.latency_s, joined.values, holes_s)


