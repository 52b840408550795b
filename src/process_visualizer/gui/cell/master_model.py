# SPDX-License-Identifier: BSD-3-Clause
"""Decides when the ROS master counts as lost, and when RViz counts as slow or hanging."""
from __future__ import annotations

from dataclasses import replace
from typing import Optional, Set

from PyQt5.QtCore import QObject, QTimer, pyqtSignal

from process_visualizer.gui.cell.launch_model import LaunchModel
from process_visualizer.gui.ros.ros_link import RosLink, RosLinkError
from process_visualizer.gui.toolkit.tasks import Tasks
from process_visualizer.launching.cell_watch import CellLook, CellWatch
from process_visualizer.launching.part_report import NodeState, PartState
from process_visualizer.launching.ros_master import RosMaster, RosMasterError
from process_visualizer.ros_names import RVIZ

_LINE = 'master'
_FAREWELL_LINE = 'farewell'
_FAREWELL_TIMEOUT_S = 5.0
"""Limit of unregistering the node [s]; a master that hangs does not answer."""
_CHECK_PERIOD_MS = 1000
_END_TIMEOUT_S = 60.0
_MAX_FAILURES = 3
"""Failed checks in a row until the master counts as lost; a busy master may miss one."""
_DRAWING_LOOK_MS = 500
_MAX_MISSED_LOOKS = 12
"""Missed looks until RViz counts as hanging. It reports drawing twice a second, but on a busy
computer a picture may take seconds, as at the start of a second cell."""
_SLOW_LOOKS, _CALM_LOOKS = 4, 20
"""Missed looks from which on RViz counts as slow, and looks until it no longer does."""
_SILENT = 'The ROS master is not responding'
_OTHER = 'The ROS master was restarted'


class MasterModel(QObject):
    """Connects the launcher to the master, and reports when the master is gone or hangs.

    Without a master at the start, it connects as soon as there is one. ``problem`` says why it is
    not connected, while ``is_connected`` is False. ``is_other`` if another master answers in place
    of the lost one: that one knows none of the running nodes, not even the launcher's own, and the
    launcher can only start again.
    """

    connected = pyqtSignal()
    failed = pyqtSignal(str)
    lost = pyqtSignal()
    """The master does not answer, or (perhaps later) another one does; see ``problem``."""
    returned = pyqtSignal()
    """The lost master answers again."""

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
        """Count failed checks, given the process ID of the master that answered, if one did."""
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
        if isinstance(error, RosMasterError):  # a master may be started later
            self._is_awaited = True
            self._timer.start()
        self.failed.emit(self.problem)


class WatchModel(QObject):
    """Asks all nodes in a thread; ``found`` is delivered in the window's thread.

    RViz answers requests in one thread and draws in another. If the drawing thread hangs, the
    picture freezes and can show no text, so RViz must also report that it draws. A missing
    report is counted in looks, not in seconds: a window that hung itself has missed nothing.
    """

    found = pyqtSignal(object)
    """A CellLook that differs from the last one."""
    slowed = pyqtSignal()
    """RViz draws more slowly, or quickly enough again; see ``picture_age_s``."""
    _asked = pyqtSignal(object)

    def __init__(self, launch: LaunchModel) -> None:
        super().__init__(launch)
        self._launch = launch
        self._watch = CellWatch(self._running, self._asked.emit)
        self._look = self._reported = CellLook()
        self._asked.connect(self._take_look)
        self._draws = False  # RViz has reported that it draws since it was started
        self._missed = self._calm = self._slow = 0
        self._timer = QTimer(self, interval=_DRAWING_LOOK_MS)
        self._timer.timeout.connect(self.look_at_drawing)

    @property
    def picture_age_s(self) -> float:
        """Age of RViz's picture just before the next one [s]; 0 if it draws quickly enough."""
        return self._slow * _DRAWING_LOOK_MS / 1000.0

    @property
    def draws_again(self) -> bool:
        """True when RViz, which was slow shortly before, draws quickly enough."""
        return self._slow > 0 and self._calm > _SLOW_LOOKS

    def take_drawing(self) -> None:
        """Note that RViz has reported that it draws."""
        self._draws, self._missed = True, 0

    def look_at_drawing(self) -> None:
        """Check whether RViz has reported anything since the last look."""
        if f'/{RVIZ}' in self._running():
            self._missed += 1
        else:
            self._draws, self._missed = False, 0
        self._look_at_pace()
        self._report()

    def _look_at_pace(self) -> None:
        before = self._slow, self.draws_again
        self._calm = 0 if self._missed >= _SLOW_LOOKS else self._calm + 1
        hangs = self._missed > _MAX_MISSED_LOOKS  # which is reported instead
        if not self._draws or hangs or self._calm > _CALM_LOOKS:
            self._slow = 0
        elif self._missed >= _SLOW_LOOKS:
            self._slow = max(self._slow, self._missed)
        if (self._slow, self.draws_again) != before:
            self.slowed.emit()

    def _take_look(self, look: CellLook) -> None:
        self._look = look
        self._report()

    def _report(self) -> None:
        stands_still = self._draws and self._missed > _MAX_MISSED_LOOKS
        silent = self._look.silent | {f'/{RVIZ}'} if stands_still else self._look.silent
        look = replace(self._look, silent=silent)
        if look != self._reported:
            self._reported = look
            self.found.emit(look)

    def begin(self) -> None:
        """Start asking."""
        self._watch.begin()
        self._timer.start()

    def close(self) -> None:
        """Stop asking."""
        self._watch.close()
        self._timer.stop()

    def _running(self) -> Set[str]:
        """Return the nodes that are up; also called in the thread."""
        return {node.name for report in self._launch.reports.values()
                if report.state is not PartState.STOPPING
                for node in report.nodes if node.state is NodeState.RUNNING}
