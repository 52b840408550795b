# SPDX-License-Identifier: BSD-3-Clause
"""Runs as people name them: a recording, or one of its cycles, such as shift.bag#12."""
from __future__ import annotations

import os
import re
from contextlib import contextmanager
from typing import Callable, Dict, Iterator, List, Optional, Sequence, Tuple

from process_visualizer.bags.recording import Recording
from process_visualizer.cell.model import Cell
from process_visualizer.runs.recorded.recorded_cell import recorded_cell
from process_visualizer.runs.recorded.run_cutting import cut_into_runs
from process_visualizer.runs.recorded.run_reader import read_run
from process_visualizer.runs.run import Run

_CYCLE = re.compile(r'(.+)#(\d+)\Z')


class ChosenRuns:
    """Reads recordings, each once, and returns runs of them."""

    def __init__(self, cell: Optional[Cell] = None,
                 is_cancelled: Callable[[], bool] = lambda: False) -> None:
        """Take the cell; without one, each recording's own configuration is used."""
        self._cell = cell
        self._is_cancelled = is_cancelled
        self._read: Dict[str, Tuple[Run, ...]] = {}

    def runs(self, words: Sequence[str]) -> List[Run]:
        """Return the runs of some recordings: of BAG all cycles, of BAG#N one.

        Raises:
            BagError: a file cannot be read as a bag, or holds no configuration.
            ReadingCancelled: is_cancelled() has become true.
            ConfigurationError: the configuration in a bag is none on this machine.
            NoCycle: a recording holds no whole run.
            ValueError: there is no cycle of that number.
            OSError: the files of a configuration cannot be written.
        """
        return [run for word in words for run in self._runs(word)]

    @contextmanager
    def cell_of(self, run: Run) -> Iterator[Cell]:
        """Yield the cell that a run was made of; while it is used, its models exist.

        Raises:
            BagError, ConfigurationError, OSError: as ``runs``.
        """
        if self._cell is not None:
            yield self._cell
            return
        with Recording(run.recording) as recording, recorded_cell(recording) as cell:
            yield cell

    def _runs(self, word: str) -> Tuple[Run, ...]:
        match = None if os.path.exists(word) else _CYCLE.match(word)
        if match is None:
            return self._cycles(word)
        path, number = match.group(1), int(match.group(2))
        found = self._cycles(path)
        if not 1 <= number <= len(found):
            raise ValueError(f'{path} has the runs 1 to {len(found)}, not {number}')
        return (found[number - 1],)

    def _cycles(self, path: str) -> Tuple[Run, ...]:
        if path not in self._read:
            with Recording([path]) as recording:
                self._read[path] = self._of(recording)
        return self._read[path]

    def _of(self, recording: Recording) -> Tuple[Run, ...]:
        if self._cell is not None:
            return self._cut(recording, self._cell)
        with recorded_cell(recording) as cell:
            return self._cut(recording, cell)

    def _cut(self, recording: Recording, cell: Cell) -> Tuple[Run, ...]:
        return cut_into_runs(read_run(recording, cell, is_cancelled=self._is_cancelled), cell.run)
