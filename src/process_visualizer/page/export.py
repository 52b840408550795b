# SPDX-License-Identifier: BSD-3-Clause
"""Export of runs for other programs, as a table or an MCAP file."""
from __future__ import annotations

import os
from contextlib import contextmanager
from typing import Callable, Dict, Iterator, List, Tuple

from process_visualizer.bagio.recording import Recording
from process_visualizer.bagio.recording_calibration import saved_poses, with_saved_poses
from process_visualizer.cell.model import Cell
from process_visualizer.figures import clock_text
from process_visualizer.page.number_table import (
    NumberTable,
    joined,
    number_table,
    run_column,
    write_csv,
)
from process_visualizer.page.packed import Packed
from process_visualizer.page.run_page import PageCell, run_entry
from process_visualizer.page.shared_page import ChosenSpans
from process_visualizer.runs.recorded.chosen_runs import recorded_cell
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
