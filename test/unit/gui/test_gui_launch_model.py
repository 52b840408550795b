# SPDX-License-Identifier: BSD-3-Clause
"""Messages of launching if it fails or ends unexpectedly."""
from __future__ import annotations

import shutil
from types import SimpleNamespace
from typing import Any, Dict, Iterator, List
from unittest.mock import Mock

import pytest
from held_tasks import HeldTasks

from process_visualizer.cell.errors import ConfigurationError, Location, Problem
from process_visualizer.cell.model import Mode
from process_visualizer.generate.plan import BAG_PART, Part, Plan, PlanError
from process_visualizer.gui.cell import launch_model
from process_visualizer.gui.cell.launch_model import LaunchModel, LaunchPhase
from process_visualizer.gui.session import Session
from process_visualizer.health.node_history import STARTS_WITHIN_S
from process_visualizer.launching.cell_owner import OtherCell
from process_visualizer.launching.part_report import PartReport, PartState

FIRST: Any = SimpleNamespace(mode=Mode.REALTIME)
SECOND: Any = SimpleNamespace(mode=Mode.PLAYBACK)
PART = Part(None, {}, '')
REFUSED = PlanError('the disk is full')


class Launching:
    """Model whose tasks end on the test's command."""

    def __init__(self) -> None:
        self.tasks = HeldTasks()
        tasks: Any = self.tasks
        self.now_s = 100.0
        self.model = LaunchModel(tasks, Session(), clock_s=lambda: self.now_s)
        self.told: List[str] = []
        self.problems: List[Any] = []
        self.stops = 0
        self.model.failed.connect(self.told.append)
        self.model.problems_found.connect(self.problems.append)
        self.model.stopped.connect(self._count)

    def answer(self, result: Any) -> None:
        """Let the oldest task succeed."""
        on_result = self.tasks.held.pop(0)[2]
        assert on_result is not None
        on_result(result)

    def fail(self, error: Exception) -> None:
        """Let the oldest task fail."""
        on_error = self.tasks.held.pop(0)[3]
        assert on_error is not None
        on_error(error)

    def run(self, *parts: str) -> None:
        """Launch parts and let them start up."""
        self.model.launch(FIRST)
        for part in parts:
            self.model._reported.emit(PartReport(part, PartState.RUNNING))
        self.answer(Plan(parts=dict.fromkeys(parts, PART)))
        assert self.model.phase is LaunchPhase.RUNNING

    def _count(self) -> None:
        self.stops += 1


@pytest.fixture
def launching(qtbot: Any) -> Iterator[Launching]:
    made = Launching()
    yield made
    shutil.rmtree(made.model.folder)


@pytest.mark.parametrize('error', [
    REFUSED, ConfigurationError([Problem(Location('cell.xml', 3), 'node', 'not there')])])
def test_after_a_change_that_fails_the_choice_before_runs(launching: Launching,
                                                          error: Exception) -> None:
    launching.run('robot')
    launching.model.apply(SECOND)
    launching.fail(error)
    assert launching.model.running is FIRST
    assert launching.model.is_running
    assert (len(launching.told), len(launching.problems)) == ((1, 0) if error is REFUSED
                                                              else (0, 1))


@pytest.mark.parametrize('error', [REFUSED, OtherCell('another cell runs')])
def test_a_launch_that_fails_leaves_nothing_running(launching: Launching,
                                                    error: Exception) -> None:
    launching.model.launch(FIRST)
    launching.fail(error)
    assert (launching.model.running, launching.model.phase) == (None, LaunchPhase.IDLE)
    assert launching.told == [str(error)]


@pytest.mark.parametrize('change, can, kept', [
    ({}, True, [BAG_PART]), ({}, False, []), ({'bag_folder': '/else'}, True, []),
    ({'cell': 'another'}, True, []), ({'mode': Mode.PLAYBACK}, True, [])])
def test_the_recorder_goes_on_with_other_devices(
        change: Dict[str, Any], can: bool, kept: List[str], launching: Launching,
        monkeypatch: pytest.MonkeyPatch) -> None:
    """A restart would lose the data in its memory."""
    calls: List[Any] = []
    plan = Plan(parts={BAG_PART: PART, 'arm': PART})
    device = SimpleNamespace(topics=(), objects=None)
    before: Any = SimpleNamespace(mode=Mode.REALTIME, cell='cell', bag_folder='', devices=[device])
    model = launching.model
    model._watch = lambda topics: calls.append(('watch', topics)) or can
    model._launched = Mock(differing=lambda plan: [BAG_PART, 'arm'])
    monkeypatch.setattr(launch_model, '_plan', lambda choice: plan)
    model._change(SimpleNamespace(**{**vars(before), **change}), before)
    model._launched.change.assert_called_once_with(plan, kept)
    assert model._launched.adopt.called == bool(kept)
    assert calls == ([] if change else [('watch', [])])


def test_beside_another_cell_nothing_is_launched(launching: Launching,
                                                 monkeypatch: pytest.MonkeyPatch) -> None:
    """ROS would end the nodes of the other cell."""
    def refuse() -> None:
        raise OtherCell('another cell runs')

    monkeypatch.setattr(launch_model, 'refuse_other_cell', refuse)
    monkeypatch.setattr(launch_model, '_plan', lambda choice: None)
    with pytest.raises(OtherCell):
        launching.model._start(FIRST)


def test_a_launch_that_fails_while_all_is_quit_does_not_end_the_quitting(
        launching: Launching) -> None:
    launching.model.launch(FIRST)
    launching.model.quit()
    launching.fail(REFUSED)
    assert (launching.model.phase, launching.stops) == (LaunchPhase.QUITTING, 0)
    launching.answer(None)
    assert (launching.model.phase, launching.stops) == (LaunchPhase.IDLE, 1)


def test_quitting_that_fails_says_so_and_can_be_followed_by_a_launch(
        launching: Launching) -> None:
    launching.run('robot')
    launching.model.quit()
    launching.fail(OSError('no more processes'))
    assert (launching.model.phase, launching.stops) == (LaunchPhase.IDLE, 1)
    assert launching.told == ['no more processes']


def test_a_part_that_was_left_out_cannot_be_restarted(launching: Launching) -> None:
    launching.run('robot', 'table')
    launching.model.apply(SECOND)
    launching.answer(Plan(parts={'robot': PART}))
    launching.model.restart('table')
    assert launching.tasks.held == []
    launching.model.restart('robot')
    assert len(launching.tasks.held) == 1


@pytest.mark.parametrize('is_well', [True, False])
def test_what_comes_after_cleaning_up_comes_in_any_case(launching: Launching,
                                                        is_well: bool) -> None:
    begun: List[bool] = []
    launching.model.prepare(lambda: begun.append(True))
    assert begun == []
    if is_well:
        launching.answer([17, 18])
    else:
        launching.fail(PermissionError('the folder of ROS cannot be written'))
    assert begun == [True]
    assert len(launching.told) == 1


def test_a_node_that_never_gets_up_keeps_nobody_waiting(launching: Launching) -> None:
    hanging = PartReport('robot').starting(['/robot/driver'])
    launching.model.launch(FIRST)
    launching.model._reported.emit(hanging)
    launching.answer(Plan(parts={'robot': PART}))
    launching.now_s += STARTS_WITHIN_S - 1.0
    launching.model.look()
    assert launching.model.phase is LaunchPhase.LAUNCHING
    launching.now_s += 1.0
    launching.model.look()
    assert launching.model.phase is LaunchPhase.RUNNING
