# SPDX-License-Identifier: BSD-3-Clause
"""Labelled moments of a recording: those in the bag, and those added afterwards beside it."""
from __future__ import annotations

import bisect
import json
import os
from typing import Any, List, NamedTuple, Optional, Sequence

from process_visualizer.bags.bag_errors import BagError
from process_visualizer.bags.json_text import parsed_json
from process_visualizer.bags.recorder_topics import MARKS, texts
from process_visualizer.bags.recording import Recording


class Mark(NamedTuple):
    """A labelled moment [ns since the epoch]."""

    time_ns: int
    label: str


def marks_path(bag: str) -> str:
    """Return the file beside a bag that holds the marks added afterwards."""
    return f'{bag}.marks.json'


def read_marks(recording: Recording) -> List[Mark]:
    """Return all marks of a recording in the order of time.

    Raises:
        BagError: a file of marks beside a bag is not one.
    """
    marks = [Mark(*text) for text in texts(recording, MARKS)]
    for path in recording.paths:
        marks += added_marks(path)
    return sorted(marks)


def mark_at(marks: Sequence[Mark], time_ns: int) -> Optional[Mark]:
    """Return the last of sorted marks at or before a time [ns since the epoch], or None."""
    row = bisect.bisect_right([mark.time_ns for mark in marks], time_ns)
    return marks[row - 1] if row else None


def added_marks(bag: str) -> List[Mark]:
    """Return the marks in the file beside a bag; an empty list if there is none.

    Raises:
        BagError: the file is not one of marks.
    """
    path = marks_path(bag)
    if not os.path.exists(path):
        return []
    try:
        with open(path, encoding='utf-8') as file:
            return [_mark(entry) for entry in parsed_json(file.read())]
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise BagError(path, f'cannot be read as marks ({error}); repair or remove it') from error


def _mark(entry: Any) -> Mark:
    """A mark from its JSON.

    Raises:
        ValueError, KeyError, TypeError: it is none.
    """
    time_ns, label = entry['time_ns'], entry['label']
    if not isinstance(time_ns, int) or not 0 <= time_ns < 1 << 63 or not isinstance(label, str):
        raise ValueError('a mark is a time in ns since the epoch and a label')
    label.encode()
    return Mark(time_ns, label)


def add_mark(bag: str, mark: Mark) -> None:
    """Add a mark to the file beside a bag; the bag itself is not touched.

    Raises:
        BagError: the file cannot be read or written; then it is as it was.
    """
    write_added_marks(bag, [*added_marks(bag), mark])


def write_added_marks(bag: str, marks: Sequence[Mark]) -> None:
    """Replace the marks in the file beside a bag, all at once.

    Raises:
        BagError: the file cannot be written; then it is as it was.
    """
    path = marks_path(bag)
    unfinished = f'{path}.unfinished'
    try:
        with open(unfinished, 'w', encoding='utf-8') as file:
            json.dump([mark._asdict() for mark in sorted(marks)], file, indent=1,
                      ensure_ascii=False)
        os.replace(unfinished, path)
    except OSError as error:
        raise BagError(path, f'cannot be written: {error.strerror}') from error
