# SPDX-License-Identifier: BSD-3-Clause
"""A roslaunch that a server has forked, with the methods of ``subprocess.Popen`` that are used."""
from __future__ import annotations

import os
import signal
import subprocess
import threading
from typing import IO, Optional


class ForkedProcess:
    """Made from the reading ends of the pipes for output and status; ``pid`` is its process id.

    Raises:
        ChildProcessError: the server has not started it.
    """

    def __init__(self, output: int, status: int) -> None:
        self.stdout: Optional[IO[str]] = os.fdopen(output, encoding='utf-8', errors='replace')
        self._status = os.fdopen(status, encoding='ascii')
        first = self._status.readline()
        if not first:
            self.stdout.close()
            self._status.close()
            raise ChildProcessError('roslaunch cannot be started')
        self.pid = int(first)
        self._code = -int(signal.SIGKILL)  # if it has no chance to say another
        self._ended = threading.Event()
        threading.Thread(target=self._follow, name='follow roslaunch', daemon=True).start()

    def poll(self) -> Optional[int]:
        """The exit code, or None while it runs."""
        return self._code if self._ended.is_set() else None

    def wait(self, timeout: Optional[float] = None) -> int:
        """Wait for its end; returns the exit code, or raises subprocess.TimeoutExpired."""
        if not self._ended.wait(timeout):
            raise subprocess.TimeoutExpired('roslaunch', timeout or 0.0)
        return self._code

    def send_signal(self, number: int) -> None:
        """Send a signal if it still runs."""
        if not self._ended.is_set():
            os.kill(self.pid, number)

    def kill(self) -> None:
        """Send SIGKILL if it still runs."""
        self.send_signal(signal.SIGKILL)

    def _follow(self) -> None:
        """The status pipe is closed only when it ends: its nodes do not inherit it."""
        with self._status as status:
            for line in status:
                self._code = int(line)
        self._ended.set()
