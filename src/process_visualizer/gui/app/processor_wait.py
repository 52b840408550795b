# SPDX-License-Identifier: BSD-3-Clause
"""Time that the program's threads have waited for a processor, as the kernel counts it."""
from __future__ import annotations

import os
import threading
from typing import Dict, NamedTuple

_RAN_NS, _WAITED_NS = 0, 1  # fields of schedstat
_STOLEN_TICKS = 8  # the field of /proc/stat, proc(5)
_TASKS = '/proc/self/task'
_LOOKS_FOR_THREADS = 50
"""Each so many readings: threads begin and end seldom."""


class ProcessorTimes(NamedTuple):
    """A thread's use of the processor since it began [s], and the wait of each other thread."""

    ran_s: float = 0.0
    waited_s: float = 0.0
    others_waited_s: Dict[int, float] = {}

    def kept_waiting_s(self, before: 'ProcessorTimes', elapsed_s: float) -> float:
        """Return for how long nothing could be done since, because processors were busy elsewhere.

        That is the thread's own wait; and while it slept, the longest wait of another thread of
        the program, which may have had Python's lock.
        """
        waited_s = self.waited_s - before.waited_s
        slept_s = elapsed_s - waited_s - (self.ran_s - before.ran_s)
        other_s = max((seconds - before.others_waited_s.get(thread, seconds)
                       for thread, seconds in self.others_waited_s.items()), default=0.0)
        return waited_s + max(min(slept_s, other_s), 0.0)


class ProcessorWait:
    """A meter for the thread that makes it; the files stay open, as they are read often."""

    def __init__(self) -> None:
        self._own = threading.get_native_id()
        self._threads: Dict[int, int] = {}
        self._stat = os.open('/proc/stat', os.O_RDONLY)
        self._tick_s = 1.0 / os.sysconf('SC_CLK_TCK')
        self._readings = 0

    def times(self) -> ProcessorTimes:
        """Return the times until now; zeros if the kernel does not count them.

        The waits include what the host of a virtual machine took from all processors, which looks
        the same.
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
