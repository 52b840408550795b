# SPDX-License-Identifier: BSD-3-Clause
"""Calibration: the base frame of a device, moved in RViz at once, saved when it is right."""
from __future__ import annotations

import os
from typing import Optional

from PyQt5.QtWidgets import QHBoxLayout, QLabel, QPushButton, QVBoxLayout, QWidget

from process_visualizer.gui.models.cell.calibration_model import CalibrationModel
from process_visualizer.gui.models.cell.fit_model import FitModel
from process_visualizer.gui.toolkit.icons import icon
from process_visualizer.gui.toolkit.theme_following import colour
from process_visualizer.gui.views.cell.edited_parts import EditedParts, icon_button
from process_visualizer.gui.views.parts.labels import note, show_note
from process_visualizer.gui.views.parts.pose_fields import PoseFields
from process_visualizer.gui.views.parts.text_place import TextPlace
from process_visualizer.motion.pose_difference import pose_difference

_SAME_M, _SAME_RAD = 5e-5, 5e-5  # what the text shows
_TEXT_LINES = 4


class CalibrationPanel(QWidget):
    """Device, pose, marker, save and revert; says what is unsaved, and why nothing can be moved."""

    def __init__(self, model: CalibrationModel, fit: FitModel,
                 parent: Optional[QWidget] = None) -> None:
        super().__init__(parent)
        self._model, self._fit_model = model, fit
        self._parts = EditedParts(
            model, 'calibration', 'The device whose base frame is moved', 'Shows arrows and rings '
            'at the frame in RViz; drag them with its tool Interact (I)')
        self._frame = QLabel()
        self._fields = PoseFields()
        self._reason = note('calibration_reason')
        self._found = note('calibration_found')
        self._then = note('calibration_then')
        self._fit = icon_button('calibration_fit', 'fit', 'Fit', 'Moves the sensor to where its '
                                'cloud lies on the models that it sees; nothing is saved')
        self._as_recorded = QPushButton('As recorded')
        self._as_file = QPushButton('As in the file')
        self._keep = QPushButton(icon('save'), 'Save for this recording')
        self._state = QLabel()
        self._set_up()
        self._lay_out()
        fit.changed.connect(self.refresh)  # it follows the other model
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
        self._state.setToolTip(model.base.location.file if model.base is not None else '')
        colour(self._state, 'warning' if model.is_unsaved else 'quiet')

    def _show_fit(self) -> None:
        fit = self._fit_model
        self._fit.setVisible(fit.is_offered)
        self._fit.setEnabled(fit.can_fit)
        self._fit.setText('Fitting…' if fit.is_fitting else 'Fit')
        show_note(self._found, fit.text)
        colour(self._found, 'warning' if fit.is_refused else 'quiet')

    def _show_recording(self) -> None:
        """The buttons that a recording needs."""
        model = self._model
        is_played = model.recording != ''
        for button in (self._as_recorded, self._as_file, self._keep):
            button.setVisible(is_played)
        self._as_recorded.setEnabled(model.can_move and model.recorded_pose is not None)
        self._as_file.setEnabled(model.can_move and model.can_save)
        self._keep.setEnabled(model.can_save_for_recording)

    def _recorded_text(self) -> str:
        """Return where the frame was when the recording was made, as the operator needs it."""
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
        colour(self._frame, 'quiet')
        self._fit.clicked.connect(self._fit_model.fit)
        self._set_up_recording()

    def _set_up_recording(self) -> None:
        for button, name, hint, action in (
                (self._as_recorded, 'as_recorded', 'Move it to where it was when the recording was '
                 'made', self._model.take_recorded),
                (self._as_file, 'as_file', 'Move it to where the configuration says',
                 self._model.take_file),
                (self._keep, 'keep', 'Write the numbers into a file beside the recording; they '
                 'count whenever it is played', self._model.save_for_recording)):
            button.setObjectName(f'calibration_{name}')
            button.setToolTip(hint)
            button.clicked.connect(lambda _checked, do=action: do())

    def _lay_out(self) -> None:
        device = QHBoxLayout()
        device.addWidget(QLabel('Device:'))
        device.addWidget(self._parts.device, 1)
        frame = QHBoxLayout()
        frame.addWidget(QLabel('Base frame:'))
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
