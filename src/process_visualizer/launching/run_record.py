# SPDX-License-Identifier: BSD-3-Clause
"""A record file for each run, with which the next start can clean up after a crash."""
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

# Processes of a run have a mark in their environment, which every descendant inherits.

RUN_VARIABLE = 'PROCESS_VISUALIZER_RUN'
_TERM_TIMEOUT_S = 3.0
_CHECK_PERIOD_S = 0.05
_EXEC_S = 5.0  # maximum time of an exec, even on an overloaded computer
_EXEC_PERIOD_S = 0.002
_ENVIRONMENT = slice(47, 49)  # the fields of `_stat` with its start and end in memory
_LINUX = ('0', '2')  # the parents of kernel threads, which are not user programs


def processes_of_run(run_id: str) -> List[int]:
    """Return the ids of processes with the run's mark in their environment, except this process."""
    mark = f'{RUN_VARIABLE}={run_id}'.encode()
    pids = [int(path.name) for path in Path('/proc').iterdir() if path.name.isdigit()]
    return [pid for pid in pids if pid != os.getpid() and mark in _environment(pid).split(b'\0')]


def _environment(pid: int) -> bytes:
    """Return a process's environment; empty for ended ones, other users' and kernel threads.

    During an exec nothing can be read, although the kernel reports a nonempty environment, or does
    not report its address yet.
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
    """Return the fields of a process after its name: state, parent's id, …; see proc(5)."""
    return Path(f'/proc/{pid}/stat').read_text().rpartition(')')[2].split()


def names_of(pids: List[int]) -> List[str]:
    """Return the names of those processes that have not ended."""
    found = []
    for pid in pids:
        with contextlib.suppress(OSError):
            found.append(Path(f'/proc/{pid}/comm').read_text().strip())
    return found


def continue_processes(run_id: str) -> None:
    """Continue a run's processes stopped by SIGSTOP, which react only to SIGCONT and SIGKILL."""
    _signal_all(processes_of_run(run_id), signal.SIGCONT)


def start_time(pid: int) -> Optional[str]:
    """Return the start time of a process in kernel ticks, which distinguishes reused ids.

    None if there is no such process, or only a zombie.
    """
    try:
        fields = _stat(pid)
        return None if fields[0] == 'Z' else fields[19]
    except (OSError, IndexError):
        return None


def end_processes(run_id: str) -> List[int]:
    """End the processes of a run with SIGTERM, after 3 s with SIGKILL; return their ids."""
    ended: List[int] = []

    def end_more() -> bool:
        left = processes_of_run(run_id)
        more = [pid for pid in left if pid not in ended]  # started by others in the meantime
        _signal_all(more, signal.SIGTERM)
        ended.extend(more)
        return not left

    if not _wait_for(end_more, _TERM_TIMEOUT_S):
        _signal_all(processes_of_run(run_id), signal.SIGKILL)
        wait_until_gone(run_id, _TERM_TIMEOUT_S)
    return ended


def wait_until_gone(run_id: str, timeout_s: float) -> bool:
    """Wait for the end of a run's processes by polling, because they are not our children."""
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
    """Make a temporary folder for the files of a run, and return its path."""
    return tempfile.mkdtemp(prefix=_FOLDER_PREFIX)


def require_log_folder() -> None:
    """Check that ROS can write its logs; otherwise neither master nor nodes start.

    Raises:
        OSError: it cannot; the text names the folder and the remedy.
    """
    folder = rospkg.get_log_dir()
    try:
        os.makedirs(folder, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise OSError(error.errno, f'ROS cannot write its logs: {error.strerror}; set ROS_LOG_DIR '
                      'or ROS_HOME to a folder that can be written', folder) from error


class RunRecord:
    """The record of this process's run; ``run_id`` marks its processes."""

    def __init__(self) -> None:
        self.run_id = uuid.uuid4().hex
        self._path = _folder() / f'{self.run_id}.json'

    def write(self, folder: str = '', is_replay: bool = False) -> None:
        """Record the owner of the run, and the folder (by ``new_run_folder``) to remove with it.

        ``is_replay`` marks a run beside the owner's cell.
        """
        self._path.parent.mkdir(parents=True, exist_ok=True)
        owner = {'pid': os.getpid(), 'start_time': start_time(os.getpid()), 'folder': folder,
                 'is_replay': is_replay}
        written = self._path.with_suffix('.new')
        written.write_text(json.dumps(owner), encoding='utf-8')
        written.replace(self._path)  # so that a concurrent cleanup always finds a complete record

    def begin(self) -> str:
        """Make a temporary folder for the files of the run and record it; return its path.

        Raises:
            OSError: folder or record cannot be written; nothing is left behind.
        """
        folder = new_run_folder()
        try:
            self.write(folder)
        except OSError as error:
            shutil.rmtree(folder, ignore_errors=True)
            raise OSError(error.errno, f'the run cannot be registered: {error.strerror}; make '
                          'room, or set ROS_HOME to a folder that can be written',
                          str(self._path.parent)) from error
        return folder

    def remove(self) -> None:
        """Remove the record after the end of a run that has left nothing behind."""
        self._path.unlink(missing_ok=True)


def clean_up_crashed_runs() -> List[int]:
    """End the processes of runs without a living owner, remove their folders; return the ids."""
    ended: List[int] = []
    for path in sorted(_folder().glob('*.json')):
        owner = _owner(path)
        if not _lives(owner):
            ended += end_processes(path.stem)
            _remove_run_folder(owner)
            path.unlink(missing_ok=True)  # another program may be cleaning up, too
    return ended


def folder_of_run(owner_id: int) -> str:
    """Return the folder of the cell launched by a running process; empty if there is none.

    The process may have further runs: a replay, a master, a server for quick starts.
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
    """Remove a run folder by its prefix: a record edited by hand must not delete other folders."""
    folder = str(owner.get('folder') or '')
    if os.path.basename(folder).startswith(_FOLDER_PREFIX):
        shutil.rmtree(folder, ignore_errors=True)
