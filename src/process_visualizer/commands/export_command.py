# SPDX-License-Identifier: BSD-3-Clause
"""The command ``cell export``: the numbers of runs as a table for other programs."""
from __future__ import annotations

import argparse
import os
from contextlib import ExitStack
from typing import Callable, Dict, List, Sequence

from process_visualizer.bagio.recording import Recording
from process_visualizer.commands.chosen_spans import ChosenSpans, add_span_options, chosen_spans
from process_visualizer.page.number_table import (
    NumberTable,
    joined,
    number_table,
    run_column,
    write_csv,
)
from process_visualizer.runs.comparison.wording import clock
from process_visualizer.runs.recorded.chosen_runs import recorded_cell
from process_visualizer.shown_text import say
from process_visualizer.whole_file import whole_file

DEFAULT_RATE_HZ, _MAX_RATE_HZ = 100.0, 10_000.0
_MAX_ROWS = 5_000_000


def add_export_options(command: argparse.ArgumentParser) -> None:
    """Add the options of ``cell export``."""
    add_span_options(command, 'the table: FILE.csv or FILE.parquet', reference_help='')
    command.add_argument('--rate', metavar='HZ', type=float, default=DEFAULT_RATE_HZ,
                         help=f'rows in a second (default: {DEFAULT_RATE_HZ:g})')


def execute_export(options: argparse.Namespace, arguments: Dict[str, str]) -> int:
    """Write the table; return 0.

    Raises:
        BagError, ConfigurationError: a recording or its configuration cannot be read.
        ValueError: an option is out of range, or a package is missing.
        OSError: the file cannot be written; nothing of it is left then.
    """
    ending = os.path.splitext(options.output)[1].lower()
    if ending not in _WRITERS:
        raise ValueError(f'{options.output}: name a file that ends in {" or ".join(_WRITERS)}')
    if not 0.0 < options.rate <= _MAX_RATE_HZ:
        raise ValueError(f'--rate {options.rate:g}: write a number above 0 and up to '
                         f'{_MAX_RATE_HZ:g}')
    write = _WRITERS[ending]()
    chosen = chosen_spans(options, arguments)
    if chosen.duration_s * options.rate > _MAX_ROWS:
        raise ValueError(f'{clock(chosen.duration_s)} at {options.rate:g} Hz are more than '
                         f'{_MAX_ROWS} rows; name a part with --from and --to, or a lower --rate')
    tables = _tables(chosen, options.rate)
    with whole_file(options.output) as unfinished:
        write(unfinished, tables)
    say(f'{options.output}: {clock(chosen.duration_s)}, {sum(len(it.values) for it in tables)} '
        f'rows, {len(joined(tables).columns) + 1} columns')
    return 0


def _tables(chosen: ChosenSpans, rate_hz: float) -> List[NumberTable]:
    found = []
    for run, span in zip(chosen.runs, chosen.spans):
        with ExitStack() as stack:
            recording = stack.enter_context(Recording(run.recording))
            cell = chosen.cell if chosen.cell is not None \
                else stack.enter_context(recorded_cell(recording))
            found.append(number_table(cell, recording, run.name, span, rate_hz))
    return found


Write = Callable[[str, Sequence[NumberTable]], None]


def _csv_writer() -> Write:
    def write(path: str, tables: Sequence[NumberTable]) -> None:
        with open(path, 'w', encoding='utf-8', errors='backslashreplace', newline='') as file:
            write_csv(file, tables)
    return write


def _parquet_writer() -> Write:
    """Return what writes Parquet.

    Raises:
        ValueError: the package for it is missing.
    """
    try:
        import pyarrow
        import pyarrow.parquet
    except ImportError:
        raise ValueError('Parquet needs the Python package pyarrow; install it with "pip install '
                         'pyarrow", or write a .csv') from None

    def write(path: str, tables: Sequence[NumberTable]) -> None:
        whole = joined(tables)
        columns = {'run': run_column(tables), **dict(zip(whole.columns, whole.values.T))}
        pyarrow.parquet.write_table(pyarrow.table(columns), path)
    return write


_WRITERS: Dict[str, Callable[[], Write]] = {'.csv': _csv_writer, '.parquet': _parquet_writer}
