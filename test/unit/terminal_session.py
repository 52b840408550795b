# SPDX-License-Identifier: BSD-3-Clause
"""A terminal with a process, which a test types to and reads from."""
import fcntl
import os
import pty
import select
import subprocess
import termios
import time

from surroundings import hear_hangup

DEADLINE_S = 60.0


class TerminalSession:
    """Command that runs as the leader of a new session with its own terminal."""

    def __init__(self, command, environment):
        self.master, terminal = pty.openpty()
        self._begun = termios.tcgetattr(self.master)
        self._unread = b''
        try:
            self.process = subprocess.Popen(
                command, stdin=terminal, stdout=terminal, stderr=terminal, env=environment,
                start_new_session=True,
                preexec_fn=_take_terminal)
        finally:
            os.close(terminal)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.kill()
        self.process.wait()
        self.hang_up()

    def hang_up(self):
        """Close the terminal, which ends the processes in its foreground."""
        if self.master >= 0:
            os.close(self.master)
        self.master = -1

    def type(self, data):
        os.write(self.master, data)

    def expect(self, text):
        """Read up to a text; return everything before it."""
        deadline = time.monotonic() + DEADLINE_S
        while text not in self._unread:
            remaining = deadline - time.monotonic()
            ready = select.select([self.master], [], [], max(remaining, 0.0))[0]
            assert ready, f'{text!r} did not come, but {self._unread!r}'
            try:
                self._unread += os.read(self.master, 4096)
            except OSError:
                raise AssertionError(f'ended before {text!r} came: {self._unread!r}') from None
        before, _, self._unread = self._unread.partition(text)
        return before

    def is_restored(self):
        """Return whether lines are edited and echoed, and the rest is as in the beginning."""
        return termios.tcgetattr(self.master) == self._begun

    def wait(self):
        return self.process.wait(DEADLINE_S)


def _take_terminal():
    """Control the terminal as a shell's first process does, and get notified when it is closed."""
    hear_hangup()
    fcntl.ioctl(0, termios.TIOCSCTTY, 0)
