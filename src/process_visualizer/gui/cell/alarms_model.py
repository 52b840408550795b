# SPDX-License-Identifier: BSD-3-Clause
"""Collects the present alarms of all sources, and the events since the launcher was opened."""
from __future__ import annotations

import getpass
import os
import time
from typing import Callable, Collection, FrozenSet, List, Optional, Sequence, Set, Tuple

from PyQt5.QtCore import QObject, QTimer, pyqtSignal

from process_visualizer.cell.model import Device, Mode
from process_visualizer.generate.plan import BAG_PART
from process_visualizer.gui.cell.device_states_model import DeviceStatesModel
from process_visualizer.gui.cell.launch_model import LaunchModel, LaunchPhase
from process_visualizer.gui.ros.snapshots import RecorderSnapshot
from process_visualizer.health.alarm_board import Action, Alarm, AlarmBoard, Condition, Event
from process_visualizer.health.alarm_conditions import (
    MASTER,
    NO_DATA,
    QUIT,
    cloud_conditions,
    conflict_conditions,
    departure_conditions,
    end_words,
    limit_conditions,
    loss_conditions,
    lost_master,
    message_conditions,
    own_part_conditions,
    own_restart,
    part_conditions,
    part_titles,
    recorded_conditions,
    silence_conditions,
    topic_conditions,
    watch_conditions,
)
from process_visualizer.launching.part_report import NodeState, PartReport, PartState

Departed = Sequence[Tuple[str, str, str, float]]
RecordedAlarms = Sequence[Tuple[str, str, float, float]]
_LOOK_MS = 1000
_UP = LaunchPhase.LAUNCHING, LaunchPhase.RUNNING


class AlarmsModel(QObject):
    """Collects the alarms whenever something changes; emits ``changed`` when they differ."""

    changed = pyqtSignal()
    happened = pyqtSignal()
    """An event has been added."""

    def __init__(self, launch: LaunchModel, states: DeviceStatesModel,
                 wall_s: Callable[[], float] = time.time,
                 clock_s: Callable[[], float] = time.monotonic,
                 who: Callable[[], str] = lambda: _user()) -> None:
        """``clock_s`` is the clock of the nodes' warnings, ``who`` returns the operator's name."""
        super().__init__(launch)
        self._launch, self._states = launch, states
        self._wall_s, self._clock_s, self._who = wall_s, clock_s, who
        self._board = AlarmBoard()
        self._losses: List[Condition] = []
        self._lost_master: Optional[Condition] = None
        self._departed: Departed = ()
        self._objects: Tuple[Condition, ...] = ()
        self._lost_channels: FrozenSet[Tuple[str, ...]] = frozenset()
        self._lost_sensors: FrozenSet[Tuple[str, ...]] = frozenset()
        self._recorded: RecordedAlarms = ()
        self._played: RecordedAlarms = ()
        self._position_s = 0.0
        states.changed.connect(self.look)
        self._timer = QTimer(self, interval=_LOOK_MS)  # some alarms begin and end by time alone
        self._timer.timeout.connect(self.look)
        self._remembered_s = 0.0  # length of the recorder's memory; 0 if unknown
        self._replayable: Tuple[bool, ...] = ()  # of each alarm
        launch.changed.connect(self._follow_mode)

    @property
    def alarms(self) -> Tuple[Alarm, ...]:
        """The present alarms, the worst first."""
        return self._board.alarms

    @property
    def events(self) -> Tuple[Event, ...]:
        """All events."""
        return self._board.events

    @property
    def recorded(self) -> RecordedAlarms:
        """The alarms of the open recording, in the order of time."""
        return sorted((*self._recorded, *self._played), key=lambda it: it[2])

    def can_replay(self, alarm: Alarm) -> bool:
        """Return whether the live cell runs, and its recorder remembers when an alarm began."""
        running = self._launch.running
        is_live = (running is not None and running.mode is Mode.REALTIME
                   and self._launch.phase is LaunchPhase.RUNNING)
        age_s = self._wall_s() - alarm.since_s
        return is_live and (not self._remembered_s or age_s <= self._remembered_s)

    @property
    def summary(self) -> str:
        """Return the text that is shown when there are no alarms."""
        running, count = self._launch.running, len(self.recorded)
        if running is None or running.mode is not Mode.PLAYBACK or not count:
            return 'No alarms'
        return f'No alarms here; the recording has {count}, in color on the timeline'

    def events_since(self, time_s: float) -> Tuple[Event, ...]:
        """Return the events from a time [s since the epoch] on."""
        return self._board.events_since(time_s)

    def note(self, text: str) -> None:
        """Add an event."""
        self._take(self._board.noted(text, self._wall_s()))

    def acknowledge(self, condition: Condition) -> None:
        """Note the operator's name in the events; an alarm that has ended then disappears."""
        self._take(self._board.acknowledged(condition, self._who(), self._wall_s()))

    def take_recorder(self, recorder: RecorderSnapshot) -> None:
        """Update from the recorder."""
        self._remembered_s = recorder.remembered_s
        self._losses = loss_conditions(recorder.phase == 'recording', recorder.dropped,
                                       recorder.lost)
        self.look()

    def set_master(self, is_lost: bool, is_other: bool) -> None:
        """Set whether the ROS master is lost, also while no cell runs; see MasterModel."""
        self._lost_master = lost_master(is_other) if is_lost else None
        self.look()

    def set_departed(self, departed: Departed,
                     lost: Collection[Tuple[str, str]] = ()) -> None:
        """Set the channels that are out of the band of good runs; see departure_conditions.

        ``lost`` are channels (device, label) that cannot be judged now.
        """
        self._lost_channels = frozenset(lost)
        if tuple(departed) != self._departed:
            self._departed = tuple(departed)
            self.look()

    def set_objects(self, conditions: Sequence[Condition], played: RecordedAlarms,
                    lost: Collection[str] = ()) -> None:
        """Set the objects near robots now, and those in the recording as far as it has been played.

        ``lost`` are the sensors (their devices) that report nothing now.
        """
        self._lost_sensors = frozenset((it,) for it in lost)
        is_other = len(played) != len(self._played)
        self._objects, self._played = tuple(conditions), played
        self.look()
        if is_other:
            self.changed.emit()

    def set_recorded(self, alarms: RecordedAlarms) -> None:
        """Set the alarms of the open recording."""
        self._recorded = tuple(alarms)
        self.look()
        self.changed.emit()

    def take_position(self, position_s: float) -> None:
        """Update from the position of playback."""
        before = recorded_conditions(self._recorded, self._position_s)
        self._position_s = position_s
        if recorded_conditions(self._recorded, position_s) != before:
            self.look()

    def look(self) -> None:
        """Update the alarms now."""
        self._take(self._board.seen(self._conditions(), self._wall_s(), self._end_words))
        replayable = tuple(map(self.can_replay, self.alarms))
        if replayable != self._replayable:
            self._replayable = replayable
            self.changed.emit()

    def _end_words(self, condition: Condition) -> str:
        """Return the text about a condition that has ended."""
        if condition.source == MASTER:
            return condition.end
        running = self._launch.running
        is_up = running is not None and self._launch.phase in _UP
        if not is_up or (condition.part and condition.part not in self._launch.reports):
            return QUIT
        if condition.reported_by and running is not None and running.mode is Mode.PLAYBACK:
            return NO_DATA  # the condition was of the live cell
        lost: Set[Tuple[str, ...]] = {*self._states.lapsed_warnings(), *self._lost_channels,
                                      *self._lost_sensors}
        return end_words(condition, lost)

    def _follow_mode(self) -> None:
        recorder = self._launch.reports.get(BAG_PART)
        if recorder is not None and recorder.has_died:
            self._losses = []  # of its recording, which has ended with it
        if self._launch.phase not in _UP:
            self._timer.stop()
        elif not self._timer.isActive():
            self._timer.start()
        if self._recorded or tuple(map(self.can_replay, self.alarms)) != self._replayable:
            self.changed.emit()

    def _take(self, board: AlarmBoard) -> None:
        before, self._board = self._board, board
        if board.alarms != before.alarms:
            self.changed.emit()
        if board.events != before.events:
            self.happened.emit()

    def _history(self, source: str, report: PartReport, restart: Action) -> List[Condition]:
        return self._launch.history.conditions(source, report, restart, self._clock_s())

    def _silences(self, device: Device, report: PartReport) -> List[Condition]:
        """Return the silent topics of a device; a restart alone does not end a silence."""
        silent = self._missing(topic_conditions(
            device.name, self._states.silent(device), self._wall_s()))
        return self._known(silent) if report.state is PartState.STOPPED else silent

    def _missing(self, found: List[Condition]) -> List[Condition]:
        """Return conditions of missing data; no new ones during a launch, which delays data."""
        is_launching = self._launch.phase is LaunchPhase.LAUNCHING
        return self._known(found) if is_launching else found

    def _known(self, found: List[Condition]) -> List[Condition]:
        known = {(it.condition.source, it.condition.about) for it in self._board.alarms
                 if it.ended_s is None}
        return [it for it in found if (it.source, it.about) in known]

    def _conditions(self) -> List[Condition]:
        running = self._launch.running
        if running is None or self._launch.phase not in _UP:
            return [] if self._lost_master is None else [self._lost_master]
        conditions: List[Condition] = []
        for device in running.devices:
            report = self._launch.reports.get(device.name)
            if report is not None:
                conditions += part_conditions(device.name, report, Action.RESTART_DEVICE)
                conditions += self._history(device.name, report, Action.RESTART_DEVICE)
                conditions += self._silences(device, report)
        conditions += own_part_conditions(running.mode, self._launch.reports)
        for part, title in part_titles(running.mode).items():
            if part in self._launch.reports:
                conditions += self._history(title, self._launch.reports[part], own_restart(part))
        epoch_s = self._wall_s() - self._clock_s()
        silent = silence_conditions(self._states.watch_warnings(), epoch_s)
        parts = {node.name: part for part, report in self._launch.reports.items()
                 for node in report.nodes}
        # A node that was asked may have ended meanwhile, which is an alarm of its own.
        ended = {node.name for report in self._launch.reports.values() for node in report.nodes
                 if node.state in (NodeState.EXITED, NodeState.FAILED)}
        conditions += [it for it in (*silent, *watch_conditions(
            running.mode, self._states.cell_look, parts, silent, epoch_s)) if it.node not in ended]
        if running.mode is Mode.PLAYBACK:
            return [*conditions, *recorded_conditions(self._recorded, self._position_s),
                    *self._objects]
        sources = {it.source for it in conditions}
        for device in running.devices:
            warnings = self._states.warnings(device.name)
            clouds = cloud_conditions(device.name, self._states.watch_warnings(), epoch_s)
            # No new one beside its reason; one that was shown before ends with the next cloud.
            conditions += self._known(clouds) if device.name in sources else self._missing(clouds)
            conditions += limit_conditions(device.name, warnings, epoch_s)
            conditions += conflict_conditions(device.name, warnings)
            conditions += message_conditions(device.name, warnings, self._clock_s())
        recorder = self._launch.reports.get(BAG_PART)
        is_recording = recorder is None or ended.isdisjoint(it.name for it in recorder.nodes)
        return [*conditions, *departure_conditions(self._departed),
                *(self._losses if is_recording else ()), *self._objects]


def _user() -> str:
    """Return the user's name, or the number of a user without a name."""
    try:
        return getpass.getuser()
    except (KeyError, OSError):
        return f'user {os.getuid()}'
