# SPDX-License-Identifier: BSD-3-Clause
"""Notes events (launching, recording, marks), also in a file beside each bag; alarms of objects."""
from __future__ import annotations

import os
import time
from typing import Callable, Dict, Optional

from PyQt5.QtCore import QObject

from process_visualizer.bagio.bag_errors import BagError
from process_visualizer.bagio.reindex import copy_path
from process_visualizer.cell.model import Mode
from process_visualizer.generate.choice import Choice
from process_visualizer.gui.cell.alarms_model import AlarmsModel
from process_visualizer.gui.cell.launch_model import LaunchModel, LaunchPhase
from process_visualizer.gui.cell.objects_model import ObjectsModel
from process_visualizer.gui.recording.recording_model import RecordingModel
from process_visualizer.gui.recording.recording_state import RECENT_S
from process_visualizer.gui.ros.ros_link import ObjectLink, RosLinkError
from process_visualizer.gui.session import Session
from process_visualizer.gui.toolkit.tasks import Tasks
from process_visualizer.health.alarm_board import events_text
from process_visualizer.health.alarm_conditions import part_titles
from process_visualizer.launching.part_report import PartState
from process_visualizer.whole_file import write_text


def events_path(bag: str) -> str:
    """Return the path of the file beside a bag with the events of its recording."""
    return f'{bag}.events.txt'


def write_events(bag: str, text: str) -> None:
    """Write the file beside a bag, atomically.

    Raises:
        BagError: the file cannot be written.
    """
    path = events_path(bag)
    try:
        write_text(path, text + '\n')
    except OSError as error:
        raise BagError(path, f'cannot be written: {error.strerror}') from error


_MODES = {Mode.REALTIME: 'real-time mode', Mode.PLAYBACK: 'playback'}
_PHASES = {LaunchPhase.LAUNCHING: 'launching', LaunchPhase.RUNNING: 'launched',
           LaunchPhase.QUITTING: 'quitting all nodes', LaunchPhase.IDLE: 'all nodes have ended'}
_STATES = {PartState.STOPPING: 'is stopping', PartState.STARTING: 'is starting'}


class EventNotes(QObject):
    """Notes what is launched and recorded, and saves the events beside the bag."""

    def __init__(self, tasks: Tasks, alarms: AlarmsModel, launch: LaunchModel,
                 recording: RecordingModel, wall_s: Callable[[], float] = time.time) -> None:
        super().__init__(alarms)
        self._tasks, self._alarms, self._wall_s = tasks, alarms, wall_s
        self._launch, self._recording = launch, recording
        self._phase = launch.phase
        self._parts: Dict[str, PartState] = {}
        self._path, self._marks = '', 0
        self._begun_s: Optional[float] = None
        self._unfinished: Dict[str, str] = {}  # events by the path that a recovered bag has
        launch.changed.connect(self._follow_launch)
        recording.changed.connect(self._follow_recording)
        recording.finished.connect(self._finish)
        recording.broken_off.connect(self._keep_unfinished)

    def _follow_launch(self) -> None:
        before, self._phase = self._phase, self._launch.phase
        running = self._launch.running
        if self._phase is not before:
            is_applied = before is LaunchPhase.RUNNING and self._phase is LaunchPhase.LAUNCHING
            self._alarms.note(f'applying: {self._launch.applied}' if is_applied else
                              _PHASES[self._phase] + self._what(running))
        self._follow_parts()

    def _what(self, running: Optional[Choice]) -> str:
        """Return what is launched, in which mode; '' unless something is."""
        if running is None or self._phase is not LaunchPhase.LAUNCHING:
            return ''
        return f' in {_MODES[running.mode]}: ' + ', '.join(it.name for it in running.devices)

    def _follow_parts(self) -> None:
        """Note single parts that stop and start while everything else runs."""
        before = self._parts
        self._parts = {part: report.state for part, report in self._launch.reports.items()}
        if self._phase is LaunchPhase.RUNNING:
            titles = {} if self._launch.running is None else part_titles(
                self._launch.running.mode)
            for part, state in self._parts.items():
                if state is not before.get(part, state) and state in _STATES:
                    self._alarms.note(f'{titles.get(part, part)} {_STATES[state]}')

    def _follow_recording(self) -> None:
        state = self._recording.state
        if state.path and state.path != self._path:
            self._begun_s, self._marks = self._wall_s(), 0
            self._alarms.note(f'recording {os.path.basename(state.path)}')
            for alarm in self._alarms.alarms:  # a lasting alarm is an event of the recording, too
                if alarm.ended_s is None:
                    self._alarms.note(
                        f'{alarm.condition.said} (already present when recording began)')
        self._path = state.path
        for mark in state.marks[self._marks:]:
            self._alarms.note(f'mark: {mark.label}')
        self._marks = len(state.marks)

    def _finish(self, path: str) -> None:
        """Save the events of a recorded bag; for a bag saved afterwards, those of its time."""
        self._alarms.note(f'recorded {os.path.basename(path)}')
        if path in self._unfinished:
            self._write(path, self._unfinished.pop(path))
        else:
            self._write(path, self._text_of_recording())

    def _keep_unfinished(self, path: str) -> None:
        """Save the events of a recording whose recorder ended without finishing its bag."""
        self._alarms.note(f'{os.path.basename(path)} was not finished')
        text = self._unfinished[copy_path(path)] = self._text_of_recording()
        self._write(path, text)

    def _text_of_recording(self) -> str:
        begun_s = self._wall_s() - RECENT_S if self._begun_s is None else self._begun_s
        self._begun_s = None
        return events_text(self._alarms.events_since(begun_s))

    def _write(self, path: str, text: str) -> None:
        self._tasks.run('files', lambda: write_events(path, text), None, self._note_failure)

    def _note_failure(self, error: Exception) -> None:
        if not isinstance(error, BagError):
            raise error
        self._alarms.note(str(error))


_OBJECTS_LINE = 'objects'


class ObjectAlarms(QObject):
    """Passes on the alarms of objects that the sensors of the running cell see near robots."""

    def __init__(self, tasks: Tasks, session: Session, launch: LaunchModel,
                 alarms: AlarmsModel) -> None:
        super().__init__(alarms)
        self._launch, self._alarms = launch, alarms
        self.link = ObjectLink(self)
        self.model = ObjectsModel(self)
        self.model.sensors_wanted.connect(lambda names: tasks.run(
            _OBJECTS_LINE, lambda: self.link.follow(names), None, self._refuse))
        self.model.changed.connect(self._pass_on)
        self.link.seen.connect(self.model.take)
        launch.changed.connect(self._follow_launch)
        session.player_changed.connect(lambda: self.model.take_player(session.player))

    def _follow_launch(self) -> None:
        is_up = self._launch.phase in (LaunchPhase.LAUNCHING, LaunchPhase.RUNNING)
        self.model.set_running(self._launch.running if is_up else None)
        self.model.set_starting({device for device, report in self._launch.reports.items()
                                 if report.state in (PartState.STOPPING, PartState.STARTING)})

    def _refuse(self, error: Exception) -> None:
        if not isinstance(error, RosLinkError):
            raise error
        self._alarms.note(str(error))

    def _pass_on(self) -> None:
        self._alarms.set_objects(self.model.conditions, [
            (it.device, it.text, it.begin_s, it.end_s) for it in self.model.played],
            self.model.silent)
