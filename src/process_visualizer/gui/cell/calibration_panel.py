# SPDX-License-Identifier: BSD-3-Clause
"""Calibration: base frames and boxes of devices, moved in RViz at once, saved when right."""
from __future__ import annotations

import os
from typing import Any, Optional

from PyQt5.QtCore import QSize, Qt
from PyQt5.QtWidgets import (
    QComboBox,
    QGridLayout,
    QHBoxLayout,
    QMessageBox,
    QPushButton,
    QToolButton,
    QVBoxLayout,
    QWidget,
)

from process_visualizer.gui.cell.calibration_model import CalibrationModel, FitModel, RegionModel
from process_visualizer.gui.cell.edited_values import EditedValues
from process_visualizer.gui.cell.expected_model import ExpectModel, question_text
from process_visualizer.gui.toolkit.dialogs import ask, message_box
from process_visualizer.gui.toolkit.icons import icon
from process_visualizer.gui.toolkit.labels import plain_label, plain_tip
from process_visualizer.gui.toolkit.scrolling import TextPlace
from process_visualizer.gui.toolkit.theme import color
from process_visualizer.gui.toolkit.widgets import NumberField, PoseFields, note, show_note
from process_visualizer.robot.rotations import pose_difference

# Common parts of the panels that edit values of devices: choice, marker, revert, save.

_UNSAVED = '  (unsaved)'
_ICON = QSize(18, 18)


class EditedParts:
    """The widgets, connected to their model; the panel lays them out."""

    def __init__(self, model: EditedValues[Any], name: str, device_hint: str,
                 marker_hint: str) -> None:
        """``name`` is the first part of the widgets' names."""
        self._model = model
        self.device = QComboBox()
        self.device.setObjectName(f'{name}_device')
        self.device.setAccessibleName('Device')
        self.device.setToolTip(plain_tip(device_hint))
        self.device.activated.connect(
            lambda index: model.choose(str(self.device.itemData(index))))
        self.marker = icon_button(f'{name}_marker', 'view', 'Drag in RViz', marker_hint)
        self.marker.setCheckable(True)
        self.marker.clicked.connect(model.show_marker)
        self.revert = QPushButton(icon('revert'), 'Revert')
        self.revert.setObjectName(f'{name}_revert')
        self.revert.setToolTip('Go back to what is saved')
        self.revert.clicked.connect(model.revert)
        self.save = QPushButton(icon('save'), 'Save')
        self.save.setObjectName(f'{name}_save')
        self.save.setToolTip('Write the numbers into the file; a backup is kept beside it')
        self.save.clicked.connect(model.save)

    def refresh(self, file: str) -> None:
        """Show the model; ``file`` is that of the chosen device, '' without one."""
        model = self._model
        self._show_devices()
        self.marker.setEnabled(model.can_move)
        self.marker.setChecked(model.has_marker)
        self.revert.setEnabled(model.is_unsaved)
        self.save.setEnabled(model.can_save)
        where = os.path.basename(file) or 'the file'
        self.save.setText('Saving…' if model.is_saving else f'Save into {where}')

    def _show_devices(self) -> None:
        names = self._model.devices
        texts = [name + _UNSAVED * (name in self._model.unsaved) for name in names]
        if texts != [self.device.itemText(index) for index in range(self.device.count())]:
            self.device.clear()
            for name, text in zip(names, texts):
                self.device.addItem(text, name)
        if self._model.device:
            self.device.setCurrentIndex(names.index(self._model.device))
        self.device.setEnabled(bool(names))


def icon_button(name: str, symbol: str, text: str, hint: str) -> QToolButton:
    """Return a button with an icon beside its text."""
    button = QToolButton()
    button.setObjectName(name)
    button.setText(text)
    button.setIcon(icon(symbol))
    button.setIconSize(_ICON)
    button.setToolButtonStyle(Qt.ToolButtonTextBesideIcon)
    button.setToolTip(plain_tip(hint))
    return button


_SAME_M, _SAME_RAD = 5e-5, 5e-5  # resolution of the text
_TEXT_LINES = 6  # the unsaved change, what a fit found, and where the frame was when recorded


class CalibrationPanel(QWidget):
    """Device, pose, marker, save and revert; says what is unsaved, and why nothing can be moved."""

    def __init__(self, model: CalibrationModel, fit: FitModel,
                 parent: Optional[QWidget] = None) -> None:
        super().__init__(parent)
        self._model, self._fit_model = model, fit
        self._parts = EditedParts(
            model, 'calibration', 'The device whose base frame is moved', 'Shows arrows and rings '
            'at the frame in RViz; drag them with its tool Interact (I)')
        self._frame = plain_label()
        self._fields = PoseFields()
        self._reason = note('calibration_reason')
        self._found = note('calibration_found')
        self._then = note('calibration_then')
        self._fit = icon_button('calibration_fit', 'fit', 'Fit', 'Moves the sensor to where its '
                                'cloud lies on the models that it sees; nothing is saved')
        self._as_recorded = QPushButton('As recorded')
        self._as_file = QPushButton('As in the file')
        self._keep = QPushButton(icon('save'), 'Save for this recording')
        self._state = plain_label()
        self._set_up()
        self._lay_out()
        fit.changed.connect(self.refresh)  # the fit follows the other model
        self.refresh()

    def refresh(self) -> None:
        """Show the model."""
        model = self._model
        self._parts.refresh('' if model.base is None else model.base.location.file)
        self._frame.setText('' if model.base is None else model.base.frame)
        self._fields.show_pose(model.pose)
        self._fields.setEnabled(model.can_move)
        self._show_fit()
        self._show_recording()
        self._show_state()

    def _show_state(self) -> None:
        model = self._model
        show_note(self._reason, model.blocked_reason)
        show_note(self._then, self._recorded_text())
        text = f'As in {self._place()}.' if model.base is not None else ''
        if model.saved_pose is not None and model.is_unsaved:
            text = f'Unsaved: {pose_difference(model.pose, model.saved_pose)} from {self._place()}.'
        self._state.setText(text)
        self._state.setToolTip('' if model.base is None else plain_tip(model.base.location.file))
        color(self._state, 'warning' if model.is_unsaved else 'quiet')

    def _show_fit(self) -> None:
        fit = self._fit_model
        self._fit.setVisible(fit.is_offered)
        self._fit.setEnabled(fit.can_fit)
        self._fit.setText('Fitting…' if fit.is_fitting else 'Fit')
        show_note(self._found, fit.text)
        color(self._found, 'warning' if fit.is_refused else 'quiet')

    def _show_recording(self) -> None:
        """Show the buttons that a recording needs."""
        model = self._model
        is_played = model.recording != ''
        for button in (self._as_recorded, self._as_file, self._keep):
            button.setVisible(is_played)
        self._as_recorded.setEnabled(model.can_move and model.recorded_pose is not None)
        self._as_file.setEnabled(model.can_move and model.can_save)
        self._keep.setEnabled(model.can_save_for_recording)

    def _recorded_text(self) -> str:
        """Return the frame's place at the time of the recording, in words for the operator."""
        model, bag = self._model, os.path.basename(self._model.recording)
        if not bag or model.base is None:
            return ''
        if model.recorded_pose is None:
            return f'{bag} does not say where it was then.'
        apart = pose_difference(model.pose, model.recorded_pose)
        if apart.distance_m < _SAME_M and apart.angle_rad < _SAME_RAD:
            return f'As when {bag} was recorded.'
        return f'When {bag} was recorded it was {apart} from here.'

    def _place(self) -> str:
        if self._model.is_for_recording:
            return f'what is saved for {os.path.basename(self._model.recording)}'
        base = self._model.base
        return '' if base is None else \
            f'{os.path.basename(base.location.file)}:{base.location.line}'

    def _set_up(self) -> None:
        self._fields.edited.connect(self._model.set_value)
        self._state.setObjectName('calibration_state')
        self._state.setWordWrap(True)
        color(self._frame, 'quiet')
        self._fit.clicked.connect(self._fit_model.fit)
        self._set_up_recording()

    def _set_up_recording(self) -> None:
        for button, name, hint, action in (
                (self._as_recorded, 'as_recorded', 'Move it to its pose when the recording was '
                 'made', self._model.take_recorded),
                (self._as_file, 'as_file', 'Move it to its pose in the configuration',
                 self._model.take_file),
                (self._keep, 'keep', 'Write the numbers into a file beside the recording; they '
                 'count whenever it is played', self._model.save_for_recording)):
            button.setObjectName(f'calibration_{name}')
            button.setToolTip(plain_tip(hint))
            button.clicked.connect(lambda _checked, do=action: do())

    def _lay_out(self) -> None:
        device = QHBoxLayout()
        device.addWidget(plain_label('Device:'))
        device.addWidget(self._parts.device, 1)
        frame = QHBoxLayout()
        frame.addWidget(plain_label('Base frame:'))
        frame.addWidget(self._frame, 1)
        frame.addWidget(self._fit)
        frame.addWidget(self._parts.marker)
        back, save = QHBoxLayout(), QHBoxLayout()
        for button in (self._parts.revert, self._as_recorded, self._as_file):
            back.addWidget(button)
        back.addStretch(1)
        save.addWidget(self._parts.save, 1)
        save.addWidget(self._keep, 1)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 6, 0, 4)
        layout.setSpacing(8)
        layout.addLayout(device)
        layout.addLayout(frame)
        layout.addWidget(self._fields)
        layout.addLayout(back)
        layout.addLayout(save)
        layout.addWidget(TextPlace(_TEXT_LINES, self._reason, self._state, self._found, self._then))


_CENTER, _SIZE = ('center x', 'center y', 'center z'), ('size x', 'size y', 'size z')
_REACH_M, _MIN_M, _STEP_M = 100.0, 0.001, 0.01
_HINT = 'Arrow keys and wheel: 1 cm; with Ctrl ten times as much'


class RegionPanel(QWidget):
    """Sensor, center and edge lengths, marker, save and revert; hidden if no sensor has a box."""

    def __init__(self, model: RegionModel, parent: Optional[QWidget] = None) -> None:
        super().__init__(parent)
        self._model = model
        self._parts = EditedParts(
            model, 'region', 'The depth sensor whose cloud is cropped', 'Shows arrows at the '
            'middle of the box and a cube on each face; drag them with the tool Interact (I)')
        self._frame = plain_label()
        color(self._frame, 'quiet')
        self._fields = [self._field(index, name) for index, name in enumerate(_CENTER + _SIZE)]
        self._lay_out()
        model.changed.connect(self.refresh)
        self.refresh()

    def refresh(self) -> None:
        """Show the model."""
        model, region = self._model, self._model.region
        self.setVisible(region is not None)
        if region is None:
            return
        self._parts.refresh(region.location.file)
        self._frame.setText(f'aligned with {region.frame}')
        for field, value in zip(self._fields, (*region.center, *region.size)):
            field.show_value(value)
            field.setEnabled(model.can_move)

    def _field(self, index: int, name: str) -> NumberField:
        field = NumberField(name)
        field.setRange(-_REACH_M if name in _CENTER else _MIN_M, _REACH_M)
        field.setDecimals(4)
        field.setSingleStep(_STEP_M)
        field.setSuffix(' m')
        field.setToolTip(_HINT)
        field.valueChanged.connect(lambda value: self._model.set_value(index, value))
        return field

    def _lay_out(self) -> None:
        top = QHBoxLayout()
        top.addWidget(plain_label('Crop box:'))
        top.addWidget(self._parts.device)
        top.addWidget(self._frame, 1)
        top.addWidget(self._parts.marker)
        numbers = QGridLayout()
        for index, field in enumerate(self._fields):
            column, row = 2 * (index // 3), index % 3
            numbers.addWidget(plain_label(field.objectName()), row, column)
            numbers.addWidget(field, row, column + 1)
        numbers.setColumnStretch(1, 1)
        numbers.setColumnStretch(3, 1)
        buttons = QHBoxLayout()
        buttons.addWidget(self._parts.revert)
        buttons.addWidget(self._parts.save, 1)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 6, 0, 4)
        layout.setSpacing(8)
        layout.addLayout(top)
        layout.addLayout(numbers)
        layout.addLayout(buttons)


class ExpectedPanel(QWidget):
    """Sensor, what it sees, and buttons that write and revert; hidden if none looks for any."""

    def __init__(self, model: ExpectModel, parent: Optional[QWidget] = None) -> None:
        super().__init__(parent)
        self._model = model
        self._device = QComboBox()
        self._device.setObjectName('expected_device')
        self._device.setAccessibleName('Depth sensor')
        self._device.setToolTip('The depth sensor whose objects are expected')
        self._device.activated.connect(lambda index: model.choose(self._device.itemText(index)))
        self._state = plain_label()
        self._state.setObjectName('expected_state')
        color(self._state, 'quiet')
        self._revert = QPushButton(icon('revert'), 'Revert')
        self._revert.setObjectName('expected_revert')
        self._revert.setToolTip('Take out of the file what was added last')
        self._revert.clicked.connect(model.revert)
        self._expect = QPushButton(icon('save'), 'Expect what is there now…')
        self._expect.setObjectName('expected_add')
        self._expect.setToolTip('Shows what would be added to the file, and asks')
        self._expect.clicked.connect(lambda: self.ask_about(model.device))
        self._lay_out()
        model.changed.connect(self.refresh)
        self.refresh()

    def refresh(self) -> None:
        """Show the model."""
        model, names = self._model, self._model.sensors
        self.setVisible(bool(names))
        if names != [self._device.itemText(index) for index in range(self._device.count())]:
            self._device.clear()
            self._device.addItems(names)
        if model.device:
            self._device.setCurrentIndex(names.index(model.device))
        self._state.setText(model.text)
        self._revert.setEnabled(model.can_revert)
        self._expect.setEnabled(model.can_expect)

    def ask_about(self, device: str) -> None:
        """Show what a sensor sees and could expect; write it if the operator wants it."""
        model = self._model
        model.choose(device)
        found = model.look()
        text = question_text(device, found, model.file)
        if found.added:
            ask(self.window(), text, f'Write into {model.file}', lambda: model.write(
                device, found.boxes))
        else:
            message_box(self.window(), text, QMessageBox.Information).open()

    def _lay_out(self) -> None:
        top, buttons = QHBoxLayout(), QHBoxLayout()
        top.addWidget(plain_label('Objects:'))
        top.addWidget(self._device)
        top.addWidget(self._state, 1)
        buttons.addWidget(self._revert)
        buttons.addWidget(self._expect, 1)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 6, 0, 4)
        layout.setSpacing(8)
        layout.addLayout(top)
        layout.addLayout(buttons)
