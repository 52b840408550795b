# SPDX-License-Identifier: BSD-3-Clause
"""A file for each run, so that the next start can clean up after a crash."""
from __future__ import annotations

import contextlib
import json
import os
import shutil
import signal
import tempfile
import time
import uuid
from pathlib import Path
from typing import Any, Callable, Dict, List, Optional

import rospkg

from process_visualizer.whole_file import small_file

# Finds the processes of a run by a mark in their environment, which every descendant inherits.

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
    """Continue the processes of a run that were stopped by SIGSTOP: they heed no other signal."""
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


_FOLDER_PREFIX = 'process_visualizer-'


def new_run_folder() -> str:
    """Make a temporary folder for the files of a run; a record can note it."""
    return tempfile.mkdtemp(prefix=_FOLDER_PREFIX)


class RunRecord:
    """The record of this process's run; ``run_id`` marks its processes."""

    def __init__(self) -> None:
        self.run_id = uuid.uuid4().hex
        self._path = _folder() / f'{self.run_id}.json'

    def write(self, folder: str = '', is_replay: bool = False) -> None:
        """Note who owns the run, and the folder (by ``new_run_folder``) that goes with it.

        ``is_replay``: it is beside the cell that the owner has.
        """
        self._path.parent.mkdir(parents=True, exist_ok=True)
        owner = {'pid': os.getpid(), 'start_time': start_time(os.getpid()), 'folder': folder,
                 'is_replay': is_replay}
        written = self._path.with_suffix('.new')
        written.write_text(json.dumps(owner), encoding='utf-8')
        written.replace(self._path)  # so that a concurrent clean-up finds a complete record

    def begin(self) -> str:
        """Make a temporary folder for the files of the run, and note it; return its name.

        Raises:
            OSError: that cannot be done; nothing is left.
        """
        folder = new_run_folder()
        try:
            self.write(folder)
        except OSError as error:
            shutil.rmtree(folder, ignore_errors=True)
            raise OSError(error.errno, f'what runs cannot be noted: {error.strerror}; make room, '
                          'or set ROS_HOME to a folder that can be written',
                          str(self._path.parent)) from error
        return folder

    def remove(self) -> None:
        """The run is over and left nothing."""
        self._path.unlink(missing_ok=True)


def clean_up_crashed_runs() -> List[int]:
    """End the processes of runs without an owner, and remove their folders; return the ids."""
    ended: List[int] = []
    for path in sorted(_folder().glob('*.json')):
        owner = _owner(path)
        if not _lives(owner):
            ended += end_processes(path.stem)
            _remove_run_folder(owner)
            path.unlink(missing_ok=True)  # another program may be cleaning up, too
    return ended


def folder_of_run(owner_id: int) -> str:
    """Return the folder of the cell that a living process has launched; empty if there is none.

    The process may have further runs: a replay, a master, what starts quickly.
    """
    owners = (_owner(path) for path in sorted(_folder().glob('*.json')))
    return next((str(it['folder']) for it in owners if it.get('pid') == owner_id and _lives(it)
                 and it.get('folder') and not it.get('is_replay')), '')


def _folder() -> Path:
    return Path(rospkg.get_ros_home()) / 'process_visualizer' / 'runs'


def _owner(path: Path) -> Dict[str, Any]:
    try:
        owner = json.loads(small_file(str(path)))
    except (OSError, ValueError, RecursionError):
        return {}
    return owner if isinstance(owner, dict) else {}


def _lives(owner: Dict[str, Any]) -> bool:
    pid, started = owner.get('pid'), owner.get('start_time')
    return isinstance(pid, int) and started is not None and start_time(pid) == started


def _remove_run_folder(owner: Dict[str, Any]) -> None:
    """Only if it looks like one: a record changed by hand must not delete other folders."""
    folder = str(owner.get('folder') or '')
    if os.path.basename(folder).startswith(_FOLDER_PREFIX):
        shutil.rmtree(folder, ignore_errors=True)
