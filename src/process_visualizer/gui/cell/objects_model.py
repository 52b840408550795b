# SPDX-License-Identifier: BSD-3-Clause
"""Decides which unmodeled objects near robots are alarms, and in which spans there were some."""
from __future__ import annotations

import math
import time
from typing import Callable, Collection, Dict, FrozenSet, List, Optional, Tuple

from PyQt5.QtCore import QObject, QTimer, pyqtSignal

from process_visualizer.cell.model import Device, Mode, SoughtObjects
from process_visualizer.generate.choice import Choice
from process_visualizer.gui.ros.snapshots import ObjectsSnapshot, PlayerSnapshot
from process_visualizer.health.alarm_board import Condition
from process_visualizer.health.alarm_conditions import blind_condition, object_conditions
from process_visualizer.health.device_state import Level
from process_visualizer.health.near_objects import (
    SILENT_S,
    START_S,
    NearMoment,
    NearObject,
    NearSpan,
    ObjectSpans,
    ObjectWatch,
)
from process_visualizer.playback.playback_clock import PlaybackClock

_TEXT_S = 0.2  # shortest time between two distances, so that they can be read
_MEMORY_S = 600.0  # of the running cell: as much as its curves show


class ObjectsModel(QObject):
    """Judges what the sensors of the running cell see; ``changed`` is emitted for anything new."""

    changed = pyqtSignal()
    sensors_wanted = pyqtSignal(object)
    """Follow these depth sensors (their names), and no others."""

    def __init__(self, parent: Optional[QObject] = None,
                 wall_s: Callable[[], float] = time.time) -> None:
        super().__init__(parent)
        self._wall_s = wall_s
        self._choice: Optional[Choice] = None
        self._sought: Dict[str, SoughtObjects] = {}
        self._watches: Dict[str, ObjectWatch] = {}
        self._heard_s: Dict[str, float] = {}
        self._begun_s: Dict[str, float] = {}
        self._starting: FrozenSet[str] = frozenset()
        self._player = PlaybackClock()
        self._live, self._played = ObjectSpans(), ObjectSpans()
        self._conditions: Tuple[Condition, ...] = ()
        self._updated_s, self._is_new = 0.0, False
        self._timer = QTimer(self, singleShot=True)
        self._timer.timeout.connect(self._update)

    @property
    def conditions(self) -> Tuple[Condition, ...]:
        """Return the present conditions."""
        return self._conditions

    @property
    def silent(self) -> Tuple[str, ...]:
        """Return the sensors (their devices) that have reported nothing for too long."""
        now_s = self._wall_s()
        return tuple(name for name in self._watches if now_s >= self._silent_s(name))

    @property
    def live(self) -> Tuple[NearSpan, ...]:
        """Return the spans [s since the epoch] of the last minutes in which something was near."""
        return self._live.spans

    @property
    def played(self) -> Tuple[NearSpan, ...]:
        """Return the spans of the recording played so far in which something was near."""
        return self._played.spans

    def set_running(self, choice: Optional[Choice]) -> None:
        """Set the running choice; None if nothing runs."""
        if choice is self._choice:
            return
        sought = {} if choice is None else _sought(choice.devices)
        if choice is not None and self._is_other(choice, sought):
            self._live, self._played = ObjectSpans(), ObjectSpans()
        if choice is None or self._mode is not choice.mode or sought != self._sought:
            self._watches = {name: ObjectWatch(it.warn_m, it.stop_m) for name, it in sought.items()}
        if choice is None or self._mode is not choice.mode or set(sought) != set(self._sought):
            self._heard_s, self._begun_s = {}, dict.fromkeys(sought, self._wall_s())
        if set(sought) != set(self._sought):
            self.sensors_wanted.emit(tuple(sought))
        self._choice, self._sought = choice, sought
        self._update()

    def set_starting(self, devices: Collection[str]) -> None:
        """Set the devices that are being stopped or started: their reports are not awaited."""
        before, self._starting = self._starting, frozenset(devices)
        for name in self._begun_s:
            if name in before - self._starting:
                self._begun_s[name] = self._wall_s()
                self._heard_s.pop(name, None)
        if before != self._starting:
            self._update()

    def take_player(self, player: Optional[PlayerSnapshot]) -> None:
        """Update from the state of the player, None without one."""
        if player is None:
            self._player = PlaybackClock()
            return
        self._player.add(player.clock_state)

    def take(self, snapshot: ObjectsSnapshot) -> None:
        """Update from the objects that a sensor sees."""
        now_s, watch = self._wall_s(), self._watches.get(snapshot.device)
        if watch is None:
            return
        self._heard_s[snapshot.device] = now_s
        watch.take(snapshot.objects, now_s)
        self._place(snapshot, watch.present(now_s), now_s)
        is_calm = not watch.present(now_s) and not self._conditions
        self._is_new = self._is_new or not is_calm
        is_due = now_s >= self._updated_s + _TEXT_S
        if (is_due and not is_calm) or _kinds(self._found(now_s)) != _kinds(self._conditions):
            self._update()
        else:
            self._wait(now_s)

    # Implementation

    @property
    def _mode(self) -> Optional[Mode]:
        return None if self._choice is None else self._choice.mode

    def _is_other(self, choice: Choice, sought: Dict[str, SoughtObjects]) -> bool:
        """Return whether earlier objects are of another recording, or were judged differently."""
        before = self._choice
        return before is None or sought != self._sought or (
            (choice.mode, choice.bag, choice.further_bags)
            != (before.mode, before.bag, before.further_bags))

    def _update(self) -> None:
        now_s = self._wall_s()
        for name, watch in self._watches.items():
            if now_s >= self._silent_s(name):
                watch.take((), now_s)
        self._conditions, self._updated_s, self._is_new = tuple(self._found(now_s)), now_s, False
        self._live.forget(now_s - _MEMORY_S)
        self._wait(now_s)
        self.changed.emit()

    def _wait(self, now_s: float) -> None:
        """Look again when the next alarm may end, or its text can change."""
        due = [ends_s for ends_s in (it.ends_s(now_s) for it in self._watches.values())
               if ends_s is not None]
        due += [self._updated_s + _TEXT_S] if self._is_new else []
        due += [self._silent_s(name) for name, it in self._watches.items() if it.present(now_s)]
        due += [self._blind_s(name) for name in self._watches]
        due = [it for it in due if it > now_s]
        self._timer.stop()
        if due and min(due) < math.inf:
            self._timer.start(1 + int(1000.0 * (min(due) - now_s)))

    def _silent_s(self, device: str) -> float:
        """Return when a sensor will have been silent for too long; a recording may be paused."""
        if self._mode is Mode.PLAYBACK:
            return math.inf
        return self._heard_s.get(device, 0.0) + SILENT_S

    def _blind_s(self, device: str) -> float:
        """Return when the operator must know that a sensor of the running cell is silent."""
        if self._mode is Mode.PLAYBACK or device in self._starting:
            return math.inf
        return max(self._begun_s[device] + START_S, self._heard_s.get(device, 0.0) + SILENT_S)

    def _found(self, now_s: float) -> List[Condition]:
        played = self._played if self._mode is Mode.PLAYBACK else None
        blind = [blind_condition(name, self._heard_s.get(name, self._begun_s[name]))
                 for name in self._watches if now_s >= self._blind_s(name)]
        return blind + [it for device, watch in self._watches.items()
                for it in object_conditions(device, watch.present(now_s), played)]

    def _place(self, snapshot: ObjectsSnapshot, near: Tuple[NearObject, ...],
               now_s: float) -> None:
        """Note the time at which objects are seen, or the position in the recording."""
        spans, moment = self._live, NearMoment(0, now_s)
        if self._mode is Mode.PLAYBACK:
            at = self._player.bag_time(snapshot.stamp_s)
            if at is None:
                return
            spans, moment = self._played, NearMoment(at.segment, at.time_s)
        spans.take(snapshot.device, snapshot.objects, near, moment)


def _sought(devices: Tuple[Device, ...]) -> Dict[str, SoughtObjects]:
    return {it.name: it.objects for it in devices if it.objects is not None}


def _kinds(conditions: 'List[Condition] | Tuple[Condition, ...]') -> List[Tuple[str, str, Level]]:
    """Return the parts of alarms whose changes are shown at once; changes of text may wait."""
    return [(it.source, it.about, it.level) for it in conditions]
