# SPDX-License-Identifier: BSD-3-Clause
"""How long a thread has waited for a processor, as the kernel counts it."""
from __future__ import annotations

import os
import threading

_WAITED_NS = 1  # the field of schedstat
_STOLEN_TICKS = 8  # the field of /proc/stat, proc(5)


class ProcessorWait:
    """For the thread that makes it; the files stay open, as they are read often."""

    def __init__(self) -> None:
        waits = f'/proc/self/task/{threading.get_native_id()}/schedstat'
        paths = [waits, '/proc/stat'] if os.path.exists(waits) else []
        self._files = [os.open(path, os.O_RDONLY) for path in paths]
        self._tick_s = 1.0 / os.sysconf('SC_CLK_TCK')

    def seconds(self) -> float:
        """Return the wait since the thread began [s]; 0 if it is not counted.

        Includes what the host of a virtual machine took from all processors, which looks the same.
        """
        if not self._files:
            return 0.0
        thread, processors = (os.pread(file, 200, 0).split() for file in self._files)
        return int(thread[_WAITED_NS]) * 1e-9 + int(processors[_STOLEN_TICKS]) * self._tick_s

    def close(self) -> None:
        """Close the files."""
        while self._files:
            os.close(self._files.pop())
