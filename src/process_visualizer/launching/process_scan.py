"""Finds the processes of a run by a mark in their environment, which every descendant inherits."""
from __future__ import annotations

import os
import signal
import time
from pathlib import Path
from typing import List, Optional

RUN_VARIABLE = 'PROCESS_VISUALIZER_RUN'
_TERM_TIMEOUT_S = 3.0
_CHECK_PERIOD_S = 0.05


def processes_of_run(run_id: str) -> List[int]:
    """The process ids whose environment carries the run's mark, this process excepted."""
    mark = f'{RUN_VARIABLE}={run_id}'.encode()
    pids = [int(path.name) for path in Path('/proc').iterdir() if path.name.isdigit()]
    return [pid for pid in pids if pid != os.getpid() and _carries(pid, mark)]


def _carries(pid: int, mark: bytes) -> bool:
    try:
        alive = Path(f'/proc/{pid}/stat').read_bytes().rpartition(b')')[2].split()[0] != b'Z'
        return alive and mark in Path(f'/proc/{pid}/environ').read_bytes().split(b'\0')
    except (OSError, IndexError):  # it ended meanwhile, or belongs to somebody else
        return False


def start_time(pid: int) -> Optional[str]:
    """When the process started, in the kernel's ticks; tells it from a later one of that id.

    None if there is none, or if it has ended and its parent has not asked for its exit code yet.
    """
    try:
        fields = Path(f'/proc/{pid}/stat').read_text().rpartition(')')[2].split()
        return None if fields[0] == 'Z' else fields[19]
    except (OSError, IndexError):
        return None


def end_processes(run_id: str) -> List[int]:
    """End what is left of a run, with SIGTERM and after 3 s with SIGKILL; returns the ids."""
    ended = processes_of_run(run_id)
    _signal_all(ended, signal.SIGTERM)
    if not wait_until_gone(run_id, _TERM_TIMEOUT_S):
        _signal_all(processes_of_run(run_id), signal.SIGKILL)
        wait_until_gone(run_id, _TERM_TIMEOUT_S)
    return ended


def wait_until_gone(run_id: str, timeout_s: float) -> bool:
    """Wait for the end of all processes of a run; they are not our children, so look at them."""
    deadline = time.monotonic() + timeout_s
    while processes_of_run(run_id):
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
