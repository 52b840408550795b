# SPDX-License-Identifier: BSD-3-Clause
"""Devices and problems: their visibility, and their share of the space."""
from __future__ import annotations

import pytest
from PyQt5.QtCore import Qt
from PyQt5.QtWidgets import QApplication, QLabel, QListWidget
from pytestqt.qtbot import QtBot

from process_visualizer.cell.errors import Location, Problem
from process_visualizer.cell.model import Device, DeviceType
from process_visualizer.gui.cell.devices_panel import DevicesPanel
from process_visualizer.health.device_state import DeviceState, Level, Line

NOTE = 'These devices stay:'
PROBLEMS = [Problem(Location('/cells/a.xml', line), 'device', f'problem {line}')
            for line in range(1, 9)]


@pytest.fixture
def panel(qtbot: QtBot) -> DevicesPanel:
    widget = DevicesPanel()
    qtbot.addWidget(widget)
    widget.resize(440, 400)
    widget.show()
    return widget


def shown(panel: DevicesPanel) -> 'tuple[bool, str, bool]':
    """Visibility of the problems, the note, and visibility of the devices."""
    note = panel.findChild(QLabel, 'problems_note')
    return (panel.problems.isVisible(), note.text() if note.isVisible() else '',
            panel.devices.isVisible())


def test_without_problems_only_the_devices(panel: DevicesPanel) -> None:
    assert shown(panel) == (False, '', True)


def test_without_devices_only_the_problems(panel: DevicesPanel) -> None:
    panel.show_problems(PROBLEMS)
    assert shown(panel) == (True, '', False)


def test_problems_and_the_devices_in_force(panel: DevicesPanel, qtbot: QtBot) -> None:
    panel.show_problems(PROBLEMS, NOTE)
    assert shown(panel) == (True, NOTE, True)
    problems = panel.findChild(QListWidget, 'problems')
    with qtbot.waitSignal(panel.problems.open_wanted) as opened:
        qtbot.mouseClick(problems.viewport(), Qt.LeftButton,
                         pos=problems.visualItemRect(problems.item(1)).center())
    assert opened.args == ['/cells/a.xml', 2]
    panel.show_problems([], NOTE)
    assert shown(panel) == (False, '', True)


def test_many_problems_leave_room_for_the_devices(panel: DevicesPanel, qtbot: QtBot) -> None:
    panel.show_problems(PROBLEMS * 5)
    qtbot.waitUntil(lambda: panel.problems.height() == 400)
    panel.show_problems(PROBLEMS * 5, NOTE)
    qtbot.waitUntil(lambda: panel.problems.height() == 168)
    qtbot.waitUntil(
        lambda: panel.devices.height() >= panel.devices.minimumSizeHint().height())


def test_rows_stay_where_they_are_when_states_come(panel: DevicesPanel, qtbot: QtBot) -> None:
    devices = panel.devices
    devices.set_devices(tuple(
        Device(DeviceType.OTHER, name, Location('cell.xml', 1)) for name in 'abc'), lambda _: True)

    def places() -> 'list[int]':
        QApplication.processEvents()
        return [devices.visualItemRect(devices.topLevelItem(row)).top() for row in range(3)]

    before = places()
    for name in 'abc':
        devices.set_state(name, DeviceState(Line(Level.GOOD, 'running'), {}, {}))
    assert places() == before and before[1] > before[0]
