# SPDX-License-Identifier: BSD-3-Clause
"""Export of runs for other programs, as a table or an MCAP file."""
from __future__ import annotations

import csv
import os
from contextlib import contextmanager
from typing import Callable, Dict, Iterable, Iterator, List, NamedTuple, Sequence, TextIO, Tuple

import numpy as np

from process_visualizer.bagio.recording import Recording
from process_visualizer.bagio.recording_calibration import saved_poses, with_saved_poses
from process_visualizer.cell.model import Cell
from process_visualizer.curves.curve_sources import Quantity, curve_sources
from process_visualizer.curves.samples import Samples, found_series, read_samples
from process_visualizer.figures import clock_text
from process_visualizer.page.numbers import held
from process_visualizer.page.packed import Packed
from process_visualizer.page.robots import PageSpan
from process_visualizer.page.run_page import PageCell, run_entry
from process_visualizer.page.shared_page import ChosenSpans
from process_visualizer.robot.recorded_velocity import velocity_rows
from process_visualizer.runs.recorded.chosen_runs import recorded_cell
from process_visualizer.runs.recorded.robot_series import robot_series
from process_visualizer.runs.run import Run
from process_visualizer.whole_file import whole_file

DEFAULT_RATE_HZ = 100.0
_MAX_ROWS = 5_000_000


def export(path: str, chosen: ChosenSpans, rate_hz: float = DEFAULT_RATE_HZ) -> str:
    """Write a file, with ``rate_hz`` table rows per second; return a summary of its contents.

    Raises:
        BagError, ConfigurationError: a recording or its configuration cannot be read.
        ValueError: there are too many rows or runs, or a package is missing.
        OSError: the file cannot be written; no partial file is left.
    """
    try:
        write = _WRITERS[os.path.splitext(path)[1].lower()]()
    except ImportError as error:
        raise ValueError(f'{path} needs the Python package {error.name}; install it '
                         f'with "pip install {error.name}", or write a .csv') from None
    with whole_file(path) as unfinished:
        return write(unfinished, chosen, rate_hz)


@contextmanager
def _opened(chosen: ChosenSpans, run: Run) -> Iterator[Tuple[Recording, Cell]]:
    """Yield the recording of a run and its cell."""
    with Recording(run.recording) as recording:
        if chosen.cell is not None:
            yield recording, chosen.cell
            return
        with recorded_cell(recording) as cell:
            yield recording, cell


def _tables(chosen: ChosenSpans, rate_hz: float) -> List[NumberTable]:
    if chosen.duration_s * rate_hz > _MAX_ROWS:
        raise ValueError(f'{clock_text(chosen.duration_s)} at {rate_hz:g} Hz are more than '
                         f'{_MAX_ROWS} rows; name a part with --from and --to, or a lower --rate')
    found = []
    for run, span in zip(chosen.runs, chosen.spans):
        with _opened(chosen, run) as (recording, cell):
            found.append(number_table(cell, recording, run.name, span, rate_hz))
    return found


Write = Callable[[str, ChosenSpans, float], str]
"""Writes a file, with a number of rows per second [Hz], and returns a summary of its contents."""


def _csv_writer() -> Write:
    def write(path: str, chosen: ChosenSpans, rate_hz: float) -> str:
        tables = _tables(chosen, rate_hz)
        with open(path, 'w', encoding='utf-8', errors='backslashreplace', newline='') as file:
            write_csv(file, tables)
        return _size(tables)
    return write


def _parquet_writer() -> Write:
    import pyarrow
    import pyarrow.parquet

    def write(path: str, chosen: ChosenSpans, rate_hz: float) -> str:
        tables = _tables(chosen, rate_hz)
        whole = joined(tables)
        columns = {'run': run_column(tables), **dict(zip(whole.columns, whole.values.T))}
        pyarrow.parquet.write_table(pyarrow.table(columns), path)
        return _size(tables)
    return write


def _size(tables: List[NumberTable]) -> str:
    return (f'{sum(len(it.values) for it in tables)} rows, '
            f'{len(joined(tables).columns) + 1} columns')


def _mcap_writer() -> Write:
    from process_visualizer.page.mcap_file import PageData, write_mcap

    def write(path: str, chosen: ChosenSpans, _rate_hz: float) -> str:
        if len(chosen.runs) != 1:
            raise ValueError('an .mcap holds one run; name it with BAG#NUMBER')
        run, span = chosen.runs[0], chosen.spans[0]
        with _opened(chosen, run) as (recording, cell), open(path, 'wb') as file:
            packed = Packed()
            shared = PageCell(with_saved_poses(cell, saved_poses(run.recording[0])), packed)
            entry = run_entry(shared, recording, chosen.judged(run), span, packed,
                              with_frames=True)
            count = write_mcap(file, recording, span,
                               PageData(entry, shared.meshes, packed, cell.frame))
        return f'{count} messages'
    return write


_WRITERS: Dict[str, Callable[[], Write]] = {
    '.csv': _csv_writer, '.parquet': _parquet_writer, '.mcap': _mcap_writer}
ENDINGS = tuple(_WRITERS)
"""Endings of the files that can be written."""


# The numbers of a recording as a table: a common time base, and a column per curve and joint.

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
