# SPDX-License-Identifier: BSD-3-Clause
"""Opens the recording for playback, or says why not; its curves, played topics and marks."""
from __future__ import annotations

import os
from typing import Any, Callable, Dict, FrozenSet, List, Mapping, Optional, Sequence, Set, Tuple

from PyQt5.QtCore import QFileSystemWatcher, QObject, pyqtSignal

from process_visualizer.bagio.bag_errors import BagError, BagUnindexed
from process_visualizer.bagio.catalog import Catalog, missing_topics, read_catalog
from process_visualizer.bagio.marks import Mark, add_mark, marks_path
from process_visualizer.bagio.recorder_topics import recorded_configuration
from process_visualizer.bagio.recording import Recording
from process_visualizer.bagio.reindex import (
    ReindexCanceled,
    Reindexed,
    copy_path,
    recovered_text,
    reindex,
)
from process_visualizer.cell.model import Device, Mode
from process_visualizer.curves.curve_sources import CurveSource, curve_sources
from process_visualizer.curves.curves import Curve, RecordedAlarm, read_curves, recorded_alarms
from process_visualizer.curves.samples import ReadingCanceled
from process_visualizer.gui.lanes.lane_choice import LaneChoices
from process_visualizer.gui.playback.playback_state import PlacedMark
from process_visualizer.gui.session import Session
from process_visualizer.gui.toolkit.labels import with_details
from process_visualizer.gui.toolkit.tasks import TaskProgress, Tasks

# Functions of the bag model that run off the GUI thread.



class RecordingGone(Exception):
    """Files (``paths``) of a recording that was open before no longer exist."""

    def __init__(self, paths: Tuple[str, ...]) -> None:
        super().__init__(f'{", ".join(paths)}: no longer exists')
        self.paths = paths


def catalog_of(paths: Sequence[str]) -> Catalog:
    """Return the catalog of bags; an indexed copy that is newer than its bag replaces the bag.

    Raises:
        BagUnindexed: a bag has to be reindexed first.
        BagError: a bag cannot be read.
    """
    try:
        return read_catalog(paths)
    except BagUnindexed as error:
        copy = copy_path(error.file)
        if error.file == copy or error.file not in paths or not _is_newer(copy, error.file):
            raise
        return catalog_of([copy if path == error.file else path for path in paths])


def holds_configuration(paths: Sequence[str]) -> bool:
    """Return whether a recording contains the configuration with which it was made.

    Raises:
        BagError: a bag cannot be read.
    """
    with Recording(paths) as recording:
        return recorded_configuration(recording) is not None


def catalog_if_there(paths: Sequence[str]) -> Catalog:
    """Return the catalog of bags; see catalog_of.

    Raises:
        RecordingGone: some bags no longer exist.
    """
    gone = missing_of(paths)
    if gone:
        raise RecordingGone(gone)
    return catalog_of(paths)


def missing_of(paths: Sequence[str]) -> Tuple[str, ...]:
    """Return the files that no longer exist."""
    return tuple(path for path in paths if not os.path.exists(path))


def in_order(paths: Sequence[str]) -> List[str]:
    """Return the absolute paths of the files of one recording, sorted and without duplicates."""
    return sorted({os.path.abspath(os.path.expanduser(path)) for path in paths})


def _is_newer(copy: str, path: str) -> bool:
    return os.path.exists(copy) and os.path.getmtime(copy) >= os.path.getmtime(path)


class PlayedTopics(QObject):
    """The topics to play; opening a recording ticks all topics."""

    changed = pyqtSignal()

    def __init__(self, session: Session, parent: QObject) -> None:
        super().__init__(parent)
        self._of_devices: FrozenSet[str] = frozenset()
        self._unticked: Set[str] = set()
        self._paths: Tuple[str, ...] = ()
        session.cell_changed.connect(lambda: self._follow_cell(session.chosen))
        session.recording_changed.connect(lambda: self._follow_recording(session.paths))

    @property
    def left_out(self) -> Tuple[str, ...]:
        """The names of the devices' topics that are not to be played."""
        return tuple(sorted(self._unticked & self._of_devices))

    def is_offered(self, topic: str) -> bool:
        """Return whether a topic is one of the devices' topics; only these can be played."""
        return topic in self._of_devices

    def is_ticked(self, topic: str) -> bool:
        """Return whether a topic is to be played."""
        return topic in self._of_devices - self._unticked

    def tick(self, topic: str, is_ticked: bool) -> None:
        """Set whether a topic is played."""
        if is_ticked != self.is_ticked(topic):
            (self._unticked.discard if is_ticked else self._unticked.add)(topic)
            self.changed.emit()

    def _follow_cell(self, devices: Sequence[Device]) -> None:
        topics = frozenset(topic.name for device in devices for topic in device.topics
                           if topic.record)
        if topics != self._of_devices:
            self._of_devices = topics
            self.changed.emit()

    def _follow_recording(self, paths: Tuple[str, ...]) -> None:
        """Tick all topics of another recording."""
        if paths != self._paths:
            self._paths = paths
            self._unticked.clear()
            self.changed.emit()


LINE = 'curves'


class CurvesModel(QObject):
    """The curves and alarms of a recording; read again for other recordings or other variables."""

    changed = pyqtSignal()
    failed = pyqtSignal(str)

    def __init__(self, tasks: Tasks, session: Session, parent: Optional[QObject] = None) -> None:
        super().__init__(parent)
        self._tasks, self._session = tasks, session
        self.choices = LaneChoices(self)
        self._sources: Tuple[CurveSource, ...] = ()
        self._curves: Tuple[Curve, ...] = ()
        self._alarms: Tuple[RecordedAlarm, ...] = ()
        self._reading: Optional[TaskProgress] = None
        self._is_canceled = False
        for changed in (session.cell_changed, session.run_changed):
            changed.connect(self._follow_cell)

    @property
    def curves(self) -> Tuple[Curve, ...]:
        """The curves, in the order of the devices."""
        return self._curves

    @property
    def alarms(self) -> Tuple[RecordedAlarm, ...]:
        """The times at which variables were beyond their limits, in order of time."""
        return self._alarms

    @property
    def reading(self) -> Optional[TaskProgress]:
        """The progress of reading; None while nothing is being read."""
        return self._reading

    @property
    def is_canceled(self) -> bool:
        """Return whether the operator did not want the curves; ``read`` reads them after all."""
        return self._is_canceled

    def _follow_cell(self) -> None:
        sources = curve_sources(self._session.played_devices)
        if sources != self._sources:
            self._sources = sources
            self.read()
        elif self._judge():
            self.changed.emit()

    def read(self) -> None:
        """Read all curves again."""
        self._stop()
        self._curves, self._alarms, self._is_canceled = (), (), False
        paths, devices = self._session.paths, self._session.played_devices
        if paths and self._sources:
            self._reading = progress = TaskProgress(self)
            self._tasks.run(
                LINE, lambda: read_curves(paths, devices, None, progress.report,
                                          progress.is_canceled),
                lambda curves: self._take(progress, curves),
                lambda error: self._refuse(progress, error))
        self.changed.emit()

    def cancel(self) -> None:
        """Cancel reading."""
        if self._reading is not None:
            self._stop()
            self._is_canceled = True
            self.changed.emit()

    def _judge(self) -> bool:
        """Find the alarms again, as limits may have changed; return whether they differ."""
        before = self._alarms
        self._alarms = recorded_alarms(self._session.played_devices, self._curves)
        return self._alarms != before

    def _stop(self) -> None:
        if self._reading is not None:
            self._reading.cancel()
            self._reading = None

    def _take(self, progress: TaskProgress, curves: Tuple[Curve, ...]) -> None:
        if progress is self._reading:
            self._reading, self._curves = None, curves
            self._judge()
            self.changed.emit()

    def _refuse(self, progress: TaskProgress, error: Exception) -> None:
        if isinstance(error, ReadingCanceled) or progress is not self._reading:
            return
        self._reading = None
        self.changed.emit()
        if not isinstance(error, BagError):
            raise error
        self.failed.emit(f'The curves cannot be shown: {error}')


_FILES, _REINDEXING = 'files', 'reindexing'
_MAX_RECENT = 8
_NS_PER_S = 1_000_000_000

Paths = Tuple[str, ...]


def placed_marks(found: Optional[Catalog]) -> Tuple[PlacedMark, ...]:
    """Return the marks of a recording; empty without a recording."""
    return () if found is None else tuple(
        PlacedMark(found.position_s(mark), mark.label) for mark in found.marks)


def placed_gaps(found: Optional[Catalog]) -> Tuple[Tuple[float, float], ...]:
    """Return the known unreadable parts (begin, end) [s from the beginning]."""
    return () if found is None else tuple(
        ((gap.begin_ns - found.begin_ns) / _NS_PER_S, (gap.end_ns - found.begin_ns) / _NS_PER_S)
        for gap in found.gaps if gap.end_ns)


class RecentRecordings:
    """The recordings opened last; ``all`` has the newest first."""

    def __init__(self, where_recorded: Callable[[], str]) -> None:
        """Set a function that returns the folder for recordings."""
        self.all: Tuple[Paths, ...] = ()
        self._where_recorded = where_recorded
        self._folder = ''

    @property
    def folder(self) -> str:
        """Return the folder for opening a recording: that of the last one, else of new recordings.

        Reads the disk.
        """
        folders = (self._folder, *(os.path.dirname(paths[0]) for paths in self.all),
                   self._where_recorded(), os.path.expanduser('~'))
        return next(filter(os.path.isdir, folders), '')

    def look_into(self, folder: str) -> None:
        """Remember a folder in which the operator has looked for a recording."""
        self._folder = folder

    def add(self, paths: Paths) -> None:
        """Put a recording first."""
        self.all = (paths, *(it for it in self.all if it != paths))[:_MAX_RECENT]
        self._folder = os.path.dirname(paths[0])

    def forget(self, paths: Paths) -> None:
        """Remove a recording that cannot be opened."""
        self.all = tuple(it for it in self.all if it != paths)


class BagModel(QObject):
    """Opens one bag, or several files of one recording, in the background.

    An opened recording is put in force in the session; one that cannot be read changes nothing.
    """

    changed = pyqtSignal()
    failed = pyqtSignal(str)
    noted = pyqtSignal(str)
    """A note for the operator that is not a failure."""
    chosen = pyqtSignal()
    """A recording has been opened."""

    def __init__(self, tasks: Tasks, session: Session, parent: Optional[QObject] = None,
                 where_recorded: Callable[[], str] = lambda: '') -> None:
        """Set a function that returns the folder for recordings."""
        super().__init__(parent)
        self.recent = RecentRecordings(where_recorded)
        self.curves = CurvesModel(tasks, session, self)
        self.curves.failed.connect(self.failed)
        self.played = PlayedTopics(session, self)
        self._tasks, self.session = tasks, session
        self._wanted: Paths = ()
        self._unindexed = ''
        self._reindexing: Optional[TaskProgress] = None
        self._gone: Paths = ()
        self._holds_configuration = False
        self._aside: Optional[Catalog] = None  # opened during playback, and waits for its cell
        self._last: Paths = ()  # open when the window was closed, and not reopened yet
        self._watcher = QFileSystemWatcher(self)
        self._watcher.fileChanged.connect(self._look)
        session.run_changed.connect(self._follow_run)
        session.cell_changed.connect(self._follow_cell)

    # The open recording.

    @property
    def is_loading(self) -> bool:
        """Return whether a recording is being opened."""
        return bool(self._wanted) and not self._unindexed

    @property
    def missing(self) -> Dict[str, Tuple[str, ...]]:
        """By device, the topics that it would play and that the recording lacks."""
        found = self._next
        return {} if found is None else missing_topics(found, self.session.chosen)

    @property
    def is_foreign(self) -> bool:
        """Return whether the ticked devices have topics, but the recording has none of them."""
        return self._is_of_another_cell(self._next)

    @property
    def next_paths(self) -> Paths:
        """The files that are played after the next launch or *Apply*."""
        return () if self._next is None else self._next.paths

    @property
    def _next(self) -> Optional[Catalog]:
        waits = self._aside is not None and not self._is_of_another_cell(self._aside)
        return self._aside if waits else self.session.recording

    def _is_of_another_cell(self, found: Optional[Catalog]) -> bool:
        wanted = {topic.name for device in self.session.chosen for topic in device.topics
                  if topic.record}
        return found is not None and bool(wanted) and wanted.isdisjoint(found.topic_names)

    @property
    def foreign_text(self) -> str:
        """Return why nothing of the recording can be played; empty if something can."""
        if not self.is_foreign:
            return ''
        return f'{os.path.basename(self.next_paths[0])} has no topic of the ticked devices'

    @property
    def foreign_paths(self) -> Paths:
        """The files of a recording of another cell that is open or waits to be opened."""
        if self._aside is not None and self._is_of_another_cell(self._aside):
            return self._aside.paths
        return self.next_paths if self.is_foreign else ()

    @property
    def waiting_note(self) -> str:
        """Return why the recording that was opened last is not the one that is shown; or ''."""
        shown = os.path.basename((*self.session.paths, '')[0])
        if not self.foreign_paths:
            return '' if self._aside is None else (
                f'{os.path.basename(self._aside.paths[0])} is played once you press Apply. '
                f'Until then {shown} is shown.')
        played = '' if self._aside is None else f' {shown} stays open.'
        return (f'{os.path.basename(self.foreign_paths[0])} has no topic of the ticked devices. '
                f'It is from another cell.{played}')

    @property
    def holds_configuration(self) -> bool:
        """Return whether a foreign recording contains its own configuration."""
        return self._holds_configuration

    @property
    def gone(self) -> Paths:
        """The files that were deleted or moved while they were open."""
        return self._gone

    def open(self, paths: Sequence[str]) -> None:
        """Open the files of one recording in place of the open recording."""
        self._read(tuple(in_order(paths)), catalog_of)

    def _follow_cell(self) -> None:
        """For playback, reopen the last session's recording unless another has been opened."""
        self._follow_run()
        self.changed.emit()
        if self.session.mode is Mode.PLAYBACK and self._last:
            self._read(self._last, catalog_if_there)

    def keep_open(self) -> None:
        """Let the open recording stay open at the end of playback, as the window closes.

        A recording of another cell that waits for that end is only one of the recent ones then.
        """
        if self._aside is not None:
            self.recent.add(self._aside.paths)
            self._aside = None

    # A bag without an index.

    @property
    def unindexed(self) -> str:
        """The bag that cannot be opened as it has no index; empty if there is none."""
        return self._unindexed

    @property
    def reindexing(self) -> Optional[TaskProgress]:
        """The progress of the indexed copy; None while none is being made."""
        return self._reindexing

    def reindex(self) -> None:
        """Make an indexed copy of the bag without an index, and open the copy; the bag stays."""
        if not self._unindexed or self._reindexing is not None:
            return
        path, progress = self._unindexed, TaskProgress(self)
        self._reindexing = progress
        self._tasks.run(_REINDEXING, lambda: reindex(path, progress.go_on),
                        lambda result: self._take_copy(progress, result),
                        lambda error: self._refuse_copy(progress, error))
        self.changed.emit()

    def cancel_reindexing(self) -> None:
        """Cancel the indexed copy."""
        if self._reindexing is not None:
            self._reindexing.cancel()
            self._reindexing = None
            self.changed.emit()

    def dismiss(self) -> None:
        """Give up opening the bag that has no index."""
        self.cancel_reindexing()
        self._wanted, self._unindexed = (), ''
        self.changed.emit()

    # Marks of the operator.

    def add_mark(self, position_s: float, label: str) -> None:
        """Add a mark in a file beside the bag, or elsewhere if the folder is read-only."""
        found = self.session.recording
        if found is not None:
            mark = Mark(found.begin_ns + round(position_s * _NS_PER_S), label)
            self._tasks.run(_FILES, lambda: add_mark(found.paths[0], mark),
                            lambda path: self._take_mark(found.paths, mark, path), self._report)

    # Settings for the next session.

    def add_recent(self, path: str) -> None:
        """Put a bag first in the recent recordings without opening it."""
        self.recent.add((path,))
        self.changed.emit()

    def settings(self) -> Dict[str, Any]:
        """Return the settings to save."""
        is_chosen = self._wanted and not self._unindexed
        return {'recent': [list(paths) for paths in self.recent.all],
                'open': list(self._wanted if is_chosen else self.session.paths or self._last)}

    def restore(self, settings: Mapping[str, Any]) -> None:
        """Restore saved settings; the recording that was open is opened again for playback."""
        self.recent.all = tuple(tuple(str(path) for path in paths)
                                for paths in settings.get('recent', []) if paths)
        self._last = tuple(str(path) for path in settings.get('open', []))
        self.changed.emit()

    # Inside.

    def _read(self, wanted: Paths, read: Callable[[Paths], Catalog]) -> None:
        self.cancel_reindexing()
        self._unindexed, self._last, self._wanted = '', (), wanted
        self._tasks.run(_FILES, lambda: read(wanted), lambda found: self._take(wanted, found),
                        lambda error: self._refuse(wanted, error))
        self.changed.emit()

    def _take(self, wanted: Paths, found: Catalog) -> None:
        if wanted != self._wanted:
            return  # another recording has been chosen meanwhile
        self._wanted = ()
        if found.paths != self.session.paths and self._must_wait(found):
            self._aside = found
            self._look_for_configuration(found.paths)
            self.changed.emit()
        else:
            self._put_in_force(found)

    def _must_wait(self, found: Catalog) -> bool:
        """Return whether a recording has to wait, as nodes of another cell play another one."""
        is_played = self.session.running_mode is Mode.PLAYBACK and bool(self.session.paths)
        return is_played and (self.session.awaits_apply or self._is_of_another_cell(found))

    def _follow_run(self) -> None:
        """Open a waiting recording once its configuration is in use, or nothing is played."""
        if self._aside is not None and not self._must_wait(self._aside):
            self._put_in_force(self._aside)

    def _put_in_force(self, found: Catalog) -> None:
        self._aside, self._gone = None, ()
        self.session.set_recording(found)
        self.recent.add(found.paths)
        if self._watcher.files():
            self._watcher.removePaths(self._watcher.files())
        self._watcher.addPaths(list(found.paths))
        self.curves.read()
        self._look_for_configuration(found.paths)
        self.changed.emit()
        self.chosen.emit()

    def _look_for_configuration(self, paths: Paths) -> None:
        self._holds_configuration = False
        self._tasks.run(_FILES, lambda: holds_configuration(paths),
                        lambda holds: self._take_configuration(paths, holds), self._report)

    def _take_configuration(self, paths: Paths, holds: bool) -> None:
        shown = self.session.paths if self._aside is None else self._aside.paths
        if paths == shown and holds != self._holds_configuration:
            self._holds_configuration = holds
            self.changed.emit()

    def _refuse(self, wanted: Paths, error: Exception) -> None:
        if wanted != self._wanted:
            return
        if isinstance(error, BagUnindexed):
            self._unindexed = error.file
        else:
            self._wanted = ()
            self.recent.forget(wanted)
        if isinstance(error, RecordingGone):
            self._gone = error.paths
        self.changed.emit()
        if not isinstance(error, (BagUnindexed, RecordingGone)):
            self._report(error)

    def _report(self, error: Exception) -> None:
        if not isinstance(error, BagError):
            raise error
        self.failed.emit(str(error))

    def _take_copy(self, progress: TaskProgress, result: Reindexed) -> None:
        if progress is not self._reindexing:
            return
        self._reindexing = None
        self.open([result.path if path == self._unindexed else path for path in self._wanted])
        if result.gaps:
            self._tasks.run(_FILES, lambda: recovered_text(result), lambda text: self.failed.emit(
                with_details(text, map(str, result.gaps))), self._report)

    def _refuse_copy(self, progress: TaskProgress, error: Exception) -> None:
        if progress is not self._reindexing or isinstance(error, ReindexCanceled):
            return
        self.dismiss()
        self._report(error)

    def _take_mark(self, paths: Paths, mark: Mark, path: str) -> None:
        if path != marks_path(paths[0]):
            self.noted.emit(f'{os.path.dirname(paths[0])} cannot be written: the mark is kept in '
                            f'{path}')
        found = self.session.recording
        if found is not None and found.paths == paths:
            self.session.set_recording(found._replace(marks=tuple(sorted([*found.marks, mark]))))
            self.changed.emit()

    def _look(self, _path: str) -> None:
        """Check whether a file that has changed still exists."""
        paths = self.session.paths
        self._tasks.run(_FILES, lambda: missing_of(paths),
                        lambda gone: self._take_gone(paths, gone))

    def _take_gone(self, paths: Paths, gone: Paths) -> None:
        if paths != self.session.paths or gone == self._gone:
            return
        self._gone = gone
        self.changed.emit()
        if gone:
            self.failed.emit(f'{gone[0]} has been deleted or moved while it was open. '
                             'Playback continues until its nodes are quit; put it back, or open '
                             'another bag.')
