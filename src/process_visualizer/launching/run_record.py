"""A file for each run, so that the next start can clean up after a crash."""
from __future__ import annotations

import json
import os
import uuid
from pathlib import Path
from typing import List

import rospkg

from process_visualizer.launching.process_scan import end_processes, start_time


class RunRecord:
    """The record of this process's run; ``run_id`` marks its processes."""

    def __init__(self) -> None:
        self.run_id = uuid.uuid4().hex
        self._path = _folder() / f'{self.run_id}.json'

    def write(self) -> None:
        """Note who owns the run."""
        self._path.parent.mkdir(parents=True, exist_ok=True)
        owner = {'pid': os.getpid(), 'start_time': start_time(os.getpid())}
        self._path.write_text(json.dumps(owner), encoding='utf-8')

    def remove(self) -> None:
        """The run is over and left nothing."""
        self._path.unlink(missing_ok=True)


def clean_up_crashed_runs() -> List[int]:
    """End the processes of runs whose owner is gone; returns their ids."""
    ended: List[int] = []
    for path in sorted(_folder().glob('*.json')):
        if not _owner_lives(path):
            ended += end_processes(path.stem)
            path.unlink(missing_ok=True)  # another program may be cleaning up, too
    return ended


def _folder() -> Path:
    return Path(rospkg.get_ros_home()) / 'process_visualizer' / 'runs'


def _owner_lives(path: Path) -> bool:
    try:
        owner = json.loads(path.read_text(encoding='utf-8'))
        return owner['start_time'] is not None and start_time(owner['pid']) == owner['start_time']
    except (OSError, ValueError, KeyError, TypeError):
        return False
