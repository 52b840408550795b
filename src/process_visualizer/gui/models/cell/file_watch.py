# SPDX-License-Identifier: BSD-3-Clause
"""Notices that files have changed on the disk since they were read."""
from __future__ import annotations

import hashlib
import os
from typing import Dict, Iterable, Mapping, Optional, Tuple

from PyQt5.QtCore import QFileSystemWatcher, QObject, QTimer, pyqtSignal

from process_visualizer.gui.toolkit.tasks import Tasks

_LINE = 'watch'  # of its own: a network folder may hang
_PERIOD_MS = 2000  # nothing tells of changes that another computer makes in a network folder

Contents = Mapping[str, Optional[str]]
"""A digest of each file by its path; None where it cannot be read."""


class FileWatch(QObject):
    """Compares contents, not times: an editor that writes the same text has changed nothing.

    A file that is away is not outdated: an editor may be about to put another in its place.
    """

    changed = pyqtSignal()
    """``outdated`` is another one."""

    def __init__(self, tasks: Tasks, parent: Optional[QObject] = None) -> None:
        super().__init__(parent)
        self._tasks = tasks
        self._read: Contents = {}
        self._is_looking = False
        self.outdated: Tuple[str, ...] = ()
        self._watcher = QFileSystemWatcher(self)
        self._watcher.fileChanged.connect(self._look)
        self._watcher.directoryChanged.connect(self._look)
        self._timer = QTimer(self, interval=_PERIOD_MS)
        self._timer.timeout.connect(self._look)

    def follow(self, read: Contents) -> None:
        """Watch these files from now on, with the contents that were read."""
        self._read = read
        self._watch()
        self._timer.start()
        self._set(())

    def _look(self) -> None:
        if not self._is_looking and self._read:
            self._is_looking = True
            read = self._read
            self._tasks.run(_LINE, lambda: contents_of(read), lambda now: self._take(read, now))

    def _take(self, read: Contents, now: Contents) -> None:
        self._is_looking = False
        if read is self._read:  # else they have been read again meanwhile
            self._watch()
            self._set(tuple(path for path in now if now[path] not in (None, read[path])))

    def _set(self, outdated: Tuple[str, ...]) -> None:
        if outdated != self.outdated:
            self.outdated = outdated
            self.changed.emit()

    def _watch(self) -> None:
        """Watch the files, those that have been replaced too, and their folders."""
        wanted = {*self._read, *map(os.path.dirname, self._read)}
        watched = {*self._watcher.files(), *self._watcher.directories()}
        if watched - wanted:
            self._watcher.removePaths(list(watched - wanted))
        new = [path for path in wanted - watched if os.path.exists(path)]
        if new:
            self._watcher.addPaths(new)


def contents_of(paths: Iterable[str]) -> Contents:
    """Return a digest of each file; touches the disk."""
    found: Dict[str, Optional[str]] = {}
    for path in paths:
        try:
            with open(path, 'rb') as file:
                found[path] = hashlib.sha256(file.read()).hexdigest()
        except OSError:  # away, or not to be read: reading it again tells why
            found[path] = None
    return found
