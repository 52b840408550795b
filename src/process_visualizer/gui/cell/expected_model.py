# SPDX-License-Identifier: BSD-3-Clause
"""Writes the objects that a depth sensor sees now into the file, as expected ones."""
from __future__ import annotations

import os
import time
from typing import Any, Callable, Dict, List, Mapping, Optional, Sequence, Tuple

from PyQt5.QtCore import QObject, QTimer, pyqtSignal

from process_visualizer.cell.file_edit import PoseEditError, SavedPose
from process_visualizer.cell.model import Device, Mode, RegionOfInterest
from process_visualizer.figures import count_text
from process_visualizer.gui.ros.snapshots import ObjectsSnapshot
from process_visualizer.gui.session import Session
from process_visualizer.gui.toolkit.tasks import Tasks
from process_visualizer.health.expected_objects import LOOK_S, Expectation, expectation
from process_visualizer.health.near_objects import SILENT_S, SeenObject

_Look = Tuple[float, Tuple[SeenObject, ...]]
_MAX_LINES = 8


class ExpectModel(QObject):
    """The sensors that look for objects; writes on demand, and can remove what it wrote."""

    changed = pyqtSignal()
    failed = pyqtSignal(str)
    noted = pyqtSignal(str)
    """Message for the operator: the result."""
    saved = pyqtSignal()
    """A file of the configuration has other boxes."""

    def __init__(self, tasks: Tasks, session: Session, parent: Optional[QObject] = None,
                 monotonic_s: Callable[[], float] = time.monotonic) -> None:
        super().__init__(parent)
        self._tasks, self._session, self._monotonic_s = tasks, session, monotonic_s
        self._looks: Dict[str, List[_Look]] = {}
        self._silences: Dict[str, QTimer] = {}
        self._saved: List[SavedPose] = []
        self._told: Mapping[str, Optional[int]] = {}
        self.device = ''
        self.is_saving = False
        session.opened.connect(self._saved.clear)
        for followed in (session.cell_changed, session.run_changed):
            followed.connect(self._follow)

    # State

    @property
    def sensors(self) -> List[str]:
        """The devices that look for objects."""
        return [it.name for it in self._session.devices if it.objects is not None]

    @property
    def seen(self) -> Dict[str, Optional[int]]:
        """Return how many objects each sensor reports; None if it reports nothing now."""
        return {name: len(self._looks[name][-1][1]) if name in self._looks else None
                for name in self.sensors}

    @property
    def text(self) -> str:
        """Return what the chosen sensor sees."""
        count = self.seen.get(self.device)
        if count is None:
            return 'Objects are seen while the nodes run.' if self._session.running is None else \
                f'{self.device} reports nothing now.'
        return f'{self.device} sees {count_text(count, "object") if count else "no object"}.'

    @property
    def file(self) -> str:
        """The name of the file that has the chosen sensor; '' without one."""
        return self._file(self.device)

    @property
    def can_expect(self) -> bool:
        """Return whether the chosen sensor reports an object."""
        return bool(self.seen.get(self.device)) and not self.is_saving

    @property
    def can_revert(self) -> bool:
        """Return whether boxes that were written can be removed from the file."""
        return bool(self._saved) and not self.is_saving

    # Commands

    def choose(self, device: str) -> None:
        """Choose the sensor that is shown."""
        if device in self.sensors and device != self.device:
            self.device = device
            self.changed.emit()

    def look(self) -> Expectation:
        """Return which of the objects that the chosen sensor sees can be expected."""
        cell, found = self._session.cell, self._device(self.device)
        if cell is None or found is None or found.objects is None:
            return Expectation((), ())
        looks = [objects for _at_s, objects in self._looks.get(self.device, ())]
        return expectation(looks, found.objects, cell.frame)

    def write(self, device: str, boxes: Sequence[RegionOfInterest]) -> None:
        """Add boxes to what a sensor expects."""
        editor, file = self._session.editor, self._file(device)
        if editor is None or self.is_saving or not boxes:
            return
        save = editor.save_expected
        self._begin(lambda: save(device, boxes),
                    lambda saved: self._was_written(saved, device, file, len(boxes)))

    def revert(self) -> None:
        """Remove from the file what was written last."""
        editor = self._session.editor
        if editor is None or not self.can_revert:
            return
        restore, last = editor.revert, self._saved.pop()
        self._begin(lambda: restore(last), lambda _: self._was_reverted(last))

    # Input from the program

    def take(self, snapshot: ObjectsSnapshot) -> None:
        """Update what a sensor sees."""
        name = snapshot.device
        if not self._is_followed(name):
            return
        now_s = self._monotonic_s()
        self._looks[name] = [it for it in self._looks.get(name, ()) if it[0] > now_s - LOOK_S]
        self._looks[name].append((now_s, snapshot.objects))
        if name not in self._silences:
            self._silences[name] = QTimer(self, singleShot=True, interval=int(1000.0 * SILENT_S))
            self._silences[name].timeout.connect(lambda: self._forget(name))
        if self._session.running_mode is Mode.REALTIME:  # playback may be paused
            self._silences[name].start()
        self._tell()

    # Implementation

    def _device(self, name: str) -> Optional[Device]:
        return next((it for it in self._session.devices if it.name == name), None)

    def _file(self, name: str) -> str:
        found = self._device(name)
        return '' if found is None or found.objects is None else \
            os.path.basename(found.objects.location.file)

    def _is_followed(self, name: str) -> bool:
        """Return whether a sensor that runs belongs to the open cell."""
        running, cell = self._session.running, self._session.cell
        return running is not None and cell is not None and name in self.sensors and (
            (running.cell.file, running.cell.frame) == (cell.file, cell.frame)
            and any(it.name == name for it in running.devices))

    def _follow(self) -> None:
        self._looks = {name: it for name, it in self._looks.items() if self._is_followed(name)}
        if self.device not in self.sensors:
            self.device = next(iter(self.sensors), '')
        self._told = self.seen
        self.changed.emit()

    def _forget(self, name: str) -> None:
        self._looks.pop(name, None)
        self._tell()

    def _tell(self) -> None:
        if self.seen != self._told:
            self._told = self.seen
            self.changed.emit()

    def _begin(self, work: Callable[[], Any], then: Callable[[Any], None]) -> None:
        self.is_saving = True
        self.changed.emit()
        self._tasks.run('files', work, then, self._not_done)

    def _was_written(self, saved: Optional[SavedPose], device: str, file: str,
                     count: int) -> None:
        if saved is not None:
            self._saved.append(saved)
        then = '' if self._session.running is None else f'; Apply restarts {device}'
        self._end(f'{count_text(count, "object")} of {device} added to {file}{then}. Revert is in '
                  'the tab Calibration')

    def _was_reverted(self, last: SavedPose) -> None:
        self._end(f'{os.path.basename(last.file)} is restored')

    def _end(self, note: str) -> None:
        self.is_saving = False
        self.changed.emit()
        self.saved.emit()
        self.noted.emit(note)

    def _not_done(self, error: Exception) -> None:
        self.is_saving = False
        self.changed.emit()
        if not isinstance(error, (OSError, PoseEditError)):
            raise error
        self.failed.emit(f'what is expected was not changed: {error}')


def question_text(device: str, found: Expectation, file: str) -> str:
    """Return the question for the operator, or a message if nothing can be expected."""
    count = len(found.added)
    begin = f'Nothing that {device} sees now can be added to {file}.' if not count else (
        f'Expect {count_text(count, "object")} from now on? {device} will report nothing inside '
        f'{"its box" if count == 1 else "their boxes"}, not even a hand.')
    left_out = ['Left out:', *_shortened(found.left_out_lines())] if found.left_out else []
    parts = [[begin], _shortened(found.added_lines()), left_out]
    return '\n\n'.join('\n'.join(lines) for lines in parts if lines)


def _shortened(lines: Sequence[str]) -> List[str]:
    more = len(lines) - _MAX_LINES
    return [*lines[:_MAX_LINES], *([f'and {more} more'] if more > 0 else [])]
