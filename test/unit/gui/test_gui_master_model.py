# SPDX-License-Identifier: BSD-3-Clause
"""The connection to the master: made, lost if it is gone, hangs or is another, and restored."""
from __future__ import annotations

import shutil
from typing import Any, Iterator, List, Optional

import pytest
from held_tasks import HeldTasks

from process_visualizer.generate.plan import RVIZ_PART
from process_visualizer.gui.cell.launch_model import LaunchModel
from process_visualizer.gui.cell.master_model import MasterModel, WatchModel
from process_visualizer.gui.ros.ros_link import RosLinkError
from process_visualizer.gui.session import Session
from process_visualizer.launching.cell_watch import CellLook
from process_visualizer.launching.part_report import NodeReport, NodeState, PartReport, PartState
from process_visualizer.launching.ros_master import RosMasterError


class Master:
    """Stand-in for RosMaster and RosLink: the process that answers, and the faults."""

    def __init__(self) -> None:
        self.answers: Optional[int] = 17
        self.error: Optional[Exception] = None

    def ensure(self) -> None:
        if isinstance(self.error, RosMasterError):
            raise self.error

    def begin(self) -> None:
        if isinstance(self.error, RosLinkError):
            raise self.error

    def process_id(self) -> Optional[int]:
        return self.answers


class Stand:
    """Model with a master that is checked on the test's command, and the model's signals."""

    def __init__(self) -> None:
        self.tasks, self.master = HeldTasks(), Master()
        anything: Any = self.master
        tasks: Any = self.tasks
        self.model = MasterModel(tasks, anything, master=anything)
        self.told: List[str] = []
        for name in ('connected', 'lost', 'returned'):
            getattr(self.model, name).connect(lambda name=name: self.told.append(name))
        self.model.failed.connect(self.told.append)

    def connect(self) -> None:
        self.model.connect_to_master()
        assert self.model.is_connecting and not self.model.is_connected
        self.tasks.end_all()

    def check(self, times: int = 1, is_answered: bool = True) -> None:
        for _ in range(times):
            self.model._timer.timeout.emit()
            if is_answered:
                self.tasks.end_all()


@pytest.fixture
def stand(qtbot: Any) -> Stand:
    return Stand()


def test_it_is_connected_while_the_master_answers(stand: Stand) -> None:
    stand.connect()
    stand.check(10)
    assert stand.told == ['connected'] and stand.model.is_connected


@pytest.mark.parametrize('error', [RosMasterError('no free port'),
                                   RosLinkError('Another launcher (process 5)')])
def test_why_there_is_no_connection(stand: Stand, error: Exception) -> None:
    stand.master.error = error
    stand.connect()
    assert stand.told == [str(error)] == [stand.model.problem]
    assert not stand.model.is_connected and not stand.model.is_connecting


def test_a_master_that_is_started_later_is_found(stand: Stand) -> None:
    stand.master.error, stand.master.answers = RosMasterError('start roscore on "a"'), None
    stand.connect()
    stand.check(5)
    assert stand.told == ['start roscore on "a"'] and not stand.model.is_connected
    stand.master.error, stand.master.answers = None, 17
    stand.check()
    stand.tasks.end_all()
    assert stand.told[1:] == ['connected'] and stand.model.is_connected
    stand.check(3)
    assert stand.told[1:] == ['connected']


def test_a_busy_master_may_miss_a_check(stand: Stand) -> None:
    stand.connect()
    for _ in range(3):
        stand.master.answers = None
        stand.check(2)
        stand.master.answers = 17
        stand.check()
    assert stand.told == ['connected']


def test_a_master_that_is_gone_is_told_once_and_so_is_its_return(stand: Stand) -> None:
    stand.connect()
    stand.check()
    stand.master.answers = None
    stand.check(5)
    assert stand.told == ['connected', 'lost'] and not stand.model.is_connected
    assert stand.model.problem == 'The ROS master is not responding'
    stand.master.answers = 17
    stand.check(2)
    assert stand.told == ['connected', 'lost', 'returned'] and stand.model.is_connected


def test_another_master_knows_no_node(stand: Stand) -> None:
    stand.connect()
    stand.check()
    stand.master.answers = 18
    stand.check(5)
    assert stand.told == ['connected', 'lost'] and stand.model.is_other
    assert stand.model.problem == 'The ROS master was restarted'


def test_a_master_that_was_killed_and_started_anew_is_not_said_to_be_silent(stand: Stand) -> None:
    stand.connect()
    stand.check()
    stand.master.answers = None
    stand.check(4)
    assert not stand.model.is_other
    stand.master.answers = 18
    stand.check(3)
    assert stand.told == ['connected', 'lost', 'lost']
    assert stand.model.problem == 'The ROS master was restarted'
    assert stand.model.is_lost and not stand.model.is_connected
    stand.master.answers = None  # busy
    stand.check(5)
    assert stand.told == ['connected', 'lost', 'lost']
    stand.master.answers = 17
    stand.check()
    assert stand.told[-1] == 'returned' and not stand.model.is_other


def test_a_master_that_hangs_is_asked_once_and_given_up(stand: Stand) -> None:
    stand.connect()
    stand.check()
    stand.check(4, is_answered=False)
    assert stand.told == ['connected', 'lost'] and len(stand.tasks.held) == 1
    stand.tasks.end_all()
    assert stand.told[-1] == 'returned'


# RViz drawing or not

RVIZ_SILENT = CellLook(frozenset({'/rviz'}))


class Drawing:
    """The watch over a cell with RViz, and its results."""

    def __init__(self) -> None:
        tasks: Any = HeldTasks()
        self.launch = LaunchModel(tasks, Session())
        self.watch = WatchModel(self.launch)
        self.found: List[CellLook] = []
        self.watch.found.connect(self.found.append)
        self.run(PartState.RUNNING)

    def run(self, state: PartState) -> None:
        node = NodeReport('/rviz', NodeState.RUNNING)
        self.launch.reports = {RVIZ_PART: PartReport(RVIZ_PART, state, (node,))}

    def look(self, times: int, draws: bool = False) -> None:
        for _ in range(times):
            if draws:
                self.watch.take_drawing()
            self.watch.look_at_drawing()


@pytest.fixture
def drawing(qtbot: Any) -> Iterator[Drawing]:
    made = Drawing()
    yield made
    shutil.rmtree(made.launch.folder)


def test_a_picture_that_stands_still_is_told_though_rviz_answers(drawing: Drawing) -> None:
    drawing.look(10, draws=True)
    drawing.look(11)
    assert drawing.found == []
    drawing.look(3)
    assert drawing.found == [RVIZ_SILENT]
    drawing.watch._asked.emit(CellLook(frozenset({'/driver'})))
    assert drawing.found[-1] == CellLook(frozenset({'/rviz', '/driver'}))
    drawing.look(1, draws=True)
    assert drawing.found[-1] == CellLook(frozenset({'/driver'}))


def test_a_picture_that_is_seconds_old_is_told(drawing: Drawing) -> None:
    """It then differs from the curves, and nothing else shows this."""
    drawing.look(10, draws=True)
    assert drawing.watch.picture_age_s == 0.0
    for _picture in range(3):
        drawing.look(5)
        drawing.look(1, draws=True)
    assert drawing.watch.picture_age_s == 3.0 and drawing.found == []
    assert not drawing.watch.draws_again
    drawing.look(6, draws=True)
    assert drawing.watch.picture_age_s == 3.0 and drawing.watch.draws_again
    drawing.look(24, draws=True)
    assert drawing.watch.picture_age_s == 0.0


def test_an_rviz_that_hangs_is_not_said_to_be_slow(drawing: Drawing) -> None:
    drawing.look(10, draws=True)
    drawing.look(20)
    assert drawing.found == [RVIZ_SILENT] and drawing.watch.picture_age_s == 0.0
    drawing.look(1, draws=True)
    assert drawing.watch.picture_age_s == 0.0


def test_rviz_is_not_missed_before_it_has_drawn_or_while_it_is_stopped(drawing: Drawing) -> None:
    drawing.look(20)
    drawing.look(1, draws=True)
    drawing.run(PartState.STOPPING)
    drawing.look(20)
    drawing.run(PartState.RUNNING)  # another one, which is still loading
    drawing.look(20)
    assert drawing.found == []
