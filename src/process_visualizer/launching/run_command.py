"""``cell run``: starts a plan, tells what its nodes do, and stops everything at the end."""
from __future__ import annotations

import shutil
import signal
import sys
import time
from types import FrameType
from typing import Optional

from process_visualizer.generate.plan import LAUNCH_FILE, Plan, write_plan
from process_visualizer.launching.node_state import NodeReport, NodeState
from process_visualizer.launching.run import Run
from process_visualizer.launching.run_record import clean_up_crashed_runs, new_run_folder

_STOP_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


class _StopRequested(Exception):
    """A signal asked for the end."""


def run_plan(plan: Plan, folder: Optional[str]) -> int:
    """Write the plan into the folder (a temporary one without it), run it; the exit code."""
    ended = clean_up_crashed_runs()
    if ended:
        print(f'ended {len(ended)} processes that a crashed run had left')
    output = folder or new_run_folder()
    write_plan(plan, output)
    code = _run(f'{output}/{LAUNCH_FILE}')
    if folder is None and code == 0:
        shutil.rmtree(output, ignore_errors=True)
    return code


class _Reporter:
    """Prints the changes of the nodes' states, and the lines that an operator should see."""

    def __init__(self) -> None:
        self._begin = time.monotonic()

    def report(self, report: NodeReport) -> None:
        self._print(str(report))

    def line(self, line: str) -> None:
        if any(word in line for word in ('[WARN]', '[ERROR]', '[FATAL]', 'ERROR:', 'WARN]')):
            self._print(line)

    def _print(self, text: str) -> None:
        print(f'{time.monotonic() - self._begin:7.2f} s  {text}', flush=True)


def _run(launch_file: str) -> int:
    reporter = _Reporter()
    previous = {number: signal.signal(number, _raise_stop) for number in _STOP_SIGNALS}
    run = Run(launch_file, reporter.report, reporter.line)
    try:
        run.wait()
    except _StopRequested:
        print('stopping all nodes', flush=True)
    finally:
        for number in _STOP_SIGNALS:
            signal.signal(number, signal.SIG_IGN)
        orphans = run.stop()
        for number, handler in previous.items():
            signal.signal(number, handler)
    if orphans:
        print(f'ended {len(orphans)} processes that roslaunch had left')
    return _exit_code(run)


def _raise_stop(_number: int, _frame: Optional[FrameType]) -> None:
    raise _StopRequested


def _exit_code(run: Run) -> int:
    """1 when a required node failed or nothing could be started, else 0."""
    failed = run.failed_required
    if failed is not None and failed.exit_code != 0:
        print(f'the required node {failed}; see {run.log_path}', file=sys.stderr)
        return 1
    states = [report.state for report in run.reports()]
    if not any(state in (NodeState.RUNNING, NodeState.EXITED, NodeState.STARTING)
               for state in states):
        print(f'nothing could be started; see {run.log_path}', file=sys.stderr)
        return 1
    return 0
