# SPDX-License-Identifier: BSD-3-Clause
"""Marks (labeled moments) of a recording: in the bag, and added later in a file beside it."""
from __future__ import annotations

import bisect
import errno
import hashlib
import json
import os
from typing import Any, List, NamedTuple, Optional, Sequence

from process_visualizer.bagio.bag_errors import BagError
from process_visualizer.bagio.json_text import parsed_json
from process_visualizer.bagio.recorder_topics import MARKS, texts
from process_visualizer.bagio.recording import Recording
from process_visualizer.whole_file import small_file, write_text

_READ_ONLY = (errno.EACCES, errno.EPERM, errno.EROFS)


class Mark(NamedTuple):
    """A labeled moment [ns since the epoch]."""

    time_ns: int
    label: str


def marks_path(bag: str) -> str:
    """Return the path of the file beside a bag with the marks that were added later."""
    return f'{bag}.marks.json'


def read_marks(recording: Recording) -> List[Mark]:
    """Return all marks of a recording in the order of time.

    Raises:
        BagError: a file of marks beside a bag is invalid.
    """
    marks = [Mark(*text) for text in texts(recording, MARKS)]
    for path in recording.paths:
        marks += added_marks(path)
    return sorted(marks)


def mark_at(marks: Sequence[Mark], time_ns: int) -> Optional[Mark]:
    """Return the last mark (of a sorted list) at or before a time [ns since the epoch], or None."""
    row = bisect.bisect_right([mark.time_ns for mark in marks], time_ns)
    return marks[row - 1] if row else None


def own_marks_path(bag: str) -> str:
    """Return the path of the user's own file for marks of a bag in a read-only folder."""
    data = os.environ.get('XDG_DATA_HOME') or os.path.expanduser('~/.local/share')
    where = hashlib.sha256(os.path.abspath(bag).encode('utf-8', 'surrogateescape')).hexdigest()
    return os.path.join(data, 'process_visualizer', 'marks',
                        f'{os.path.basename(bag)}-{where[:12]}.marks.json')


def added_marks(bag: str) -> List[Mark]:
    """Return the marks added to a bag, from the file beside it and the user's own file.

    Raises:
        BagError: a file does not hold marks.
    """
    return [*_marks_in(marks_path(bag)), *_marks_in(own_marks_path(bag))]


def _marks_in(path: str) -> List[Mark]:
    """Return the marks in a file; none if it does not exist."""
    try:
        return [_mark(entry) for entry in parsed_json(small_file(path).decode())]
    except FileNotFoundError:
        return []
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise BagError(path, f'cannot be read as marks ({error}); repair or remove it') from error


def _mark(entry: Any) -> Mark:
    """Return a mark from its JSON.

    Raises:
        ValueError, KeyError, TypeError: the JSON is not a mark.
    """
    time_ns, label = entry['time_ns'], entry['label']
    if type(time_ns) is not int or not 0 <= time_ns < 1 << 63 or not isinstance(label, str):
        raise ValueError('a mark is a time in ns since the epoch and a label')
    label.encode()
    return Mark(time_ns, label)


def add_mark(bag: str, mark: Mark) -> str:
    """Add a mark to the file beside a bag, or to the user's own file if the folder is read-only.

    The bag is not touched. Returns the path of the file.

    Raises:
        BagError: the file cannot be read, or neither can be written; both stay unchanged.
    """
    path, own = marks_path(bag), own_marks_path(bag)
    try:
        _write(path, [*_marks_in(path), mark])
        return path
    except OSError as error:
        refusal = BagError(path, f'cannot be written: {error.strerror}')
        if error.errno not in _READ_ONLY:
            raise refusal from error
    try:
        os.makedirs(os.path.dirname(own), exist_ok=True)
        _write(own, [*_marks_in(own), mark])
    except OSError:
        raise refusal from None
    return own


def write_added_marks(bag: str, marks: Sequence[Mark]) -> None:
    """Replace all marks added to a bag; without marks, their file is removed.

    Raises:
        BagError: a file cannot be written or removed.
    """
    path, own = marks_path(bag), own_marks_path(bag)
    try:
        if marks:
            _write(path, marks)
        for old in (own,) if marks else (path, own):
            if os.path.lexists(old):
                os.remove(old)
    except OSError as error:
        raise BagError(path, f'cannot be written: {error.strerror}') from error


def _write(path: str, marks: Sequence[Mark]) -> None:
    write_text(path, json.dumps([mark._asdict() for mark in sorted(marks)], indent=1,
                                ensure_ascii=False))
