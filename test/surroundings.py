# SPDX-License-Identifier: BSD-3-Clause
"""Surroundings of a test: a port for a master, a screen, long limits for other processes."""
from __future__ import annotations

import os
import random
import signal
import socket
import subprocess
import time
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Callable, Iterator, List, Sequence, Set

SOFTWARE_GRAPHICS = {'LIBGL_ALWAYS_SOFTWARE': '1', 'QT_X11_NO_MITSHM': '1'}
"""The environment of programs that draw on a virtual screen."""
PATIENCE_S = 120.0
"""Limit for events that always happen, on a machine with other load; reached only on a failure."""
_PERIOD_S = 0.05


def wait_until(condition: Callable[[], bool], what: str, timeout_s: float = PATIENCE_S,
               instead: Callable[[], object] = lambda: '') -> None:
    """Wait for a condition on other processes; ``instead`` describes the failure."""
    deadline_s = time.monotonic() + timeout_s
    while not condition():
        assert time.monotonic() < deadline_s, f'not in {timeout_s} s: {what}; {instead()}'
        time.sleep(_PERIOD_S)


_PORTS = range(20_000, 32_000)  # not those that systems assign automatically
_taken: List[socket.socket] = []


def free_port() -> int:
    """Return a port on which nothing listens; no other test run takes it during this process."""
    for _ in _PORTS:
        port = random.choice(_PORTS)
        mark, probe = socket.socket(socket.AF_UNIX), socket.socket()
        try:
            mark.bind(f'\0process_visualizer test port {port}')  # it disappears with this process
            probe.bind(('', port))
        except OSError:
            mark.close()
        else:
            _taken.append(mark)
            return port
        finally:
            probe.close()
    raise AssertionError('no port is free')


@contextmanager
def virtual_screen() -> Iterator[str]:
    """Run a screen of 1600x1000 pixels; yield its display name."""
    reader, writer = os.pipe()
    process = subprocess.Popen(
        ['Xvfb', '-displayfd', str(writer), '-screen', '0', '1600x1000x24', '-nolisten', 'tcp'],
        pass_fds=[writer], stderr=subprocess.DEVNULL, start_new_session=True)
    os.close(writer)
    try:
        with os.fdopen(reader) as numbers:
            number = numbers.readline().strip()
        assert number, 'Xvfb has not started'
        yield f':{number}'
    finally:
        process.terminate()
        process.wait()


def marked_processes(mark: str) -> Set[str]:
    """Return the other processes whose environment has ``NAME=value``: ids, command lines."""
    found = set()
    for path in Path('/proc').iterdir():
        if path.name.isdigit() and int(path.name) != os.getpid():
            command = _command(path, mark.encode())
            if command:
                found.add(f'{path.name} {command}')
    return found


def _command(path: Path, wanted: bytes) -> str:
    try:
        if wanted not in (path / 'environ').read_bytes().split(b'\0'):
            return ''
        return (path / 'cmdline').read_bytes().replace(b'\0', b' ').decode(errors='replace')
    except OSError:
        return ''


def wait_until_alone(mark: str, besides: Sequence[str] = ()) -> None:
    """Wait until all marked processes have ended; those with a word of ``besides`` may remain."""
    def left() -> Set[str]:
        return {it for it in marked_processes(mark) if not any(word in it for word in besides)}

    wait_until(lambda: not left(), 'nothing is left', instead=left)


def end_marked_processes(mark: str) -> None:
    """Kill everything that a failed test has left."""
    for it in marked_processes(mark):
        with suppress(ProcessLookupError):
            os.kill(int(it.split()[0]), signal.SIGKILL)


def hear_hangup() -> None:
    """Let a process about to start receive SIGHUP, which it ignores if nohup runs the tests."""
    signal.signal(signal.SIGHUP, signal.SIG_DFL)


@contextmanager
def suspended(process_id: int, timeout_s: float = PATIENCE_S) -> Iterator[None]:
    """Suspend a process: all of its threads, which continue for a moment after the signal."""
    os.kill(process_id, signal.SIGSTOP)
    try:
        wait_until(lambda: _stands_still(process_id), f'process {process_id} stops', timeout_s)
        yield
    finally:
        with suppress(ProcessLookupError):  # the test may have ended it
            os.kill(process_id, signal.SIGCONT)


def _stands_still(process_id: int) -> bool:
    """Return whether every thread is stopped: proc(5), the field after the name."""
    return all(path.read_text().rpartition(')')[2].split()[0] == 'T'
               for path in Path(f'/proc/{process_id}/task').glob('*/stat'))
