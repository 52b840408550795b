# SPDX-License-Identifier: BSD-3-Clause
"""The box that a depth sensor's cloud is cropped to, moved at once, saved when it is right."""
from __future__ import annotations

from typing import Optional

from PyQt5.QtWidgets import QGridLayout, QHBoxLayout, QLabel, QVBoxLayout, QWidget

from process_visualizer.gui.models.cell.region_model import RegionModel
from process_visualizer.gui.toolkit.theme_following import colour
from process_visualizer.gui.views.cell.edited_parts import EditedParts
from process_visualizer.gui.views.parts.pose_fields import NumberField

_CENTER, _SIZE = ('centre x', 'centre y', 'centre z'), ('size x', 'size y', 'size z')
_REACH_M, _SHORTEST_M, _STEP_M = 100.0, 0.001, 0.01
_HINT = 'Arrow keys and wheel: 1 cm; with Ctrl ten times as much'


class RegionPanel(QWidget):
    """Sensor, centre and edge lengths, marker, save and revert; hidden if no sensor has a box."""

    def __init__(self, model: RegionModel, parent: Optional[QWidget] = None) -> None:
        super().__init__(parent)
        self._model = model
        self._parts = EditedParts(
            model, 'region', 'The depth sensor whose cloud is cropped', 'Shows arrows at the '
            'middle of the box and a cube on each face; drag them with the tool Interact (I)')
        self._frame = QLabel()
        colour(self._frame, 'quiet')
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
        field.setRange(-_REACH_M if name in _CENTER else _SHORTEST_M, _REACH_M)
        field.setDecimals(4)
        field.setSingleStep(_STEP_M)
        field.setSuffix(' m')
        field.setToolTip(_HINT)
        field.valueChanged.connect(lambda value: self._model.set_value(index, value))
        return field

    def _lay_out(self) -> None:
        top = QHBoxLayout()
        top.addWidget(QLabel('Crop box:'))
        top.addWidget(self._parts.device)
        top.addWidget(self._frame, 1)
        top.addWidget(self._parts.marker)
        numbers = QGridLayout()
        for index, field in enumerate(self._fields):
            column, row = 2 * (index // 3), index % 3
            numbers.addWidget(QLabel(field.objectName()), row, column)
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
