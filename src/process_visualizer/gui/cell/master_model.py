# SPDX-License-Identifier: BSD-3-Clause
"""The ROS master, found or started, and watched; and the watch over all nodes."""
from __future__ import annotations

from typing import Optional, Set

from PyQt5.QtCore import QObject, QTimer, pyqtSignal

from process_visualizer.gui.cell.launch_model import LaunchModel
from process_visualizer.gui.ros.ros_link import RosLink, RosLinkError
from process_visualizer.gui.toolkit.tasks import Tasks
from process_visualizer.launching.cell_watch import CellWatch
from process_visualizer.launching.part_report import NodeState
from process_visualizer.launching.ros_master import RosMaster, RosMasterError

_LINE = 'master'
_FAREWELL_LINE = 'farewell'
_FAREWELL_TIMEOUT_S = 5.0
"""A master that hangs does not answer when the node unregisters."""
_CHECK_PERIOD_MS = 1000
_END_TIMEOUT_S = 60.0
_MAX_FAILURES = 3
"""Most failed checks in a row; a busy master may miss one."""
_SILENT = 'The ROS master is not responding'
_OTHER = 'The ROS master was started anew'


class MasterModel(QObject):
    """Connects the launcher to the master, and reports when it is gone or hangs.

    If there is none at the start, it connects as soon as there is.
    ``problem`` says why it is not connected, while ``is_connected`` is False. ``is_other`` if
    another master answers in place of the one that is lost: that knows no node that runs, not even
    the launcher's own, which can only start again.
    """

    connected = pyqtSignal()
    failed = pyqtSignal(str)
    lost = pyqtSignal()
    """It does not answer, or (which may come later) another one does; see ``problem``."""
    returned = pyqtSignal()
    """The master that was lost answers again."""

    def __init__(self, tasks: Tasks, link: RosLink, parent: Optional[QObject] = None,
                 master: Optional[RosMaster] = None) -> None:
        super().__init__(parent)
        self._tasks, self._link = tasks, link
        self._master = master or RosMaster()
        self._process_id: Optional[int] = None
        self._failures = 0
        self._is_checking = False
        self._timer = QTimer(self)
        self._timer.setInterval(_CHECK_PERIOD_MS)
        self._timer.timeout.connect(self._check)
        self.is_connected = self.is_connecting = self.is_lost = self.is_other = False
        self._is_awaited = False
        self.problem = 'The ROS master is not running yet'

    def connect_to_master(self) -> None:
        """Use the running master, or start one, and become its node."""
        self.is_connecting, self._is_awaited = True, False

        def begin() -> None:
            self._master.ensure()
            self._link.begin()

        self._tasks.run(_LINE, begin, self._take_connection, self._report_failure)

    def close(self) -> None:
        """Leave the master, and end it if it was started here; block."""
        self._timer.stop()
        self._tasks.run_and_wait(_FAREWELL_LINE, self._link.end, _FAREWELL_TIMEOUT_S)
        self._tasks.run_and_wait(_LINE, self._master.stop, _END_TIMEOUT_S)

    def _take_connection(self, _nothing: object) -> None:
        self.is_connected, self.is_connecting = True, False
        self._timer.start()
        self.connected.emit()

    def _check(self) -> None:
        if self.is_connecting:
            return
        if self._is_checking:  # a master that hangs does not answer at all
            if not self._is_awaited:
                self._count(None)
            return
        self._is_checking = True
        self._tasks.run(_LINE, self._master.process_id, self._take_check)

    def _take_check(self, process_id: Optional[int]) -> None:
        self._is_checking = False
        if self._is_awaited:
            if process_id is not None:
                self.connect_to_master()
            return
        self._process_id = self._process_id or process_id
        self._count(process_id)

    def _count(self, answered: Optional[int]) -> None:
        """Take the process id of the master that has answered, if one has."""
        is_known = answered is not None and answered == self._process_id
        self._failures = 0 if is_known else self._failures + 1
        if is_known and self.is_lost:
            self.is_connected, self.is_lost, self.is_other = True, False, False
            self.returned.emit()
        elif self._failures >= _MAX_FAILURES and not self.is_other and (
                self.is_connected or answered is not None):
            self.is_connected, self.is_lost, self.is_other = False, True, answered is not None
            self.problem = _OTHER if self.is_other else _SILENT
            self.lost.emit()

    def _report_failure(self, error: Exception) -> None:
        self.is_connecting = False
        if not isinstance(error, (RosMasterError, RosLinkError)):
            raise error
        self.problem = str(error)
        if isinstance(error, RosMasterError):  # it may be started later
            self._is_awaited = True
            self._timer.start()
        self.failed.emit(self.problem)


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
        return {node.name for report in self._launch.reports.values()
                if report.state is not PartState.STOPPING
                for node in report.nodes if node.state is NodeState.RUNNING}
