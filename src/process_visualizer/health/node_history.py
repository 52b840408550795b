# SPDX-License-Identifier: BSD-3-Clause
"""History of nodes: which ones never come up, and which ones end repeatedly.

The present states do not show this: a node that roslaunch restarts is down only for an instant; a
node that hangs before it registers with the master, or is not a ROS node, stays in state STARTING.
"""
from __future__ import annotations

from dataclasses import dataclass
from typing import Dict, Iterable, List, Optional

from process_visualizer.health.alarm_board import Action, Condition
from process_visualizer.health.device_state import Level
from process_visualizer.launching.part_report import (
    NodeReport,
    NodeState,
    PartReport,
    PartState,
    exit_words,
)

STARTS_WITHIN_S = 30.0
"""Time limit for a node's start: usually a few seconds, several times that on a busy computer."""
STEADY_AFTER_S = 20.0
"""Time after which a restarted node counts as stable."""
_NEVER_UP = (f'is still starting after {STARTS_WITHIN_S:.0f} s: it may be hanging, or not be a ROS '
             'node')
_UP = NodeState.STARTING, NodeState.RUNNING


@dataclass
class _Known:
    state: NodeState
    restarts: int
    since_s: float  # of the state
    restarted_s: float = 0.0
    exit_code: Optional[int] = None


class NodeHistory:
    """Remembers when nodes were started; times [s] come from a clock that does not jump."""

    def __init__(self) -> None:
        """Begin without nodes."""
        self._parts: Dict[str, Dict[str, _Known]] = {}
        self._begun_s: Dict[str, float] = {}

    def take(self, reports: Iterable[PartReport], now_s: float) -> None:
        """Update with the present reports of all parts; call this at each change."""
        present = [report for report in reports
                   if report.state not in (PartState.STOPPED, PartState.STOPPING)]
        self._begun_s = {it.part: self._begun_s.get(it.part, now_s) for it in present}
        self._parts = {it.part: self._followed(it, now_s) for it in present}

    def is_up(self, report: PartReport, now_s: float) -> bool:
        """Return whether a part has started, or is not worth waiting for any longer."""
        if report.state is not PartState.STARTING:
            return True
        if not report.nodes:
            return now_s - self._begun_s.get(report.part, now_s) >= STARTS_WITHIN_S
        return all(node.state is not NodeState.STARTING
                   or self._is_overdue(report.part, node, now_s) for node in report.nodes)

    def conditions(self, source: str, report: PartReport, restart: Action,
                   now_s: float) -> List[Condition]:
        """Return conditions for nodes of a part that do not come up, or were restarted recently."""
        found: List[Condition] = []
        for node in report.nodes:
            known = self._parts.get(report.part, {}).get(node.name)
            words, level = '', Level.WARNING
            if self._is_overdue(report.part, node, now_s):
                words = _NEVER_UP
            elif known is not None and node.restarts and node.state in _UP \
                    and now_s - known.restarted_s < STEADY_AFTER_S:
                words = f'{exit_words(known.exit_code)}, and was started again{_times(node)}'
                level = Level.BAD if known.exit_code else Level.WARNING
            if words:
                found.append(Condition(source, node.name, _about(source, node, words), level,
                                       (restart, Action.SHOW_LOG), report.part, node.name))
        return found

    def _followed(self, report: PartReport, now_s: float) -> Dict[str, _Known]:
        before = self._parts.get(report.part, {})
        return {node.name: _next(before.get(node.name), node, now_s) for node in report.nodes}

    def _is_overdue(self, part: str, node: NodeReport, now_s: float) -> bool:
        known = self._parts.get(part, {}).get(node.name)
        return (node.state is NodeState.STARTING and known is not None
                and now_s - known.since_s >= STARTS_WITHIN_S)


def _next(before: Optional[_Known], node: NodeReport, now_s: float) -> _Known:
    if before is None or node.restarts < before.restarts:
        return _Known(node.state, node.restarts, now_s, now_s, node.exit_code)
    is_same = node.state is before.state and node.restarts == before.restarts
    return _Known(node.state, node.restarts, before.since_s if is_same else now_s,
                  now_s if node.restarts > before.restarts else before.restarted_s,
                  node.exit_code if node.state is NodeState.EXITED else before.exit_code)


def _times(node: NodeReport) -> str:
    return f' {node.restarts} times' if node.restarts > 1 else ''


def _about(source: str, node: NodeReport, words: str) -> str:
    short = node.name.rpartition('/')[2]
    return words if short == source else f'{short} {words}'
