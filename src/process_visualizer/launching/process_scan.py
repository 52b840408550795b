# SPDX-License-Identifier: BSD-3-Clause
"""Finds the processes of a run by a mark in their environment, which every descendant inherits."""
from __future__ import annotations

import contextlib
import os
import signal
import time
from pathlib import Path
from typing import Callable, List, Optional

RUN_VARIABLE = 'PROCESS_VISUALIZER_RUN'
_TERM_TIMEOUT_S = 3.0
_CHECK_PERIOD_S = 0.05
_EXEC_S = 5.0  # in which a process becomes another program, also on a computer that is too busy
_EXEC_PERIOD_S = 0.002
_ENVIRONMENT = slice(47, 49)  # where it begins and ends in memory, in the fields of `_stat`
_LINUX = ('0', '2')  # the parents of kernel threads, which are not programs


def processes_of_run(run_id: str) -> List[int]:
    """The ids of processes with the run's mark in their environment, except this process."""
    mark = f'{RUN_VARIABLE}={run_id}'.encode()
    pids = [int(path.name) for path in Path('/proc').iterdir() if path.name.isdigit()]
    return [pid for pid in pids if pid != os.getpid() and mark in _environment(pid).split(b'\0')]


def _environment(pid: int) -> bytes:
    """The environment of a process; empty if it has ended, or belongs to another user or Linux.

    While a process becomes another program nothing can be read, though the kernel says that the
    environment is not empty, or not yet where it is.
    """
    deadline = time.monotonic() + _EXEC_S
    try:
        while True:
            fields = _stat(pid)
            state, parent, (begin, end) = fields[0], fields[1], fields[_ENVIRONMENT]
            found = Path(f'/proc/{pid}/environ').read_bytes()
            is_empty = begin == end != '0' or state == 'Z' or parent in _LINUX
            if found or is_empty or time.monotonic() > deadline:
                return b'' if state == 'Z' else found
            time.sleep(_EXEC_PERIOD_S)
    except (OSError, IndexError):
        return b''


def _stat(pid: int) -> List[str]:
    """The fields of a process after its name: state, parent's id, …; see proc(5)."""
    return Path(f'/proc/{pid}/stat').read_text().rpartition(')')[2].split()


def names_of(pids: List[int]) -> List[str]:
    """The names of processes that have not ended."""
    found = []
    for pid in pids:
        with contextlib.suppress(OSError):
            found.append(Path(f'/proc/{pid}/comm').read_text().strip())
    return found


def continue_processes(run_id: str) -> None:
    """Let those processes of a run go on that somebody has stopped: they heed no other signal."""
    _signal_all(processes_of_run(run_id), signal.SIGCONT)


def start_time(pid: int) -> Optional[str]:
    """Return when the process started, in the kernel's ticks, unlike any later one with that id.

    None if there is none, or if it has ended and its parent has not read its exit code yet.
    """
    try:
        fields = _stat(pid)
        return None if fields[0] == 'Z' else fields[19]
    except (OSError, IndexError):
        return None


def end_processes(run_id: str) -> List[int]:
    """End the processes of a run, with SIGTERM and after 3 s with SIGKILL; return their ids."""
    ended: List[int] = []

    def end_more() -> bool:
        left = processes_of_run(run_id)
        more = [pid for pid in left if pid not in ended]  # begun by one that had not ended yet
        _signal_all(more, signal.SIGTERM)
        ended.extend(more)
        return not left

    if not _wait_for(end_more, _TERM_TIMEOUT_S):
        _signal_all(processes_of_run(run_id), signal.SIGKILL)
        wait_until_gone(run_id, _TERM_TIMEOUT_S)
    return ended


def wait_until_gone(run_id: str, timeout_s: float) -> bool:
    """Wait for the end of all processes of a run, by polling, as they are not our children."""
    return _wait_for(lambda: not processes_of_run(run_id), timeout_s)


def _wait_for(condition: Callable[[], bool], timeout_s: float) -> bool:
    deadline = time.monotonic() + timeout_s
    while not condition():
        if time.monotonic() > deadline:
            return False
        time.sleep(_CHECK_PERIOD_S)
    return True


def _signal_all(pids: List[int], number: int) -> None:
    for pid in pids:
        try:
            os.kill(pid, number)
        except ProcessLookupError:
            continue
