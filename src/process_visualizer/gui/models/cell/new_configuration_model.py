# SPDX-License-Identifier: BSD-3-Clause
"""Makes a configuration from what is running, or from a recording."""
from __future__ import annotations

import os
from typing import Callable, Optional, Sequence

from PyQt5.QtCore import QObject, pyqtSignal

from process_visualizer.bags.bag_errors import BagError
from process_visualizer.discovery.new_configuration import (
    NewConfiguration,
    from_bags,
    write_new,
)
from process_visualizer.gui.toolkit.tasks import Tasks

_LINE = 'new'


class NewConfigurationModel(QObject):
    """Works off the GUI thread, for some seconds, on one at a time."""

    changed = pyqtSignal()
    made = pyqtSignal(str)
    """The path of a configuration that has been written."""
    summary_ready = pyqtSignal(str)
    """Its contents, in words."""
    failed = pyqtSignal(str)

    def __init__(self, tasks: Tasks, look_at_system: Callable[[], NewConfiguration],
                 parent: Optional[QObject] = None) -> None:
        super().__init__(parent)
        self._tasks, self._look_at_system = tasks, look_at_system
        self.is_making = False
        self.where = ''

    def make(self, path: str, bags: Sequence[str] = ()) -> None:
        """Write a configuration for what is running, or for the contents of bags.

        The file of that path may be overwritten, as the operator was asked; others are not.
        """
        if self.is_making:
            return
        self.is_making = True
        self.where = os.path.basename(bags[0]) if bags else 'what is running'
        self.changed.emit()
        self._tasks.run(_LINE, lambda: self._written(path, list(bags)), self._take, self._fail)

    def _written(self, path: str, bags: Sequence[str]) -> 'tuple[str, str]':
        new = from_bags(bags) if bags else self._look_at_system()
        write_new(new, path, may_overwrite=(path,))
        return path, new.summary

    def _take(self, result: 'tuple[str, str]') -> None:
        path, summary = result
        self._end()
        self.summary_ready.emit(f'{os.path.basename(path)}: {summary}. Read the comments in the '
                                'file: some values need your decision.')
        self.made.emit(path)

    def _fail(self, error: Exception) -> None:
        self._end()
        if not isinstance(error, (BagError, ValueError, OSError)):
            raise error
        self.failed.emit(f'No configuration was made: {error}')

    def _end(self) -> None:
        self.is_making = False
        self.changed.emit()
