# SPDX-License-Identifier: BSD-3-Clause
"""One run of a generated launch file, from its start to the end of all its processes."""
from __future__ import annotations

import contextlib
import re
import threading
import time
from collections import deque
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Callable, Deque, Dict, Iterable, List, Optional, Tuple, Union

from process_visualizer.launching.part_report import NodeReport, NodeState, exit_words
from process_visualizer.launching.ros_api import forget_ended, is_registered
from process_visualizer.launching.roslaunch_process import (
    RoslaunchProcess,
    Start,
    far_computers,
    start_roslaunch,
)
from process_visualizer.launching.run_record import RunRecord

# Parsing of roslaunch's output about its processes (ros_comm 1.14 to 1.16).

_CONTROL = re.compile(r'\x1b\[[0-9;]*m|\x1b\]2;.*?\x07')
_PROCESS = r'\[(?P<name>[^\[\]]+)-\d+\]'
_STARTED = re.compile(r'process' + _PROCESS + r': started with pid \[(?P<pid>\d+)\]')
_DIED = re.compile(_PROCESS + r' process has died \[pid \d+, exit code (?P<code>-?\d+)')
_FINISHED = re.compile(_PROCESS + r' process has finished cleanly')
_REQUIRED = re.compile(r'REQUIRED process \[(?P<name>[^\[\]]+?)(-\d+)?\] has died!')
MASTER = '/master'
"""The name, without a number, in roslaunch's reports about a ROS master that it has started."""
_UNLOCATED = re.compile(r'ERROR: cannot launch node of type \[(?P<type>[^\]]*)\]: (?P<why>.*)')
_LOG_FILE = re.compile(r'log file: (?P<path>/.*)\*\.log')
_EXIT_CODE = re.compile(r'process has died \[pid \d+, exit code (?P<code>-?\d+)')


@dataclass(frozen=True)
class LaunchEvent:
    """An event of a process, from one line; ``name`` is the node's absolute name.

    ``kind`` is started, exited, required_died or cannot_launch (then ``name`` is package/type).
    ``rest`` is output of the node within roslaunch's line about its start.
    """

    kind: str
    name: str
    exit_code: int = 0
    reason: str = ''
    rest: str = ''


def plain(line: str) -> str:
    """Return the line without colors, window titles and the line end."""
    return _CONTROL.sub('', line).rstrip()


def parse_line(line: str) -> Optional[LaunchEvent]:
    """Return the event that a plain line reports, or None."""
    match = _STARTED.search(line)
    if match:
        return LaunchEvent('started', '/' + match['name'], rest=line[match.end():])
    match = _REQUIRED.search(line)
    if match:
        return LaunchEvent('required_died', '/' + match['name'])
    match = _DIED.search(line)
    if match:
        return LaunchEvent('exited', '/' + match['name'], int(match['code']))
    match = _FINISHED.search(line)
    if match:
        return LaunchEvent('exited', '/' + match['name'])
    match = _UNLOCATED.search(line)
    if match:
        return LaunchEvent('cannot_launch', match['type'], reason=match['why'])
    return None


def stdout_file_in(line: str) -> Optional[str]:
    """Return the stdout file of a node that logs to a file, from the line after its end."""
    match = _LOG_FILE.fullmatch(line)
    return f'{match["path"]}-stdout.log' if match else None


def exit_code_in(line: str) -> Optional[int]:
    """Return the exit code in the line after the report about a required process."""
    match = _EXIT_CODE.search(line)
    return int(match['code']) if match else None


TAIL_LINES = 20
_TAIL_BYTES = 1 << 14


class LogTail:
    """Remembers the last lines of an output that several processes share."""

    def __init__(self) -> None:
        self._lines: Deque[str] = deque(maxlen=TAIL_LINES)

    def add(self, line: str) -> None:
        """Append a line."""
        self._lines.append(line)

    def lines(self) -> Tuple[str, ...]:
        """Return the lines, the newest last."""
        return tuple(self._lines)

    def after(self, earlier: Tuple[str, ...]) -> Tuple[str, ...]:
        """Return half of the lines of another log, if it has any, followed by half of these.

        A node's standard output goes to its log file, but its standard error to this one.
        """
        half = TAIL_LINES // 2
        return (*earlier[-half:], *self.lines()[-half:]) if earlier else self.lines()


def last_lines(path: Union[str, Path]) -> Tuple[str, ...]:
    """Return the last lines of a file; none if it cannot be read."""
    try:
        with Path(path).open('rb') as file:
            size = file.seek(0, 2)
            file.seek(max(0, size - _TAIL_BYTES))
            text = file.read().decode('utf-8', 'replace')
    except OSError:
        return ()
    return tuple(plain(line) for line in text.splitlines()[-TAIL_LINES:])


_CHECK_PERIODS_S = 0.05, 0.25
_ASKING_SHARE = 0.1  # maximum share of the time spent on questions, except at the longest period

OnReport = Callable[[NodeReport], None]
OnLine = Callable[[str], None]


class NodeWatcher:
    """Calls ``on_report`` at every change of a node's state and ``on_line`` for every line.

    ``watch`` reads the output to its end in the calling thread; another thread asks the master,
    but only while a node is starting, and when one has ended, because another node may have taken
    its name.
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
        self._just_ended: List[str] = []
        self._tail = LogTail()
        self.failed_required: Optional[NodeReport] = None

    def reports(self) -> List[NodeReport]:
        """Return the latest report of every node."""
        with self._lock:
            return list(self._reports.values())

    def watch(self, output: Iterable[str]) -> None:
        """Follow the output of roslaunch to its end."""
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

    def _take(self, event: LaunchEvent) -> None:
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
        report = self._change(name, lambda report: report.exited(exit_code, self._tail.lines()))
        with self._lock:
            self._just_ended.append(name)
        self._starting.set()
        return report

    def _take_required_exit(self, line: str) -> None:
        """Read the exit code of a required process from its separate line."""
        code = exit_code_in(line)
        if code is None and 'process has finished cleanly' in line:
            code = 0
        if code is not None and self._required is not None:
            self.failed_required = self._exited(self._required, code)
            self._required = None

    def _take_log_file(self, line: str) -> None:
        """Read the log file of an ended node from roslaunch's next line."""
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
        """Ask the master which starting nodes have registered; less often if there are many."""
        while True:
            self._starting.wait()
            self._starting.clear()  # before reading the states, so that no start is missed
            is_over = self._ended.is_set()  # read this before the last check of ended nodes
            begin_s = time.monotonic()
            self._look_for_namesakes()
            if is_over:
                return
            names = [report.name for report in self.reports()
                     if report.state is NodeState.STARTING]
            if names:
                self._starting.set()
            for name in names:
                if is_registered(name, self._master_uri):
                    self._change(name, lambda report: report.registered())
            self._ended.wait(_pause_s(time.monotonic() - begin_s))

    def _look_for_namesakes(self) -> None:
        """Note which nodes have ended because another node took their name."""
        with self._lock:
            names, self._just_ended = self._just_ended, []
        for name in names:
            if is_registered(name, self._master_uri):
                self._change(name, lambda report: report.replaced())


def _pause_s(asking_s: float) -> float:
    """Return the pause [s] after a round of questions that took ``asking_s``."""
    shortest_s, longest_s = _CHECK_PERIODS_S
    return min(max(asking_s / _ASKING_SHARE, shortest_s), longest_s)


LOG_FILE = 'roslaunch.log'
_LAST_LINES_TIMEOUT_S = 1.0


class LaunchRun:
    """Runs a launch file; callbacks are called from a thread of the run, never from the caller's.

    Create it in a thread that lives as long as the program (the main thread): the kernel interrupts
    roslaunch when its starting thread ends. ``on_end`` is called after the last report, with the
    exit code of roslaunch (negative: the signal that ended it).
    """

    def __init__(self, launch_file: str, on_report: Callable[[NodeReport], None],
                 on_line: Callable[[str], None] = lambda line: None,
                 on_end: Callable[[int], None] = lambda code: None,
                 log_file: str = LOG_FILE, start: Start = start_roslaunch,
                 master_uri: Optional[str] = None) -> None:
        """Start roslaunch; ``log_file`` is written beside the launch file.

        ``master_uri`` is set for another master than that of this process.

        Raises:
            OSError: the log cannot be written, or roslaunch cannot be started.
        """
        self.log_path = Path(launch_file).with_name(log_file)
        self._log = self.log_path.open('w', encoding='utf-8', errors='replace')
        self._log_works = True
        self._on_line = on_line
        self._on_end = on_end
        self._master_uri = master_uri
        self._record = RunRecord()
        self._far = far_computers(launch_file)
        self._watcher = NodeWatcher(on_report, self._take_line, master_uri)
        self._process = self._start(launch_file, start, master_uri)
        self._ended = threading.Event()
        self._is_stopping = False
        self._killed_by = ''
        self._threads = [
            threading.Thread(target=self._watcher.watch, args=[self._process.output],
                             name='watch nodes', daemon=True),
            threading.Thread(target=self._wait_for_end, name='wait for roslaunch', daemon=True)]
        for thread in self._threads:
            thread.start()

    def _start(self, launch_file: str, start: Start,
               master_uri: Optional[str]) -> RoslaunchProcess:
        try:
            self._record.write()
            return RoslaunchProcess([launch_file], self._record.run_id, start, master_uri)
        except OSError:
            self._log.close()
            with contextlib.suppress(OSError):  # an error with its folder has been reported
                self._record.remove()
            raise

    def wait(self, timeout_s: Optional[float] = None) -> bool:
        """Wait for the end of roslaunch; return True if it has ended."""
        return self._ended.wait(timeout_s)

    def reports(self) -> List[NodeReport]:
        """Return the latest report of every node."""
        return self._watcher.reports()

    @property
    def run_id(self) -> str:
        """The mark in the environment of every process of the run."""
        return self._record.run_id

    @property
    def failed_required(self) -> Optional[NodeReport]:
        """The required node whose exit ended the run, if any."""
        return self._watcher.failed_required

    @property
    def killed_by(self) -> str:
        """The signal by which roslaunch was killed from outside, in words; '' if it was not."""
        return self._killed_by

    def stop(self, tell: Callable[[str], None] = lambda text: None) -> List[int]:
        """Stop everything; return the ids of processes that roslaunch left behind.

        The master forgets nodes that could not unregister.

        ``tell`` receives messages about processes that take long to end.
        """
        self._is_stopping = True
        orphans = self._process.stop(tell, self._far)
        for thread in self._threads:
            thread.join()
        forget_ended([it.name for it in self.reports()], self._master_uri)
        with contextlib.suppress(OSError):  # a failure to write was reported at once
            self._log.close()
        self._record.remove()
        return orphans

    def _wait_for_end(self) -> None:
        """Wait for the end of roslaunch, not of its output, which nodes left behind keep open."""
        code = self._process.wait()
        if code < 0 and not self._is_stopping:
            self._killed_by = exit_words(code)
        self._threads[0].join(_LAST_LINES_TIMEOUT_S)
        self._ended.set()
        self._on_end(code)

    def _take_line(self, line: str) -> None:
        self._on_line(line)
        if self._log_works:
            self._write_log(line)

    def _write_log(self, line: str) -> None:
        """Write a line; a full disk must not stop reading, or roslaunch would block on its pipe."""
        try:
            self._log.write(line + '\n')
            self._log.flush()
        except OSError as error:
            self._log_works = False
            self._on_line(f'[ERROR] {self.log_path} cannot be written: {error.strerror}; the run '
                          'continues without a log')
