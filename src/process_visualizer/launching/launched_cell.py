# SPDX-License-Identifier: BSD-3-Clause
"""A cell in parts, each of which can be restarted while the others keep running."""
from __future__ import annotations

import threading
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Callable, Collection, Dict, Iterable, Iterator, List, Mapping, Optional, Sequence

from process_visualizer.generate.plan import Part, Plan, write_plan
from process_visualizer.launching.part_report import NodeReport, NodeState, PartReport
from process_visualizer.launching.roslaunch_process import RoslaunchForks, Start, launch_environment
from process_visualizer.launching.run import LaunchRun, LogTail
from process_visualizer.launching.run_record import clean_up_crashed_runs

OnChange = Callable[[PartReport], None]


class LaunchedPart:
    """Starts and stops a part; ``on_change`` is called from several threads, one at a time."""

    def __init__(self, name: str, on_change: OnChange, start: Start,
                 master_uri: Optional[str] = None) -> None:
        self._on_change = on_change
        self._start, self._master_uri = start, master_uri
        self._lock = threading.RLock()
        self._report = PartReport(name)
        self._part: Optional[Part] = None
        self._run: Optional[LaunchRun] = None
        self._tail = LogTail()

    @property
    def part(self) -> Optional[Part]:
        """The part that is running, or that was started last."""
        return self._part

    def adopt(self, part: Part) -> None:
        """Replace the running part, without a restart, by one that launches the same."""
        self._part = part

    @property
    def report(self) -> PartReport:
        """The latest report."""
        with self._lock:
            return self._report

    def start(self, part: Part, folder: str) -> None:
        """Start the part's launch file in the folder; failures appear in the report."""
        self._part = part
        self._tail = LogTail()
        self._change(lambda report: report.starting(part.nodes))
        if part.launch_file is None:
            self._change(lambda report: report.launched())
            return
        try:
            path = Path(folder, part.launch_file)
            self._run = LaunchRun(str(path), self._take_node, self._tail.add, self._take_end,
                                  f'{path.stem}.log', self._start, self._master_uri)
        except OSError as error:
            reason = str(error)
            self._change(lambda report: report.failed(reason))

    def stop(self) -> None:
        """Stop the part, and everything left behind by a failed one."""
        self._change(lambda report: report.stopping())
        if self._run is not None:
            self._run.stop(self._tail.add)
            self._run = None
        self._change(lambda report: report.stopped())

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
    """Return the nodes of a type: roslaunch reports a node that cannot start as package/type."""
    return [name for name, type_name in nodes.items() if type_name == package_and_type]


class LaunchedCell:
    """Runs a roslaunch for each part of a plan; needs a running ROS master.

    The methods block; call them from one thread. ``on_change`` is called from other threads, but
    for each part from one at a time; it must not wait for a method of this object.
    """

    def __init__(self, folder: str, on_change: OnChange,
                 master_uri: Optional[str] = None, niceness: int = 0,
                 variables: Optional[Mapping[str, str]] = None) -> None:
        """``folder`` receives the plan's files and the logs of the parts.

        ``master_uri`` is set for another master than that of this process; see RoslaunchForks for
        ``niceness`` and ``variables``.
        """
        self._folder, self._master_uri = folder, master_uri
        self._on_change = on_change
        self._forks = RoslaunchForks(niceness, variables)
        self._parts: Dict[str, LaunchedPart] = {}

    def prepare(self) -> List[int]:
        """Load roslaunch in advance, for a faster start; end the processes left by crashed runs.

        Returns the ids of the ended processes.
        """
        ended = clean_up_crashed_runs()
        self._forks.prepare()
        return ended

    def start(self, plan: Plan) -> None:
        """Start all parts, after stopping the running ones.

        Returns while the parts are starting; ``on_change`` reports the rest, including failures.

        Raises:
            PlanError: the files cannot be written.
        """
        self._stop(list(self._parts))
        self.change(plan)

    def differing(self, plan: Plan) -> List[str]:
        """Return the launched parts, failed ones included, that the plan changes or removes."""
        return [name for name, part in self._parts.items() if part.part != plan.parts.get(name)]

    def change(self, plan: Plan, keep: Collection[str] = ()) -> List[str]:
        """Stop removed parts, restart changed ones, start new ones; the others keep running.

        Parts in ``keep`` keep running unchanged. Returns the names of the started parts.

        Raises:
            PlanError: the files cannot be written; nothing has changed then.
        """
        write_plan(plan, self._folder)
        stopped = [name for name in self.differing(plan) if name not in keep]
        started = [name for name in plan.parts if name not in self._parts or name in stopped]
        with self._loaded(plan.parts[name] for name in started):
            self._stop(stopped)
            for name in started:
                self._parts[name] = LaunchedPart(name, self._on_change, self._forks.start,
                                                 self._master_uri)
                self._parts[name].start(plan.parts[name], self._folder)
        return started

    def adopt(self, plan: Plan) -> None:
        """Replace the running parts, without a restart, by those of a plan that launches the same.

        Raises:
            PlanError: the files cannot be written; nothing has changed then.
        """
        write_plan(plan, self._folder)
        for name, launched in self._parts.items():
            if name in plan.parts:
                launched.adopt(plan.parts[name])

    def restart(self, name: str) -> None:
        """Stop a part and start it again.

        Raises:
            KeyError: there is no such part.
        """
        launched, part = self._parts[name], self._parts[name].part
        with self._loaded([] if part is None else [part]):
            launched.stop()
            if part is not None:
                launched.start(part, self._folder)

    def stop(self) -> None:
        """Stop all parts at the same time; return when nothing is left."""
        try:
            self._stop(list(self._parts))
        finally:
            self._forks.close()

    def reports(self) -> List[PartReport]:
        """Return the latest report of each part."""
        return [part.report for part in self._parts.values()]

    @contextmanager
    def _loaded(self, parts: Iterable[Part]) -> Iterator[None]:
        """Load the launch files of parts while other parts are still being stopped."""
        try:
            for part in parts:
                if part.launch_file is not None:
                    self._forks.load(str(Path(self._folder, part.launch_file)),
                                     launch_environment(self._master_uri))
            yield
        finally:
            self._forks.discard()

    def _stop(self, names: Sequence[str]) -> None:
        parts = [self._parts.pop(name) for name in names]
        with ThreadPoolExecutor(max(1, len(parts)), 'stop part') as pool:
            list(pool.map(LaunchedPart.stop, parts))
