# SPDX-License-Identifier: BSD-3-Clause
"""Follows the nodes of roslaunch: its output shows starts and ends, the master the rest."""
from __future__ import annotations

import threading
import time
from dataclasses import replace
from typing import Callable, Dict, Iterable, List, Optional

from process_visualizer.launching.log_tail import LogTail, last_lines
from process_visualizer.launching.node_state import NodeReport, NodeState
from process_visualizer.launching.ros_api import is_registered
from process_visualizer.launching.roslaunch_output import (
    ProcessEvent,
    exit_code_in,
    parse_line,
    plain,
    stdout_file_in,
)

_CHECK_PERIODS_S = 0.05, 0.25
_ASKING_SHARE = 0.1  # of the time, at most, unless the longest period is over

OnReport = Callable[[NodeReport], None]
OnLine = Callable[[str], None]


class NodeWatcher:
    """Calls ``on_report`` at every change of a node's state and ``on_line`` with every line.

    ``watch`` reads the output in the calling thread until it ends; the master is asked in another
    thread, and only while a node is starting.
    """

    def __init__(self, on_report: OnReport, on_line: OnLine,
                 master_uri: Optional[str] = None) -> None:
        self._on_report = on_report
        self._on_line = on_line
        self._master_uri = master_uri
        self._lock = threading.Lock()
        self._reports: Dict[str, NodeReport] = {}
        self._starting = threading.Event()
        self._ended = threading.Event()
        self._required: Optional[str] = None
        self._ended_last: Optional[str] = None
        self._tail = LogTail()
        self.failed_required: Optional[NodeReport] = None

    def reports(self) -> List[NodeReport]:
        """The latest report of every node."""
        with self._lock:
            return list(self._reports.values())

    def watch(self, output: Iterable[str]) -> None:
        """Follow the output of roslaunch until its end."""
        asker = threading.Thread(target=self._ask_master, name='ask master', daemon=True)
        asker.start()
        for line in output:
            text = plain(line)
            self._on_line(text)
            self._follow(text)
        self._ended.set()
        self._starting.set()
        asker.join()

    def _follow(self, line: str) -> None:
        event = parse_line(line)
        if event is not None:
            self._take(event)
            if event.rest:
                self._tail.add(event.rest)
        elif self._required is not None:
            self._take_required_exit(line)
        elif self._ended_last is not None:
            self._take_log_file(line)
        else:
            self._tail.add(line)

    def _take(self, event: ProcessEvent) -> None:
        if event.kind == 'started':
            self._change(event.name, lambda report: report.started())
            self._starting.set()
        elif event.kind == 'exited':
            self._exited(event.name, event.exit_code)
        elif event.kind == 'cannot_launch':
            self._change(event.name, lambda report: report.failed(event.reason))
        elif event.kind == 'required_died':
            self._required = event.name

    def _exited(self, name: str, exit_code: int) -> NodeReport:
        self._ended_last = name
        return self._change(name, lambda report: report.exited(exit_code, self._tail.lines()))

    def _take_required_exit(self, line: str) -> None:
        """The exit code of a required process is on a separate line."""
        code = exit_code_in(line)
        if code is None and 'process has finished cleanly' in line:
            code = 0
        if code is not None and self._required is not None:
            self.failed_required = self._exited(self._required, code)
            self._required = None

    def _take_log_file(self, line: str) -> None:
        """The next line of roslaunch names the log file of a node that has ended."""
        path, name, self._ended_last = stdout_file_in(line), self._ended_last, None
        if path is None or name is None:
            self._tail.add(line)
            return
        tail = self._tail.after(last_lines(path))
        report = self._change(name, lambda report: replace(report, log_tail=tail))
        if self.failed_required is not None and self.failed_required.name == name:
            self.failed_required = report

    def _change(self, name: str, change: Callable[[NodeReport], NodeReport]) -> NodeReport:
        with self._lock:
            before = self._reports.get(name)
            after = change(before or NodeReport(name))
            self._reports[name] = after
        if after != before:
            self._on_report(after)
        return after

    def _ask_master(self) -> None:
        """Ask which of the starting nodes have registered; seldom if there are many."""
        while not self._ended.is_set():
            self._starting.wait()
            self._starting.clear()  # before looking, so that no start in between is missed
            begin_s = time.monotonic()
            names = [report.name for report in self.reports()
                     if report.state is NodeState.STARTING]
            if names:
                self._starting.set()
            for name in names:
                if is_registered(name, self._master_uri):
                    self._change(name, lambda report: report.registered())
            self._ended.wait(_pause_s(time.monotonic() - begin_s))


def _pause_s(asking_s: float) -> float:
    """Return how long to wait after asking for so long."""
    shortest_s, longest_s = _CHECK_PERIODS_S
    return min(max(asking_s / _ASKING_SHARE, shortest_s), longest_s)
