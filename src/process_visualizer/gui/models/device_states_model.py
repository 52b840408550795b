"""The states of all devices, from what roslaunch, the recorder and the player tell."""
from __future__ import annotations

import time
from typing import Callable, Dict, Tuple

from PyQt5.QtCore import QObject, pyqtSignal

from process_visualizer.cell.model import Device
from process_visualizer.generate.plan import BAG_PART, FRAMES_PART, RVIZ_PART
from process_visualizer.gui.models.launch_model import LaunchModel
from process_visualizer.gui.snapshots import PlayerSnapshot, RecorderSnapshot
from process_visualizer.launching.device_state import (
    DeviceState,
    Line,
    device_state,
    part_line,
    worst,
)
from process_visualizer.launching.topic_watch import TopicActivity, TopicCounter, TopicWatch

_PARTS = {FRAMES_PART: 'frames', BAG_PART: 'recorder or player', RVIZ_PART: 'RViz'}


class DeviceStatesModel(QObject):
    """``changed`` comes when a state may be another one; `state` looks at one device."""

    changed = pyqtSignal()

    def __init__(self, launch: LaunchModel, clock: Callable[[], float] = time.monotonic) -> None:
        super().__init__(launch)
        self._launch = launch
        self._clock = clock
        self._activities: Dict[str, TopicActivity] = {}
        self._watch = TopicWatch()
        self._counter = TopicCounter()
        launch.changed.connect(self.changed)
        launch.stopped.connect(self._forget)

    def take_recorder(self, recorder: RecorderSnapshot) -> None:
        """In real-time mode the recorder counts what arrives."""
        self._activities = {topic.name: self._watch.update(topic.name, topic.rate_hz,
                                                           topic.silence_s, topic.messages)
                            for topic in recorder.topics}
        self.changed.emit()

    def take_player(self, player: PlayerSnapshot) -> None:
        """In playback mode the player counts what it sends; that a bag has gaps is no news."""
        now_s = self._clock()
        rates = {topic: self._counter.rate_hz(topic, count, now_s)
                 for topic, count in player.topics}
        self._activities = {topic: TopicActivity(rate, 0.0, False)
                            for topic, rate in rates.items()}
        self.changed.emit()

    def state(self, device: Device) -> DeviceState:
        """Return the state of a device."""
        report = self._launch.reports.get(device.name)
        return device_state(device, report, self._activities)

    def trouble(self, devices: Tuple[Device, ...]) -> Line:
        """Return the worst state of devices and of the program's own parts, with its name."""
        lines = [(device.name, self.state(device).summary) for device in devices]
        lines += [(title, part_line(self._launch.reports[part])) for part, title in _PARTS.items()
                  if part in self._launch.reports]
        return worst(tuple(Line(line.level, f'{name}: {line.text}') for name, line in lines))

    def _forget(self) -> None:
        self._activities = {}
        self._watch, self._counter = TopicWatch(), TopicCounter()
        self.changed.emit()
