# SPDX-License-Identifier: BSD-3-Clause
"""A disk that becomes full when a test wants it."""
from __future__ import annotations

import contextlib
import os
import signal
import subprocess
from pathlib import Path
from types import TracebackType
from typing import Iterator, Optional, Type

_SIZE_MB = 4096  # more than a recorder wants to be free; nothing of it is taken


class SmallDisk:
    """A file system in memory; without the right to mount one, an ordinary folder."""

    def __init__(self, folder: Path) -> None:
        folder.mkdir()
        self.folder = folder
        self._is_mounted = self._mount('-t', 'tmpfs', '-o', f'size={_SIZE_MB}m', 'tmpfs')

    def fill(self, writer: int) -> None:
        """Leave no room; without a disk of its own, for the files of a process (its id) only."""
        if self._is_mounted:
            assert self._mount('-o', f'remount,size={self._used_bytes()}')
        else:
            with _stopped(writer):  # else it may have written more than is allowed then
                subprocess.run(['prlimit', '--pid', str(writer), f'--fsize={self._used_bytes()}'],
                               check=True)

    def __enter__(self) -> SmallDisk:
        return self

    def __exit__(self, _type: Optional[Type[BaseException]], _error: Optional[BaseException],
                 _traceback: Optional[TracebackType]) -> None:
        if self._is_mounted:
            subprocess.run(['umount', '--lazy', str(self.folder)], check=True)

    def _mount(self, *words: str) -> bool:
        return subprocess.run(['mount', *words, str(self.folder)],
                              stderr=subprocess.DEVNULL).returncode == 0

    def _used_bytes(self) -> int:
        return sum(512 * path.stat().st_blocks for path in self.folder.iterdir())


@contextlib.contextmanager
def _stopped(process: int) -> Iterator[None]:
    """Let a process do nothing meanwhile."""
    tasks = Path(f'/proc/{process}/task')
    os.kill(process, signal.SIGSTOP)
    try:
        while any(_state(task) not in 'Tt' for task in tasks.iterdir()):
            os.sched_yield()
        yield
    finally:
        os.kill(process, signal.SIGCONT)


def _state(task: Path) -> str:
    """The state of a thread, see proc(5)."""
    return (task / 'stat').read_text().rpartition(')')[2].split()[0]
