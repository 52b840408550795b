# SPDX-License-Identifier: BSD-3-Clause
"""The simulated cell in parts, with real nodes: start, restart, change, deaths, and end."""
from __future__ import annotations

import os
import signal
import threading
from dataclasses import replace
from pathlib import Path
from typing import Callable, Dict, Iterator, List
from xmlrpc.client import ServerProxy

import pytest
import rosgraph
from surroundings import PATIENCE_S, wait_until_alone

from process_visualizer.cell.model import Mode, Pose
from process_visualizer.cell.xml_parser import XmlParser
from process_visualizer.generate.choice import Choice, RvizStart, choose_devices
from process_visualizer.generate.generator import generate_parts
from process_visualizer.generate.plan import BAG_PART, FRAMES_PART, Plan
from process_visualizer.launching.launched_cell import LaunchedCell
from process_visualizer.launching.part_report import NodeState, PartReport, PartState
from process_visualizer.launching.ros_master import RosMaster
from process_visualizer.ros_names import SENSOR_FIT

OTHER = '<device type="other" name="{}">{}</device>'
NODE = '<node pkg="process_visualizer" type="cell_frames" name="n" output="log">{}</node>'
FRAMES = '<rosparam>frames: []</rosparam>'


class Observed:
    """A launched cell with all its reports."""

    def __init__(self, folder: Path) -> None:
        self.reports: Dict[str, PartReport] = {}
        self.history: List[PartReport] = []
        self._changed = threading.Condition()
        self.cell = LaunchedCell(str(folder), self._take)

    def wait_for(self, part: str, test: Callable[[PartReport], bool]) -> PartReport:
        """Wait until the latest report of a part passes the test."""
        with self._changed:
            assert self._changed.wait_for(
                lambda: part in self.reports and test(self.reports[part]), PATIENCE_S), self.reports
            return self.reports[part]

    def wait_until_up(self, plan: Plan) -> None:
        """Wait until all parts are running."""
        for part in plan.parts:
            self.wait_for(part, lambda report: report.state is PartState.RUNNING)

    def _take(self, report: PartReport) -> None:
        with self._changed:
            self.reports[report.part] = report
            self.history.append(report)
            self._changed.notify_all()


@pytest.fixture
def observed(master: RosMaster, tmp_path: Path) -> Iterator[Observed]:
    """A cell that is stopped in the end."""
    made = Observed(tmp_path / 'plan')
    yield made
    made.cell.stop()


def make_plan(config: str, devices: 'List[str] | None' = None,
              kinect: 'Pose | None' = None) -> Plan:
    cell = XmlParser().parse(config)
    choice = Choice(cell, Mode.REALTIME, choose_devices(cell, devices), RvizStart.NONE)
    if kinect is not None:
        device = cell.device('kinect')
        assert device.base is not None
        choice = choice.with_device(replace(device, base=replace(device.base, pose=kinect)))
    return generate_parts(choice)


def node_addresses() -> Dict[str, str]:
    """Return the addresses of the nodes by name: a restarted node has another one."""
    master = rosgraph.Master('/test')
    state = master.getSystemState()
    names = {name for topics in state for _, nodes in topics for name in nodes}
    return {name: master.lookupNode(name) for name in names if name != '/rosout'}


def pid_of(node: str) -> int:
    """Return the process id of a node."""
    answer = ServerProxy(rosgraph.Master('/test').lookupNode(node)).getPid('/test')
    assert isinstance(answer, list)
    return int(str(answer[2]))


def test_simulated_cell(observed: Observed, simulated_config: str, mark: str) -> None:
    plan = make_plan(simulated_config)
    observed.cell.prepare()
    observed.cell.start(plan)
    observed.wait_until_up(plan)
    names = {name for part in plan.parts.values() for name in part.nodes}
    before = node_addresses()
    assert set(before) == names
    assert {node.name for report in observed.cell.reports() for node in report.nodes} == names

    observed.cell.restart('ur_rt_upper')
    observed.wait_until_up(plan)
    after = node_addresses()
    assert {name for name in names if before[name] != after[name]} == set(
        plan.parts['ur_rt_upper'].nodes)

    moved = make_plan(simulated_config, kinect=Pose((1.0, 1.0, 1.0)))
    assert observed.cell.differing(moved) == [FRAMES_PART]
    observed.cell.adopt(moved)  # as if it had been given to the nodes
    assert observed.cell.differing(moved) == [] and node_addresses() == after

    fewer = make_plan(simulated_config, [
        'ur_rt_upper', 'ur_rt_lower', 'sewing_machine', 'cell_stand', 'simulator'])
    gone = {FRAMES_PART, BAG_PART, 'kinect'}
    assert set(observed.cell.differing(fewer)) == gone
    assert observed.cell.change(fewer, keep=gone) == []
    assert node_addresses() == after
    assert observed.cell.change(fewer) == [FRAMES_PART, BAG_PART]
    observed.wait_until_up(fewer)
    assert observed.reports['kinect'] == PartReport('kinect')
    last = node_addresses()
    assert set(last) == names - set(plan.parts['kinect'].nodes) - {f'/{SENSOR_FIT}'}
    assert {name for name in last if last[name] != after[name]} == {
        '/cell_frames', '/ghost', '/scene_watch', '/bag_recorder', '/view_relay'}
    assert observed.cell.change(fewer) == []

    observed.cell.stop()
    assert node_addresses() == {}
    assert all(report == PartReport(name) for name, report in observed.reports.items())
    wait_until_alone(mark, besides=['--core', 'rosmaster', 'rosout'])


def test_killed_node_with_the_end_of_its_log(observed: Observed, write_config: object,
                                             tmp_path: Path) -> None:
    program = tmp_path / 'talker.sh'
    program.write_text('#!/bin/sh\necho last words\necho complaint >&2\nexec "$@"\n')
    program.chmod(0o755)
    node = NODE.format(FRAMES).replace('<node', f'<node launch-prefix="{program}"')
    plan = make_plan(write_config(OTHER.format('box', node)))  # type: ignore[operator]
    observed.cell.start(plan)
    observed.wait_until_up(plan)
    os.kill(pid_of('/box/n'), signal.SIGKILL)
    report = observed.wait_for('box', lambda it: it.state is PartState.FAILED)
    (dead,) = report.dead_nodes
    assert (dead.name, dead.state, dead.exit_code) == ('/box/n', NodeState.EXITED, -9)
    assert {'last words', 'complaint'} <= set(dead.log_tail)
    assert report.reason == 'all nodes have ended: /box/n: killed by SIGKILL'
    observed.cell.restart('box')
    observed.wait_until_up(plan)
    os.kill(pid_of('/box/n'), signal.SIGKILL)
    observed.wait_for('box', lambda it: it.state is PartState.FAILED)
    assert '/box/n' in node_addresses()
    observed.cell.stop()
    assert node_addresses() == {}  # the master has forgotten it too


def test_part_that_roslaunch_cannot_load(observed: Observed, write_config: object) -> None:
    """The others start nevertheless."""
    observed.cell.start(make_plan(write_config(  # type: ignore[operator]
        OTHER.format('box', '<param name="p" command="false"/>') + OTHER.format('can', ''))))
    report = observed.wait_for('box', lambda it: it.state is PartState.FAILED)
    assert 'command' in report.reason
    for part in ('can', FRAMES_PART):
        observed.wait_for(part, lambda it: it.state is PartState.RUNNING)
