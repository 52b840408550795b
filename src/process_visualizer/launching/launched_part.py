# SPDX-License-Identifier: BSD-3-Clause
"""One part of a launched cell: its own roslaunch, and what is known about it."""
from __future__ import annotations

import threading
from functools import partial
from pathlib import Path
from typing import Callable, Mapping, Optional

from process_visualizer.generate.plan import Part
from process_visualizer.launching.log_tail import LogTail
from process_visualizer.launching.node_state import NodeReport, NodeState
from process_visualizer.launching.part_report import PartReport
from process_visualizer.launching.roslaunch_process import Start
from process_visualizer.launching.run import Run

OnChange = Callable[[PartReport], None]


class LaunchedPart:
    """Starts and stops a part; ``on_change`` is called in several threads, one at a time."""

    def __init__(self, name: str, on_change: OnChange, start: Start,
                 master_uri: Optional[str] = None) -> None:
        self._on_change = on_change
        self._start, self._master_uri = start, master_uri
        self._lock = threading.RLock()
        self._report = PartReport(name)
        self._part: Optional[Part] = None
        self._run: Optional[Run] = None
        self._tail = LogTail()

    @property
    def part(self) -> Optional[Part]:
        """The part that was started last."""
        return self._part

    @property
    def report(self) -> PartReport:
        """The latest report."""
        with self._lock:
            return self._report

    def start(self, part: Part, folder: str) -> None:
        """Start a launch file of the folder; failures are reported."""
        self._part = part
        self._tail = LogTail()
        self._change(lambda report: report.starting(part.nodes))
        if part.launch_file is None:
            self._change(lambda report: report.launched())
            return
        try:
            self._run = self._launch(Path(folder, part.launch_file))
        except OSError as error:
            reason = str(error)
            self._change(lambda report: report.failed(reason))

    def stop(self) -> None:
        """Stop it, and everything that it has left if it has failed."""
        self._change(lambda report: report.stopping())
        if self._run is not None:
            self._run.stop()
            self._run = None
        self._change(lambda report: report.stopped())

    def _launch(self, path: Path) -> Run:
        return Run(str(path), self._take_node, self._tail.add, self._take_end,
                   f'{path.stem}.log', self._start, self._master_uri)

    def _take_node(self, node: NodeReport) -> None:
        nodes = [node]
        if node.state is NodeState.FAILED and self._part is not None:
            nodes = [NodeReport(name).failed(node.reason)
                     for name in _nodes_of_type(self._part.nodes, node.name)]
        for changed in nodes:
            self._change(partial(PartReport.node_changed, node=changed))

    def _take_end(self, exit_code: int) -> None:
        run = self._run
        required = None if run is None else run.failed_required
        self._change(lambda report: report.ended(exit_code, self._tail.lines(), required))

    def _change(self, change: Callable[[PartReport], PartReport]) -> None:
        with self._lock:
            before, self._report = self._report, change(self._report)
            if self._report != before:
                self._on_change(self._report)


def _nodes_of_type(nodes: Mapping[str, str], package_and_type: str) -> 'list[str]':
    """roslaunch names a node that it cannot start by its executable."""
    return [name for name, type_name in nodes.items() if type_name == package_and_type]
