# SPDX-License-Identifier: BSD-3-Clause
"""The states of all devices, as reported by roslaunch, the recorder and the player."""
from __future__ import annotations

import time
from typing import Callable, Collection, Dict, FrozenSet, Optional, Tuple

from PyQt5.QtCore import QObject, QTimer, pyqtSignal

from process_visualizer.bagio.catalog import missing_topics
from process_visualizer.cell.model import Device, Mode
from process_visualizer.gui.cell.launch_model import LaunchModel
from process_visualizer.gui.ros.snapshots import RecorderSnapshot
from process_visualizer.gui.session import Session
from process_visualizer.health.alarm_conditions import (
    own_part_conditions,
    part_titles,
    silence_conditions,
)
from process_visualizer.health.device_state import (
    NOT_RECORDED,
    DeviceState,
    Level,
    Line,
    device_state,
    live_line,
    part_line,
    recorded_line,
    said_of,
    worst,
)
from process_visualizer.health.node_warnings import (
    OUT_OF_ORDER,
    NodeWarning,
    NodeWarnings,
    by_node,
)
from process_visualizer.health.topic_silence import TopicWatch
from process_visualizer.launching.cell_watch import CellLook
from process_visualizer.ros_names import CELL_FRAMES, SCENE_WATCH

PERIOD_MS = 500
_UNSURE_STATES = 2
"""States to ignore of a recorder that hung: until it has caught up, it reports false silences."""


class WarningsModel(QObject):
    """Updates twice a second while nodes run, however fast warnings arrive."""

    changed = pyqtSignal()

    def __init__(self, warnings: NodeWarnings, session: Session, parent: Optional[QObject] = None,
                 clock_s: Callable[[], float] = time.monotonic) -> None:
        super().__init__(parent)
        self._warnings, self._session, self._clock_s = warnings, session, clock_s
        self.present: Tuple[NodeWarning, ...] = ()
        self._timer = QTimer(self, interval=PERIOD_MS)
        self._timer.timeout.connect(self.look)
        session.run_changed.connect(lambda: self._follow(session.launched is not None))

    def _follow(self, is_running: bool) -> None:
        if is_running == self._timer.isActive():
            return
        if is_running:
            self._timer.start()
        else:
            self._timer.stop()
            self._warnings.forget()
            self.look()

    def look(self) -> None:
        """Update the warnings now."""
        is_played = self._session.running_mode is Mode.PLAYBACK
        present = tuple(it for it in self._warnings.present(self._clock_s())
                        if not (is_played and OUT_OF_ORDER in it.text))
        if present != self.present:
            self.present = present
            self.changed.emit()

    def lapse(self, nodes: Collection[str]) -> None:
        """Note that these nodes have ended, even if others of the same names start."""
        self._warnings.lapse(nodes)
        self.look()

    @property
    def lapsed(self) -> FrozenSet[Tuple[str, str]]:
        """Return node and text of warnings that are neither repeated nor reported as over."""
        return self._warnings.lapsed()


class DeviceStatesModel(QObject):
    """``changed`` is emitted when a state may have changed; `state` returns that of a device."""

    changed = pyqtSignal()

    def __init__(self, launch: LaunchModel, warnings: WarningsModel, session: Session) -> None:
        super().__init__(launch)
        self._launch, self._warnings, self._session = launch, warnings, session
        self._lines: Dict[str, Line] = {}
        self._watch = TopicWatch()
        self._unsure = 0  # remaining states of the recorder to ignore
        self.cell_look = CellLook()
        """The findings of the watch, which asks all nodes and the master."""
        session.player_changed.connect(self._follow_player)
        self._nodes: FrozenSet[str] = frozenset()  # that have been launched
        launch.changed.connect(self._follow_nodes)
        launch.changed.connect(self.changed)
        warnings.changed.connect(self.changed)
        launch.stopped.connect(self._forget)

    def take_recorder(self, recorder: RecorderSnapshot) -> None:
        """Update from the recorder, which counts what arrives in real-time mode."""
        if self._unsure:
            self._unsure -= 1
            return
        self._lines = {topic.name: live_line(self._watch.update(
            topic.name, topic.rate_hz, topic.silence_s, topic.messages, topic.largest_gap_s,
            topic.is_latched), topic.is_latched) for topic in recorder.topics}
        self.changed.emit()

    def _follow_nodes(self) -> None:
        """Let the warnings of ended nodes lapse: they say nothing about the nodes' successors."""
        nodes = frozenset(node.name for report in self._launch.reports.values()
                          for node in report.nodes)
        ended, self._nodes = self._nodes - nodes, nodes
        if ended:
            self._warnings.lapse(ended)

    def silent(self, device: Device) -> Dict[str, Line]:
        """Return the topics of a device without data, also while its nodes are being restarted."""
        return {topic.name: line for topic in device.topics
                for line in [self._lines.get(topic.name)]
                if line is not None and line.level is Level.WARNING}

    def take_look(self, look: CellLook) -> None:
        """Update from the watch, which asks all nodes and the master."""
        self.cell_look = look
        self.changed.emit()

    def forget_topics(self) -> None:
        """Forget the rates, as no messages are counted now; keep silences, whose end is unseen."""
        self._unsure = _UNSURE_STATES
        self._lines = {topic: line for topic, line in self._lines.items()
                       if line.level is Level.WARNING}
        self.changed.emit()

    def _follow_player(self) -> None:
        """Show the topics' states in the recording, whatever the playback rate."""
        recorded, player = self._session.recording, self._session.player
        if recorded is None or player is None or recorded.paths != player.files:
            return  # one of them is about to change
        played = {topic for topic, _ in player.topics}
        lines = {topic.name: recorded_line(topic, topic.name in played)
                 for topic in recorded.topics}
        lines.update((topic, NOT_RECORDED)
                     for topics in missing_topics(recorded, self._session.devices).values()
                     for topic in topics)
        if lines != self._lines:
            self._lines = lines
            self.changed.emit()

    def state(self, device: Device) -> DeviceState:
        """Return the state of a device."""
        report = self._launch.reports.get(device.name)
        nodes = set() if report is None else {node.name for node in report.nodes}
        silent = {it.node for it in silence_conditions(self.watch_warnings(), 0.0)
                  if it.source == device.name or it.node in nodes}
        return device_state(device, report, self._lines, self._warnings.present,
                            silent | (self.cell_look.silent & nodes))

    def warnings(self, device: str) -> Tuple[NodeWarning, ...]:
        """Return the present warnings of the nodes of a device (its name)."""
        report = self._launch.reports.get(device)
        nodes = set() if report is None else {node.name for node in report.nodes}
        return by_node(self._warnings.present, nodes)

    def lapsed_warnings(self) -> FrozenSet[Tuple[str, str]]:
        """Return node and text of the warnings that may or may not be over."""
        return self._warnings.lapsed

    def watch_warnings(self) -> Tuple[NodeWarning, ...]:
        """Return the warnings of the nodes that ask all others whether they answer."""
        return by_node(self._warnings.present, {f'/{SCENE_WATCH}', f'/{CELL_FRAMES}'})

    def trouble(self, devices: Tuple[Device, ...]) -> Line:
        """Return the worst state of devices and of the program's own parts, with its name."""
        lines = [(device.name, self.state(device).summary) for device in devices]
        found = [Line(line.level, said_of(name, line.text)) for name, line in lines]
        running, reports = self._launch.running, self._launch.reports
        if running is not None:
            found += [Line(it.level, it.said)
                      for it in own_part_conditions(running.mode, reports)]
            found += [Line(line.level, said_of(title, line.text))
                      for part, title in part_titles(running.mode).items() if part in reports
                      for line in [part_line(reports[part])] if line.level < Level.WARNING]
        return worst(tuple(found))

    def _forget(self) -> None:
        self._lines, self._watch, self._unsure = {}, TopicWatch(), 0
        self.changed.emit()
