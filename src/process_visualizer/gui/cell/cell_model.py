# SPDX-License-Identifier: BSD-3-Clause
"""The configuration: read, watched on the disk, or newly made; and its ticked devices."""
from __future__ import annotations

import hashlib
import os
from typing import (
    Any,
    Callable,
    Dict,
    Iterable,
    List,
    Mapping,
    NamedTuple,
    Optional,
    Sequence,
    Set,
    Tuple,
)

from PyQt5.QtCore import QFileSystemWatcher, QObject, QTimer, pyqtSignal

from process_visualizer.bagio.bag_errors import BagError
from process_visualizer.cell.environment import check_environment
from process_visualizer.cell.errors import ConfigurationError, Problem
from process_visualizer.cell.file_edit import PoseEditError, PoseEditor
from process_visualizer.cell.model import Cell, Device
from process_visualizer.cell.xml_parser import XmlParser
from process_visualizer.discovery.new_configuration import NewConfiguration, from_bags, write_new
from process_visualizer.gui.session import Session
from process_visualizer.gui.toolkit.tasks import Tasks

# Notices that files have changed on the disk since they were read.

_WATCH_LINE = 'watch'  # a line of its own: a network folder may hang
_PERIOD_MS = 2000  # nothing announces the changes of another computer in a network folder

Contents = Mapping[str, Optional[str]]
"""A digest of each file by its path; None if it cannot be read."""


class FileWatch(QObject):
    """Compares contents, not times: an editor that writes the same text has changed nothing.

    A missing file is not outdated: an editor may be about to put another in its place.
    """

    changed = pyqtSignal()
    """``outdated`` has changed."""

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
            self._tasks.run(_WATCH_LINE, lambda: contents_of(read),
                            lambda now: self._take(read, now))

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
        """Watch the files, including replaced ones, and their folders."""
        wanted = {*self._read, *map(os.path.dirname, self._read)}
        watched = {*self._watcher.files(), *self._watcher.directories()}
        if watched - wanted:
            self._watcher.removePaths(list(watched - wanted))
        new = [path for path in wanted - watched if os.path.exists(path)]
        if new:
            self._watcher.addPaths(new)


def contents_of(paths: Iterable[str]) -> Contents:
    """Return a digest of each file; reads the disk."""
    found: Dict[str, Optional[str]] = {}
    for path in paths:
        try:
            with open(path, 'rb') as file:
                found[path] = hashlib.sha256(file.read()).hexdigest()
        except OSError:  # missing or unreadable: a reload reports why
            found[path] = None
    return found


class _Loaded(NamedTuple):
    path: str
    cell: Optional[Cell]
    problems: Tuple[Problem, ...]
    missing: Tuple[Problem, ...]
    contents: Contents
    editor: Optional[PoseEditor] = None


class CellModel(QObject):
    """Loads a configuration off the GUI thread; an invalid one leaves the previous one in force.

    ``problems`` are those of the file that was read last, ``missing`` is what the devices need and
    this computer lacks.
    """

    changed = pyqtSignal()
    """Loading has begun or ended, or the session has another cell, other ticks or another mode."""
    loaded = pyqtSignal(bool)
    """A file has been read; True if the configuration is valid."""

    def __init__(self, tasks: Tasks, session: Session, parent: Optional[QObject] = None) -> None:
        super().__init__(parent)
        self._tasks, self.session = tasks, session
        self._arguments_of: Dict[str, Dict[str, str]] = {}  # by path
        self._unticked: Dict[str, Set[str]] = {}  # by configuration
        self.files = FileWatch(tasks, self)
        self.path = ''
        self.problems: Tuple[Problem, ...] = ()
        self.missing: Tuple[Problem, ...] = ()
        self.is_loading = False
        session.cell_changed.connect(self.changed)

    def open(self, path: str, arguments: Optional[Mapping[str, str]] = None) -> None:
        """Load a configuration with values for its ``<arg>`` elements; default: its last ones."""
        self.path = os.path.abspath(path)
        if arguments is not None:
            self._arguments_of[self.path] = dict(arguments)
        self.reload()

    def reload(self) -> None:
        """Read the file again."""
        self.is_loading = True
        self.changed.emit()
        path, arguments = self.path, self.arguments
        self._tasks.run('files', lambda: _load(path, arguments), self._take)

    def is_ticked(self, name: str) -> bool:
        """Return whether a device is chosen; all devices of a new configuration are."""
        return name not in self._unticked.get(self._file, ())

    def tick(self, name: str, ticked: bool) -> None:
        """Choose a device, or leave it out."""
        if ticked == self.is_ticked(name):
            return
        unticked = self._unticked.setdefault(self._file, set())
        (unticked.discard if ticked else unticked.add)(name)
        self.session.choose(self._ticked(self.session.cell))

    def tick_only(self, names: Set[str]) -> None:
        """Choose these devices only."""
        if self.session.cell is not None:
            self._unticked[self._file] = {it.name for it in self.session.devices} - names
            self.session.choose(self._ticked(self.session.cell))

    @property
    def in_force(self) -> str:
        """Return which devices remain although the file has problems; empty if there are none."""
        if self.session.cell is None:
            return ''
        if self.session.file == self.path:
            return 'Keeping the last valid configuration; fix the file and press F5:'
        return f'The devices are still those of {os.path.basename(self.session.file)}:'

    @property
    def arguments(self) -> Dict[str, str]:
        """The values for the <arg> elements of the configuration."""
        return dict(self._arguments_of.get(self.path, {}))

    @property
    def source(self) -> Dict[str, Any]:
        """The path and the arguments, for the settings."""
        return {'path': self.path, 'arguments': self.arguments}

    @property
    def unticked(self) -> Dict[str, List[str]]:
        """The devices that are left out, by configuration."""
        return {path: sorted(names) for path, names in self._unticked.items() if names}

    def set_unticked(self, unticked: Mapping[str, Sequence[str]]) -> None:
        """Restore an earlier value of ``unticked``."""
        self._unticked = {path: set(names) for path, names in unticked.items()}
        self.session.choose(self._ticked(self.session.cell))
        self.changed.emit()

    @property
    def _file(self) -> str:
        """The configuration whose devices are shown."""
        return self.session.file or self.path

    def _ticked(self, cell: Optional[Cell]) -> Tuple[Device, ...]:
        """Return the chosen devices in the order of the configuration."""
        if cell is None:
            return ()
        unticked = self._unticked.get(cell.file, ())
        return tuple(it for it in cell.devices if it.name not in unticked)

    def _take(self, loaded: _Loaded) -> None:
        if loaded.path != self.path:  # another file was opened in the meantime
            return
        self.is_loading = False
        self.problems = loaded.problems
        self.files.follow(loaded.contents)
        if loaded.cell is None:
            self.changed.emit()
        else:
            self.missing = loaded.missing
            self.session.set_cell(loaded.cell, self._ticked(loaded.cell), loaded.editor)
        self.loaded.emit(loaded.cell is not None)


def _load(path: str, arguments: Mapping[str, str]) -> _Loaded:
    main = contents_of([path])  # before reading, so that a change meanwhile is noticed
    try:
        cell = XmlParser(arguments).parse(path)
    except ConfigurationError as error:
        others = contents_of(problem.location.file for problem in error.problems)
        return _Loaded(path, None, tuple(error.problems), (), {**others, **main})
    contents = {**contents_of(cell.files), **main}
    return _Loaded(path, cell, (), tuple(check_environment(cell)), contents, _editor(cell))


def _editor(cell: Cell) -> Optional[PoseEditor]:
    """Return the editor of poses in the files; None if one was just removed (a reload reports)."""
    try:
        return PoseEditor(cell)
    except PoseEditError:
        return None


_LINE = 'new'


class NewConfigurationModel(QObject):
    """Makes configurations off the GUI thread, one at a time; each takes some seconds."""

    changed = pyqtSignal()
    made = pyqtSignal(str)
    """The path of a configuration that has been written."""
    summary_ready = pyqtSignal(str)
    """The contents of the new configuration, in words."""
    failed = pyqtSignal(str)

    def __init__(self, tasks: Tasks, look_at_system: Callable[[], NewConfiguration],
                 parent: Optional[QObject] = None) -> None:
        super().__init__(parent)
        self._tasks, self._look_at_system = tasks, look_at_system
        self.is_making = False
        self.where = ''

    def make(self, path: str, bags: Sequence[str] = ()) -> None:
        """Write a configuration for what is running, or for the contents of bags.

        The file at that path may be overwritten, as the operator was asked; others may not.
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
