# SPDX-License-Identifier: BSD-3-Clause
"""Expect the objects in view: display, question, writing and undo."""
from __future__ import annotations

from pathlib import Path
from typing import Any, List

import pytest
from held_tasks import HeldTasks
from PyQt5.QtCore import QPoint
from PyQt5.QtWidgets import QAction, QComboBox, QLabel, QMenu, QMessageBox, QPushButton
from session_stand import run

from process_visualizer.cell.file_edit import PoseEditor
from process_visualizer.cell.model import Mode
from process_visualizer.cell.xml_parser import XmlParser
from process_visualizer.gui.cell.calibration_panel import ExpectedPanel
from process_visualizer.gui.cell.devices_panel import DevicesView
from process_visualizer.gui.cell.expected_model import ExpectModel, question_text
from process_visualizer.gui.ros.snapshots import ObjectsSnapshot
from process_visualizer.gui.session import Session
from process_visualizer.health.device_state import Level
from process_visualizer.health.expected_objects import LOOK_S, Expectation
from process_visualizer.health.near_objects import SeenObject

CELL = '''<visualizer>
  <device type="depth_sensor" name="kinect">
    <topic ns="kinect" name="cloud" type="pointcloud"/>
    <objects/>
  </device>
  <device type="depth_sensor" name="top">
    <topic ns="top" name="cloud" type="pointcloud"/>
    <objects/>
  </device>
  <device type="other" name="table"/>
</visualizer>
'''
ELEMENT = '<expected xyz="1 2 0.5" size="0.46 0.26 0.16" />'
WITH_BOX = CELL.replace('<objects/>', f'<objects>\n      {ELEMENT}\n    </objects>', 1)


def seen(number: int = 1, **other: Any) -> SeenObject:
    return SeenObject(number, 'arm/hand', 0.31, (0.4, 0.2, 0.1), Level.WARNING,
                      (1.0, 2.0, 0.5))._replace(**other)


class Stand:
    """A model and its panel, with a file; its clock is set by hand."""

    def __init__(self, folder: Path) -> None:
        self.file = folder / 'cell.xml'
        self.file.write_text(CELL)
        self.now_s = 100.0
        self.tasks, self.session = HeldTasks(), Session()
        self.model = ExpectModel(self.tasks, self.session, monotonic_s=lambda: self.now_s)
        self.panel = ExpectedPanel(self.model)
        self.notes: List[str] = []
        self.failures: List[str] = []
        self.model.noted.connect(self.notes.append)
        self.model.failed.connect(self.failures.append)
        self.model.saved.connect(self.load)

    def load(self) -> None:
        cell = XmlParser().parse(str(self.file))
        self.session.set_cell(cell, cell.devices, PoseEditor(cell))

    def see(self, *objects: SeenObject, device: str = 'kinect') -> None:
        self.model.take(ObjectsSnapshot(device, 0.0, objects))

    def button(self, name: str) -> QPushButton:
        found: QPushButton = self.panel.findChild(QPushButton, f'expected_{name}')
        return found

    def state(self) -> str:
        return str(self.panel.findChild(QLabel, 'expected_state').text())

    def question(self) -> QMessageBox:
        """The open message box."""
        (box,) = [it for it in self.panel.findChildren(QMessageBox) if it.isVisible()]
        return box

    def answer(self, name: str) -> None:
        self.question().findChild(QPushButton, name).click()
        self.tasks.end_all()


@pytest.fixture
def stand(tmp_path: Path, qtbot: Any) -> Stand:
    made = Stand(tmp_path)
    qtbot.addWidget(made.panel)
    made.load()
    run(made.session, Mode.REALTIME)
    return made


def test_the_panel_is_for_sensors_that_seek_objects(stand: Stand) -> None:
    devices = stand.panel.findChild(QComboBox, 'expected_device')
    assert [devices.itemText(it) for it in range(devices.count())] == ['kinect', 'top']
    assert not stand.panel.isHidden()
    stand.file.write_text(CELL.replace('<objects/>', ''))
    stand.load()
    assert stand.panel.isHidden()


def test_the_button_needs_an_object(stand: Stand) -> None:
    shown = [(stand.state(), stand.button('add').isEnabled())]
    for objects in ((), (seen(),), (seen(), seen(2))):
        stand.see(*objects)
        shown.append((stand.state(), stand.button('add').isEnabled()))
    assert shown == [('kinect reports nothing now.', False), ('kinect sees no object.', False),
                     ('kinect sees 1 object.', True), ('kinect sees 2 objects.', True)]
    stand.model.choose('top')
    assert stand.state() == 'top reports nothing now.'
    stand.model.choose('kinect')
    run(stand.session, None)
    assert stand.state() == 'Objects are seen while the nodes run.'
    assert not stand.button('add').isEnabled()


def test_a_sensor_that_falls_silent_sees_nothing(stand: Stand) -> None:
    stand.see(seen())
    stand.model._silences['kinect'].timeout.emit()
    assert stand.state() == 'kinect reports nothing now.'


def test_playback_may_stand_still(stand: Stand) -> None:
    run(stand.session, Mode.PLAYBACK)
    stand.see(seen())
    assert not stand.model._silences['kinect'].isActive()
    assert stand.model.can_expect


@pytest.mark.parametrize('where', ['another cell', 'another frame', 'not ticked'])
def test_only_the_cell_that_is_open_counts(stand: Stand, where: str, tmp_path: Path) -> None:
    if where == 'another cell':
        stand.file = tmp_path / 'other.xml'
        stand.file.write_text(CELL)
        stand.load()
    elif where == 'another frame':
        stand.file.write_text(CELL.replace('<visualizer>', '<visualizer frame="map">'))
        stand.load()
    else:
        stand.session.chosen = ()
        run(stand.session, Mode.REALTIME)
    stand.see(seen())
    assert stand.model.seen == {'kinect': None, 'top': None}


def test_it_asks_writes_and_takes_back(stand: Stand) -> None:
    stand.see(seen(), seen(2, speed_m_s=0.4))
    assert not stand.button('revert').isEnabled()
    stand.button('add').click()
    assert stand.question().text() == (
        'Expect 1 object from now on? kinect will report nothing inside its box, not even a hand.'
        "\n\nobject 1: 40 × 20 × 10 cm, 0.31 m from arm's hand"
        "\n\nLeft out:\nobject 2 moves: 40 × 20 × 10 cm, 0.31 m from arm's hand")
    stand.answer('yes')
    assert stand.file.read_text() == WITH_BOX
    assert stand.notes == ['1 object of kinect added to cell.xml; Apply restarts kinect. Revert is '
                           'in the tab Calibration']
    stand.button('revert').click()
    stand.tasks.end_all()
    assert (stand.file.read_text(), stand.notes[1:]) == (CELL, ['cell.xml is restored'])
    assert not stand.button('revert').isEnabled()
    assert stand.failures == []


def test_an_answer_of_no_changes_nothing(stand: Stand) -> None:
    stand.see(seen())
    stand.button('add').click()
    stand.question().reject()
    assert (stand.tasks.held, stand.file.read_text()) == ([], CELL)


def test_what_was_written_is_not_added_again(stand: Stand) -> None:
    stand.see(seen())
    stand.button('add').click()
    stand.answer('yes')
    stand.see(seen())
    stand.button('add').click()
    assert stand.question().text() == (
        'Nothing that kinect sees now can be added to cell.xml.'
        "\n\nLeft out:\nobject 1 is expected already: 40 × 20 × 10 cm, 0.31 m from arm's hand")
    assert stand.question().findChild(QPushButton, 'yes') is None


def test_older_looks_are_forgotten(stand: Stand) -> None:
    stand.see(seen(center_m=(3.0, 0.0, 0.0)))
    stand.now_s += LOOK_S / 2
    stand.see(seen())
    assert len(stand.model.look().left_out) == 1  # it has moved
    stand.now_s += LOOK_S / 2
    stand.see(seen())
    assert len(stand.model.look().added) == 1


def test_a_file_that_was_changed_is_not_touched(stand: Stand) -> None:
    stand.see(seen())
    stand.button('add').click()
    stand.file.write_text(CELL + '\n')
    stand.answer('yes')
    assert stand.failures == [f'what is expected was not changed: {stand.file}: has been changed '
                              'since it was loaded; load the configuration again']
    assert stand.file.read_text() == CELL + '\n' and stand.button('add').isEnabled()


def test_what_was_written_into_another_configuration_is_not_reverted(stand: Stand,
                                                                     tmp_path: Path) -> None:
    stand.see(seen())
    stand.button('add').click()
    stand.answer('yes')
    assert stand.button('revert').isEnabled()
    stand.file = tmp_path / 'other.xml'
    stand.file.write_text(CELL)
    stand.load()
    assert not stand.button('revert').isEnabled()


def test_a_question_about_many_objects_stays_short(stand: Stand) -> None:
    added = stand.model.look().added
    assert added == ()
    many = Expectation((), tuple((seen(number), 'moves') for number in range(1, 101)))
    lines = question_text('kinect', many, 'cell.xml').splitlines()
    assert len(lines) < 20 and lines[-1] == 'and 92 more'


def test_the_menu_of_a_row_has_it(stand: Stand, qtbot: Any) -> None:
    devices = DevicesView()
    qtbot.addWidget(devices)
    devices.set_devices(stand.session.devices, lambda _name: True)
    devices.show()
    wanted: List[str] = []
    devices.expect_wanted.connect(wanted.append)

    def offers(row: int) -> List[bool]:
        """Open the menu of a row and use its enabled entries; return whether each was enabled."""
        place = devices.visualItemRect(devices.topLevelItem(row)).center()
        devices.customContextMenuRequested.emit(QPoint(place))
        menu = devices.findChildren(QMenu)[-1]
        found = [it for it in menu.actions() if it.text() == 'Expect what is there now…']
        for it in filter(QAction.isEnabled, found):
            it.trigger()
        menu.close()
        return [it.isEnabled() for it in found]

    devices.set_seen({'kinect': 2, 'top': 0})
    assert [offers(row) for row in range(3)] == [[True], [False], []]
    assert wanted == ['kinect']
