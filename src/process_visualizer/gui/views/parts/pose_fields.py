# SPDX-License-Identifier: BSD-3-Clause
"""Six fields of a pose: x y z in m, yaw pitch roll in degrees."""
from __future__ import annotations

import math
from typing import List, Optional

from PyQt5.QtCore import Qt, pyqtSignal
from PyQt5.QtGui import QWheelEvent
from PyQt5.QtWidgets import QDoubleSpinBox, QGridLayout, QLabel, QWidget

from process_visualizer.cell.model import Pose

_NAMES = ('x', 'y', 'z', 'yaw', 'pitch', 'roll')
_AXES = {'yaw': 'about z', 'pitch': "about y'", 'roll': "about x''"}
_REACH_M = 100.0
_STEP_M, _STEP_DEG = 0.001, 0.1


class PoseFields(QWidget):
    """Shows a pose; only numbers that the operator changes are reported, the others stay exact."""

    edited = pyqtSignal(int, float)
    """The index (x y z yaw pitch roll: 0 to 5) and the new value in m or rad."""

    def __init__(self, parent: Optional[QWidget] = None) -> None:
        super().__init__(parent)
        self._fields: List[NumberField] = [self._field(index) for index in range(len(_NAMES))]
        layout = QGridLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setHorizontalSpacing(8)
        layout.setVerticalSpacing(4)
        for index, (name, field) in enumerate(zip(_NAMES, self._fields)):
            column, row = 3 * (index // 3), index % 3
            layout.addWidget(QLabel(name), row, column)
            layout.addWidget(field, row, column + 1)
        layout.setColumnMinimumWidth(2, 12)
        layout.setColumnStretch(1, 1)
        layout.setColumnStretch(4, 1)

    def show_pose(self, pose: Pose) -> None:
        """Show xyz [m] and ypr [rad] without reporting an edit."""
        for field, value in zip(self._fields[:3], pose.xyz):
            field.show_value(value)
        for field, angle in zip(self._fields[3:], pose.ypr):
            field.show_value(math.degrees(angle))
            axis = _AXES[field.objectName()]
            field.setToolTip(f"{angle:.6f} rad, {axis}\n{_HINT.format('0.1°')}")

    def _field(self, index: int) -> NumberField:
        name, is_angle = _NAMES[index], index >= 3
        field = NumberField(name)
        field.setRange(-360.0 if is_angle else -_REACH_M, 360.0 if is_angle else _REACH_M)
        field.setDecimals(2 if is_angle else 4)
        field.setSingleStep(_STEP_DEG if is_angle else _STEP_M)
        field.setSuffix('°' if is_angle else ' m')
        field.setToolTip(_HINT.format('1 mm'))
        field.valueChanged.connect(
            lambda value: self.edited.emit(index, math.radians(value) if is_angle else value))
        return field


_HINT = 'Arrow keys and wheel: {}; with Ctrl ten times as much'


class NumberField(QDoubleSpinBox):
    """A spin box that the wheel changes only while it is being edited."""

    def __init__(self, name: str, parent: Optional[QWidget] = None) -> None:
        super().__init__(parent)
        self.setObjectName(name)
        self.setAccessibleName(name)
        self.setFocusPolicy(Qt.StrongFocus)
        self.setKeyboardTracking(False)
        self.setAlignment(Qt.AlignRight)
        self.setAccelerated(True)

    def show_value(self, value: float) -> None:
        """Show a value that was not entered here."""
        if round(value, self.decimals()) != self.value():
            self.blockSignals(True)
            self.setValue(value)
            self.blockSignals(False)

    def wheelEvent(self, event: QWheelEvent) -> None:
        """Leave the wheel to the scrolled window."""
        if self.hasFocus():
            super().wheelEvent(event)
        else:
            event.ignore()
