# SPDX-License-Identifier: BSD-3-Clause
"""A text that is made from files, and made again only when one of them has changed."""
from __future__ import annotations

import os
import threading
import time
from typing import Callable, Dict, Iterable, Optional, Tuple

Make = Callable[[], Tuple[str, Iterable[str]]]
"""Returns the text, and the paths of the files that were read for it."""
_FileState = Optional[Tuple[int, int]]
_SETTLED_NS = 2_000_000_000
"""A file may change twice within what some file systems take for the same time."""


class MadeText:
    """Remembers the text; several threads may ask for it."""

    def __init__(self, make: Make) -> None:
        """``make`` may raise anything; nothing is remembered then."""
        self._make = make
        self._lock = threading.Lock()
        self._text: Optional[str] = None
        self._states: Dict[str, _FileState] = {}

    def get(self) -> str:
        """Return the text for the present state of the files."""
        with self._lock:
            if self._text is not None and _states(self._states) == self._states:
                return self._text
            return self._made()

    def _made(self) -> str:
        """Make the text; remember it unless a file has just changed, or does so meanwhile."""
        self._text, begin_ns = None, time.time_ns()
        text, paths = self._make()
        self._states = _states(paths)
        if all(state is None or state[0] < begin_ns - _SETTLED_NS
               for state in self._states.values()):
            self._text = text
        return text


def _states(paths: Iterable[str]) -> Dict[str, _FileState]:
    return {path: _state(path) for path in paths}


def _state(path: str) -> _FileState:
    """Time of the last change [ns] and size [bytes]; None without the file."""
    try:
        found = os.stat(path)
    except OSError:
        return None
    return found.st_mtime_ns, found.st_size
