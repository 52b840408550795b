# SPDX-License-Identifier: BSD-3-Clause
"""Runs the command ``cell`` as a user would, and checks what it leaves behind."""
from __future__ import annotations

import signal
import subprocess
import threading
from typing import Dict, List, Optional, Sequence

from roslib.packages import find_node
from surroundings import PATIENCE_S, hear_hangup

CELL = find_node('process_visualizer', 'cell')[0]
"""The command `cell`; rosrun would need a second to find it each time."""


class CellRun:
    """A running command ``cell``; its output is collected while it runs."""

    def __init__(self, arguments: Sequence[str], environment: Dict[str, str],
                 prefix: Sequence[str] = ()) -> None:
        self.environment = environment
        self.process = subprocess.Popen(
            [*prefix, CELL, *arguments], env=environment, stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT, text=True, preexec_fn=hear_hangup)
        self._lines: List[str] = []
        self._changed = threading.Condition()
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    @property
    def text(self) -> str:
        """Return its whole output."""
        with self._changed:
            return ''.join(self._lines)

    def wait_for_line(self, part: str, timeout_s: float = PATIENCE_S) -> str:
        """Wait for a line that contains the part; return it, or fail with all lines."""
        def found() -> Optional[str]:
            return next((line for line in self._lines if part in line), None)

        with self._changed:
            line = self._changed.wait_for(found, timeout_s)
            assert line is not None, f'no line with "{part}" in:\n' + ''.join(self._lines)
            return str(line)

    def signal_and_wait(self, number: int, timeout_s: float = PATIENCE_S) -> int:
        """Send a signal and wait for the end; return the exit code."""
        self.process.send_signal(number)
        return self.wait(timeout_s)

    def wait(self, timeout_s: float = PATIENCE_S) -> int:
        """Wait for the end; return the exit code."""
        code = self.process.wait(timeout_s)
        self._reader.join(timeout_s)
        return code

    def end(self) -> None:
        """End it if it still runs."""
        if self.process.poll() is None:
            self.signal_and_wait(signal.SIGINT)

    def _read(self) -> None:
        assert self.process.stdout is not None
        for line in self.process.stdout:
            with self._changed:
                self._lines.append(line)
                self._changed.notify_all()


def run_command(environment: Dict[str, str], *command: str) -> 'subprocess.CompletedProcess[str]':
    """Run a command to its end, with its output as text."""
    return subprocess.run(command, env=environment, stdout=subprocess.PIPE, check=False,
                          stderr=subprocess.STDOUT, text=True, timeout=2.0 * PATIENCE_S)
