# SPDX-License-Identifier: BSD-3-Clause
"""Runs as people name them: a recording, or some of its cycles, such as shift.bag#12."""
from __future__ import annotations

import os
import re
from contextlib import contextmanager
from typing import Callable, Dict, Iterator, List, Optional, Sequence, Set, Tuple

from process_visualizer.bags.recording import Recording
from process_visualizer.bags.recording_parts import recording_parts
from process_visualizer.cell.model import Cell
from process_visualizer.runs.recorded.recorded_cell import recorded_cell
from process_visualizer.runs.recorded.run_cutting import cut_into_runs
from process_visualizer.runs.recorded.run_reader import read_run
from process_visualizer.runs.run import Run

_CYCLE = re.compile(r'(.+)#(\d+)(?:-(\d+))?\Z')
Numbers = Tuple[int, int]
"""The first and the last one of a range."""


class ChosenRuns:
    """Reads recordings, each once, and returns runs of them."""

    def __init__(self, cell: Optional[Cell] = None,
                 is_cancelled: Callable[[], bool] = lambda: False) -> None:
        """Take the cell; without one, each recording's own configuration is used."""
        self._cell = cell
        self._is_cancelled = is_cancelled
        self._read: Dict[Tuple[str, ...], Tuple[Run, ...]] = {}

    def runs(self, words: Sequence[str]) -> List[Run]:
        """Return the runs of some recordings: of BAG all cycles, of BAG#N one, of BAG#N-M some.

        A recording in parts is named by its first one; the others, if they are named behind it,
        count no more.

        Raises:
            BagError: a file cannot be read as a bag, or holds no configuration.
            ReadingCancelled: is_cancelled() has become true.
            ConfigurationError: the configuration in a bag is none on this machine.
            NoCycle: a recording holds no whole run.
            ValueError: there is no cycle of that number.
            OSError: the files of a configuration cannot be written.
        """
        found: List[Run] = []
        known: Set[str] = set()
        for word in words:
            path, numbers = _path_and_numbers(word)
            if path not in known or numbers is not None:
                parts = recording_parts(path)
                known.update(parts[1:])
                found += self._chosen(parts, numbers)
        return found

    def of_recording(self, paths: Sequence[str]) -> Tuple[Run, ...]:
        """Return the runs of one recording, given by all of its files.

        Raises:
            BagError, ReadingCancelled, ConfigurationError, NoCycle, OSError: as ``runs``.
        """
        key = tuple(paths)
        if key not in self._read:
            with Recording(key) as recording:
                self._read[key] = self._of(recording)
        return self._read[key]

    @contextmanager
    def cell_of(self, run: Run) -> Iterator[Cell]:
        """Yield the cell that a run was made of; while it is used, its models exist.

        Raises:
            BagError, ConfigurationError, OSError: as ``runs``.
        """
        with self.cell_of_recording(run.recording) as cell:
            yield cell

    @contextmanager
    def cell_of_recording(self, paths: Sequence[str]) -> Iterator[Cell]:
        """Yield the cell of a recording, given by all of its files, as ``cell_of``.

        Raises:
            BagError, ConfigurationError, OSError: as ``runs``.
        """
        if self._cell is not None:
            yield self._cell
            return
        with Recording(paths) as recording, recorded_cell(recording) as cell:
            yield cell

    def _chosen(self, parts: Tuple[str, ...], numbers: Optional[Numbers]) -> Sequence[Run]:
        found = self.of_recording(parts)
        if numbers is None:
            return found
        first, last = numbers
        wrong = next((it for it in numbers if not 1 <= it <= len(found)), None)
        if wrong is not None:
            raise ValueError(f'{parts[0]} has the runs 1 to {len(found)}, not {wrong}')
        if first > last:
            raise ValueError(f'{parts[0]}#{first}-{last}: write the smaller number first')
        return found[first - 1:last]

    def _of(self, recording: Recording) -> Tuple[Run, ...]:
        if self._cell is not None:
            return self._cut(recording, self._cell)
        with recorded_cell(recording) as cell:
            return self._cut(recording, cell)

    def _cut(self, recording: Recording, cell: Cell) -> Tuple[Run, ...]:
        return cut_into_runs(read_run(recording, cell, is_cancelled=self._is_cancelled), cell.run)


def _path_and_numbers(word: str) -> Tuple[str, Optional[Numbers]]:
    """Return what BAG#N or BAG#N-M names; no numbers if it is BAG."""
    match = None if os.path.exists(word) else _CYCLE.match(word)
    if match is None:
        return word, None
    first = int(match.group(2))
    return match.group(1), (first, first if match.group(3) is None else int(match.group(3)))
