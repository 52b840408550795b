# SPDX-License-Identifier: BSD-3-Clause
"""The box of a depth sensor: numbers, dragging, saving; the panel used as by an operator."""
from __future__ import annotations

from dataclasses import replace
from typing import Any, Iterator, List, Tuple

import pytest
from PyQt5.QtWidgets import QComboBox, QDoubleSpinBox, QPushButton, QToolButton
from recording_stand_in import HERE

from process_visualizer.cell.file_edit import PoseEditError
from process_visualizer.cell.model import (
    Device,
    DeviceType,
    RegionOfInterest,
    Topic,
    TopicFunction,
)
from process_visualizer.gui.cell.calibration_model import RegionModel
from process_visualizer.gui.cell.calibration_panel import RegionPanel
from process_visualizer.gui.toolkit.tasks import Tasks

BOX = RegionOfInterest('table', (1.0, 2.0, 3.0), (0.2, 0.4, 0.6), HERE)


def sensor(name: str, region: RegionOfInterest = BOX) -> Device:
    cloud = Topic('/c', TopicFunction.POINTCLOUD, None, False, HERE)
    return Device(DeviceType.DEPTH_SENSOR, name, HERE, roi=region, topics=(cloud,))


class Nodes:
    """Stand-in for the nodes that notes moves and saves, or fails."""

    def __init__(self) -> None:
        self.moves: List[Tuple[str, RegionOfInterest]] = []
        self.saves: List[Tuple[str, RegionOfInterest]] = []
        self.error: Any = None

    def move(self, device: str, region: RegionOfInterest) -> None:
        if self.error is not None:
            raise self.error
        self.moves.append((device, region))

    def save(self, device: str, region: RegionOfInterest) -> None:
        if self.error is not None:
            raise self.error
        self.saves.append((device, region))


@pytest.fixture
def nodes() -> Nodes:
    return Nodes()


@pytest.fixture
def model(nodes: Nodes, qtbot) -> Iterator[RegionModel]:
    tasks = Tasks()
    region = RegionModel(tasks, nodes.move)
    region.set_save(nodes.save)
    region.set_devices([sensor('a'), Device(DeviceType.OTHER, 'floor', HERE), sensor('b')])
    yield region
    tasks.close()


@pytest.fixture
def panel(model: RegionModel, qtbot) -> RegionPanel:
    widget = RegionPanel(model)
    qtbot.addWidget(widget)
    widget.show()
    return widget


def field(panel: RegionPanel, name: str) -> QDoubleSpinBox:
    return panel.findChild(QDoubleSpinBox, name)


def test_only_sensors_with_a_box_are_there(model):
    assert (model.devices, model.device, model.region) == (['a', 'b'], 'a', BOX)


def test_a_number_moves_the_box_at_once(model, nodes, panel, qtbot):
    assert not field(panel, 'size x').isEnabled()  # nothing runs
    model.set_running(True)
    field(panel, 'size x').setValue(0.5)
    moved = replace(BOX, size=(0.5, 0.4, 0.6))
    qtbot.waitUntil(lambda: nodes.moves == [('a', moved)])
    assert model.region == moved and model.is_unsaved


def test_saved_into_the_file(model, nodes, panel, qtbot):
    model.set_running(True)
    save = panel.findChild(QPushButton, 'region_save')
    assert not save.isEnabled()
    field(panel, 'center z').setValue(3.5)
    with qtbot.waitSignal(model.saved):
        save.click()
    assert nodes.saves == [('a', replace(BOX, center=(1.0, 2.0, 3.5)))]
    assert not model.is_unsaved and not save.isEnabled()


def test_values_stay_when_they_cannot_be_saved(model, nodes, qtbot):
    model.set_running(True)
    model.set_value(0, 1.5)
    qtbot.waitUntil(lambda: bool(nodes.moves))
    nodes.error = PoseEditError('cell.xml is read-only')
    with qtbot.waitSignal(model.failed) as failed:
        model.save()
    assert 'read-only' in failed.args[0] and model.is_unsaved and model.can_save


def test_dragging_in_rviz_is_taken_and_not_sent_back(model, nodes, panel, qtbot):
    model.set_running(True)
    wanted, moved = [], []
    model.marker_wanted.connect(wanted.append)
    model.moved.connect(lambda *it: moved.append(it))
    larger = replace(BOX, size=(0.3, 0.4, 0.6))
    model.take_dragged('a', larger)  # too late: it is not visible
    assert model.region == BOX
    panel.findChild(QToolButton, 'region_marker').click()
    model.take_dragged('b', larger)
    model.take_dragged('a', larger)
    qtbot.waitUntil(lambda: nodes.moves == [('a', larger)])
    assert (wanted, moved) == ([True], [])
    assert field(panel, 'size x').value() == pytest.approx(0.3)


def test_revert_goes_back_to_the_file(model, nodes, panel, qtbot):
    model.set_running(True)
    model.set_value(1, 9.0)
    panel.findChild(QPushButton, 'region_revert').click()
    qtbot.waitUntil(lambda: bool(nodes.moves) and nodes.moves[-1] == ('a', BOX))
    assert not model.is_unsaved


def test_starting_nodes_get_every_unsaved_box(model, nodes, panel, qtbot):
    model.set_value(0, 1.5)
    model.choose('b')
    model.set_value(0, 2.5)
    combo = panel.findChild(QComboBox, 'region_device')
    assert [combo.itemText(index) for index in range(2)] == ['a  (unsaved)', 'b  (unsaved)']
    model.set_running(True)
    qtbot.waitUntil(lambda: len(nodes.moves) == 2)
    assert {name: it.center[0] for name, it in nodes.moves} == {'a': 1.5, 'b': 2.5}


def test_another_sensor_takes_the_marker_along(model, panel):
    model.set_running(True)
    model.show_marker(True)
    wanted = []
    model.marker_wanted.connect(wanted.append)
    panel.findChild(QComboBox, 'region_device').activated.emit(1)
    assert model.device == 'b' and wanted == [False, True]


def test_a_restart_gets_the_unsaved_boxes(model, nodes, qtbot):
    model.set_running(True)
    model.set_value(0, 5.0)
    model.set_running(False)
    qtbot.waitUntil(lambda: len(nodes.moves) == 1)
    model.set_running(True)
    qtbot.waitUntil(lambda: len(nodes.moves) == 2)
    assert nodes.moves[0] == nodes.moves[1]


def test_failure_to_move_is_told(model, nodes, qtbot):
    model.set_running(True)
    nodes.error = OSError('no master')
    with qtbot.waitSignal(model.failed) as failed:
        model.set_value(0, 5.0)
    assert 'no master' in failed.args[0]


def test_hidden_without_a_box(model, panel):
    assert panel.isVisible()
    model.set_devices([])
    assert not panel.isVisible() and model.region is None
