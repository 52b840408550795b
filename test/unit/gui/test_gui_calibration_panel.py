# SPDX-License-Identifier: BSD-3-Clause
"""The calibration panel, used as by an operator."""
from __future__ import annotations

import math
from typing import Iterator

import pytest
from PyQt5.QtCore import QPoint, QPointF, Qt
from PyQt5.QtGui import QWheelEvent
from PyQt5.QtWidgets import (
    QApplication,
    QComboBox,
    QDoubleSpinBox,
    QLabel,
    QPushButton,
    QToolButton,
)
from test_gui_calibration_model import IN_FILE, Frames, device

from process_visualizer.clients.sensor_fit_client import FitError, SensorFit
from process_visualizer.gui.cell.calibration_model import CalibrationModel, FitModel
from process_visualizer.gui.cell.calibration_panel import CalibrationPanel
from process_visualizer.gui.toolkit.tasks import Tasks


def refused(name: str) -> SensorFit:
    raise FitError(f'{name} sees nothing')


@pytest.fixture
def model(qtbot) -> Iterator[CalibrationModel]:
    tasks, frames = Tasks(), Frames()
    calibration = CalibrationModel(tasks, frames.move)
    calibration.set_save(frames.save)
    yield calibration
    tasks.close()


@pytest.fixture
def panel(model: CalibrationModel, qtbot) -> CalibrationPanel:
    widget = CalibrationPanel(model, FitModel(Tasks(model), model, refused))
    qtbot.addWidget(widget)
    model.set_devices([device('a'), device('b')])
    widget.show()
    return widget


def field(panel: CalibrationPanel, name: str) -> QDoubleSpinBox:
    return panel.findChild(QDoubleSpinBox, name)


def test_the_pose_is_shown_in_meters_and_degrees(panel):
    assert [field(panel, name).value() for name in ('x', 'y', 'z')] == [1.0, 2.0, 3.0]
    assert field(panel, 'yaw').value() == pytest.approx(math.degrees(0.1), abs=0.005)
    assert '0.100000 rad' in field(panel, 'yaw').toolTip()


def test_disabled_with_a_reason_but_saving_is_possible(panel, model):
    assert not field(panel, 'x').isEnabled()
    assert 'Launch' in panel.findChild(QLabel, 'calibration_reason').text()
    model.set_running(True)
    assert field(panel, 'x').isEnabled()
    assert not panel.findChild(QLabel, 'calibration_reason').isVisible()
    model.set_value(0, 1.5)
    model.set_running(False)
    assert panel.findChild(QPushButton, 'calibration_save').isEnabled()


def test_steps(panel, model, qtbot):
    model.set_running(True)
    qtbot.keyClick(field(panel, 'x'), Qt.Key_Up)
    assert model.pose.xyz == pytest.approx((1.001, 2.0, 3.0))
    assert model.pose.ypr == IN_FILE.ypr  # not rounded to the displayed value
    qtbot.keyClick(field(panel, 'x'), Qt.Key_Up, Qt.ControlModifier)
    assert model.pose.xyz[0] == pytest.approx(1.011)
    before = field(panel, 'yaw').value()
    qtbot.keyClick(field(panel, 'yaw'), Qt.Key_Down)
    assert math.degrees(model.pose.ypr[0]) == pytest.approx(before - 0.1)


def test_the_wheel_scrolls_the_window_and_changes_nothing(panel, model):
    model.set_running(True)
    field(panel, 'yaw').setFocus()
    event = QWheelEvent(QPointF(5, 5), QPointF(5, 5), QPoint(), QPoint(0, 120), Qt.NoButton,
                        Qt.NoModifier, Qt.NoScrollPhase, False)
    QApplication.sendEvent(field(panel, 'x'), event)
    assert model.pose == IN_FILE


def test_unsaved_save_and_revert(panel, model, qtbot):
    model.set_running(True)
    state = panel.findChild(QLabel, 'calibration_state')
    save, revert = (panel.findChild(QPushButton, f'calibration_{it}') for it in ('save', 'revert'))
    assert state.text() == 'As in cell.xml:1.' and not save.isEnabled() and not revert.isEnabled()
    field(panel, 'x').setValue(1.012)
    assert state.text() == 'Unsaved: 12.0 mm and 0.00° from cell.xml:1.'
    assert panel.findChild(QComboBox, 'calibration_device').currentText() == 'a  (unsaved)'
    revert.click()
    assert field(panel, 'x').value() == 1.0 and not save.isEnabled()
    field(panel, 'x').setValue(1.5)
    with qtbot.waitSignal(model.saved):
        save.click()
    assert state.text() == 'As in cell.xml:1.' and field(panel, 'x').value() == 1.5


def test_another_device(panel, model, qtbot):
    model.set_running(True)
    combo = panel.findChild(QComboBox, 'calibration_device')
    combo.setFocus()
    qtbot.keyClick(combo, Qt.Key_Down)
    assert model.device == 'b'


def test_the_marker_button(panel, model):
    model.set_running(True)
    button = panel.findChild(QToolButton, 'calibration_marker')
    button.click()
    assert model.has_marker and button.isChecked()
    model.take_pose((4.0, 5.0, 6.0), (0.0, 0.0, math.pi / 2))
    assert field(panel, 'x').value() == 4.0 and field(panel, 'roll').value() == 90.0
    model.set_running(False)
    assert not button.isChecked() and not button.isEnabled()
