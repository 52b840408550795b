# SPDX-License-Identifier: BSD-3-Clause
"""A second cell that plays a recording beside the first, on a ROS master of its own."""
from __future__ import annotations

import contextlib
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

_NICENESS = 10  # drivers and the recorder of the running cell come first


class ReplayCell:
    """Starts when it is first needed, and stays until it is stopped.

    On a master of its own every node has its usual name and every topic too, whatever the nodes of
    a cell do with their names, and nothing that they publish or offer can reach the running cell.
    The methods block; call them in one thread that lives as long as the program does.
    """

    def __init__(self, on_change: OnChange,
                 variables: Optional[Mapping[str, str]] = None) -> None:
        """``on_change`` is called in other threads with the reports of the parts.

        ``variables`` are those of the environment in which its nodes differ from this process.
        """
        self._on_change, self._variables = on_change, variables
        self._folder = ''
        self._record = RunRecord()
        self._master = RosMaster(f'http://localhost:{_free_port()}')
        self._launched: Optional[LaunchedCell] = None
        self._choice: Optional[Choice] = None

    @property
    def master_uri(self) -> str:
        """The address of its master."""
        return self._master.uri

    @property
    def folder(self) -> str:
        """Return where its files are, and what it plays; it goes with the cell."""
        if not self._folder:
            self._folder = new_run_folder()
            self._record.write(self._folder, is_replay=True)
        return self._folder

    def show(self, choice: Choice) -> None:
        """Start the nodes of a choice; those that run already and do the same keep running.

        The player is started again in any case: its bag is another one, by the same name.

        Raises:
            RosMasterError: there is no master.
            ConfigurationError, PlanError, OSError: they cannot be started.
        """
        self._master.ensure()
        if self._launched is None:
            self._launched = LaunchedCell(self.folder, self._on_change, self._master.uri,
                                          _NICENESS, self._variables)
        ended = [report.part for report in self._launched.reports()
                 if report.state in (PartState.FAILED, PartState.STOPPED)]
        playing = [] if self._choice is None else [BAG_PART]
        started, before = [], self._choice
        if before is None or choice != replace(before, window=choice.window):
            started, self._choice = self._launched.change(generate_parts(choice)), choice
        for part in dict.fromkeys((*ended, *playing)):
            if part not in started:
                self._launched.restart(part)

    def stop(self) -> None:
        """Stop everything, and remove what was written."""
        if self._launched is not None:
            self._launched.stop()
        self._launched = self._choice = None
        self._master.stop()
        shutil.rmtree(self._folder, ignore_errors=True)
        self._record.remove()
        self._folder = ''


def _free_port() -> int:
    """Return a port that is free now."""
    with contextlib.closing(socket.socket()) as probe:
        probe.bind(('localhost', 0))
        return int(probe.getsockname()[1])
