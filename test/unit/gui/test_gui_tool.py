# SPDX-License-Identifier: BSD-3-Clause
"""The learned tool: offered once, written into the file or not."""
from __future__ import annotations

from types import SimpleNamespace
from typing import Any, Iterator, List, Sequence, Tuple

import pytest
from held_tasks import HeldTasks
from PyQt5.QtCore import Qt
from PyQt5.QtWidgets import QLabel, QPushButton

from process_visualizer.cell.errors import Location
from process_visualizer.cell.file_edit import PoseEditError
from process_visualizer.cell.model import Cell, Device, DeviceType, Pose, Tool
from process_visualizer.gui.cell.calibration_model import ToolModel
from process_visualizer.gui.cell.notices import ToolNotice
from process_visualizer.gui.session import Session
from process_visualizer.health.node_warnings import NodeWarning, Severity

HERE = Location('/cells/cell.xml', 1)
ARMS = [Device(DeviceType.ROBOT, name, HERE) for name in ('left', 'right')]
VALUES = {'tool_frame': 'hand', 'tool_xyz': '0 0 0.103', 'tool_ypr': '0 0 0'}
ELEMENT = '<tool frame="hand" xyz="0 0 0.103" />'


def warning(name: str, values: 'dict[str, str]') -> NodeWarning:
    return NodeWarning(f'/{name}/robot_proc', Severity.WARNING, f'the poses of {name} are others',
                       0, 1.0, 1.0, values)


class Stand:
    """Model with its notice, and files that accept or refuse the text."""

    def __init__(self) -> None:
        self.tasks = HeldTasks()
        self.session = Session()
        self.model = ToolModel(self.tasks, self.session)
        self.written: List[Tuple[str, str, Pose]] = []
        self.refusal = ''
        self.failures: List[str] = []
        self.model.failed.connect(self.failures.append)
        self.open(ARMS)
        self.notice = ToolNotice(self.model)

    def open(self, devices: Sequence[Device]) -> None:
        editor: Any = SimpleNamespace(save_tool=self.save)
        cell = Cell('cell.xml', 'world', tuple(devices))
        self.session.set_cell(cell, cell.devices, editor)

    def save(self, device: str, frame: str, pose: Pose) -> None:
        if self.refusal:
            raise PoseEditError(self.refusal)
        self.written.append((device, frame, pose))

    def learn(self, *names: str, **values: str) -> None:
        self.model.take_warnings({name: [warning(name, {}), warning(name, {**VALUES, **values})]
                                  for name in names})

    def asked(self) -> str:
        return self.notice.findChild(QLabel, 'tool_text').text() \
            if not self.notice.isHidden() else ''


@pytest.fixture
def stand(qtbot: Any) -> Iterator[Stand]:
    made = Stand()
    qtbot.addWidget(made.notice)
    yield made


def test_it_is_offered_while_it_holds(stand: Stand) -> None:
    assert stand.asked() == ''
    stand.learn('left')
    assert stand.asked() == f'The poses of left are others. Write {ELEMENT} into cell.xml?'
    assert stand.notice.accessibleName() == 'Tool frame of left'
    stand.learn()
    assert stand.asked() == ''


@pytest.mark.parametrize('values', [{'tool_frame': ''}, {'tool_xyz': '0 0'},
                                    {'tool_ypr': 'nan 0 0'}])
def test_what_is_no_tool_is_not_offered(stand: Stand, values: 'dict[str, str]') -> None:
    stand.learn('left', **values)
    assert stand.asked() == ''


def test_what_was_refused_is_not_offered_again(stand: Stand, qtbot: Any) -> None:
    stand.learn('left', 'right')
    qtbot.keyClick(stand.notice.findChild(QPushButton, 'tool_dismiss'), Qt.Key_Space)
    assert 'right' in stand.asked()
    stand.model.dismiss()
    stand.learn()
    stand.learn('left', 'right')
    assert (stand.asked(), stand.written) == ('', [])


def test_it_is_written_once(stand: Stand, qtbot: Any) -> None:
    stand.learn('left')
    button = stand.notice.findChild(QPushButton, 'tool_write')
    assert button.accessibleName() == f'Write {ELEMENT} into /cells/cell.xml'
    qtbot.mouseClick(button, Qt.LeftButton)
    stand.model.write()  # writing is in progress
    with qtbot.waitSignal(stand.model.saved):
        stand.tasks.end_one()
    assert (stand.asked(), stand.tasks.held) == ('', [])
    assert stand.written == [('left', 'hand', Pose((0.0, 0.0, 0.103)))]


def test_what_cannot_be_written_stays_offered(stand: Stand) -> None:
    stand.refusal = 'cell.xml: has been changed'
    stand.learn('left')
    stand.model.write()
    stand.tasks.end_one()
    assert stand.failures == ['the tool was not written: cell.xml: has been changed']
    assert 'left' in stand.asked()


def test_a_robot_whose_tool_is_configured_is_left_alone(stand: Stand) -> None:
    stand.learn('left')
    configured = Device(DeviceType.ROBOT, 'left', HERE, tool=Tool('a', Pose(), HERE))
    stand.open([configured])
    assert stand.asked() == ''
