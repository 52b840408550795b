# SPDX-License-Identifier: BSD-3-Clause
"""Runs slow work off the GUI thread, and delivers the results to it."""
from __future__ import annotations

import queue
import threading
from typing import Any, Callable, Dict, NamedTuple, Optional

from PyQt5.QtCore import QObject, Qt, pyqtSignal

OnResult = Callable[[Any], None]
OnError = Callable[[Exception], None]


class _Task(NamedTuple):
    function: Callable[[], Any]
    on_result: Optional[OnResult]
    on_error: Optional[OnError]


class _Outcome(NamedTuple):
    task: _Task
    result: Any
    error: Optional[Exception]


class Tasks(QObject):
    """Lines of work by name, each with its own thread that lives as long as the program.

    Tasks of one line run one after the other, in their order; related work (such as all commands
    of the player) goes into one line.
    """

    _ended = pyqtSignal(object)

    def __init__(self, parent: Optional[QObject] = None) -> None:
        super().__init__(parent)
        self._lines: Dict[str, 'queue.Queue[Optional[_Task]]'] = {}
        self._threads: Dict[str, threading.Thread] = {}
        self._ended.connect(self._deliver, Qt.QueuedConnection)

    def run(self, line: str, function: Callable[[], Any], on_result: Optional[OnResult] = None,
            on_error: Optional[OnError] = None) -> None:
        """Run a function in a line; then call one of the others, in the GUI thread.

        Without ``on_error`` an exception is raised in the GUI thread.
        """
        if line not in self._lines:
            self._begin(line)
        self._lines[line].put(_Task(function, on_result, on_error))

    def run_and_wait(self, line: str, function: Callable[[], Any], timeout_s: float) -> None:
        """Run a function after the present tasks of the line, and wait for its end.

        It blocks the calling thread: only for the end of the program.
        """
        ended = threading.Event()

        def work() -> None:
            try:
                function()
            finally:
                ended.set()

        self.run(line, work)
        ended.wait(timeout_s)

    def close(self, timeout_s: float = 5.0) -> None:
        """End all lines after their present task; later results are not delivered."""
        self._ended.disconnect(self._deliver)
        for line in self._lines.values():
            line.put(None)
        for thread in self._threads.values():
            thread.join(timeout_s)

    def _begin(self, line: str) -> None:
        tasks: 'queue.Queue[Optional[_Task]]' = queue.Queue()
        thread = threading.Thread(target=self._work, args=[tasks], name=line, daemon=True)
        self._lines[line], self._threads[line] = tasks, thread
        thread.start()

    def _work(self, tasks: 'queue.Queue[Optional[_Task]]') -> None:
        while True:
            task = tasks.get()
            if task is None:
                return
            try:
                outcome = _Outcome(task, task.function(), None)
            except Exception as error:  # passed to the GUI thread, which shows it
                outcome = _Outcome(task, None, error)
            self._ended.emit(outcome)

    def _deliver(self, outcome: _Outcome) -> None:
        task, result, error = outcome
        if error is None:
            if task.on_result is not None:
                task.on_result(result)
        elif task.on_error is not None:
            task.on_error(error)
        else:
            raise error
