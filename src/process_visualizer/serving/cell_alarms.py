# SPDX-License-Identifier: BSD-3-Clause
"""The alarms of the live page, from the reports of its nodes and its recorder; no ROS."""
from __future__ import annotations

import math
import re
from typing import Any, Dict, FrozenSet, List, NamedTuple, Optional, Sequence, Tuple

from process_visualizer.cell.model import Device
from process_visualizer.curves.live_curves import LiveMark
from process_visualizer.health.alarm_board import Alarm, AlarmBoard, Condition
from process_visualizer.health.alarm_conditions import (
    blind_condition,
    conflict_conditions,
    departure_conditions,
    end_words,
    limit_conditions,
    loss_conditions,
    message_conditions,
    object_conditions,
    silence_conditions,
    topic_conditions,
)
from process_visualizer.health.device_state import Level, Line, live_line
from process_visualizer.health.near_objects import SILENT_S, START_S, ObjectWatch, SeenObject
from process_visualizer.health.node_pulse import ENDED, SILENT
from process_visualizer.health.node_warnings import NodeWarning, NodeWarnings
from process_visualizer.health.topic_silence import TopicWatch

MAX_SHOWN = 50
"""Maximum number of alarms, events and marks on a page; of events and marks, the newest."""
_MAX_NUMBER = 1e10
_DIGITS = re.compile(r'[\d.]+')


class RecorderTopic(NamedTuple):
    """A topic as the recorder sees it; see TopicRecord.msg. A gap of 0 is unknown."""

    name: str
    rate_hz: float
    silence_s: Optional[float]
    messages: int
    is_latched: bool
    largest_gap_s: float = 0.0


class SeenRecorder(NamedTuple):
    """The recorder's state; ``name`` is the name of the file."""

    is_recording: bool
    name: str
    duration_s: float
    dropped: int
    lost: int
    topics: Tuple[RecorderTopic, ...]

    @property
    def text(self) -> str:
        """Return the state as text."""
        if not self.is_recording:
            return 'not recording'
        minutes, seconds = divmod(int(self.duration_s), 60)
        losses = f', {self.dropped + self.lost} messages missing' if self.dropped + self.lost \
            else ''
        return f'recording for {minutes}:{seconds:02d}{losses}'


class CellAlarms:
    """Collects alarms; any thread may fill ``warnings``, only one thread may use the rest."""

    def __init__(self, devices: Sequence[Device]) -> None:
        """Initialize with the devices of the cell."""
        self._devices = tuple(devices)
        self.warnings = NodeWarnings()
        self._watch = TopicWatch()
        self._lines: Dict[str, Line] = {}
        self._recorder: Optional[SeenRecorder] = None
        self._board = AlarmBoard()
        self._objects = {it.name: ObjectWatch(it.objects.warn_m, it.objects.stop_m)
                         for it in devices if it.objects is not None}
        self._objects_s: Dict[str, float] = {}  # of each sensor's last message
        self._begun_s: Optional[float] = None
        self.departed: Sequence[Tuple[str, str, str, float]] = ()
        """Departures from the band of good runs; see departure_conditions."""
        self.lost: FrozenSet[Tuple[str, str]] = frozenset()
        """The channels (device, label) that cannot be judged now."""

    def take_recorder(self, recorder: SeenRecorder) -> None:
        """Update from the recorder's state, unless its numbers are unusable."""
        numbers = [recorder.duration_s, *(it.rate_hz for it in recorder.topics),
                   *(it.silence_s or 0.0 for it in recorder.topics),
                   *(it.largest_gap_s for it in recorder.topics)]
        if not all(abs(it) < _MAX_NUMBER for it in numbers):
            return
        self._recorder = recorder
        self._lines = {it.name: live_line(self._watch.update(
            it.name, it.rate_hz, it.silence_s, it.messages, it.largest_gap_s, it.is_latched),
            it.is_latched)
            for it in recorder.topics}

    def take_objects(self, sensor: str, objects: Sequence[SeenObject], wall_s: float) -> None:
        """Update from the unmodeled objects that a sensor sees."""
        watch = self._objects.get(sensor)
        if watch is not None:
            watch.take(objects, wall_s)
            self._objects_s[sensor] = wall_s

    @property
    def recorder(self) -> Optional[SeenRecorder]:
        """Return the recorder's last state."""
        return self._recorder

    def look(self, wall_s: float, clock_s: float, said: Sequence[str] = (),
             is_live: bool = True) -> None:
        """Update the alarms.

        Args:
            wall_s: time since the epoch.
            clock_s: time of the clock that times the warnings.
            said: the lines with which scene_watch marks devices, ``DEVICE: what; consequence``.
            is_live: False while a recording is played, which may be paused.
        """
        conditions = [*self._conditions(wall_s, clock_s),
                      *self._object_conditions(wall_s, is_live)]
        lost = {*self.warnings.lapsed(), *self.lost}
        self._board = self._board.seen([*conditions,
                                        *_marked_conditions(said)], wall_s,
                                       lambda it: end_words(it, lost))

    def _conditions(self, wall_s: float, clock_s: float) -> List[Condition]:
        present = self.warnings.present(clock_s)
        found = list(silence_conditions(present, wall_s - clock_s))
        for device in self._devices:
            name = device.name
            own = [it for it in present if _is_of(it, name)]
            lines = {it.name: self._lines[it.name] for it in device.topics
                     if it.name in self._lines}
            found += [*topic_conditions(name, lines, wall_s),
                      *limit_conditions(name, own, wall_s - clock_s),
                      *conflict_conditions(name, own), *message_conditions(name, own, clock_s)]
        recorder = self._recorder
        if recorder is not None:
            found += loss_conditions(recorder.is_recording, recorder.dropped, recorder.lost)
        return [*found, *departure_conditions(self.departed)]

    def _object_conditions(self, wall_s: float, is_live: bool) -> List[Condition]:
        self._begun_s = wall_s if self._begun_s is None else self._begun_s
        found = []
        for sensor, watch in self._objects.items():
            heard_s = self._objects_s.get(sensor)
            if is_live and wall_s >= (-math.inf if heard_s is None else heard_s) + SILENT_S:
                watch.take((), wall_s)
                if wall_s >= self._begun_s + START_S:
                    found.append(blind_condition(
                        sensor, self._begun_s if heard_s is None else heard_s))
            found += object_conditions(sensor, watch.present(wall_s))
        return found

    def note(self, text: str, wall_s: float) -> None:
        """Add an event."""
        self._board = self._board.noted(text, wall_s)

    def entries(self, marks: Sequence[LiveMark], epoch_s: float) -> Dict[str, Any]:
        """Return alarms, events and marks for JSON; times of marks count from ``epoch_s`` [s]."""
        recorder = self._recorder
        return {
            'alarms': [_alarm(it) for it in self._board.alarms[:MAX_SHOWN]],
            'events': [{'text': it.text, 'time': round(it.time_s, 2)}
                       for it in reversed(self._board.events[-MAX_SHOWN:])],
            'marks': [{'label': it.label, 'at': round(epoch_s + it.time_s, 3)}
                      for it in marks[-MAX_SHOWN:]],
            'recording': 'no recorder' if recorder is None else recorder.text,
            'is_recording': recorder is not None and recorder.is_recording}


def _marked_conditions(said: Sequence[str]) -> List[Condition]:
    """Return the conditions marked by scene_watch, except hanging nodes (see /diagnostics)."""
    found = []
    for line in said:
        device, separator, what = line.partition(': ')
        if separator and SILENT not in what:
            level = Level.BAD if ENDED in what else Level.WARNING
            found.append(Condition(device, _DIGITS.sub('#', what), what, level))
    return found


def _is_of(warning: NodeWarning, device: str) -> bool:
    return warning.node.startswith(f'/{device}/')


def _alarm(alarm: Alarm) -> Dict[str, Any]:
    return {'text': alarm.worst.said, 'level': int(alarm.condition.level),
            'begin': round(alarm.since_s, 2),
            'end': None if alarm.ended_s is None else round(alarm.ended_s, 2)}
