# SPDX-License-Identifier: BSD-3-Clause
"""The ticks, good runs, comparisons and edits of a session, in a file that outlives the program."""
from __future__ import annotations

import json
import os
from collections import deque
from typing import Any, Callable, Deque, Dict, Mapping

from PyQt5.QtCore import QObject, pyqtSignal

from process_visualizer.gui.toolkit.tasks import Tasks
from process_visualizer.whole_file import small_file, write_small_file

FILE_NAME = 'session.json'
_DAMAGED = (KeyError, TypeError, ValueError, AttributeError, RecursionError)
Values = Dict[str, Any]


class KeptState(QObject):
    """Writes the file after each change, so that not even a crash loses anything.

    A file that cannot be read is reported and put aside; the session begins without it.
    """

    failed = pyqtSignal(str)

    def __init__(self, path: str, tasks: Tasks, restore: Callable[[Mapping[str, Any]], None],
                 values: Callable[[], Values], parent: QObject) -> None:
        """``restore`` takes what ``values`` returned: numbers, texts, lists, dictionaries."""
        super().__init__(parent)
        self._path, self._tasks = path, tasks
        self._restore, self._values = restore, values
        self._written: Values = {}
        self._waiting: Deque[Values] = deque(maxlen=1)

    def restore(self) -> None:
        """Restore the state in the file, if there is one; blocks."""
        try:
            self._restore(json.loads(small_file(self._path)))
            self._written = self._values()
        except FileNotFoundError:
            return
        except OSError as error:
            self.failed.emit(f'The ticks and comparisons of the last session cannot be read: '
                             f'{self._path}: {error.strerror}')
        except _DAMAGED:
            self._put_aside()

    def write(self) -> None:
        """Write changes in the background: only the newest, as a dragged pose changes often."""
        values = self._values()
        if values != self._written:
            self._written = values
            self._waiting.append(values)
            self._tasks.run('session', self._write_waiting, None, self._report_failure)

    def _write_waiting(self) -> None:
        """Write the newest state; runs as a task."""
        try:
            values = self._waiting.pop()
        except IndexError:
            return  # a task before this one has written it
        _write(self._path, values)

    def _put_aside(self) -> None:
        aside = f'{self._path}.damaged'
        try:
            os.replace(self._path, aside)
            where = f'It was moved to {aside}.'
        except OSError as error:
            where = f'It stays there: {error.strerror}.'
        self.failed.emit('The ticks and comparisons of the last session are not shown: '
                         f'{self._path} is damaged. {where} All devices are ticked')

    def _report_failure(self, error: Exception) -> None:
        if not isinstance(error, OSError):
            raise error
        self.failed.emit('The ticks and comparisons cannot be kept for the next session: '
                         f'{self._path}: {error.strerror}')


def _write(path: str, values: Values) -> None:
    """Write the file atomically."""
    os.makedirs(os.path.dirname(path), exist_ok=True)
    write_small_file(path, json.dumps(values, indent=1).encode())
