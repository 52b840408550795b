# SPDX-License-Identifier: BSD-3-Clause
"""Problems of a configuration file, each with its location."""
from __future__ import annotations

import difflib
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Iterable, List, Optional, Sequence

_MAX_QUOTE = 60


def shortened(text: str, longest: int = _MAX_QUOTE) -> str:
    """Return the text on one line, cut if it is too long for a message."""
    line = ' '.join(text[:4 * longest].split())
    return line if len(line) <= longest else line[:longest - 1] + '…'


def quoted(text: str) -> str:
    """Return the text in quotation marks, as messages show the content of a file."""
    blanks = ' ' * min(len(text), _MAX_QUOTE)
    return f'"{shortened(text) or blanks}"'


@dataclass(frozen=True, order=True)
class Location:
    """A line of a file; ``line`` counts from 1."""

    file: str
    line: int

    def __str__(self) -> str:
        return f'{self.file}:{self.line}'


@dataclass(frozen=True, order=True)
class Problem:
    """A problem: its location, the element, and what to write instead."""

    location: Location
    element: str
    message: str

    def __str__(self) -> str:
        element = f'<{self.element}>: ' if self.element else ''
        return f'{self.location}: {element}{self.message}'


class ConfigurationError(Exception):
    """Raised with every problem found in a configuration, in the order of the file."""

    def __init__(self, problems: Iterable[Problem]) -> None:
        self.problems: Sequence[Problem] = tuple(dict.fromkeys(problems))
        super().__init__('\n'.join(str(problem) for problem in self.problems))


class ProblemList:
    """Collects problems so that all of them can be reported at once."""

    def __init__(self) -> None:
        self._problems: List[Problem] = []
        self._files: List[str] = []

    def __len__(self) -> int:
        return len(self._problems)

    def begin_file(self, file: str) -> None:
        """Note that a file is being read; the problems of earlier files are listed first."""
        self._files.append(file)

    def add(self, location: Location, element: str, message: str) -> None:
        """Add a problem of an element (its tag, without brackets)."""
        self._problems.append(Problem(location, shortened(element), message))

    def extend(self, problems: Iterable[Problem]) -> None:
        """Add problems found elsewhere."""
        self._problems.extend(problems)

    def sorted(self) -> List[Problem]:
        """Return the problems by file, in the order of reading, and line."""
        found = (problem.location.file for problem in self._problems)
        files = list(dict.fromkeys([*self._files, *found]))
        return sorted(self._problems,
                      key=lambda problem: (files.index(problem.location.file),
                                           problem.location.line))

    def raise_if_any(self) -> None:
        """Raise ConfigurationError if there are problems."""
        if self._problems:
            raise ConfigurationError(self.sorted())


_LIKENESS = 0.6


def nearest(word: str, names: Iterable[str]) -> Optional[str]:
    """Return the name most similar to ``word`` (ignoring case), or None."""
    by_lower_case = {name.lower(): name for name in names}
    found = difflib.get_close_matches(word.lower(), list(by_lower_case), n=1, cutoff=_LIKENESS)
    return by_lower_case[found[0]] if found else None


def advice(word: str, names: Iterable[str]) -> str:
    """Return what to write instead of ``word``: the nearest name, or otherwise all of them."""
    known = sorted(names)
    name = nearest(word, known)
    if name is not None:
        return f'did you mean "{name}"?'
    return 'expected one of: ' + ', '.join(known)


def root_as_global_frame(device: str, root: str) -> str:
    """Return what to do about a model whose root link has the name of the global frame."""
    return (f'as that is the global frame, write prefix="{device}_" in <model> and '
            f'frame="{device}_{root}" in <base>, or rename the global frame: '
            '<visualizer frame="cell">')


def missing_file(path: str) -> str:
    """Return a message that there is no such regular file, and what to name instead."""
    file = Path(path)
    if os.path.isdir(file):
        return f'"{file}" is a folder; name a file in it'
    if os.path.exists(file):
        return f'"{file}" is not a regular file; name another one'
    if not os.path.isdir(file.parent):
        return f'there is no file "{file}", nor its folder; check the path'
    try:
        name = nearest(file.name, os.listdir(file.parent))
    except OSError as error:
        return f'there is no file "{file}" that can be seen: its folder cannot be read: ' \
               f'{error.strerror}'
    meant = 'check the path' if name is None else f'did you mean "{file.with_name(name)}"?'
    return f'there is no file "{file}"; {meant}'
