# SPDX-License-Identifier: BSD-3-Clause
"""Session: the cell, its ticked devices, the mode, the run and the recording that are in force."""
from __future__ import annotations

from typing import List, Mapping, Optional, Tuple

from PyQt5.QtCore import QObject, pyqtSignal

from process_visualizer.bagio.catalog import Catalog
from process_visualizer.cell.file_edit import PoseEditor
from process_visualizer.cell.model import Cell, Device, Mode
from process_visualizer.generate.choice import Choice
from process_visualizer.gui.ros.snapshots import PlayerSnapshot
from process_visualizer.launching.part_report import NodeState, PartReport, PartState


class Session(QObject):
    """The single source of what is in force; models read it, and follow its signals.

    Models that read a configuration, launch nodes or open a recording put it in force here.

    ``editor`` writes poses into the files of the cell; None if one of the files has just been
    removed. ``launched`` is the choice that was launched last, until all its nodes have ended.
    ``reports`` are the states of its parts. ``player`` is the last state of the player, None
    without a player.
    """

    opened = pyqtSignal()
    """Another configuration is in force; ``cell_changed`` follows."""
    cell_changed = pyqtSignal()
    """A configuration has been read, other devices are ticked, or the mode has changed."""
    run_changed = pyqtSignal()
    """The launched choice, or the state of one of its parts, has changed."""
    player_changed = pyqtSignal()
    """The player has another state, or is gone."""
    recording_changed = pyqtSignal()
    """The open recording, or its marks, have changed."""

    def __init__(self, parent: Optional[QObject] = None) -> None:
        super().__init__(parent)
        self.cell: Optional[Cell] = None
        self.editor: Optional[PoseEditor] = None
        self.chosen: Tuple[Device, ...] = ()
        self.mode = Mode.REALTIME
        self.launched: Optional[Choice] = None
        self.running: Optional[Choice] = None
        self.reports: Mapping[str, PartReport] = {}
        self.player: Optional[PlayerSnapshot] = None
        self.recording: Optional[Catalog] = None

    # The cell and its chosen devices

    @property
    def file(self) -> str:
        """The configuration's file; '' before one has been read."""
        return '' if self.cell is None else self.cell.file

    @property
    def devices(self) -> Tuple[Device, ...]:
        """All devices of the cell."""
        return () if self.cell is None else self.cell.devices

    def set_cell(self, cell: Cell, chosen: Tuple[Device, ...],
                 editor: Optional[PoseEditor] = None) -> None:
        """Put a configuration in force, with its ticked devices."""
        before = self.file
        self.cell, self.chosen, self.editor = cell, chosen, editor
        if cell.file != before:
            self.opened.emit()
        self.cell_changed.emit()

    def choose(self, devices: Tuple[Device, ...]) -> None:
        """Tick these devices only."""
        if devices != self.chosen:
            self.chosen = devices
            self.cell_changed.emit()

    def set_mode(self, mode: Mode) -> None:
        """Choose real time or playback."""
        if mode is not self.mode:
            self.mode = mode
            self.cell_changed.emit()

    # The run

    @property
    def running_mode(self) -> Optional[Mode]:
        """The mode of the running nodes; None without any, and while they are launched or quit."""
        return None if self.running is None else self.running.mode

    @property
    def mode_in_force(self) -> Mode:
        """The mode of the running nodes, else the one that would be launched."""
        return self.running_mode or self.mode

    @property
    def awaits_apply(self) -> bool:
        """Return whether the nodes were started from another configuration than the open one."""
        return (self.running is not None and self.cell is not None
                and self.running.cell.file != self.cell.file)

    @property
    def played_devices(self) -> Tuple[Device, ...]:
        """The devices whose recording is shown.

        While the nodes of another configuration play, these are its devices, not the ticked ones.
        """
        if self.running is not None and self.running.mode is Mode.PLAYBACK and self.awaits_apply:
            return self.running.devices
        return self.chosen

    @property
    def live_devices(self) -> Tuple[Device, ...]:
        """The devices of the nodes in real-time mode; without any, those that would be launched.

        Ticks that are not applied change neither what is recorded nor what is measured.
        """
        if self.launched is None or self.launched.mode is not Mode.REALTIME:
            return self.chosen
        return self.launched.devices

    @property
    def nodes(self) -> List[str]:
        """The nodes that were launched here."""
        return [node.name for report in self.reports.values() for node in report.nodes]

    def set_run(self, launched: Optional[Choice], is_running: bool,
                reports: Mapping[str, PartReport]) -> None:
        """Set the launched choice, whether all of it has started, and the states of its parts."""
        self.launched, self.running = launched, launched if is_running else None
        self.reports = reports
        self.run_changed.emit()
        if self.running_mode is not Mode.PLAYBACK:
            self.take_player(None)

    @property
    def is_restarting(self) -> bool:
        """Return whether a device is being restarted while the others run."""
        return self.running is not None and any(
            report.state in (PartState.STOPPING, PartState.STARTING)
            for part, report in self.reports.items()
            if any(it.name == part for it in self.running.devices))

    def runs(self, part: str) -> bool:
        """Return whether a part is up."""
        report = self.reports.get(part)
        return report is not None and report.state is PartState.RUNNING

    def has_ended(self, part: str) -> bool:
        """Return whether a part, or one of its nodes, has ended by itself."""
        report = self.reports.get(part)
        return report is not None and (
            report.state in (PartState.FAILED, PartState.STOPPED)
            or any(node.state in (NodeState.EXITED, NodeState.FAILED) for node in report.nodes))

    def take_player(self, player: Optional[PlayerSnapshot]) -> None:
        """Set the newest state of the player; None when the player is gone."""
        if player is not None or self.player is not None:
            self.player = player
            self.player_changed.emit()

    # The recording

    @property
    def paths(self) -> Tuple[str, ...]:
        """The files of the open recording."""
        return () if self.recording is None else self.recording.paths

    def set_recording(self, recording: Catalog) -> None:
        """Put an opened recording in force, or the same one with other marks."""
        self.recording = recording
        self.recording_changed.emit()
