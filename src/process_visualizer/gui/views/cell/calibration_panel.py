# SPDX-License-Identifier: BSD-3-Clause
"""Calibration: the base frame of a device, moved in RViz at once, saved when it is right."""
from __future__ import annotations

import math
import os
from typing import Optional

from PyQt5.QtCore import QSize, Qt
from PyQt5.QtWidgets import (
    QComboBox,
    QHBoxLayout,
    QLabel,
    QPushButton,
    QToolButton,
    QVBoxLayout,
    QWidget,
)

from process_visualizer.gui.models.cell.calibration_model import CalibrationModel, difference
from process_visualizer.gui.toolkit.icons import icon
from process_visualizer.gui.toolkit.theme_following import colour
from process_visualizer.gui.views.parts.pose_fields import PoseFields

_UNSAVED = '  (unsaved)'


class CalibrationPanel(QWidget):
    """Device, pose, marker, save and revert; says what is unsaved, and why nothing can be moved."""

    def __init__(self, model: CalibrationModel, parent: Optional[QWidget] = None) -> None:
        super().__init__(parent)
        self._model = model
        self._device = QComboBox()
        self._frame = QLabel()
        self._fields = PoseFields()
        self._marker = QToolButton()
        self._reason = QLabel()
        self._state = QLabel()
        self._revert = QPushButton(icon('revert'), 'Revert')
        self._save = QPushButton(icon('save'), 'Save')
        self._set_up()
        self._lay_out()
        model.changed.connect(self.refresh)
        self.refresh()

    def refresh(self) -> None:
        """Show the model."""
        model = self._model
        self._show_devices()
        self._frame.setText('' if model.base is None else model.base.frame)
        self._fields.show_pose(model.pose)
        can_move = not model.blocked_reason
        self._fields.setEnabled(can_move)
        self._marker.setEnabled(can_move)
        self._marker.setChecked(model.has_marker)
        self._revert.setEnabled(model.is_unsaved)
        self._save.setEnabled(model.can_save)
        self._save.setText('Saving…' if model.is_saving else f'Save into {self._file_name()}')
        self._show_state()

    def _show_devices(self) -> None:
        names = self._model.devices
        texts = [name + _UNSAVED * (name in self._model.unsaved) for name in names]
        shown = [self._device.itemText(index) for index in range(self._device.count())]
        if texts != shown:
            self._device.clear()
            for name, text in zip(names, texts):
                self._device.addItem(text, name)
        if self._model.device:
            self._device.setCurrentIndex(names.index(self._model.device))
        self._device.setEnabled(bool(names))

    def _show_state(self) -> None:
        model = self._model
        self._reason.setText(model.blocked_reason)
        self._reason.setVisible(bool(model.blocked_reason))
        text = f'As in {self._place()}.' if model.base is not None else ''
        if model.base is not None and model.is_unsaved:
            distance_m, angle_rad = difference(model.pose, model.base.pose)
            text = (f'Unsaved: {1000 * distance_m:.1f} mm and {math.degrees(angle_rad):.2f}° '
                    f'from {self._place()}.')
        self._state.setText(text)
        self._state.setToolTip(model.base.location.file if model.base is not None else '')
        colour(self._state, 'warning' if model.is_unsaved else 'quiet')

    def _place(self) -> str:
        return f'{self._file_name()}:{self._model.base.location.line}' if self._model.base else ''

    def _file_name(self) -> str:
        base = self._model.base
        return os.path.basename(base.location.file) if base is not None else 'the file'

    def _set_up(self) -> None:
        self._device.setObjectName('calibration_device')
        self._device.setAccessibleName('Device')
        self._device.setToolTip('The device whose base frame is moved')
        self._device.activated.connect(
            lambda index: self._model.choose(str(self._device.itemData(index))))
        self._fields.edited.connect(self._model.set_value)
        self._marker.setObjectName('calibration_marker')
        self._marker.setText('Drag in RViz')
        self._marker.setIcon(icon('view'))
        self._marker.setIconSize(QSize(18, 18))
        self._marker.setToolButtonStyle(Qt.ToolButtonTextBesideIcon)
        self._marker.setCheckable(True)
        self._marker.setToolTip('Shows arrows and rings at the frame in RViz; drag them '
                                'with its tool Interact (I)')
        self._marker.clicked.connect(self._model.show_marker)
        self._reason.setObjectName('calibration_reason')
        colour(self._reason, 'quiet')
        self._state.setObjectName('calibration_state')
        self._state.setWordWrap(True)
        self._revert.setObjectName('calibration_revert')
        self._revert.setToolTip('Go back to the values in the file')
        self._revert.clicked.connect(self._model.revert)
        self._save.setObjectName('calibration_save')
        self._save.setToolTip('Write the numbers into the file; a backup is kept beside it')
        self._save.clicked.connect(self._model.save)
        colour(self._frame, 'quiet')

    def _lay_out(self) -> None:
        device = QHBoxLayout()
        device.addWidget(QLabel('Device:'))
        device.addWidget(self._device, 1)
        frame = QHBoxLayout()
        frame.addWidget(QLabel('Base frame:'))
        frame.addWidget(self._frame, 1)
        frame.addWidget(self._marker)
        buttons = QHBoxLayout()
        buttons.addWidget(self._revert)
        buttons.addWidget(self._save, 1)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 6, 0, 4)
        layout.setSpacing(8)
        layout.addLayout(device)
        layout.addLayout(frame)
        layout.addWidget(self._fields)
        layout.addWidget(self._reason)
        layout.addWidget(self._state)
        layout.addLayout(buttons)
        layout.addStretch(1)
