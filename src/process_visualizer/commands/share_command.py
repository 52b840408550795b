# SPDX-License-Identifier: BSD-3-Clause
"""The command ``cell share``: writes runs as one page that any browser can open."""
from __future__ import annotations

import argparse
import os
from typing import Dict

from process_visualizer.commands.chosen_spans import add_span_options, chosen_spans
from process_visualizer.page.shared_page import page_of
from process_visualizer.runs.comparison.wording import clock
from process_visualizer.shown_text import say
from process_visualizer.whole_file import write_text


def add_share_options(command: argparse.ArgumentParser) -> None:
    """Add the options of ``cell share``."""
    add_span_options(command, 'the page, such as seam.html')
    add_clouds_option(command)


def add_clouds_option(command: argparse.ArgumentParser) -> None:
    """Add the option that includes the clouds of depth sensors."""
    command.add_argument('--clouds', action='store_true',
                         help='with the clouds of depth sensors, thinned')


def execute_share(options: argparse.Namespace, arguments: Dict[str, str]) -> int:
    """Write the page; return 0.

    Raises:
        BagError, ConfigurationError: a recording or its configuration cannot be read.
        ValueError: an option is out of range, or there is more than one page can show.
        OSError: the page cannot be written; no part of it is left.
    """
    chosen = chosen_spans(options, arguments)
    write_text(options.output, page_of(chosen, options.clouds))
    size, runs = os.path.getsize(options.output) / 1e6, chosen.runs
    say(f'{options.output}: {clock(chosen.duration_s)} of '
        f'{", ".join(it.name for it in runs[:4])}{" …" if len(runs) > 4 else ""}, {size:.1f} MB')
    return 0
