# SPDX-License-Identifier: BSD-3-Clause
"""Problems of a configuration file, each with its place."""
from __future__ import annotations

from dataclasses import dataclass
from typing import Iterable, List, Sequence

_LONGEST_QUOTE = 60


def shortened(text: str, longest: int = _LONGEST_QUOTE) -> str:
    """The text on one line, cut if it is too long for a message."""
    line = ' '.join(text[:4 * longest].split())
    return line if len(line) <= longest else line[:longest - 1] + '…'


def quoted(text: str) -> str:
    """The text in quotation marks, as messages show the content of a file."""
    blanks = ' ' * min(len(text), _LONGEST_QUOTE)
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
    """One problem, its place, and what to write instead."""

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
        """Note that a file is being read: the problems of earlier files are listed first."""
        self._files.append(file)

    def add(self, location: Location, element: str, message: str) -> None:
        """Remember one problem of an element (its tag, without brackets)."""
        self._problems.append(Problem(location, shortened(element), message))

    def extend(self, problems: Iterable[Problem]) -> None:
        """Remember problems found elsewhere."""
        self._problems.extend(problems)

    def sorted(self) -> List[Problem]:
        """All problems by file and line; files in the order in which they were read."""
        found = (problem.location.file for problem in self._problems)
        files = list(dict.fromkeys([*self._files, *found]))
        return sorted(self._problems,
                      key=lambda problem: (files.index(problem.location.file),
                                           problem.location.line))

    def raise_if_any(self) -> None:
        """Raise ConfigurationError when something was found."""
        if self._problems:
            raise ConfigurationError(self.sorted())
