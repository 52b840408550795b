# SPDX-License-Identifier: BSD-3-Clause
"""The command ``cell share``: a run as one page that any browser opens."""
from __future__ import annotations

import argparse
import os
from contextlib import ExitStack
from typing import Any, Dict, Optional, Sequence

from process_visualizer.bagio.recording import Recording
from process_visualizer.bagio.recording_calibration import saved_poses, with_saved_poses
from process_visualizer.commands.chosen_spans import ChosenSpans, add_span_options, chosen_spans
from process_visualizer.page.html_page import PageParts, page_html
from process_visualizer.page.packed import Packed
from process_visualizer.page.run_page import PageCell, run_entry
from process_visualizer.runs.comparison.comparison import GoodRuns
from process_visualizer.runs.comparison.wording import band_text, clock
from process_visualizer.runs.recorded.chosen_runs import recorded_cell
from process_visualizer.shown_text import say
from process_visualizer.whole_file import write_text

MAX_S = 900.0
"""Of what one page shows: a browser has all of it in memory."""


def add_share_options(command: argparse.ArgumentParser) -> None:
    """Add the options of ``cell share``."""
    add_span_options(command, 'the page, such as seam.html')


def execute_share(options: argparse.Namespace, arguments: Dict[str, str]) -> int:
    """Write the page; return 0.

    Raises:
        BagError, ConfigurationError: a recording or its configuration cannot be read.
        ValueError: an option is out of range, or there is more than one page can show.
        OSError: the page cannot be written; nothing of it is left then.
    """
    chosen = chosen_spans(options, arguments)
    write_text(options.output, shared_page(chosen))
    size, runs = os.path.getsize(options.output) / 1e6, chosen.runs
    say(f'{options.output}: {clock(chosen.duration_s)} of '
        f'{", ".join(it.name for it in runs[:4])}{" …" if len(runs) > 4 else ""}, {size:.1f} MB')
    return 0


def shared_page(chosen: ChosenSpans) -> str:
    """Return the page of some runs; without a given cell, by the configuration of the first.

    Raises:
        ValueError: there is more than one page can show.
    """
    given, runs, spans, good = chosen
    if chosen.duration_s > MAX_S:
        raise ValueError(f'{clock(chosen.duration_s)} are more than one page can show; name a '
                         f'part of at most {clock(MAX_S)} with --from and --to, or a run with '
                         'BAG#NUMBER')
    packed = Packed()
    with ExitStack() as stack:
        recordings = {it.recording: stack.enter_context(Recording(it.recording)) for it in runs}
        first = recordings[runs[0].recording]
        cell = given if given is not None else stack.enter_context(recorded_cell(first))
        cell = with_saved_poses(cell, saved_poses(runs[0].recording[0]))
        shared = PageCell(cell, packed)
        entries = [run_entry(shared, recordings[run.recording], chosen.judged(run), span, packed)
                   for run, span in zip(runs, spans)]
    return page_html(PageParts(_title(entries), _subtitle(good), entries, shared.meshes, packed,
                               () if good is None else good.notes,
                               cell=os.path.basename(cell.file)))


def _title(entries: Sequence[Dict[str, Any]]) -> str:
    if len(entries) == 1:
        return str(entries[0]['name'])
    poor = sum(it['state'] == 'poor' for it in entries)
    return f'{poor} of {len(entries)} runs out of range' if poor else f'{len(entries)} runs'


def _subtitle(good: Optional[GoodRuns]) -> str:
    if good is None:
        return 'Without a reference there is no verdict.'
    return (f'Reference: {good.reference.name}, {good.reference.duration_s:.1f} s. '
            f'Band: {band_text(good.band)}.')
