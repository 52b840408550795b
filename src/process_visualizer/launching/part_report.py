# SPDX-License-Identifier: BSD-3-Clause
"""The state of a launched part, and its possible changes."""
from __future__ import annotations

import signal
from dataclasses import dataclass, replace
from enum import Enum
from typing import Dict, FrozenSet, Iterable, Mapping, Optional, Tuple


def exit_words(code: Optional[int]) -> str:
    """Return a text about the end of a process; a negative exit code is the number of a signal."""
    if code is not None and code < 0:
        return f'killed by {_signal_words(-code)}'
    return f'ended with code {"unknown" if code is None else code}'


def _signal_words(number: int) -> str:
    try:
        return signal.Signals(number).name
    except ValueError:  # a signal without a name
        return f'signal {number}'


REPLACED = ('another node of the same name was started, so ROS has ended this one; stop the other '
            'one, then restart this one')


class NodeState(Enum):
    """State of a node: ``STARTING`` until it has registered with the master."""

    STARTING = 'starting'
    RUNNING = 'running'
    EXITED = 'exited'
    FAILED = 'cannot be started'


@dataclass(frozen=True)
class NodeReport:
    """A node's absolute name, its state, its exit code if any, and its number of restarts.

    ``log_tail`` has the last lines before its latest end.
    """

    name: str
    state: NodeState = NodeState.STARTING
    exit_code: Optional[int] = None
    restarts: int = 0
    reason: str = ''
    log_tail: Tuple[str, ...] = ()

    def started(self) -> 'NodeReport':
        """Return the report after roslaunch has started or restarted the process."""
        if self.state is NodeState.EXITED:
            return replace(self, state=NodeState.STARTING, exit_code=None,
                           restarts=self.restarts + 1)
        return replace(self, state=NodeState.STARTING, reason='')

    def registered(self) -> 'NodeReport':
        """Return the report after the registration; an ended process stays ended."""
        if self.state is not NodeState.STARTING:
            return self
        return replace(self, state=NodeState.RUNNING)

    def exited(self, exit_code: int, log_tail: Tuple[str, ...] = ()) -> 'NodeReport':
        """Return the report after the end of the process."""
        return replace(self, state=NodeState.EXITED, exit_code=exit_code, reason='',
                       log_tail=log_tail)

    def replaced(self) -> 'NodeReport':
        """Return the report after the end of the process, if another one now has its name."""
        return replace(self, reason=REPLACED) if self.state is NodeState.EXITED else self

    @property
    def end_words(self) -> str:
        """Return a text about the end of the process, with the reason if it is known."""
        return ': '.join(filter(None, [exit_words(self.exit_code), self.reason]))

    def failed(self, reason: str) -> 'NodeReport':
        """Return the report after roslaunch failed to start the process."""
        return replace(self, state=NodeState.FAILED, exit_code=None, reason=reason)

    def __str__(self) -> str:
        is_over = self.state is NodeState.EXITED
        text = f'{self.name}: {exit_words(self.exit_code) if is_over else self.state.value}'
        if self.reason:
            text += f': {self.reason}'
        if self.restarts:
            text += f' (restarted {self.restarts} time{"s" if self.restarts > 1 else ""})'
        return text


class PartState(Enum):
    """State of a part: ``STARTING`` until no node is starting, then ``RUNNING``.

    ``RUNNING`` does not depend on later changes of nodes. ``FAILED`` if roslaunch has ended by
    itself; ``STOPPED`` if the part was stopped, or if all of its nodes have ended normally.
    """

    STARTING = 'starting'
    RUNNING = 'running'
    FAILED = 'failed'
    STOPPING = 'stopping'
    STOPPED = 'stopped'


_NEXT: Mapping[PartState, FrozenSet[PartState]] = {
    PartState.STOPPED: frozenset({PartState.STARTING}),
    PartState.STARTING: frozenset({PartState.RUNNING, PartState.FAILED, PartState.STOPPING,
                                   PartState.STOPPED}),
    PartState.RUNNING: frozenset({PartState.FAILED, PartState.STOPPING, PartState.STOPPED}),
    PartState.FAILED: frozenset({PartState.STOPPING}),
    PartState.STOPPING: frozenset({PartState.STOPPED}),
}


@dataclass(frozen=True)
class PartReport:
    """A part's name, its state, and the latest report of each of its nodes.

    For a FAILED part, ``reason`` is set, and ``log_tail`` has the last lines of its roslaunch.
    """

    part: str
    state: PartState = PartState.STOPPED
    nodes: Tuple[NodeReport, ...] = ()
    reason: str = ''
    log_tail: Tuple[str, ...] = ()

    @property
    def dead_nodes(self) -> Tuple[NodeReport, ...]:
        """The nodes that have failed, or could not be started."""
        return tuple(node for node in self.nodes if node.state is NodeState.FAILED
                     or node.state is NodeState.EXITED and node.exit_code != 0)

    @property
    def has_died(self) -> bool:
        """Return whether the part, or one of its nodes, has failed."""
        return self.state is PartState.FAILED or bool(self.dead_nodes)

    def starting(self, nodes: Iterable[str]) -> 'PartReport':
        """Return the report of a part that is being started, with the names of its nodes."""
        begun = replace(self._become(PartState.STARTING), reason='', log_tail=())
        return replace(begun, nodes=tuple(NodeReport(name) for name in nodes))

    def node_changed(self, node: NodeReport) -> 'PartReport':
        """Return the report after a change of a node, which is ignored unless the part is up."""
        if self.state not in (PartState.STARTING, PartState.RUNNING):
            return self
        nodes: Dict[str, NodeReport] = {known.name: known for known in self.nodes}
        nodes[node.name] = node
        return replace(self, nodes=tuple(nodes.values()))._up_if_complete()

    def launched(self) -> 'PartReport':
        """Return the report after everything has been launched."""
        return self._up_if_complete()

    def ended(self, exit_code: int, log_tail: Tuple[str, ...] = (),
              required: Optional[NodeReport] = None) -> 'PartReport':
        """Return the report after the end of roslaunch, unexpected unless the part is stopping."""
        if self.state not in (PartState.STARTING, PartState.RUNNING):
            return self
        if exit_code == 0 and required is None and not self.nodes:
            return self._up_if_complete()
        if exit_code == 0 and all(_ended_well(node) for node in self.nodes):
            return self._become(PartState.STOPPED)
        return replace(self._become(PartState.FAILED), log_tail=log_tail,
                       reason=_reason(self, exit_code, log_tail, required))

    def failed(self, reason: str) -> 'PartReport':
        """Return the report of a part that cannot be started."""
        return replace(self._become(PartState.FAILED), reason=reason)

    def stopping(self) -> 'PartReport':
        """Return the report of a part that is being stopped; a stopped part is unchanged."""
        return self if self.state is PartState.STOPPED else self._become(PartState.STOPPING)

    def stopped(self) -> 'PartReport':
        """Return the report after the end of everything."""
        stopped = self if self.state is PartState.STOPPED else self._become(PartState.STOPPED)
        return replace(stopped, nodes=(), reason='', log_tail=())

    def _up_if_complete(self) -> 'PartReport':
        is_starting = any(node.state is NodeState.STARTING for node in self.nodes)
        if self.state is not PartState.STARTING or is_starting:
            return self
        return self._become(PartState.RUNNING)

    def _become(self, state: PartState) -> 'PartReport':
        if state not in _NEXT[self.state]:
            raise ValueError(f'the part "{self.part}" is {self.state.value}; it cannot become '
                             f'{state.value}')
        return replace(self, state=state)


def _ended_well(node: NodeReport) -> bool:
    return node.state is NodeState.EXITED and node.exit_code == 0


def _reason(part: PartReport, exit_code: int, log_tail: Tuple[str, ...],
            required: Optional[NodeReport]) -> str:
    """Return the first known reason of the end."""
    if required is not None:
        return f'the required node {required}'
    if part.dead_nodes:
        return 'all nodes have ended: ' + ', '.join(str(node) for node in part.dead_nodes)
    errors = [line.split('RLException: ')[-1] for line in log_tail
              if 'RLException: ' in line or line.startswith('ERROR')]
    if errors:
        return errors[-1]
    return f'roslaunch: {exit_words(exit_code)}'
