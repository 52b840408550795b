# SPDX-License-Identifier: BSD-3-Clause
"""State of launched nodes and of the master: which do not answer, for the window."""
from __future__ import annotations

from typing import Set

from PyQt5.QtCore import QObject, pyqtSignal

from process_visualizer.gui.models.cell.launch_model import LaunchModel
from process_visualizer.launching.cell_watch import CellWatch
from process_visualizer.launching.node_state import NodeState


class WatchModel(QObject):
    """Asks in a thread; ``found`` is delivered in the window's."""

    found = pyqtSignal(object)
    """A CellLook, other than the last one."""

    def __init__(self, launch: LaunchModel) -> None:
        super().__init__(launch)
        self._launch = launch
        self._watch = CellWatch(self._running, self.found.emit)

    def begin(self) -> None:
        """Start asking."""
        self._watch.begin()

    def close(self) -> None:
        """Stop asking."""
        self._watch.close()

    def _running(self) -> Set[str]:
        """The nodes that are up; called in the thread."""
        return {node.name for report in self._launch.reports.values() for node in report.nodes
                if node.state is NodeState.RUNNING}
