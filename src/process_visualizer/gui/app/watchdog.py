# SPDX-License-Identifier: BSD-3-Clause
"""Measures how long the GUI thread was blocked."""
from __future__ import annotations

import faulthandler
import json
import os
import signal
import threading
import time
from collections import deque
from pathlib import Path
from typing import Callable, Deque, Dict, List, NamedTuple, Optional, Union

from PyQt5.QtCore import QObject, Qt, QTimer

_RAN_NS, _WAITED_NS = 0, 1  # fields of schedstat
_STOLEN_TICKS = 8  # the field of /proc/stat, proc(5)
_TASKS = '/proc/self/task'
_LOOKS_FOR_THREADS = 50
"""Number of readings between two searches for threads, which rarely begin or end."""


class ProcessorTimes(NamedTuple):
    """A thread's use of the processor since it began [s], and the wait of each other thread [s]."""

    ran_s: float = 0.0
    waited_s: float = 0.0
    others_waited_s: Dict[int, float] = {}

    def kept_waiting_s(self, before: 'ProcessorTimes', elapsed_s: float) -> float:
        """Return for how long busy processors have kept the thread waiting since ``before`` [s].

        That is the thread's own wait; and while it slept, the longest wait of another thread of
        the program, which may have held Python's lock.
        """
        waited_s = self.waited_s - before.waited_s
        slept_s = elapsed_s - waited_s - (self.ran_s - before.ran_s)
        other_s = max((seconds - before.others_waited_s.get(thread, seconds)
                       for thread, seconds in self.others_waited_s.items()), default=0.0)
        return waited_s + max(min(slept_s, other_s), 0.0)


class ProcessorWait:
    """Measures the thread that creates it; the files stay open, as they are read often."""

    def __init__(self) -> None:
        self._own = threading.get_native_id()
        self._threads: Dict[int, int] = {}
        self._stat = os.open('/proc/stat', os.O_RDONLY)
        self._tick_s = 1.0 / os.sysconf('SC_CLK_TCK')
        self._readings = 0

    def times(self) -> ProcessorTimes:
        """Return the times until now; zeros if the kernel does not count them.

        The waits include the time that the host of a virtual machine took from all processors,
        which looks the same.
        """
        if self._readings % _LOOKS_FOR_THREADS == 0:
            self._look_for_threads()
        self._readings += 1
        stolen_s = int(os.pread(self._stat, 200, 0).split()[_STOLEN_TICKS]) * self._tick_s
        waits = {}
        ran_s = 0.0
        for thread, file in list(self._threads.items()):
            try:
                fields = os.pread(file, 200, 0).split()
            except ProcessLookupError:
                os.close(self._threads.pop(thread))
                continue
            waits[thread] = int(fields[_WAITED_NS]) * 1e-9 + stolen_s
            if thread == self._own:
                ran_s = int(fields[_RAN_NS]) * 1e-9
        return ProcessorTimes(ran_s, waits.pop(self._own, 0.0), waits)

    def _look_for_threads(self) -> None:
        for name in os.listdir(_TASKS):
            path = os.path.join(_TASKS, name, 'schedstat')
            if int(name) not in self._threads and os.path.exists(path):
                self._threads[int(name)] = os.open(path, os.O_RDONLY)

    def close(self) -> None:
        """Close the files."""
        for file in (self._stat, *self._threads.values()):
            os.close(file)
        self._threads = {}


VARIABLE = 'PROCESS_VISUALIZER_WATCHDOG'
LIMIT_S = 0.05
BEAT_MS = 10
_SIGNAL = signal.SIGUSR2
Entry = Dict[str, Union[str, float, int]]


class Watchdog(QObject):
    """Watches regular beats of the GUI thread from another thread, and logs blocks.

    The time between two beats is at most 10 ms longer than the thread was blocked. The kernel
    counts separately for how long the thread waited for a processor, or for another thread of the
    program that waited for one. The file has a line of JSON for each block (``blocked_ms``,
    ``waited_ms``, ``ran_ms`` by the thread, ``computed_ms`` by all threads of the program, ``at``
    in s since the epoch, ``stack``) and at the end one with ``longest_ms``, ``longest_own_ms``
    (without the wait), ``beats``, ``blocks``.
    """

    def __init__(self, file: str, limit_s: float = LIMIT_S, parent: Optional[QObject] = None,
                 clock_s: Callable[[], float] = time.monotonic) -> None:
        """Watch the thread that calls this, from its first beat on."""
        super().__init__(parent)
        self._limit_s, self._clock_s = limit_s, clock_s
        self._gui_thread = threading.get_ident()
        self._wait = ProcessorWait()
        self._beat_s = self._computed_s = 0.0
        self._times = ProcessorTimes()
        self._longest_s = self._longest_own_s = 0.0
        self._beats = self._blocks = 0
        self._seen: Optional[float] = None  # the beat after which the stack was taken
        self._stack = os.memfd_create('stack')
        faulthandler.register(_SIGNAL, self._stack, all_threads=False)
        self._entries: Deque[Entry] = deque()
        self._end = threading.Event()
        self._file = Path(file)
        self._file.write_text('', encoding='utf-8')
        self._thread = threading.Thread(target=self._watch, name='watchdog', daemon=True)
        self._timer = QTimer(self)
        self._timer.setTimerType(Qt.PreciseTimer)
        self._timer.timeout.connect(self._beat)
        self._timer.start(BEAT_MS)
        self._thread.start()

    def close(self) -> None:
        """Stop watching, and write the last line."""
        self._timer.stop()
        self._end.set()
        self._thread.join()
        faulthandler.unregister(_SIGNAL)
        os.close(self._stack)
        self._wait.close()
        self._entries.append({'longest_ms': _ms(self._longest_s),
                              'longest_own_ms': _ms(self._longest_own_s),
                              'beats': self._beats, 'blocks': self._blocks})
        self._write()

    def _beat(self) -> None:
        now_s, times, computed_s = self._clock_s(), self._wait.times(), time.process_time()
        if self._beats:
            blocked_s = now_s - self._beat_s
            self._note(blocked_s, times.kept_waiting_s(self._times, blocked_s),
                       times.ran_s - self._times.ran_s, computed_s - self._computed_s)
        self._beats += 1
        self._beat_s, self._times, self._computed_s = now_s, times, computed_s

    def _note(self, blocked_s: float, waited_s: float, ran_s: float, computed_s: float) -> None:
        self._longest_s = max(self._longest_s, blocked_s)
        self._longest_own_s = max(self._longest_own_s, blocked_s - waited_s)
        if blocked_s > self._limit_s:
            self._blocks += 1
            stack = self._taken_stack() if self._seen == self._beat_s else ''
            self._entries.append({'blocked_ms': _ms(blocked_s), 'waited_ms': _ms(waited_s),
                                  'ran_ms': _ms(ran_s), 'computed_ms': _ms(computed_s),
                                  'at': round(time.time(), 3), 'stack': stack})

    def _watch(self) -> None:
        while not self._end.wait(self._limit_s / 2):
            beat_s = self._beat_s
            is_late = beat_s > 0.0 and self._clock_s() - beat_s > self._limit_s
            if is_late and self._seen != beat_s:
                self._take_stack()
                self._seen = beat_s
            self._write()

    def _take_stack(self) -> None:
        """Let the GUI thread write its stack.

        It does so itself, interrupted by a signal: this thread would keep Python's lock in the
        meantime, and delay the thread that it watches.
        """
        os.lseek(self._stack, 0, os.SEEK_SET)
        os.ftruncate(self._stack, 0)
        signal.pthread_kill(self._gui_thread, _SIGNAL)

    def _taken_stack(self) -> str:
        """Return the stack of the GUI thread, the newest call first."""
        size = os.fstat(self._stack).st_size
        return os.pread(self._stack, size, 0).decode(errors='replace')

    def _write(self) -> None:
        if not self._entries:
            return
        with self._file.open('a', encoding='utf-8') as file:
            while self._entries:
                file.write(json.dumps(self._entries.popleft()) + '\n')


class WatchdogReport(NamedTuple):
    """The log of a watchdog; the longest block [ms] with and without waiting for a processor."""

    blocks: List[Entry]
    longest_ms: float
    longest_own_ms: float


def read_report(file: str) -> WatchdogReport:
    """Read the log of a watchdog; without its last line, the blocks give the longest times."""
    entries = [json.loads(line) for line in Path(file).read_text('utf-8').splitlines()]
    blocks = [entry for entry in entries if 'blocked_ms' in entry]
    last = entries[-1] if entries and 'longest_ms' in entries[-1] else {
        'longest_ms': max((it['blocked_ms'] for it in blocks), default=0.0),
        'longest_own_ms': max((it['blocked_ms'] - it['waited_ms'] for it in blocks), default=0.0)}
    return WatchdogReport(blocks, last['longest_ms'], last['longest_own_ms'])


def watch_if_wanted(parent: QObject) -> Optional[Watchdog]:
    """Watch this thread if the environment names a file to write to."""
    file = os.environ.get(VARIABLE)
    return Watchdog(file, parent=parent) if file else None


def _ms(seconds: float) -> float:
    return round(1000.0 * seconds, 2)
