# SPDX-License-Identifier: BSD-3-Clause
"""Decides which parts of a recording are runs, and where they end; and their names (bag#12)."""
from __future__ import annotations

import os
import re
import tempfile
from contextlib import contextmanager
from typing import Callable, Dict, Iterator, List, Optional, Sequence, Set, Tuple

import numpy as np

from process_visualizer.bagio.bag_errors import BagError
from process_visualizer.bagio.recorder_topics import recorded_configuration
from process_visualizer.bagio.recording import Recording, recording_parts
from process_visualizer.cell.model import Cell, RunSpan
from process_visualizer.cell.stored_configuration import write_configuration
from process_visualizer.cell.trust import Origin, Provenance, trusted_packages
from process_visualizer.cell.xml_parser import XmlParser
from process_visualizer.runs.event import Cycle, cycles
from process_visualizer.runs.recorded.run_reader import read_run
from process_visualizer.runs.run import Run, part_of
from process_visualizer.runs.series import holes_s_of

_ENDED_S = 1.0
"""Time without any data [s] after which a run that was broken off has ended."""

_MUCH_LONGER = 1.5
"""Duration of a cycle, in usual ones, from which on a hole may hide its end."""

# The runs of a recording: its cycles, as the configuration defines a run.

class NoCycle(ValueError):
    """A recording has no cycle; the text says which event is missing."""


def cut_into_runs(whole: Run, span: Optional[RunSpan]) -> Tuple[Run, ...]:
    """Return the cycles of a recording, named NAME#1, NAME#2 …; without a span, all as one run.

    The margins before and after a cycle end where the recording ends.

    Raises:
        NoCycle: the recording contains no whole cycle.
    """
    if span is None:
        return (whole,)
    begins = [event.time_s for event in whole.events if event.name == span.begin]
    ends = [event.time_s for event in whole.events if event.name == span.end]
    found = tuple(Cycle(*it) for it in zip(begins, begins[1:])
                  if it[1] - it[0] >= span.shortest_s) if span.begin == span.end \
        else cycles(begins, ends, span.shortest_s)
    if not found:
        missing = next((name for name, times in ((span.begin, begins), (span.end, ends))
                        if not times), None)
        raise NoCycle(f'{whole.name} contains no complete run: ' + (
            f'"{missing}" does not occur' if missing is not None
            else f'no "{span.end}" follows a "{span.begin}"'))
    return tuple(_run(whole, span, cycle, f'{whole.name}#{number}',
                      min((it for it in begins if it > cycle.begin_s), default=whole.duration_s))
                 for number, cycle in enumerate(_seen_to_the_end(found, whole), start=1))


def _seen_to_the_end(found: Sequence[Cycle], whole: Run) -> List[Cycle]:
    """Return cycles; those whose end was not seen, as all data was missing, are broken off.

    A driver that begins anew is not in the cycle any more, and one that is much longer than usual
    has the end of the next one.
    """
    usual_s = float(np.median([it.end_s - it.begin_s for it in found]))
    long = [it for it in holes_s_of(whole).tolist() if it[1] - it[0] > _ENDED_S]
    return [it._replace(is_broken_off=it.is_broken_off or any(
        begin_s > it.begin_s and (begin_s < it.end_s <= end_s or (
            begin_s < it.end_s and it.end_s - it.begin_s > _MUCH_LONGER * usual_s))
        for begin_s, end_s in long)) for it in found]


def _run(whole: Run, span: RunSpan, cycle: Cycle, name: str, next_s: float) -> Run:
    """Return a cycle with its margins; a broken-off one ends before those of the next cycle."""
    end_s = max(min(cycle.end_s, next_s - span.before_s), cycle.begin_s) \
        if cycle.is_broken_off else cycle.end_s + span.after_s
    part = part_of(whole, max(cycle.begin_s - span.before_s, 0.0),
                   min(end_s, whole.duration_s), name)
    if cycle.is_broken_off:
        part = _with_data(part, cycle.begin_s - part.begin_s)
    group, place = (((what, _usual_value(part, what, cycle)),) if what else ()
                    for what in (span.group, span.place))
    return part._replace(is_broken_off=cycle.is_broken_off, group=group, place=place)


def _with_data(run: Run, since_s: float) -> Run:
    """Return a run up to the first long hole in all data after a time [s], which hides the rest."""
    holes_s = [begin_s for begin_s, end_s in holes_s_of(run).tolist()
               if begin_s > since_s and end_s - begin_s > _ENDED_S]
    return part_of(run, 0.0, min(holes_s), run.name) if holes_s else run


def _usual_value(run: Run, what: str, cycle: Cycle) -> Optional[float]:
    """Return the value that a run's channel has for longest, given its label or topic.

    Only the time of the cycle counts: before and after it, the number may be that of another one.
    """
    for channel in run.channels:
        if what.strip('/') in (channel.label, channel.topic.strip('/')):
            known = np.isfinite(channel.values)
            times_s, values = channel.times_s[known], channel.values[known]
            begin_s, end_s = (it - run.begin_s for it in (cycle.begin_s, cycle.end_s))
            edges_s = np.clip([begin_s, *times_s[1:], end_s], begin_s, end_s)
            found, which = np.unique(values, return_inverse=True)
            held_s = np.bincount(which, np.diff(edges_s[:len(values) + 1]), len(found))
            return float(found[held_s.argmax()]) if len(found) else None
    return None


@contextmanager
def recorded_cell(recording: Recording) -> Iterator[Cell]:
    """Yield the recorded cell; the models stored with its configuration exist meanwhile.

    The cell may run only nodes of packages that the user trusts.

    Raises:
        BagError: the recording holds no configuration.
        ConfigurationError: the configuration is not valid on this machine.
        OSError: its files cannot be written, or the list of trusted packages cannot be read.
    """
    stored = recorded_configuration(recording)
    if stored is None:
        raise BagError(recording.paths[0], 'holds no configuration; name one with --config')
    with tempfile.TemporaryDirectory(prefix='process_visualizer-') as folder:
        provenance = Provenance(Origin.BAG, folder, trusted_packages())
        yield XmlParser(stored.arguments, provenance).parse(write_configuration(stored, folder))


_CYCLE = re.compile(r'(.+)#(\d+)(?:-(\d+))?\Z')
Numbers = Tuple[int, int]
"""The first and the last number of a range."""


class ChosenRuns:
    """Reader of runs; it reads each recording once."""

    def __init__(self, cell: Optional[Cell] = None,
                 is_canceled: Callable[[], bool] = lambda: False) -> None:
        """Set the cell; without one, each recording's own configuration is used."""
        self._cell = cell
        self._is_canceled = is_canceled
        self._read: Dict[Tuple[str, ...], Tuple[Run, ...]] = {}

    def runs(self, words: Sequence[str]) -> List[Run]:
        """Return the runs of some recordings: for BAG all cycles, for BAG#N one, for BAG#N-M some.

        A recording in parts is named by its first part; other parts that are named after it are
        ignored.

        Raises:
            BagError: a file cannot be read as a bag, or holds no configuration.
            ReadingCanceled: is_canceled() has become true.
            ConfigurationError: the configuration in a bag is not valid on this machine.
            NoCycle: a recording contains no complete run.
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
            BagError, ReadingCanceled, ConfigurationError, NoCycle, OSError: as ``runs``.
        """
        key = tuple(paths)
        if key not in self._read:
            with Recording(key) as recording:
                self._read[key] = self._of(recording)
        return self._read[key]

    @contextmanager
    def cell_of(self, run: Run) -> Iterator[Cell]:
        """Yield the cell of a run; its models exist meanwhile.

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
        return cut_into_runs(read_run(recording, cell, is_canceled=self._is_canceled), cell.run)


def _path_and_numbers(word: str) -> Tuple[str, Optional[Numbers]]:
    """Return the path and the numbers in BAG#N or BAG#N-M; no numbers for BAG."""
    match = None if os.path.exists(word) else _CYCLE.match(word)
    if match is None:
        return word, None
    first = int(match.group(2))
    return match.group(1), (first, first if match.group(3) is None else int(match.group(3)))
