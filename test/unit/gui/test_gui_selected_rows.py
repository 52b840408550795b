# SPDX-License-Identifier: BSD-3-Clause
"""What a selected row still tells: the colours of its icon and of its text."""
from __future__ import annotations

from collections import Counter
from dataclasses import replace
from typing import Tuple

import numpy as np
import pytest
from PyQt5.QtGui import QImage
from PyQt5.QtWidgets import QApplication
from pytestqt.qtbot import QtBot

from process_visualizer.cell.errors import Location
from process_visualizer.cell.model import Device, DeviceType, Topic
from process_visualizer.curves.position_values import key_of
from process_visualizer.gui.cell.devices_panel import DevicesView
from process_visualizer.gui.lanes.curves_dialog import CurvesTree
from process_visualizer.gui.lanes.lane_choice import LaneChoice
from process_visualizer.gui.lanes.timeline_lanes import lane_of
from process_visualizer.gui.toolkit.theme import LIGHT, apply_style, readable_colour
from process_visualizer.health.device_state import DeviceState, Level, Line

HERE = Location('cell.xml', 1)
LONG = '/a_robot_with_a_long_name/the_topic_of_its_driver/that_has_a_long_name_too'


@pytest.fixture
def devices(qtbot: QtBot, qapp: QApplication) -> DevicesView:
    apply_style(qapp)
    view = DevicesView()
    qtbot.addWidget(view)
    view.set_devices((Device(DeviceType.OTHER, 'oven', HERE,
                             topics=(Topic(LONG, None, None, True, HERE),)),), lambda _name: True)
    view.resize(400, 100)
    view.show()
    view.topLevelItem(0).setSelected(True)
    return view


def colours(view: DevicesView) -> Counter:  # type: ignore[type-arg]
    """The colours of the state of the selected row, and how many pixels have them."""
    row = view.visualItemRect(view.topLevelItem(0))
    image: QImage = view.viewport().grab(row).toImage()
    points: Tuple[Tuple[int, int], ...] = tuple(
        (x, y) for x in range(image.width() // 2, image.width()) for y in range(image.height()))
    return Counter(image.pixelColor(x, y).name() for x, y in points)


@pytest.mark.parametrize('level, colour', [(Level.BAD, LIGHT.bad), (Level.WARNING, LIGHT.warning)])
def test_icon_and_text_keep_their_colour(devices: DevicesView, level: Level, colour: str) -> None:
    devices.set_state('oven', DeviceState(Line(level, ''), {}, {}))
    before = colours(devices)
    devices.set_state('oven', DeviceState(Line(level, 'killed IIIIIII'), {}, {}))
    found = colours(devices)
    assert before.most_common(1)[0][0] == LIGHT.selected
    assert before[colour] == 0 and found[colour] > 30
    icon_only = devices.topLevelItem(0)
    icon_only.setText(1, '')
    assert 0 < colours(devices)[colour] < found[colour]


def test_every_name_has_a_tooltip(devices: DevicesView) -> None:
    row = devices.topLevelItem(0)
    assert row.toolTip(0) == 'oven (other)'
    assert row.child(0).toolTip(0) == LONG


def test_a_selected_curve_keeps_its_colour(qtbot: QtBot, qapp: QApplication) -> None:
    apply_style(qapp)
    tree = CurvesTree()
    qtbot.addWidget(tree)
    curve = lane_of('oven  heat', '°C', (1.0, 0.0, 0.0), np.zeros(2), np.ones(2), 0.1)
    tree.fill([replace(curve, key=key_of('oven', 'heat', '/heat'))], LaneChoice())
    tree.resize(300, 60)
    tree.show()
    tree.topLevelItem(0).setSelected(True)
    image = tree.viewport().grab(tree.visualItemRect(tree.topLevelItem(0))).toImage()
    found = Counter(image.pixelColor(x, y).name() for x in range(image.width())
                    for y in range(image.height()))
    assert found[readable_colour((1.0, 0.0, 0.0)).name()] > 20
    assert tree.topLevelItem(0).toolTip(0) == 'oven  heat  [°C]'
