# SPDX-License-Identifier: BSD-3-Clause
"""A selected row keeps its colors: those of its icon and of its text."""
from __future__ import annotations

from collections import Counter
from dataclasses import replace
from typing import Tuple

import numpy as np
import pytest
from PyQt5.QtGui import QColor, QImage
from PyQt5.QtWidgets import QApplication
from pytestqt.qtbot import QtBot

from process_visualizer.cell.errors import Location
from process_visualizer.cell.model import Device, DeviceType, Topic
from process_visualizer.curves.position_values import key_of
from process_visualizer.gui.cell.devices_panel import DevicesView
from process_visualizer.gui.lanes.curves_dialog import CurvesTree
from process_visualizer.gui.lanes.lane_choice import LaneChoice
from process_visualizer.gui.lanes.timeline_lanes import lane_of
from process_visualizer.gui.toolkit.theme import LIGHT, apply_style, readable_color
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


def colors(view: DevicesView) -> Counter:  # type: ignore[type-arg]
    """The state colors of the selected row, and the number of pixels that have them."""
    row = view.visualItemRect(view.topLevelItem(0))
    image: QImage = view.viewport().grab(row).toImage()
    points: Tuple[Tuple[int, int], ...] = tuple(
        (x, y) for x in range(image.width() // 2, image.width()) for y in range(image.height()))
    return Counter(image.pixelColor(x, y).name() for x, y in points)


def nearly(found: Counter, name: str) -> int:  # type: ignore[type-arg]
    """Return the number of pixels that nearly have a color; icon edges are smoothed."""
    def rgb(one: str) -> np.ndarray:
        return np.array(QColor(one).getRgb()[:3])
    return sum(count for one, count in found.items() if np.abs(rgb(one) - rgb(name)).max() < 60)


@pytest.mark.parametrize('level, color', [(Level.BAD, LIGHT.bad), (Level.WARNING, LIGHT.warning)])
def test_icon_and_text_keep_their_color(devices: DevicesView, level: Level, color: str) -> None:
    devices.set_state('oven', DeviceState(Line(level, ''), {}, {}))
    before = colors(devices)
    devices.set_state('oven', DeviceState(Line(level, 'killed IIIIIII'), {}, {}))
    found = colors(devices)
    assert before.most_common(1)[0][0] == LIGHT.selected
    assert before[color] == 0 and found[color] > 30
    icon_only = devices.topLevelItem(0)
    icon_only.setText(1, '')
    assert 0 < nearly(colors(devices), color) < found[color]


def test_every_name_has_a_tooltip(devices: DevicesView) -> None:
    row = devices.topLevelItem(0)
    assert row.toolTip(0) == 'oven (other)'
    assert row.child(0).toolTip(0) == LONG


def test_a_selected_curve_keeps_its_color(qtbot: QtBot, qapp: QApplication) -> None:
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
    assert found[readable_color((1.0, 0.0, 0.0)).name()] > 20
    assert tree.topLevelItem(0).toolTip(0) == 'oven  heat  [°C]'
