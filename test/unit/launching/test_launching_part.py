# SPDX-License-Identifier: BSD-3-Clause
"""A part of a cell, with a shell script instead of roslaunch."""
from __future__ import annotations

import subprocess
import threading
from pathlib import Path
from typing import Iterator, List, Mapping, Optional

import pytest
from surroundings import PATIENCE_S

from process_visualizer.generate.plan import Part
from process_visualizer.launching.launched_cell import LaunchedPart
from process_visualizer.launching.part_report import PartReport, PartState

FOREVER = "trap 'exit 0' INT; while :; do sleep 0.05; done"


class Launch:
    """Launched part with a script instead of roslaunch; collects its reports."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.script = ''
        self.arguments: List[str] = []
        self.reports: List[PartReport] = []
        self._changed = threading.Condition()
        self.part = LaunchedPart('arm', self._take, self._begin)

    def start(self, script: str, nodes: Optional[Mapping[str, str]] = None) -> None:
        """Start the part with a script."""
        self.script = script
        (self.folder / 'parts').mkdir(exist_ok=True)
        self.part.start(Part('parts/arm.launch', nodes or {}, 'digest'), str(self.folder))

    def wait_for(self, state: PartState) -> PartReport:
        """Wait until the part has this state."""
        with self._changed:
            assert self._changed.wait_for(
                lambda: bool(self.reports) and self.reports[-1].state is state,
                PATIENCE_S), self.reports
            return self.reports[-1]

    def _take(self, report: PartReport) -> None:
        with self._changed:
            self.reports.append(report)
            self._changed.notify_all()

    def _begin(self, arguments: List[str], environment: Mapping[str, str]
               ) -> 'subprocess.Popen[str]':
        self.arguments = arguments
        return subprocess.Popen(['sh', '-c', self.script], env=environment, text=True,
                                stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                                start_new_session=True)


def lives(pid: int) -> bool:
    """Return whether the process exists, and is not only a zombie."""
    try:
        return Path(f'/proc/{pid}/stat').read_text().rpartition(')')[2].split()[0] != 'Z'
    except OSError:
        return False


@pytest.fixture
def launch(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Launch]:
    """A part, stopped at the end."""
    monkeypatch.setenv('ROS_HOME', str(tmp_path / 'home'))
    monkeypatch.setenv('ROS_MASTER_URI', 'http://127.0.0.1:9')
    made = Launch(tmp_path)
    yield made
    made.part.stop()
    assert list((tmp_path / 'home').rglob('*.json')) == []


def test_arguments_and_log(launch: Launch) -> None:
    launch.start('echo a line; exit 0')
    assert launch.wait_for(PartState.RUNNING).nodes == ()
    assert launch.arguments[-1] == f'{launch.folder}/parts/arm.launch'
    assert (launch.folder / 'parts' / 'arm.log').read_text() == 'a line\n'


def test_nothing_to_launch(launch: Launch) -> None:
    launch.part.start(Part(None, {}, 'digest'), str(launch.folder))
    assert [report.state for report in launch.reports] == [PartState.STARTING, PartState.RUNNING]
    launch.part.stop()
    assert launch.part.report == PartReport('arm')


def test_stop(launch: Launch) -> None:
    launch.start(FOREVER, {'/arm/n': 'p/t'})
    launch.wait_for(PartState.STARTING)
    launch.part.stop()
    launch.part.stop()
    assert [report.state for report in launch.reports] == [
        PartState.STARTING, PartState.STOPPING, PartState.STOPPED]


def test_node_that_died(launch: Launch) -> None:
    launch.start('echo "process[arm/n-1]: started with pid [1]"; echo last words; echo '
                 '"[arm/n-1] process has died [pid 1, exit code 3, cmd x]."; ' + FOREVER,
                 {'/arm/n': 'p/t'})
    (node,) = launch.wait_for(PartState.RUNNING).dead_nodes
    assert (node.exit_code, node.log_tail) == (3, ('last words',))


def test_node_that_cannot_be_started_is_found_by_its_type(launch: Launch) -> None:
    launch.start('echo "ERROR: cannot launch node of type [p/t]: Cannot locate it"; ' + FOREVER,
                 {'/arm/n': 'p/t', '/arm/m': 'p/t'})
    nodes = launch.wait_for(PartState.RUNNING).dead_nodes
    assert [str(node) for node in nodes] == ['/arm/n: cannot be started: Cannot locate it',
                                             '/arm/m: cannot be started: Cannot locate it']


def test_roslaunch_that_fails(launch: Launch) -> None:
    launch.start('echo "RLException: the file is wrong"; exit 1', {'/arm/n': 'p/t'})
    report = launch.wait_for(PartState.FAILED)
    assert (report.reason, report.log_tail) == ('the file is wrong',
                                                ('RLException: the file is wrong',))


def test_roslaunch_that_is_killed_leaves_a_node(launch: Launch) -> None:
    launch.start('sleep 60 & echo "process[arm/n-1]: started with pid [$!]"; '
                 f'echo $! > {launch.folder}/pid; kill -KILL $$', {'/arm/n': 'p/t'})
    assert launch.wait_for(PartState.FAILED).reason == 'roslaunch: killed by SIGKILL'
    node = int((launch.folder / 'pid').read_text())
    assert lives(node)
    launch.part.stop()
    assert not lives(node)


def test_restart_after_a_failure(launch: Launch) -> None:
    launch.start('exit 1')
    launch.wait_for(PartState.FAILED)
    launch.part.stop()
    launch.start('exit 0')
    launch.wait_for(PartState.RUNNING)
    assert [report.state for report in launch.reports] == [
        PartState.STARTING, PartState.FAILED, PartState.STOPPING, PartState.STOPPED,
        PartState.STARTING, PartState.RUNNING]


def test_roslaunch_that_cannot_be_started(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def start(*_: object) -> 'subprocess.Popen[str]':
        raise ChildProcessError('no room')

    monkeypatch.setenv('ROS_HOME', str(tmp_path / 'home'))
    (tmp_path / 'parts').mkdir()
    part = LaunchedPart('arm', lambda report: None, start)
    part.start(Part('parts/arm.launch', {}, 'digest'), str(tmp_path))
    assert (part.report.state, part.report.reason) == (PartState.FAILED, 'no room')
    assert list((tmp_path / 'home').rglob('*.json')) == []
    part.stop()


def test_folder_that_is_gone(launch: Launch) -> None:
    launch.part.start(Part('gone/arm.launch', {}, 'digest'), str(launch.folder))
    assert 'No such file or directory' in launch.wait_for(PartState.FAILED).reason


