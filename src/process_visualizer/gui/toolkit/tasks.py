# SPDX-License-Identifier: BSD-3-Clause
"""Runs slow work outside the GUI thread, in named worker queues; delivers results to it."""
from __future__ import annotations

import math
import queue
import threading
import time
from collections import deque
from typing import Any, Callable, Deque, Dict, Generic, NamedTuple, Optional, TypeVar

from PyQt5.QtCore import QObject, Qt, QTimer, pyqtSignal

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
    """Named worker queues (lines), each with its own thread for the life of the program.

    Tasks of a line run one after the other, in order. Related work, such as all commands of the
    player, goes into one line.
    """

    _ended = pyqtSignal(object)

    def __init__(self, parent: Optional[QObject] = None) -> None:
        super().__init__(parent)
        self._lines: Dict[str, 'queue.Queue[Optional[_Task]]'] = {}
        self._threads: Dict[str, threading.Thread] = {}
        self._ended.connect(self._deliver, Qt.QueuedConnection)

    def run(self, line: str, function: Callable[[], Any], on_result: Optional[OnResult] = None,
            on_error: Optional[OnError] = None) -> None:
        """Run a function in a line; then call ``on_result`` or ``on_error`` in the GUI thread.

        Without ``on_error`` an exception is raised in the GUI thread.
        """
        if line not in self._lines:
            self._begin(line)
        self._lines[line].put(_Task(function, on_result, on_error))

    def run_and_wait(self, line: str, function: Callable[[], Any], timeout_s: float) -> None:
        """Run a function after the current tasks of the line, and wait for its end.

        This blocks the calling thread: only for the end of the program.
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
        """End all lines after the tasks that they already have; no more results are delivered."""
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


class NewestValue(QObject):
    """Hands the newest value of other threads to the GUI thread.

    A GUI thread that is late leaves out what has been replaced meanwhile. Otherwise values would
    queue up on a busy computer, and clicks, timers and signals of the system would wait for all.
    """

    came = pyqtSignal(object)
    """The newest value; emitted in the GUI thread."""
    _woken = pyqtSignal()

    def __init__(self, parent: Optional[QObject] = None) -> None:
        super().__init__(parent)
        self._waiting: Deque[Any] = deque(maxlen=1)
        self._lock = threading.Lock()
        self._woken.connect(self._deliver, Qt.QueuedConnection)

    def put(self, value: Any) -> None:
        """Replace the value that waits, if there is one; for any thread."""
        with self._lock:
            is_awake = bool(self._waiting)
            self._waiting.append(value)
        if not is_awake:
            self._woken.emit()

    def _deliver(self) -> None:
        with self._lock:
            value = self._waiting.pop()
        self.came.emit(value)


_MIN_STEP = 0.005
"""Smallest step that a progress bar shows; smaller ones would only wake the GUI thread."""


class TaskProgress(QObject):
    """The progress of a task: created in the GUI thread, reported to from the task's thread."""

    changed = pyqtSignal(float)
    """The finished part, 0 to 1; emitted in the GUI thread."""

    def __init__(self, parent: Optional[QObject] = None) -> None:
        super().__init__(parent)
        self._canceled = threading.Event()
        self._reported = -1.0

    def report(self, fraction: float) -> None:
        """Report the finished part, 0 to 1; for the thread of the task."""
        if abs(fraction - self._reported) >= _MIN_STEP or fraction >= 1.0:
            self._reported = fraction
            self.changed.emit(fraction)

    def go_on(self, fraction: float) -> bool:
        """Report the finished part; return whether the task may continue."""
        self.report(fraction)
        return not self.is_canceled()

    def cancel(self) -> None:
        """Ask the task to end soon."""
        self._canceled.set()

    def is_canceled(self) -> bool:
        """Return whether the task must end; for any thread."""
        return self._canceled.is_set()


_LOOK_MS, _LATE_S = 200, 1.0
"""Polling period [ms]; longer gaps than this [s] do not count, as the window was blocked."""


class DelayedAction(QObject):
    """Acts after a delay; ``changed`` is emitted for each second that is left."""

    changed = pyqtSignal()

    def __init__(self, delay_s: float, act: Callable[[], None],
                 clock_s: Callable[[], float] = time.monotonic,
                 parent: Optional[QObject] = None) -> None:
        super().__init__(parent)
        self._delay_s, self._act, self._clock_s = delay_s, act, clock_s
        self._due_s: Optional[float] = None
        self._looked_s = 0.0
        self._left_s = 0
        self._timer = QTimer(self)
        self._timer.setInterval(_LOOK_MS)
        self._timer.timeout.connect(self.poll)

    @property
    def is_waiting(self) -> bool:
        """Return whether the action is pending, and can be canceled."""
        return self._due_s is not None

    @property
    def left_s(self) -> int:
        """The seconds until the action; 0 if none is pending."""
        return self._left_s

    def begin(self) -> None:
        """Act after the delay."""
        self._looked_s = self._clock_s()
        self._due_s = self._looked_s + self._delay_s
        self._timer.start()
        self.poll()

    def cancel(self) -> None:
        """Cancel the action."""
        self._due_s = None
        self._timer.stop()
        self._show(0)

    def poll(self) -> None:
        """Act if the delay is over."""
        if self._due_s is None:
            return
        now_s = self._clock_s()
        self._due_s += max(now_s - self._looked_s - _LATE_S, 0.0)
        self._looked_s = now_s
        left_s = self._due_s - now_s
        if left_s > 0.0:
            self._show(math.ceil(left_s))
        else:
            self.cancel()
            self._act()

    def _show(self, left_s: int) -> None:
        if left_s != self._left_s:
            self._left_s = left_s
            self.changed.emit()


_SILENCE_MS, _SILENCES = 1000, 3


class SilenceWatch(QObject):
    """Counts periods without a message, instead of measuring one long silence.

    So a window that was blocked itself does not mistake messages that wait for it for a silence.
    """

    silent = pyqtSignal()
    """No message has arrived for long; the next ``hear`` ends the silence."""

    def __init__(self, parent: Optional[QObject] = None) -> None:
        super().__init__(parent)
        self._count = 0
        self._timer = QTimer(self, interval=_SILENCE_MS)
        self._timer.timeout.connect(self._wait)

    def hear(self) -> None:
        """Start waiting for the next message."""
        self._count = 0
        self._timer.start()

    def stop(self) -> None:
        """Stop waiting."""
        self._timer.stop()

    def _wait(self) -> None:
        self._count += 1
        if self._count >= _SILENCES:
            self.stop()
            self.silent.emit()


Value = TypeVar('Value')


class NewestCall(Generic[Value]):
    """Calls a function with the newest value: one call at a time; older waiting values are skipped.

    Use it in the GUI thread; the function runs in a line of tasks.
    """

    def __init__(self, tasks: Tasks, line: str, function: Callable[[Value], Any],
                 on_done: Callable[[], None], on_error: OnError) -> None:
        """Set callbacks: ``on_done`` when no value is waiting, ``on_error`` for a failure."""
        self._tasks = tasks
        self._line = line
        self._function = function
        self._on_done = on_done
        self._on_error = on_error
        self._under_way: Optional[Value] = None
        self._next: Optional[Value] = None

    @property
    def wanted(self) -> Optional[Value]:
        """The newest value until its call has ended, then None."""
        return self._under_way if self._next is None else self._next

    @property
    def waiting(self) -> Optional[Value]:
        """The newest value while its call has not begun, else None."""
        return self._next

    def request(self, value: Value) -> None:
        """Call the function with a value, unless a newer value comes before its turn."""
        if self._under_way is None:
            self._call(value)
        else:
            self._next = value

    def _call(self, value: Value) -> None:
        self._under_way = value
        self._tasks.run(self._line, lambda: self._function(value), self._end, self._fail)

    def _end(self, _result: Any) -> None:
        value, self._under_way, self._next = self._next, None, None
        if value is None:
            self._on_done()
        else:
            self._call(value)

    def _fail(self, error: Exception) -> None:
        self._end(None)
        self._on_error(error)


Newest = Callable[[Callable[[Any], Any]], NewestCall[Any]]
"""Makes a NewestCall of a function."""
