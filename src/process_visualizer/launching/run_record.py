# SPDX-License-Identifier: BSD-3-Clause
"""A file for each run, so that the next start can clean up after a crash."""
from __future__ import annotations

import json
import os
import shutil
import tempfile
import uuid
from pathlib import Path
from typing import Any, Dict, List

import rospkg

from process_visualizer.launching.process_scan import end_processes, start_time

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
        owner = json.loads(path.read_text(encoding='utf-8'))
    except (OSError, ValueError):
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
