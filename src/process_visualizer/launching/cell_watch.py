# SPDX-License-Identifier: BSD-3-Clause
"""Asks the nodes that were launched whether they answer, and their master.

In the scene ``scene_watch`` does the same, and ``cell_frames`` asks that: this watch is neither a
node nor a child of roslaunch, so what stops all of those does not stop it.
"""
from __future__ import annotations

import threading
import time
from typing import Callable, Collection, FrozenSet, NamedTuple, Optional

import rosgraph

from process_visualizer.launching.asked_master import AskedMaster, Master
from process_visualizer.launching.node_pulse import (
    SILENT,
    Connect,
    LookupUnanswered,
    Pulses,
    connecting,
)
from process_visualizer.launching.ros_api import CALLER_ID

_STEP_S = 0.2
_MASTER_PERIOD_S = 1.0
_MOST_FAILURES = 2
"""Most questions in a row without an answer; a busy master may miss one."""
MASTER_SILENT = ('is not responding; nodes go on, but if it does not come back, stop the cell and '
                 'start it again')
MASTER_OTHER = ('was started anew, and does not know the nodes that run; stop the cell and start '
                'it again')


class CellLook(NamedTuple):
    """The nodes that do not answer, by their names, and what is wrong with the master, or ''."""

    silent: FrozenSet[str] = frozenset()
    master: str = ''


class CellWatch:
    """Asks in a thread of its own, from ``begin`` to ``close``; tells what has changed."""

    def __init__(self, running: Callable[[], Collection[str]],
                 on_change: Callable[[CellLook], None], master: Optional[Master] = None,
                 connect: Connect = connecting) -> None:
        """Ask nobody yet.

        Args:
            running: returns the names of the nodes that are up, and should answer.
            on_change: called in the thread.
            master: the one to ask; that of this process if None.
            connect: see `Pulses`.
        """
        self._running, self._on_change = running, on_change
        self._master: Master = master or AskedMaster(CALLER_ID)
        self._pulses = Pulses(self._uri, connect)
        self._look = CellLook()
        self._process_id: Optional[int] = None
        self._failures = 0
        self._is_master_silent = self._is_other = False
        self._next_master_s = 0.0
        self._closed = threading.Event()
        self._thread = threading.Thread(target=self._run, name='watch nodes', daemon=True)

    def begin(self) -> None:
        """Start asking."""
        self._thread.start()

    def close(self) -> None:
        """Stop asking, and tell nothing any more; a question under way may still be answered."""
        self._closed.set()

    def step(self, now_s: float, longest_s: float) -> None:
        """Ask who is to be asked now, wait for answers for a limited time [s], and tell.

        Args:
            now_s: the present time of a clock that does not jump.
            longest_s: how long to wait.
        """
        running = frozenset(self._running())
        if not running:
            self._process_id, self._failures, self._is_other = None, 0, False  # another cell's
            self._tell(CellLook())
            self._closed.wait(longest_s)
            return
        if now_s >= self._next_master_s:
            self._next_master_s = now_s + _MASTER_PERIOD_S
            self._ask_master()
        self._pulses.watch(running, are_expected=True)
        self._pulses.step(now_s, longest_s)
        silent = {name for name in running if self._pulses.nodes[name].problem == SILENT}
        self._tell(CellLook(frozenset(silent), self._master_problem()))

    def _run(self) -> None:
        while not self._closed.is_set():
            self.step(time.monotonic(), _STEP_S)

    def _tell(self, look: CellLook) -> None:
        if look != self._look and not self._closed.is_set():
            self._look = look
            self._on_change(look)

    def _ask_master(self) -> None:
        try:
            process_id = self._master.getPid()
        except (rosgraph.MasterException, OSError):
            self._is_master_silent = True
            self._failures += 1
            return
        self._is_master_silent, self._failures = False, 0
        self._process_id = self._process_id or process_id
        self._is_other = process_id != self._process_id

    def _master_problem(self) -> str:
        if self._failures >= _MOST_FAILURES:
            return MASTER_SILENT
        return MASTER_OTHER if self._is_other else ''

    def _uri(self, node: str) -> Optional[str]:
        """See Lookup. A master that does not answer is asked again a second later."""
        if self._is_master_silent:
            raise LookupUnanswered
        try:
            return self._master.lookupNode(node)
        except rosgraph.MasterException:
            return None
        except OSError:
            self._is_master_silent = True
            raise LookupUnanswered from None
