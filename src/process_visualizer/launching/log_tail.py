# SPDX-License-Identifier: BSD-3-Clause
"""The last lines of the output of a process."""
from __future__ import annotations

from collections import deque
from pathlib import Path
from typing import Deque, Tuple

from process_visualizer.launching.roslaunch_output import plain

TAIL_LINES = 20
_TAIL_BYTES = 1 << 14


class LogTail:
    """Remembers the last lines of an output that several processes share."""

    def __init__(self) -> None:
        self._lines: Deque[str] = deque(maxlen=TAIL_LINES)

    def add(self, line: str) -> None:
        """Append a line."""
        self._lines.append(line)

    def lines(self) -> Tuple[str, ...]:
        """The lines, the newest last."""
        return tuple(self._lines)

    def after(self, earlier: Tuple[str, ...]) -> Tuple[str, ...]:
        """Half of the lines from another log, if it has any, before those of this one.

        The standard output of a node goes to its log file, its errors come here.
        """
        half = TAIL_LINES // 2
        return (*earlier[-half:], *self.lines()[-half:]) if earlier else self.lines()


def last_lines(path: str) -> Tuple[str, ...]:
    """The last lines of a file; none if it cannot be read."""
    try:
        with Path(path).open('rb') as file:
            size = file.seek(0, 2)
            file.seek(max(0, size - _TAIL_BYTES))
            text = file.read().decode('utf-8', 'replace')
    except OSError:
        return ()
    return tuple(plain(line) for line in text.splitlines()[-TAIL_LINES:])
