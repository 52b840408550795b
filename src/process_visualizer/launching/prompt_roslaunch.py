# SPDX-License-Identifier: BSD-3-Clause
"""Lets roslaunch see at once that a node has ended, or that it is to end itself."""
from __future__ import annotations

import os
import signal
import threading
import time

from roslaunch import nodeprocess, pmon


def be_prompt() -> None:
    """Make the roslaunch of this process prompt; call it once, in the main thread.

    roslaunch looks ten times a second, and sleeps in between. Here its sleep is over as soon as a
    child process ends, or the monitor of the processes is told to shut down.
    """
    clock = _Clock()
    pmon.time = nodeprocess.time = clock

    class Monitor(pmon.ProcessMonitor):
        """Wakes the thread that has to see that it is shut down."""

        def shutdown(self) -> None:
            super().shutdown()
            clock.wake()

    pmon.ProcessMonitor = Monitor


class _Clock:
    """What roslaunch uses of the module ``time``, with a sleep that ends early."""

    time = staticmethod(time.time)

    def __init__(self) -> None:
        self._woken = threading.Condition()
        signals, written = os.pipe()
        os.set_blocking(written, False)
        signal.set_wakeup_fd(written, warn_on_full_buffer=False)
        signal.signal(signal.SIGCHLD, lambda *_: None)  # without a handler it would not be written
        threading.Thread(target=self._follow, args=[signals], name='signals', daemon=True).start()

    def sleep(self, seconds: float) -> None:
        """Wait so long, or until the next child ends."""
        with self._woken:
            self._woken.wait(seconds)

    def wake(self) -> None:
        """End all present sleeps."""
        with self._woken:
            self._woken.notify_all()

    def _follow(self, signals: int) -> None:
        while os.read(signals, 1):
            self.wake()
