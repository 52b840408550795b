# SPDX-License-Identifier: BSD-3-Clause
"""A second cell that plays a recording beside the first one, on its own ROS master."""
from __future__ import annotations

import shutil
import socket
from dataclasses import replace
from typing import Mapping, Optional

from process_visualizer.generate.choice import Choice
from process_visualizer.generate.generator import generate_parts
from process_visualizer.generate.plan import BAG_PART
from process_visualizer.launching.launched_cell import LaunchedCell, OnChange
from process_visualizer.launching.part_report import PartState
from process_visualizer.launching.ros_master import RosMaster
from process_visualizer.launching.run_record import RunRecord, new_run_folder

_NICENESS = 10  # drivers and the recorder of the running cell have precedence


class ReplayCell:
    """A cell that starts when first needed, and runs until it is stopped.

    On its own master, all nodes and topics have their usual names, however the nodes form these
    names, and no topic or service can reach the running cell. The methods block; call them from one
    thread that lives as long as the program.
    """

    def __init__(self, on_change: OnChange,
                 variables: Optional[Mapping[str, str]] = None) -> None:
        """``on_change`` is called in other threads with the reports of the parts.

        ``variables`` are environment variables of its nodes that differ from those of this process.
        """
        self._on_change, self._variables = on_change, variables
        self._folder = ''
        self._record = RunRecord()
        self._held_port = _held_port()
        self._master = RosMaster(f'http://localhost:{self._held_port.getsockname()[1]}')
        self._launched: Optional[LaunchedCell] = None
        self._choice: Optional[Choice] = None

    @property
    def master_uri(self) -> str:
        """The address of the replay's master."""
        return self._master.uri

    @property
    def folder(self) -> str:
        """The folder of the replay's files and its recording; it is removed with the cell."""
        if not self._folder:
            self._folder = new_run_folder()
            self._record.write(self._folder, is_replay=True)
        return self._folder

    def show(self, choice: Choice) -> None:
        """Start the nodes of a choice; unchanged nodes keep running.

        The player is always restarted: its bag is a new one with the same name.

        Raises:
            RosMasterError: there is no master.
            ConfigurationError, PlanError, OSError: the nodes cannot be started.
        """
        self._held_port.close()
        self._master.ensure()
        if self._launched is None:
            self._launched = LaunchedCell(self.folder, self._on_change, self._master.uri,
                                          _NICENESS, self._variables)
        ended = [report.part for report in self._launched.reports()
                 if report.has_died or report.state is PartState.STOPPED]
        playing = [] if self._choice is None else [BAG_PART]
        started, before = [], self._choice
        if before is None or choice != replace(before, window=choice.window):
            started, self._choice = self._launched.change(generate_parts(choice)), choice
        for part in dict.fromkeys((*ended, *playing)):
            if part not in started:
                self._launched.restart(part)

    def restart(self, part: str) -> None:
        """Stop and start one part."""
        if self._launched is not None:
            self._launched.restart(part)

    def stop(self) -> None:
        """Stop everything, and remove all written files."""
        if self._launched is not None:
            self._launched.stop()
        self._launched = self._choice = None
        self._held_port.close()
        self._master.stop()
        shutil.rmtree(self._folder, ignore_errors=True)
        self._record.remove()
        self._folder = ''


def _held_port() -> socket.socket:
    """Return a socket with a free port: while it is open, no node gets the same port."""
    held = socket.socket()
    held.bind(('', 0))
    return held
