# SPDX-License-Identifier: BSD-3-Clause
"""The state of a launched node, and which changes are possible."""
from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum
from typing import Optional, Tuple

from process_visualizer.launching.exit_words import exit_words


class NodeState(Enum):
    """``STARTING`` until the node has registered with the master."""

    STARTING = 'starting'
    RUNNING = 'running'
    EXITED = 'exited'
    FAILED = 'cannot be started'


@dataclass(frozen=True)
class NodeReport:
    """A node's name (absolute), state, exit code if it has one, and how often it was restarted.

    ``log_tail`` are the last lines before its last end.
    """

    name: str
    state: NodeState = NodeState.STARTING
    exit_code: Optional[int] = None
    restarts: int = 0
    reason: str = ''
    log_tail: Tuple[str, ...] = ()

    def started(self) -> 'NodeReport':
        """roslaunch has started the process, or started it again."""
        if self.state is NodeState.EXITED:
            return replace(self, state=NodeState.STARTING, exit_code=None,
                           restarts=self.restarts + 1)
        return replace(self, state=NodeState.STARTING, reason='')

    def registered(self) -> 'NodeReport':
        """The master knows the node; a process that has ended stays ended."""
        if self.state is not NodeState.STARTING:
            return self
        return replace(self, state=NodeState.RUNNING)

    def exited(self, exit_code: int, log_tail: Tuple[str, ...] = ()) -> 'NodeReport':
        """The process has ended."""
        return replace(self, state=NodeState.EXITED, exit_code=exit_code, reason='',
                       log_tail=log_tail)

    def failed(self, reason: str) -> 'NodeReport':
        """roslaunch could not start the process."""
        return replace(self, state=NodeState.FAILED, exit_code=None, reason=reason)

    def __str__(self) -> str:
        is_over = self.state is NodeState.EXITED
        text = f'{self.name}: {exit_words(self.exit_code) if is_over else self.state.value}'
        if self.reason:
            text += f': {self.reason}'
        if self.restarts:
            text += f' (restarted {self.restarts} time{"s" if self.restarts > 1 else ""})'
        return text
