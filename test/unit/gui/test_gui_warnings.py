# SPDX-License-Identifier: BSD-3-Clause
"""Warnings of nodes, in the row of their device and in a separate window."""
from __future__ import annotations

from pathlib import Path
from shutil import rmtree
from typing import Any, Iterator

import pytest
from held_tasks import HeldTasks
from PyQt5.QtCore import QPoint, Qt
from PyQt5.QtWidgets import QLabel, QPlainTextEdit
from session_stand import run

from process_visualizer.cell.errors import Location
from process_visualizer.cell.model import Device, DeviceType, Mode
from process_visualizer.gui.cell.device_states_model import DeviceStatesModel, WarningsModel
from process_visualizer.gui.cell.devices_panel import DevicesView, WarningsView
from process_visualizer.gui.cell.launch_model import LaunchModel
from process_visualizer.gui.session import Session
from process_visualizer.health.device_state import Level
from process_visualizer.health.node_warnings import NodeWarnings, Severity
from process_visualizer.launching.cell_watch import CellLook
from process_visualizer.launching.part_report import NodeReport, NodeState, PartReport, PartState
from process_visualizer.ros_names import CONCERNED_KEY, SILENT_NODE_KEY

ARM = Device(DeviceType.ROBOT, 'arm', Location('cell.xml', 1))
ZERO = 'a message on /arm/tcf is left out: it holds NaN or infinity'
SHORT = '1 warning: click to read'


class Stand:
    """Cell with an arm whose nodes run; its clock is set by hand."""

    def __init__(self) -> None:
        self.now_s = 100.0
        self.said = NodeWarnings()
        self.session = Session()
        self.warnings = WarningsModel(self.said, self.session, clock_s=lambda: self.now_s)
        self.launch = LaunchModel(HeldTasks(), self.session)
        self.launch.reports = {'arm': PartReport('arm', PartState.RUNNING, tuple(
            NodeReport(f'/arm/{name}', NodeState.RUNNING) for name in ('driver', 'robot_proc')))}
        self.states = DeviceStatesModel(self.launch, self.warnings, self.session)
        self.view = DevicesView()
        self.states.changed.connect(lambda: self.view.set_state('arm', self.states.state(ARM)))
        self.view.set_devices((ARM,), lambda _name: True)
        self.states.changed.emit()

    def complain(self) -> None:
        self.said.take_state('/arm/robot_proc', 'pose', Severity.WARNING, ZERO, self.now_s,
                             {'messages': '125', 'for_s': '2'})
        self.warnings.look()

    def mend(self) -> None:
        self.said.take_state('/arm/robot_proc', 'pose', None, '', self.now_s, {})
        self.warnings.look()


@pytest.fixture
def stand(qtbot: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Stand]:
    monkeypatch.setenv('ROS_HOME', str(tmp_path))
    made = Stand()
    qtbot.addWidget(made.view)
    made.view.resize(440, 200)
    made.view.show()
    yield made
    rmtree(made.launch.folder)


@pytest.mark.parametrize('mode, count', [(Mode.REALTIME, 1), (Mode.PLAYBACK, 0)])
def test_stamps_that_go_back_are_no_problem_of_a_device_in_playback(
        stand: Stand, mode: Mode, count: int) -> None:
    run(stand.session, mode)
    stand.said.take_log('/arm/driver', Severity.WARNING, 'Messages of type 0 arrived out of order '
                        '(will print only once)', stand.now_s)
    stand.warnings.look()
    assert len(stand.warnings.present) == count


def place(view: DevicesView, column: int) -> QPoint:
    return view.visualRect(view.model().index(0, column)).center()


def test_the_row_says_it_and_says_it_no_more(stand: Stand) -> None:
    assert stand.view.state_text('arm') == 'running'
    stand.complain()
    row = stand.view.topLevelItem(0)
    assert (row.text(1), row.toolTip(1)) == (SHORT, f'1 warning: {ZERO}')
    assert row.data(1, Qt.AccessibleTextRole) == f'1 warning: {ZERO}'
    assert 'Enter' in row.data(1, Qt.AccessibleDescriptionRole)
    assert [row.child(index).text(1) for index in range(2)] == ['running', 'running, 1 warning']
    stand.mend()
    assert (row.text(1), row.child(1).text(1)) == ('running', 'running')
    assert row.data(1, Qt.AccessibleDescriptionRole) == ''


def test_what_a_node_logs_is_counted_and_an_error_is_worse(stand: Stand) -> None:
    stand.complain()
    stand.said.take_log('/arm/driver', Severity.ERROR, 'no connection', stand.now_s)
    stand.warnings.look()
    state = stand.states.state(ARM)
    assert (state.summary.level, state.summary.text) == (
        Level.BAD, '1 error, 1 warning: no connection')


@pytest.mark.parametrize('is_told', [False, True])
def test_a_driver_that_hangs_is_told_before_what_follows_from_it(stand: Stand, is_told: bool
                                                                 ) -> None:
    """Found by the launcher's own watch, or reported by scene_watch for any node."""
    if is_told:
        stand.said.take_state('/scene_watch', '/arm_driver', Severity.WARNING,
                              'arm_driver is not responding: old', stand.now_s,
                              {SILENT_NODE_KEY: '/arm_driver', CONCERNED_KEY: 'arm'})
        stand.warnings.look()
    else:
        stand.states.take_look(CellLook(frozenset({'/arm/driver', '/other/driver'})))
    name = 'arm_driver' if is_told else 'driver'
    row = stand.view.topLevelItem(0)
    assert row.text(1) == f'{name} is not responding'
    stand.complain()
    assert row.text(1) == 'not responding, 1 warning'
    assert row.toolTip(1) == f'{name} is not responding, 1 warning: {ZERO}'
    assert stand.states.state(ARM).summary.level is Level.BAD
    assert [row.child(index).text(1) for index in range(2)] == [
        'running' if is_told else 'not responding', 'running, 1 warning']
    if is_told:
        stand.said.take_state('/scene_watch', '/arm_driver', None, '', stand.now_s, {})
        stand.warnings.look()
    else:
        stand.states.take_look(CellLook())
    assert row.text(1) == SHORT


def test_what_others_say_is_not_of_this_device(stand: Stand) -> None:
    """The player repeats a recorded log, which is not a current warning."""
    for node in ('/bag_player', '/other/robot_proc'):
        stand.said.take_log(node, Severity.ERROR, 'no connection', stand.now_s)
    stand.warnings.look()
    assert stand.view.state_text('arm') == 'running'


def test_a_click_reads_it(stand: Stand, qtbot: Any) -> None:
    viewport = stand.view.viewport()
    with qtbot.assertNotEmitted(stand.view.warnings_wanted):
        qtbot.mouseClick(viewport, Qt.LeftButton, pos=place(stand.view, 1))
    stand.complain()
    with qtbot.assertNotEmitted(stand.view.warnings_wanted):
        qtbot.mouseClick(viewport, Qt.LeftButton, pos=place(stand.view, 0))
    with qtbot.waitSignal(stand.view.warnings_wanted) as wanted:
        qtbot.mouseClick(viewport, Qt.LeftButton, pos=place(stand.view, 1))
    assert wanted.args == ['arm']


def test_the_keyboard_reads_it(stand: Stand, qtbot: Any) -> None:
    stand.view.setCurrentItem(stand.view.topLevelItem(0))
    with qtbot.assertNotEmitted(stand.view.warnings_wanted):
        qtbot.keyClick(stand.view, Qt.Key_Return)
    stand.complain()
    with qtbot.waitSignal(stand.view.warnings_wanted):
        qtbot.keyClick(stand.view, Qt.Key_Return)


def test_the_window_follows(stand: Stand, qtbot: Any) -> None:
    stand.complain()
    window = WarningsView('arm', stand.states)
    qtbot.addWidget(window)
    text = window.findChild(QPlainTextEdit, 'warnings_text')
    assert text.toPlainText().startswith('/arm/robot_proc, warning, 125 times for ')
    assert ZERO in text.toPlainText()
    assert text.accessibleName() == 'Warnings of arm'
    stand.mend()
    assert text.toPlainText() == ''
    assert 'no warnings' in window.findChild(QLabel, 'warnings_message').text()


def test_nothing_is_left_of_a_run_that_has_ended(stand: Stand) -> None:
    run(stand.session, Mode.REALTIME)
    stand.complain()
    run(stand.session, None)
    assert stand.warnings.present == ()
