# SPDX-License-Identifier: BSD-3-Clause
"""Launches and quits nodes; decides when a launch has ended, and which other nodes prevent one."""
from __future__ import annotations

import os
import shutil
import time
from enum import Enum
from typing import Callable, Collection, Dict, List, Optional, Sequence, Tuple

import rosgraph
from PyQt5.QtCore import QObject, QTimer, pyqtSignal

from process_visualizer.cell.environment import require_environment
from process_visualizer.cell.errors import ConfigurationError, Problem
from process_visualizer.cell.model import Mode, content
from process_visualizer.generate.choice import Choice
from process_visualizer.generate.generator import generate_parts
from process_visualizer.generate.launch_file import recorded_topics
from process_visualizer.generate.plan import BAG_PART, Plan, PlanError
from process_visualizer.gui.session import Session
from process_visualizer.gui.toolkit.tasks import Tasks
from process_visualizer.health.node_history import NodeHistory
from process_visualizer.health.other_publishers import (
    Others,
    described,
    mixture_text,
    others_before,
    others_beside,
)
from process_visualizer.launching.cell_owner import OtherCell, refuse_other_cell
from process_visualizer.launching.launched_cell import LaunchedCell
from process_visualizer.launching.part_report import PartReport
from process_visualizer.launching.run_record import RunRecord, new_run_folder

_LINE = 'launch'
_LOOK_MS = 1000
_MODE_WORDS = {Mode.REALTIME: 'real-time mode', Mode.PLAYBACK: 'playback'}
_END_TIMEOUT_S = 60.0


class LaunchPhase(Enum):
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

    def __init__(self, tasks: Tasks, session: Session, parent: Optional[QObject] = None,
                 clock_s: Callable[[], float] = time.monotonic,
                 watch: Callable[[Sequence[str]], bool] = lambda _topics: False) -> None:
        """Set a function that gives the running recorder other topics; it returns whether it could.

        It may block, and raise PlanError if nothing may be changed.
        """
        super().__init__(parent)
        self._tasks, self._clock_s, self._watch = tasks, clock_s, watch
        self.history = NodeHistory()
        self.folder = new_run_folder()
        self._record = RunRecord()
        self._launched = LaunchedCell(self.folder, self._reported.emit)
        self.phase = LaunchPhase.IDLE
        self._is_starting = False
        self.running: Optional[Choice] = None
        self.reports: Dict[str, PartReport] = {}
        self.warnings: Tuple[Problem, ...] = ()
        self._applied: Tuple[Optional[Choice], Optional[Choice]] = None, None
        self._reported.connect(self._take_report)
        self._timer = QTimer(self, interval=_LOOK_MS)
        self._timer.timeout.connect(self.look)
        self.changed.connect(self._remember)
        self.changed.connect(lambda: session.set_run(self.running, self.is_running, self.reports))

    def prepare(self, then: Callable[[], None] = lambda: None) -> None:
        """End processes of a crashed launcher, and prepare for fast launching."""
        def on_result(ended: List[int]) -> None:
            if ended:
                self.failed.emit(f'A launcher that was not closed properly left {len(ended)} '
                                 'processes behind; they have been ended.')
            then()

        def on_error(error: Exception) -> None:
            self._report_failure(error)
            then()

        self._tasks.run(_LINE, self._prepare, on_result, on_error)

    def launch(self, choice: Choice) -> None:
        """Generate the files of a choice and start everything."""
        self.reports = {}
        self._begin(LaunchPhase.LAUNCHING, choice)
        self._tasks.run(_LINE, lambda: self._start(choice), self._take_plan,
                        lambda error: self._not_changed(error, LaunchPhase.IDLE, None))

    def apply(self, choice: Choice) -> None:
        """Switch to another choice; parts that are the same in both keep running."""
        before = self.running
        self._applied = before, choice
        self._begin(LaunchPhase.LAUNCHING, choice)
        self._tasks.run(_LINE, lambda: self._change(choice, before), self._take_plan,
                        lambda error: self._not_changed(error, LaunchPhase.RUNNING, before))

    @property
    def applied(self) -> str:
        """Return what ``apply`` changed last, in words; '' for nothing."""
        before, after = self._applied
        return '' if before is None or after is None else _difference(before, after)

    def pending(self, choice: Choice) -> str:
        """Return what would change if a choice were applied to the running nodes; '' for nothing.

        The button *Apply* says so.
        """
        if not self.is_running or self.running is None:
            return ''
        return _difference(self.running, choice)

    def adopt(self, choice: Choice) -> None:
        """Adopt a choice whose changes are already in effect; nothing is restarted.

        A part that is restarted later is started from this choice.
        """
        if self.phase is LaunchPhase.RUNNING:
            before, self.running = self.running, choice
            self._tasks.run(_LINE, lambda: self._launched.adopt(_plan(choice)), None,
                            lambda error: self._not_changed(error, LaunchPhase.RUNNING, before))
            self.changed.emit()

    def restart(self, part: str) -> None:
        """Stop and start one part, if it was launched."""
        if part in self.reports:
            self._tasks.run(_LINE, lambda: self._launched.restart(part), None, self._report_failure)

    def quit(self) -> None:
        """Stop everything; `stopped` is emitted at the end."""
        self._begin(LaunchPhase.QUITTING, self.running)
        self._tasks.run(_LINE, self._launched.stop, self._ended, self._not_ended)

    def close(self) -> None:
        """Stop everything and remove the generated files; wait until that is done."""
        self._tasks.run_and_wait(_LINE, self._launched.stop, _END_TIMEOUT_S)
        shutil.rmtree(self.folder, ignore_errors=True)
        self._record.remove()

    @property
    def is_idle(self) -> bool:
        """Return whether nothing runs."""
        return self.phase is LaunchPhase.IDLE

    @property
    def is_running(self) -> bool:
        """Return whether everything has been launched, and nothing is being quit."""
        return self.phase is LaunchPhase.RUNNING

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

    def _change(self, choice: Choice, before: Optional[Choice]) -> Plan:
        plan = _plan(choice)
        keep = [BAG_PART] if before is not None and self._takes_topics(plan, choice, before) else []
        self._launched.change(plan, keep)
        if keep:
            self._launched.adopt(plan)
        return plan

    def _takes_topics(self, plan: Plan, choice: Choice, before: Choice) -> bool:
        """Return whether the running recorder has accepted the topics of other devices.

        Restarted, it would lose what it has in memory, also of the devices that stay.
        """
        is_same = (choice.mode is before.mode is Mode.REALTIME and choice.cell == before.cell
                   and choice.bag_folder == before.bag_folder)
        return (is_same and BAG_PART in plan.parts and BAG_PART in self._launched.differing(plan)
                and self._watch(recorded_topics(choice.devices)))

    def _take_plan(self, plan: Plan) -> None:
        self.warnings = tuple(plan.warnings)
        self.reports = {part: report for part, report in self.reports.items()
                        if part in plan.parts}
        self._is_starting = False
        self._check_whether_up()
        self.changed.emit()

    def look(self) -> None:
        """Check whether parts that are starting still have to be waited for."""
        before = self.phase
        self._check_whether_up()
        if self.phase is not before:
            self.changed.emit()

    def _remember(self) -> None:
        self.history.take(self.reports.values(), self._clock_s())
        if self.phase is not LaunchPhase.LAUNCHING:
            self._timer.stop()
        elif not self._timer.isActive():
            self._timer.start()

    def _check_whether_up(self) -> None:
        """Note that everything is launched, once no part is still starting, failed or not.

        A node that does not start is not waited for.
        """
        is_up = all(self.history.is_up(it, self._clock_s()) for it in self.reports.values())
        if self.phase is LaunchPhase.LAUNCHING and not self._is_starting and is_up:
            self.phase = LaunchPhase.RUNNING

    def _not_changed(self, error: Exception, phase: LaunchPhase, running: Optional[Choice]) -> None:
        """Restore phase and choice, as the nodes run as before, unless everything is being quit."""
        if self.phase is LaunchPhase.LAUNCHING:
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
        self.phase = LaunchPhase.IDLE
        self.changed.emit()
        self.stopped.emit()

    def _begin(self, phase: LaunchPhase, choice: Optional[Choice]) -> None:
        self.phase, self.running = phase, choice
        self._is_starting = phase is LaunchPhase.LAUNCHING
        self.changed.emit()

    def _take_report(self, report: PartReport) -> None:
        if self.phase is not LaunchPhase.IDLE:
            self.reports = {**self.reports, report.part: report}
            self._check_whether_up()
            self.changed.emit()


def _plan(choice: Choice) -> Plan:
    require_environment(choice.cell, choice.mode, [device.name for device in choice.devices])
    return generate_parts(choice)


def _difference(before: Choice, after: Choice) -> str:
    old = {device.name: content(before.in_mode(device)) for device in before.devices}
    new = {device.name: content(after.in_mode(device)) for device in after.devices}
    is_same_mode = before.mode is after.mode
    words = [('start', [name for name in new if name not in old]),
             ('stop', [name for name in old if name not in new]),
             ('restart', [name for name in new if is_same_mode and new[name] != old.get(
                 name, new[name])] + ['the player'] * (before.left_out != after.left_out)),
             ('change to', [] if is_same_mode else [_MODE_WORDS[after.mode]]),
             ('play', [os.path.basename(it) for it in (after.bag,) if it and it != before.bag])]
    if before.cell.file != after.cell.file and not any(names for _, names in words):
        words = [('use', [os.path.basename(after.cell.file)])]
    return '; '.join(f'{word} {", ".join(names)}' for word, names in words if names)


LINE = 'publishers'
PERIOD_MS = 1000


class LaunchGuard(QObject):
    """Asks if other nodes are in the way, and checks again until the question is answered.

    Commands return at once.
    """

    asked = pyqtSignal(str, object)
    """The nodes in the way, and the mode to launch."""
    settled = pyqtSignal()
    """The question no longer needs an answer."""
    changed = pyqtSignal()
    """The guard has started or stopped checking."""

    def __init__(self, tasks: Tasks, launch: Callable[[Choice], None],
                 look: Callable[[Choice], Others] = others_before,
                 parent: Optional[QObject] = None) -> None:
        """``launch`` starts a choice; ``look`` finds nodes in the way, and blocks."""
        super().__init__(parent)
        self._tasks, self._launch, self._look = tasks, launch, look
        self._choice: Optional[Choice] = None
        self._reported = ''
        self._timer = QTimer(self, interval=PERIOD_MS, singleShot=True)
        self._timer.timeout.connect(self._begin_look)

    @property
    def is_waiting(self) -> bool:
        """Return whether a launch is waiting."""
        return self._choice is not None

    @property
    def is_looking(self) -> bool:
        """Return whether it is still unknown if the choice can be launched."""
        return self._choice is not None and not self._reported

    def launch(self, choice: Choice) -> None:
        """Launch a choice, at once if no node is in the way."""
        self.cancel()
        self._choice = choice
        self.changed.emit()
        self._begin_look()

    def launch_all_the_same(self) -> None:
        """Launch in spite of other nodes."""
        choice = self._choice
        self.cancel()
        if choice is not None:
            self._launch(choice)

    def cancel(self) -> None:
        """Cancel the launch."""
        self._choice, self._reported = None, ''
        self._timer.stop()
        self.settled.emit()
        self.changed.emit()

    def _begin_look(self) -> None:
        choice = self._choice
        if choice is not None:
            self._tasks.run(LINE, lambda: self._look(choice),
                            lambda others: self._take(choice, others))

    def _take(self, choice: Choice, others: Others) -> None:
        if choice is not self._choice:
            return  # it was canceled in the meantime
        if not others:
            self.launch_all_the_same()
            return
        text = mixture_text(choice.mode, others)
        if text != self._reported:
            self._reported = text
            self.changed.emit()
            self.asked.emit(text, choice.mode)
        self._timer.start()


class MixtureModel(QObject):
    """Checks for other publishers every second while nodes run; the player reports its own.

    While nodes are launched or quit it does not check: our own previous player may still be there.
    """

    changed = pyqtSignal()
    begun = pyqtSignal()
    """A new publisher has been found."""

    def __init__(self, tasks: Tasks, session: Session,
                 look: Callable[[Choice, Collection[str]], Others] = others_beside,
                 parent: Optional[QObject] = None) -> None:
        """``look`` finds nodes beside those that were launched, and blocks."""
        super().__init__(parent)
        self._tasks, self._session, self._look = tasks, session, look
        self._choice: Optional[Choice] = None
        self._others: Others = ()
        self._player_sentences: Tuple[str, ...] = ()
        self._timer = QTimer(self, interval=PERIOD_MS)
        self._timer.timeout.connect(self._begin_look)
        self._is_looking = False
        session.run_changed.connect(self._follow_run)
        session.player_changed.connect(self._follow_player)

    @property
    def mode(self) -> Optional[Mode]:
        """The mode of the running nodes; None if there are none."""
        return None if self._choice is None else self._choice.mode

    @property
    def sentences(self) -> Tuple[str, ...]:
        """Return who publishes what; empty if there is no mixture."""
        return (*described(self._others), *self._player_sentences)

    def _follow_run(self) -> None:
        choice = self._session.launched
        if choice is self._choice:
            return
        self._choice = choice
        if self.sentences:  # they are about the previous nodes
            self._others, self._player_sentences = (), ()
            self.changed.emit()
        if choice is None:
            self._timer.stop()
        else:
            self._timer.start()

    def _follow_player(self) -> None:
        player = self._session.player
        if player is not None and player.others != self._player_sentences \
                and self._choice is not None:
            self._player_sentences = player.others
            self.changed.emit()

    def _begin_look(self) -> None:
        choice, own = self._choice, frozenset(self._session.nodes)
        if choice is not None and self._session.running is choice and not self._is_looking:
            self._is_looking = True
            self._tasks.run(LINE, lambda: self._look(choice, own),
                            lambda others: self._take(choice, others), self._keep_result)

    def _take(self, choice: Choice, others: Others) -> None:
        self._is_looking = False
        if choice is not self._session.running or others == self._others:
            return
        new, self._others = set(others) - set(self._others), others
        self.changed.emit()
        if new:
            self.begun.emit()

    def _keep_result(self, error: Exception) -> None:
        """Keep the last result: another model reports a master that does not answer."""
        self._is_looking = False
        if not isinstance(error, (rosgraph.MasterException, OSError)):
            raise error
