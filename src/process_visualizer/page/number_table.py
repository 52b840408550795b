# SPDX-License-Identifier: BSD-3-Clause
"""The numbers of a recording as a table: a common time base, and a column per curve and joint."""
from __future__ import annotations

import csv
from typing import Iterable, List, NamedTuple, Sequence, TextIO

import numpy as np

from process_visualizer.bagio.recording import Recording
from process_visualizer.cell.model import Cell
from process_visualizer.curves.curve_sources import Quantity, curve_sources
from process_visualizer.curves.samples import Samples, found_series, read_samples
from process_visualizer.page.numbers import held
from process_visualizer.page.robots import PageSpan
from process_visualizer.robot.recorded_velocity import velocity_rows
from process_visualizer.runs.recorded.robot_series import robot_series

TIME_COLUMNS = ('time [s]', 'stamp [s]')
"""Columns of the time since the start of the recording, and since the epoch."""


class NumberTable(NamedTuple):
    """Numbers at evenly spaced times; NaN where a number is missing.

    ``columns`` has the name and unit of each column of ``values`` (n, k).
    """

    run: str
    columns: List[str]
    values: np.ndarray


def number_table(cell: Cell, recording: Recording, run: str, span: PageSpan,
                 rate_hz: float) -> NumberTable:
    """Return the numbers that the launcher and the robots show in a part of a recording.

    Speeds are those of the velocity arrows. All other values hold until the next message.
    """
    series = [*found_series(recording, curve_sources(cell.devices), cell.devices),
              *robot_series(recording, cell.devices)]
    count = int((span.end_s - span.begin_s) * rate_hz + 1e-6) + 1
    times_s = span.begin_s + np.arange(count) / rate_hz
    names, values = list(TIME_COLUMNS), [times_s, times_s + recording.begin_ns / 1e9]
    for samples in read_samples(recording, series):
        source = samples.source
        name = f'{source.device} {source.channel_label or source.topic}'.strip()
        unit = f' [{source.unit}]' if source.unit else ''
        names.append(name + unit if name + unit not in names else f'{name} {source.topic}{unit}')
        values.append(_at(samples, times_s))
    return NumberTable(run, names, np.column_stack(values))


def _at(samples: Samples, times_s: np.ndarray) -> np.ndarray:
    """Return the unformatted number shown at each of the times (n,)."""
    if samples.source.quantity is Quantity.SPEED:
        known_s, vectors = velocity_rows(samples.times_s, samples.values)
        if not len(known_s):
            return np.full(len(times_s), np.nan)
        parts = [np.interp(times_s, known_s, column, np.nan, np.nan) for column in vectors.T]
        return np.asarray(np.linalg.norm(parts, axis=0))
    known_s, values = held(samples)
    row = np.searchsorted(known_s, times_s + 1e-9, side='right') - 1
    return np.where(row >= 0, values[np.maximum(row, 0)] if len(values) else np.nan, np.nan)


def joined(tables: Sequence[NumberTable]) -> NumberTable:
    """Return the rows of several tables as one table with all their columns.

    Numbers missing from a table are NaN. The names of the runs are not kept.
    """
    columns = list(dict.fromkeys(name for table in tables for name in table.columns))
    parts = []
    for table in tables:
        part = np.full((len(table.values), len(columns)), np.nan)
        part[:, [columns.index(name) for name in table.columns]] = table.values
        parts.append(part)
    return NumberTable('', columns, np.vstack(parts))


def run_column(tables: Iterable[NumberTable]) -> List[str]:
    """Return the name of the run for each row of the joined tables."""
    return [table.run for table in tables for _ in range(len(table.values))]


def write_csv(file: TextIO, tables: Sequence[NumberTable]) -> None:
    """Write the joined tables as comma-separated values; a missing number is an empty field."""
    whole = joined(tables)
    writer = csv.writer(file, lineterminator='\n')
    writer.writerow(['run', *whole.columns])
    digits = [f'{{:.{6 if name == TIME_COLUMNS[1] else 9}{"f" if name in TIME_COLUMNS else "g"}}}'
              for name in whole.columns]
    for run, row in zip(run_column(tables), whole.values.tolist()):
        writer.writerow([run, *('' if number != number else text.format(number)
                                for text, number in zip(digits, row))])
