# SPDX-License-Identifier: BSD-3-Clause
"""Launches and quits the nodes of a choice, and follows their states."""
from __future__ import annotations

import shutil
from enum import Enum
from typing import Callable, Dict, List, Optional, Tuple

from PyQt5.QtCore import QObject, pyqtSignal

from process_visualizer.cell.environment import check_environment
from process_visualizer.cell.errors import ConfigurationError, Problem
from process_visualizer.generate.choice import Choice
from process_visualizer.generate.generator import generate_parts
from process_visualizer.generate.plan import Plan, PlanError
from process_visualizer.gui.toolkit.tasks import Tasks
from process_visualizer.launching.launched_cell import LaunchedCell
from process_visualizer.launching.other_cell import OtherCell, refuse_other_cell
from process_visualizer.launching.part_report import PartReport, PartState
from process_visualizer.launching.run_record import RunRecord, new_run_folder

_LINE = 'launch'
_END_TIMEOUT_S = 60.0


class Phase(Enum):
    """The state of the nodes as a whole."""

    IDLE = 'idle'
    LAUNCHING = 'launching'
    RUNNING = 'running'
    QUITTING = 'quitting'


class LaunchModel(QObject):
    """Commands return at once; they are carried out in one line of tasks, in order."""

    changed = pyqtSignal()
    failed = pyqtSignal(str)
    problems_found = pyqtSignal(object)
    """The configuration cannot be launched here: a list of problems."""
    stopped = pyqtSignal()
    """Every node has ended."""
    _reported = pyqtSignal(object)

    def __init__(self, tasks: Tasks, parent: Optional[QObject] = None) -> None:
        super().__init__(parent)
        self._tasks = tasks
        self.folder = new_run_folder()
        self._record = RunRecord()
        self._launched = LaunchedCell(self.folder, self._reported.emit)
        self.phase = Phase.IDLE
        self._is_starting = False
        self.running: Optional[Choice] = None
        self.reports: Dict[str, PartReport] = {}
        self.warnings: Tuple[Problem, ...] = ()
        self._reported.connect(self._take_report)

    def prepare(self, then: Callable[[], None] = lambda: None) -> None:
        """End processes of a crashed launcher, and prepare for fast launching."""
        def on_result(ended: List[int]) -> None:
            self._report_clean_up(ended)
            then()

        def on_error(error: Exception) -> None:
            self._report_failure(error)
            then()

        self._tasks.run(_LINE, self._prepare, on_result, on_error)

    def launch(self, choice: Choice) -> None:
        """Generate the files of a choice and start everything."""
        self.reports = {}
        self._begin(Phase.LAUNCHING, choice)
        self._tasks.run(_LINE, lambda: self._start(choice), self._take_plan, self._not_launched)

    def apply(self, choice: Choice) -> None:
        """Switch to another choice; parts that are the same in both keep running."""
        before = self.running
        self._begin(Phase.LAUNCHING, choice)
        self._tasks.run(_LINE, lambda: self._change(choice), self._take_plan,
                        lambda error: self._not_changed(error, Phase.RUNNING, before))

    def restart(self, part: str) -> None:
        """Stop and start one part, if it was launched."""
        if part in self.reports:
            self._tasks.run(_LINE, lambda: self._launched.restart(part), None, self._report_failure)

    def quit(self) -> None:
        """Stop everything; `stopped` is emitted at the end."""
        self._begin(Phase.QUITTING, self.running)
        self._tasks.run(_LINE, self._launched.stop, self._ended, self._not_ended)

    def close(self) -> None:
        """Stop everything and remove the generated files; wait until that is done."""
        self._tasks.run_and_wait(_LINE, self._launched.stop, _END_TIMEOUT_S)
        shutil.rmtree(self.folder, ignore_errors=True)
        self._record.remove()

    @property
    def is_idle(self) -> bool:
        """Return whether nothing runs."""
        return self.phase is Phase.IDLE

    @property
    def is_running(self) -> bool:
        """Return whether everything has been launched, and nothing is being quit."""
        return self.phase is Phase.RUNNING

    def _prepare(self) -> List[int]:
        ended = self._launched.prepare()
        self._record.write(self.folder)
        return ended

    def _start(self, choice: Choice) -> Plan:
        plan = _plan(choice)
        if not self._launched.reports():  # nothing that runs is ours
            refuse_other_cell()
        self._launched.start(plan)
        return plan

    def _change(self, choice: Choice) -> Plan:
        plan = _plan(choice)
        self._launched.change(plan)
        return plan

    def _take_plan(self, plan: Plan) -> None:
        self.warnings = tuple(plan.warnings)
        self.reports = {part: report for part, report in self.reports.items()
                        if part in plan.parts}
        self._is_starting = False
        self._look_whether_up()
        self.changed.emit()

    def _look_whether_up(self) -> None:
        """Everything is launched when no part is starting any more, failed or not."""
        starting = any(report.state is PartState.STARTING for report in self.reports.values())
        if self.phase is Phase.LAUNCHING and not self._is_starting and not starting:
            self.phase = Phase.RUNNING

    def _not_launched(self, error: Exception) -> None:
        self._not_changed(error, Phase.IDLE, None)

    def _not_changed(self, error: Exception, phase: Phase, running: Optional[Choice]) -> None:
        """The nodes keep running as before, unless everything is being quit."""
        if self.phase is Phase.LAUNCHING:
            self.phase, self.running, self._is_starting = phase, running, False
        if isinstance(error, ConfigurationError):
            self.problems_found.emit(list(error.problems))
        else:
            self._report_failure(error)
        self.changed.emit()

    def _report_failure(self, error: Exception) -> None:
        if not isinstance(error, (OSError, PlanError, OtherCell)):
            raise error
        self.failed.emit(str(error))

    def _not_ended(self, error: Exception) -> None:
        self._ended(None)
        self._report_failure(error)

    def _ended(self, _nothing: object) -> None:
        self.running, self.reports, self.warnings = None, {}, ()
        self.phase = Phase.IDLE
        self.changed.emit()
        self.stopped.emit()

    def _begin(self, phase: Phase, choice: Optional[Choice]) -> None:
        self.phase, self.running = phase, choice
        self._is_starting = phase is Phase.LAUNCHING
        self.changed.emit()

    def _take_report(self, report: PartReport) -> None:
        if self.phase is not Phase.IDLE:
            self.reports = {**self.reports, report.part: report}
            self._look_whether_up()
            self.changed.emit()

    def _report_clean_up(self, ended: List[int]) -> None:
        if ended:
            self.failed.emit(f'A launcher that was not closed properly left {len(ended)} '
                             'processes behind; they have been ended.')


def _plan(choice: Choice) -> Plan:
    problems = check_environment(choice.cell, choice.mode,
                                 [device.name for device in choice.devices])
    if problems:
        raise ConfigurationError(problems)
    return generate_parts(choice)
