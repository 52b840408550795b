# SPDX-License-Identifier: BSD-3-Clause
"""Says on /diagnostics which nodes do not answer, for programs that show it."""
from __future__ import annotations

from typing import Dict, Mapping, NamedTuple

from process_visualizer.nodes.common.complaints import Complaints
from process_visualizer.nodes.common.node_handle import NodeHandle
from process_visualizer.ros_names import CONCERNED_KEY, SILENT_NODE_KEY

_LOG_PERIOD_S = 20.0


class SilentNode(NamedTuple):
    """The device that a node belongs to ('': the program itself), and what its silence means."""

    device: str
    meaning: str


class SilentNodes:
    """The nodes that were silent when it was told last."""

    def __init__(self, node: NodeHandle) -> None:
        """``node`` is the one that asks."""
        self._complaints = Complaints(node, node.name.strip('/'))
        self._told: Mapping[str, SilentNode] = {}

    def tell(self, silent: Mapping[str, SilentNode]) -> None:
        """Say that these nodes are silent now, by their names, and the others no longer."""
        for name in set(self._told) - set(silent):
            self._complaints.end(name)
        for name, it in silent.items():
            values: Dict[str, str] = {SILENT_NODE_KEY: name, CONCERNED_KEY: it.device}
            short = name.rpartition('/')[2]
            self._complaints.state(name, f'{short} is not responding: {it.meaning}', values,
                                   _LOG_PERIOD_S)
        self._told = dict(silent)
