# SPDX-License-Identifier: BSD-3-Clause
"""What a test needs of its own: a port for a master, a screen, patience with other processes."""
from __future__ import annotations

import os
import signal
import socket
import subprocess
import time
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Callable, Iterator

SOFTWARE_GRAPHICS = {'LIBGL_ALWAYS_SOFTWARE': '1', 'QT_X11_NO_MITSHM': '1'}
"""The environment of programs that draw on a virtual screen."""
PATIENCE_S = 120.0
"""For what happens anyway, on a machine that has other work; reached only if it does not happen."""
_PERIOD_S = 0.05


def wait_until(condition: Callable[[], bool], what: str, timeout_s: float = PATIENCE_S,
               instead: Callable[[], object] = lambda: '') -> None:
    """Wait for what happens in other processes; ``instead`` is told if it does not."""
    deadline_s = time.monotonic() + timeout_s
    while not condition():
        assert time.monotonic() < deadline_s, f'not in {timeout_s} s: {what}; {instead()}'
        time.sleep(_PERIOD_S)


def free_port() -> int:
    """A port at which nobody listens."""
    with socket.socket() as probe:
        probe.bind(('', 0))
        return int(probe.getsockname()[1])


@contextmanager
def virtual_screen() -> Iterator[str]:
    """A screen of 1600x1000 pixels; yields its display name."""
    reader, writer = os.pipe()
    process = subprocess.Popen(
        ['Xvfb', '-displayfd', str(writer), '-screen', '0', '1600x1000x24', '-nolisten', 'tcp'],
        pass_fds=[writer], stderr=subprocess.DEVNULL, start_new_session=True)
    os.close(writer)
    try:
        with os.fdopen(reader) as numbers:
            yield ':' + numbers.readline().strip()
    finally:
        process.terminate()
        process.wait()


def hear_hangup() -> None:
    """Let a process that is about to run hear SIGHUP, which it ignores if nohup runs the tests."""
    signal.signal(signal.SIGHUP, signal.SIG_DFL)


@contextmanager
def suspended(process_id: int, timeout_s: float = PATIENCE_S) -> Iterator[None]:
    """Let a process stand still: all of its threads, which go on for a moment after the signal."""
    os.kill(process_id, signal.SIGSTOP)
    try:
        wait_until(lambda: _stands_still(process_id), f'process {process_id} stops', timeout_s)
        yield
    finally:
        with suppress(ProcessLookupError):  # the test may have ended it
            os.kill(process_id, signal.SIGCONT)


def _stands_still(process_id: int) -> bool:
    """Whether every thread is stopped: proc(5), the field behind the name."""
    return all(path.read_text().rpartition(')')[2].split()[0] == 'T'
               for path in Path(f'/proc/{process_id}/task').glob('*/stat'))
