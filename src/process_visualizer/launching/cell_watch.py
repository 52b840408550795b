# SPDX-License-Identifier: BSD-3-Clause
"""A watch that checks whether the launched nodes and their master answer.

The node ``scene_watch`` does the same for the scene, and ``cell_frames`` checks ``scene_watch``.
This watch is neither a node nor a child of roslaunch, so it survives whatever stops all of these.
"""
from __future__ import annotations

import threading
import time
from dataclasses import dataclass, field
from typing import Callable, Collection, Dict, FrozenSet, Mapping, Optional, Set

import rosgraph

from process_visualizer.health.node_pulse import (
    ENDED,
    SILENT,
    Connect,
    MasterLookup,
    Pulses,
    connecting,
)
from process_visualizer.launching.ros_api import CALLER_ID, Master, MasterClient

_STEP_S = 0.2
_MASTER_PERIOD_S = 1.0
_REFUSES_S = 3.0
"""Time of refusals that shows that a node's process still runs: roslaunch reports an end sooner."""
_MAX_FAILURES = 2
"""Number of consecutive unanswered questions that makes a problem; a busy master may miss one."""
MASTER_SILENT = ('is not responding; recording continues, but robots in the picture may freeze. '
                 'If it does not come back, stop the cell and start it again')
MASTER_OTHER = ('was restarted, and does not know the running nodes; stop the cell and start '
                'it again')


@dataclass(frozen=True)
class CellLook:
    """The names of the silent nodes, and the problem of the master, or ''.

    ``since_s`` is when each silent node was asked first without answering [s, monotonic].
    """

    silent: FrozenSet[str] = frozenset()
    master_problem: str = ''
    since_s: Mapping[str, float] = field(default_factory=dict, compare=False)


class CellWatch:
    """Asks nodes and master in its own thread, from ``begin`` to ``close``; reports changes."""

    def __init__(self, running: Callable[[], Collection[str]],
                 on_change: Callable[[CellLook], None], master: Optional[Master] = None,
                 connect: Connect = connecting, refuses_s: float = _REFUSES_S) -> None:
        """Prepare the watch, without asking yet.

        Args:
            running: returns the names of the nodes that are up and should answer.
            on_change: called in the thread.
            master: the master to ask; None for that of this process.
            connect: see `Pulses`.
            refuses_s: time of refusals after which a node counts as silent.
        """
        self._refuses_s = refuses_s
        self._running, self._on_change = running, on_change
        self._master: Master = master or MasterClient(CALLER_ID)
        self._lookup = MasterLookup(self._master)
        self._pulses = Pulses(self._lookup, connect)
        self._look = CellLook()
        self._refused_from_s: Dict[str, float] = {}
        self._process_id: Optional[int] = None
        self._failures = 0
        self._is_other = False
        self._next_master_s = 0.0
        self._closed = threading.Event()
        self._thread = threading.Thread(target=self._run, name='watch nodes', daemon=True)

    def begin(self) -> None:
        """Start asking."""
        self._thread.start()

    def close(self) -> None:
        """Stop asking and reporting; a pending question may still be answered."""
        self._closed.set()

    def step(self, now_s: float, longest_s: float) -> None:
        """Ask the nodes that are due, wait for answers for a limited time, and report changes.

        Args:
            now_s: the present time of a clock that does not jump.
            longest_s: the maximum time to wait.
        """
        running = frozenset(self._running())
        if not running:
            self._process_id, self._failures, self._is_other = None, 0, False  # of another cell
            self._tell(CellLook())
            self._closed.wait(longest_s)
            return
        if now_s >= self._next_master_s:
            self._next_master_s = now_s + _MASTER_PERIOD_S
            self._ask_master()
        self._pulses.watch(running, are_expected=True)
        self._pulses.step(now_s, longest_s)
        silent = {name for name in running if self._pulses.nodes[name].problem == SILENT}
        silent |= self._refusing(running, now_s)
        self._tell(CellLook(frozenset(silent), self._master_problem(), {
            name: self._pulses.nodes[name].problem_since_s for name in silent}))

    def _refusing(self, running: Collection[str], now_s: float) -> Set[str]:
        """Return the nodes whose process runs but no longer accepts questions."""
        self._refused_from_s = {
            name: self._refused_from_s.get(name, now_s) for name in running
            if self._pulses.nodes[name].problem == ENDED and not self._is_other}
        return {name for name, from_s in self._refused_from_s.items()
                if now_s - from_s >= self._refuses_s}

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
            self._lookup.is_silent = True  # until the master is asked again
            self._failures += 1
            return
        self._lookup.is_silent, self._failures = False, 0
        self._process_id = self._process_id or process_id
        self._is_other = process_id != self._process_id

    def _master_problem(self) -> str:
        if self._failures >= _MAX_FAILURES:
            return MASTER_SILENT
        return MASTER_OTHER if self._is_other else ''
