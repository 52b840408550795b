# SPDX-License-Identifier: BSD-3-Clause
"""The command ``cell run``: starts a plan, reports node states, stops everything at the end."""
from __future__ import annotations

import os
import shutil
import sys
import time
from typing import Optional, Set

from process_visualizer.cell.model import Mode
from process_visualizer.generate.choice import Choice, RvizStart
from process_visualizer.generate.plan import LAUNCH_FILE, Plan, write_plan
from process_visualizer.health.alarm_board import AlarmBoard
from process_visualizer.health.alarm_conditions import part_of_node, watch_conditions
from process_visualizer.health.node_warnings import OVER
from process_visualizer.health.other_publishers import (
    Others,
    PublisherWatch,
    explanation,
    others_beside,
)
from process_visualizer.interrupts import StopRequested, StopSignals
from process_visualizer.launching.cell_owner import refuse_other_cell
from process_visualizer.launching.cell_watch import CellLook, CellWatch
from process_visualizer.launching.part_report import NodeReport, NodeState
from process_visualizer.launching.real_time_advice import give_real_time_advice
from process_visualizer.launching.ros_master import RosMaster
from process_visualizer.launching.roslaunch_process import (
    Start,
    is_for_this_computer,
    start_for_this_computer,
    start_roslaunch,
)
from process_visualizer.launching.run import MASTER, LaunchRun, last_lines
from process_visualizer.launching.run_record import (
    RunRecord,
    clean_up_crashed_runs,
    require_log_folder,
)
from process_visualizer.launching.x_display import require_display
from process_visualizer.remote.link_words import (
    HOW_TO_WATCH,
    not_this_computer,
    unnamed_here,
)
from process_visualizer.shown_text import say

_SHOWN = ('[WARN]', '[ERROR]', '[FATAL]', 'ERROR:', 'WARN]', OVER, HOW_TO_WATCH)
_NODE_TAIL = 6  # last lines shown of a failed required node
_LOG_TAIL = 20  # last lines shown of roslaunch if it could start nothing


def run_plan(plan: Plan, folder: Optional[str], choice: Choice) -> int:
    """Write the plan into a folder (default: a temporary one) and run it; return the exit code.

    ``choice`` is the choice from which the plan was generated.

    Raises:
        OtherCell: another cell is running on the master.
        NoDisplay: RViz cannot be shown.
    """
    ended = clean_up_crashed_runs()
    if ended:
        say(f'ended {len(ended)} processes that a crashed run had left')
    wrong_address = not_this_computer(os.environ)
    if wrong_address is not None:
        say(wrong_address)
    if choice.cell.machines and choice.mode is Mode.REALTIME:
        note = unnamed_here(os.environ)
        if note is not None:
            say(f'note: {note}')
    refuse_other_cell()
    require_log_folder()
    if choice.rviz is not RvizStart.NONE:
        require_display('; or add --no-rviz')
    give_real_time_advice(print)
    if folder is not None:
        write_plan(plan, folder)
        return _run(f'{folder}/{LAUNCH_FILE}', choice)
    record = RunRecord()
    output = record.begin()  # recorded: if this process is killed, the next start removes it
    write_plan(plan, output)
    code = _run(f'{output}/{LAUNCH_FILE}', choice)
    if code == 0:  # otherwise the message names the log in it, and the next start removes it
        shutil.rmtree(output, ignore_errors=True)
        record.remove()
    return code


class _Reporter:
    """Prints changes of node states, and the lines that an operator should see.

    Findings of the watch are reported as alarms, in the same words as in the launcher.
    """

    def __init__(self, choice: Choice) -> None:
        self._begin = time.monotonic()
        self._choice, self._board = choice, AlarmBoard()

    def report(self, report: NodeReport) -> None:
        self._print(str(report))

    def line(self, line: str) -> None:
        if any(word in line for word in _SHOWN):
            self._print(line)

    def others(self, others: Others) -> None:
        """Report other nodes whose messages would mix with those of the cell."""
        if others:
            self._print(f'[WARN] {explanation(self._choice.mode, others)}')

    def look(self, look: CellLook) -> None:
        """Report nodes that have stopped answering, and those that answer again."""
        parts = {name: part_of_node(name, self._choice) for name in look.silent}
        count = len(self._board.events)
        self._board = self._board.seen(watch_conditions(self._choice.mode, look, parts),
                                       time.monotonic())
        for event in self._board.events[count:]:
            self._print(f'[WARN] {event.text}')

    def _print(self, text: str) -> None:
        say(f'{time.monotonic() - self._begin:7.2f} s  {text}')


def _run(launch_file: str, choice: Choice) -> int:
    reporter, is_stopped = _Reporter(choice), False
    with StopSignals() as signals:
        run = LaunchRun(launch_file, reporter.report, reporter.line, start=_start_of(choice))
        watch = PublisherWatch(
            lambda: others_beside(choice, {report.name for report in run.reports()}),
            reporter.others)
        nodes = CellWatch(lambda: nodes_to_ask(run), reporter.look)
        try:
            watch.begin()
            nodes.begin()
            with signals.raised():
                run.wait()
        except StopRequested:
            is_stopped = True
            say('stopping all nodes')
        finally:
            watch.close()
            nodes.close()
            orphans = run.stop(say)
    if orphans:
        say(f'ended {len(orphans)} processes that roslaunch had left')
    return exit_code(run, is_stopped)


def nodes_to_ask(run: LaunchRun) -> Set[str]:
    """Return the nodes that should answer; none while roslaunch is stopping all nodes."""
    if run.failed_required is not None:
        return set()
    return {it.name for it in run.reports() if it.state is NodeState.RUNNING}


def _start_of(choice: Choice) -> Start:
    """Return the start for this computer only if roslaunch starts the master and may do so."""
    is_local = is_for_this_computer(RosMaster().uri, os.environ) \
        and not choice.cell.machines and not RosMaster().is_online()
    return start_for_this_computer if is_local else start_roslaunch


def exit_code(run: LaunchRun, is_stopped: bool = False) -> int:
    """Return 1 if a required node failed, or roslaunch was killed or started nothing, else 0.

    If the operator stopped it, it does not matter whether anything had started.
    """
    if run.killed_by:
        say(f'roslaunch was {run.killed_by}, and all nodes were ended; start the cell again, and '
            f'see {run.log_path}', file=sys.stderr)
        return 1
    failed = run.failed_required
    if failed is not None and failed.name == MASTER:
        say(f'the ROS master is gone ({failed.end_words}), and all nodes were ended; see '
            f'{run.log_path}, and start the cell again', file=sys.stderr)
        return 1
    if failed is not None and failed.exit_code != 0:
        tail = ''.join(f'\n  {line}' for line in failed.log_tail[-_NODE_TAIL:] if line)
        say(f'the required node {failed}; see {run.log_path}{tail and ", which ends:" + tail}',
            file=sys.stderr)
        return 1
    states = [report.state for report in run.reports()]
    if not is_stopped and not any(state in (NodeState.RUNNING, NodeState.EXITED, NodeState.STARTING)
               for state in states):
        tail = ''.join(f'\n  {line}' for line in last_lines(run.log_path)[-_LOG_TAIL:] if line)
        say(f'nothing could be started; the end of {run.log_path}:{tail}', file=sys.stderr)
        return 1
    return 0
