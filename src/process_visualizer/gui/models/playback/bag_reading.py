# SPDX-License-Identifier: BSD-3-Clause
"""Work of the bag model off the GUI thread."""
from __future__ import annotations

import os
from typing import Callable, List, Sequence, Tuple

from process_visualizer.bags.bag_errors import BagUnindexed
from process_visualizer.bags.catalogue import Catalogue, read_catalogue
from process_visualizer.bags.recorder_topics import recorded_configuration
from process_visualizer.bags.recording import Recording
from process_visualizer.bags.reindex import Reindexed, copy_path, reindex
from process_visualizer.gui.toolkit.progress import Progress

_STEP = 0.005  # a bar shows no smaller part


class RecordingGone(Exception):
    """Files (``paths``) of a recording that was open once no longer exist."""

    def __init__(self, paths: Tuple[str, ...]) -> None:
        super().__init__(f'{", ".join(paths)}: no longer exists')
        self.paths = paths


def catalogue_of(paths: Sequence[str]) -> Catalogue:
    """Return what bags hold; an indexed copy that is newer than its bag takes its place.

    Raises:
        BagUnindexed: a bag has to be reindexed first.
        BagError: a bag cannot be read.
    """
    try:
        return read_catalogue(paths)
    except BagUnindexed as error:
        copy = copy_path(error.file)
        if error.file == copy or error.file not in paths or not _is_newer(copy, error.file):
            raise
        return catalogue_of([copy if path == error.file else path for path in paths])


def holds_configuration(paths: Sequence[str]) -> bool:
    """Return whether a recording was made with a configuration, which it has in it.

    Raises:
        BagError: a bag cannot be read.
    """
    with Recording(paths) as recording:
        return recorded_configuration(recording) is not None


def catalogue_if_there(paths: Sequence[str]) -> Catalogue:
    """Return what bags hold, as catalogue_of does.

    Raises:
        RecordingGone: some are not there any more.
    """
    gone = missing_of(paths)
    if gone:
        raise RecordingGone(gone)
    return catalogue_of(paths)


def reindexed(path: str, progress: Progress) -> Reindexed:
    """Make an indexed copy of a bag.

    Raises:
        ReindexCancelled: the progress was cancelled.
        BagError: nothing in the bag can be read, or the copy cannot be written.
    """
    report = in_steps(progress)

    def go_on(part: float) -> bool:
        report(part)
        return not progress.is_cancelled()
    return reindex(path, go_on)


def in_steps(progress: Progress) -> Callable[[float], None]:
    """Return what reports to a progress, but only what can be seen of it."""
    shown = -1.0

    def report(part: float) -> None:
        nonlocal shown
        if part >= shown + _STEP or part >= 1.0:
            shown = part
            progress.report(part)
    return report


def missing_of(paths: Sequence[str]) -> Tuple[str, ...]:
    """Return the files that are not there any more."""
    return tuple(path for path in paths if not os.path.exists(path))


def in_order(paths: Sequence[str]) -> List[str]:
    """Return the whole paths of the files of one recording, each once, sorted by their names."""
    return sorted({os.path.abspath(os.path.expanduser(path)) for path in paths})


def _is_newer(copy: str, path: str) -> bool:
    return os.path.exists(copy) and os.path.getmtime(copy) >= os.path.getmtime(path)


def recovered_text(result: Reindexed) -> str:
    """Return how much of a bag without an index could be read.

    Raises:
        BagError: its copy cannot be read.
    """
    found = read_catalogue([result.path])
    duration_s = found.duration_s
    if all(gap.begin_ns >= found.begin_ns + round(duration_s * 1e9) for gap in result.gaps):
        return f'Recovered the first {duration_s:.1f} s; the rest is unreadable.'
    count = len(result.gaps)
    parts = 'a part is' if count == 1 else f'{count} parts are'
    return f'Recovered {duration_s:.1f} s; {parts} unreadable.'
