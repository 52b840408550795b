# SPDX-License-Identifier: BSD-3-Clause
"""Common parts of the panels that edit values of devices: choice, marker, revert, save."""
from __future__ import annotations

import os
from typing import Any

from PyQt5.QtCore import QSize, Qt
from PyQt5.QtWidgets import QComboBox, QPushButton, QToolButton

from process_visualizer.gui.models.cell.edited_values import EditedValues
from process_visualizer.gui.toolkit.icons import icon

_UNSAVED = '  (unsaved)'
_ICON = QSize(18, 18)


class EditedParts:
    """The widgets, connected to their model; the panel lays them out."""

    def __init__(self, model: EditedValues[Any], name: str, device_hint: str,
                 marker_hint: str) -> None:
        """``name`` is what the widgets' names begin with."""
        self._model = model
        self.device = QComboBox()
        self.device.setObjectName(f'{name}_device')
        self.device.setAccessibleName('Device')
        self.device.setToolTip(device_hint)
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
    button.setToolTip(hint)
    return button
