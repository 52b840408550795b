# SPDX-License-Identifier: BSD-3-Clause
"""One run of a generated launch file, from start to the end of everything it started."""
from __future__ import annotations

import contextlib
import threading
from pathlib import Path
from typing import Callable, List, Optional

from process_visualizer.launching.exit_words import exit_words
from process_visualizer.launching.node_state import NodeReport
from process_visualizer.launching.node_watcher import NodeWatcher
from process_visualizer.launching.roslaunch_process import (
    RoslaunchProcess,
    Start,
    start_roslaunch,
)
from process_visualizer.launching.run_record import RunRecord

LOG_FILE = 'roslaunch.log'
_LAST_LINES_TIMEOUT_S = 1.0


class Run:
    """Runs a launch file; reports come in a thread of the run, never in the caller's thread.

    Start it in a thread that lives as long as the program does (the main thread): the kernel
    interrupts roslaunch when the thread that started it ends. ``on_end`` is called after the last
    report with the exit code of roslaunch (negative: the signal that ended it).
    """

    def __init__(self, launch_file: str, on_report: Callable[[NodeReport], None],
                 on_line: Callable[[str], None] = lambda line: None,
                 on_end: Callable[[int], None] = lambda code: None,
                 log_file: str = LOG_FILE, start: Start = start_roslaunch,
                 master_uri: Optional[str] = None) -> None:
        """Start it; ``log_file`` is written beside the launch file.

        ``master_uri`` is of another master than that of this process.

        Raises:
            OSError: the log cannot be written, or roslaunch cannot be started.
        """
        self.log_path = Path(launch_file).with_name(log_file)
        self._log = self.log_path.open('w', encoding='utf-8', errors='replace')
        self._log_works = True
        self._on_line = on_line
        self._on_end = on_end
        self._record = RunRecord()
        self._record.write()
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
            return RoslaunchProcess([launch_file], self._record.run_id, start, master_uri)
        except OSError:
            self._log.close()
            self._record.remove()
            raise

    def wait(self, timeout_s: Optional[float] = None) -> bool:
        """Wait for the end of roslaunch; return True if it has ended."""
        return self._ended.wait(timeout_s)

    def reports(self) -> List[NodeReport]:
        """The latest report of every node."""
        return self._watcher.reports()

    @property
    def run_id(self) -> str:
        """The mark in the environment of every process of the run."""
        return self._record.run_id

    @property
    def failed_required(self) -> Optional[NodeReport]:
        """The required node that ended the run by exiting."""
        return self._watcher.failed_required

    @property
    def killed_by(self) -> str:
        """Return how roslaunch was killed by somebody else, in words; '' if it was not."""
        return self._killed_by

    def stop(self, tell: Callable[[str], None] = lambda text: None) -> List[int]:
        """Stop everything; return the ids of processes that roslaunch left behind.

        ``tell`` hears what is waited for, if that takes long.
        """
        self._is_stopping = True
        orphans = self._process.stop(tell)
        for thread in self._threads:
            thread.join()
        with contextlib.suppress(OSError):  # what cannot be written was reported when it came
            self._log.close()
        self._record.remove()
        return orphans

    def _wait_for_end(self) -> None:
        """The end of roslaunch, not of its output, which nodes left behind keep open."""
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
        """A full disk must not stop the reading, or roslaunch would block on its pipe."""
        try:
            self._log.write(line + '\n')
            self._log.flush()
        except OSError as error:
            self._log_works = False
            self._on_line(f'[ERROR] {self.log_path} cannot be written: {error.strerror}; the run '
                          'continues without a log')
