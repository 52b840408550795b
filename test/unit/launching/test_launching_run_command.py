# SPDX-License-Identifier: BSD-3-Clause
"""Signals to the command that runs a cell, and its exit code."""
from __future__ import annotations

import signal
from pathlib import Path
from types import SimpleNamespace
from typing import Any, List, NamedTuple, Optional, Tuple
from unittest.mock import Mock

import pytest

from process_visualizer.cell.model import Mode
from process_visualizer.commands import run_command
from process_visualizer.commands.run_command import exit_code, nodes_to_ask
from process_visualizer.generate.choice import RvizStart
from process_visualizer.interrupts import StopRequested, StopSignals
from process_visualizer.launching.part_report import NodeReport, NodeState


class EndedRun(NamedTuple):
    """The data that the command reads from a run that has ended."""

    failed_required: Optional[NodeReport]
    states: Tuple[NodeState, ...]
    log_path: Path = Path('cell.log')
    killed_by: str = ''

    def reports(self) -> List[NodeReport]:
        """Report of each node."""
        return [NodeReport('/node', state) for state in self.states]


def test_a_cell_that_is_stopped_before_anything_started_has_not_failed(
        capsys: pytest.CaptureFixture[str]) -> None:
    run: Any = EndedRun(None, ())
    assert exit_code(run, True) == 0
    assert not capsys.readouterr().err


@pytest.mark.parametrize('required, states, code, told', [
    (NodeReport('/driver', NodeState.FAILED, 3), (NodeState.RUNNING,), 1, '/driver'),
    (NodeReport('/rviz', NodeState.EXITED, 0), (NodeState.EXITED,), 0, ''),  # it was closed
    (None, (NodeState.RUNNING, NodeState.FAILED), 0, ''),
    (None, (NodeState.FAILED,), 1, 'nothing could be started'),
    (None, (), 1, 'nothing could be started')])
def test_the_exit_code_tells_whether_it_ran(
        required: Optional[NodeReport], states: Tuple[NodeState, ...], code: int, told: str,
        capsys: pytest.CaptureFixture[str]) -> None:
    run: Any = EndedRun(required, states)
    assert exit_code(run) == code
    error = capsys.readouterr().err
    assert told in error and bool(error) == bool(told)
    assert bool(error) == ('cell.log' in error)


@pytest.mark.parametrize('code', [0, 1])
def test_the_folder_with_the_log_of_a_failure_is_left_to_the_next_start(
        code: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv('ROS_HOME', str(tmp_path))
    monkeypatch.setenv('ROS_LOG_DIR', str(tmp_path / 'log'))
    for name in ('clean_up_crashed_runs', 'refuse_other_cell', 'give_real_time_advice'):
        monkeypatch.setattr(run_command, name, lambda *_arguments: None)
    folders: List[Path] = []
    monkeypatch.setattr(run_command, 'write_plan',
                        lambda _plan, folder: folders.append(Path(folder)))
    monkeypatch.setattr(run_command, '_run', lambda _file, _choice: code)
    choice: Any = SimpleNamespace(cell=SimpleNamespace(machines=()), mode=Mode.REALTIME,
                                  rviz=RvizStart.NONE)
    assert run_command.run_plan(Mock(), None, choice) == code
    [folder], records = folders, list(tmp_path.rglob('*.json'))
    assert folder.exists() is bool(code)
    assert len(records) == code, 'it has the folder, which the next start removes'
    if code:
        assert str(folder) in records[0].read_text()
        folder.rmdir()


def test_a_master_that_takes_all_nodes_with_it_is_a_failure(
        capsys: pytest.CaptureFixture[str]) -> None:
    master = NodeReport('/master').started().exited(-9)
    run: Any = EndedRun(master, (NodeState.EXITED,))
    assert exit_code(run) == 1
    assert capsys.readouterr().err.startswith('the ROS master is gone (killed by SIGKILL)')


def test_the_last_words_of_a_required_node_are_shown(capsys: pytest.CaptureFixture[str]) -> None:
    words = 'qt.qpa.xcb: could not connect to display :7'
    run: Any = EndedRun(NodeReport('/rviz', NodeState.EXITED, -6, log_tail=('', words)), ())
    assert exit_code(run) == 1
    assert capsys.readouterr().err == (
        f'the required node /rviz: killed by SIGABRT; see cell.log, which ends:\n  {words}\n')


def test_nobody_is_asked_while_roslaunch_stops_everything() -> None:
    run: Any = EndedRun(None, (NodeState.RUNNING, NodeState.STARTING))
    assert nodes_to_ask(run) == {'/node'}
    run = EndedRun(NodeReport('/rviz', NodeState.EXITED, 1), (NodeState.RUNNING,))
    assert nodes_to_ask(run) == set()


def test_a_roslaunch_that_was_killed_is_a_failure(capsys: pytest.CaptureFixture[str]) -> None:
    run: Any = EndedRun(None, (NodeState.RUNNING,), killed_by='killed by SIGKILL')
    assert exit_code(run) == 1
    assert 'roslaunch was killed by SIGKILL, and all nodes were ended' in capsys.readouterr().err


SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


def handlers() -> List[Any]:
    return [signal.getsignal(number) for number in SIGNALS]


@pytest.mark.parametrize('second', SIGNALS)
def test_a_second_signal_does_not_interrupt_the_end(second: signal.Signals) -> None:
    before = handlers()
    with StopSignals() as signals:
        with pytest.raises(StopRequested), signals.raised():
            signal.raise_signal(signal.SIGINT)
        signal.raise_signal(second)
    assert handlers() == before


@pytest.mark.parametrize('number', SIGNALS)
def test_a_signal_during_the_start_ends_the_wait_after_it(number: signal.Signals) -> None:
    reached = []
    with StopSignals() as signals:
        signal.raise_signal(number)
        reached.append('started')
        with pytest.raises(StopRequested), signals.raised():
            reached.append('waited')
    assert reached == ['started']


def test_a_start_that_fails_restores_the_handlers() -> None:
    before = handlers()
    with pytest.raises(OSError), StopSignals():
        raise OSError
    assert handlers() == before


def test_nohup_is_respected() -> None:
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        with StopSignals() as signals, signals.raised():
            signal.raise_signal(signal.SIGHUP)
    finally:
        signal.signal(signal.SIGHUP, before)
