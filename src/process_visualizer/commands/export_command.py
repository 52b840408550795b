# SPDX-License-Identifier: BSD-3-Clause
"""The command ``cell export``: writes runs for other programs, as a table or an MCAP file."""
from __future__ import annotations

import argparse
import os
from typing import Dict

from process_visualizer.commands.chosen_spans import add_span_options, chosen_spans
from process_visualizer.page.exported import DEFAULT_RATE_HZ, ENDINGS, export
from process_visualizer.runs.comparison.wording import clock
from process_visualizer.shown_text import say

_MAX_RATE_HZ = 10_000.0


def add_export_options(command: argparse.ArgumentParser) -> None:
    """Add the options of ``cell export``."""
    add_span_options(command, 'the table FILE.csv or FILE.parquet, or FILE.mcap',
                     'good runs, the first of which is the ghost in an .mcap')
    command.add_argument('--rate', metavar='HZ', type=float, default=DEFAULT_RATE_HZ,
                         help=f'rows of a table in a second (default: {DEFAULT_RATE_HZ:g})')


def execute_export(options: argparse.Namespace, arguments: Dict[str, str]) -> int:
    """Write the file; return 0.

    Raises:
        BagError, ConfigurationError: a recording or its configuration cannot be read.
        ValueError: an option is out of range, or a package is missing.
        OSError: the file cannot be written; no part of it is left.
    """
    if os.path.splitext(options.output)[1].lower() not in ENDINGS:
        raise ValueError(f'{options.output}: name a file that ends in {", ".join(ENDINGS)}')
    if not 0.0 < options.rate <= _MAX_RATE_HZ:
        raise ValueError(f'--rate {options.rate:g}: write a number above 0 and up to '
                         f'{_MAX_RATE_HZ:g}')
    chosen = chosen_spans(options, arguments)
    said = export(options.output, chosen, options.rate)
    say(f'{options.output}: {clock(chosen.duration_s)}, {said}')
    return 0
