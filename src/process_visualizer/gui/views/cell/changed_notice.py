# SPDX-License-Identifier: BSD-3-Clause
"""Says that the configuration has changed on the disk, and offers to read it again."""
from __future__ import annotations

import os
from typing import Optional

from PyQt5.QtWidgets import QHBoxLayout, QPushButton, QWidget

from process_visualizer.gui.models.cell.cell_model import CellModel
from process_visualizer.gui.toolkit.icons import icon
from process_visualizer.gui.toolkit.theme_following import colour
from process_visualizer.gui.views.parts.elided_label import ElidedLabel


class ChangedNotice(QWidget):
    """A quiet line; hidden while the configuration is as it was read."""

    def __init__(self, cell: CellModel, parent: Optional[QWidget] = None) -> None:
        super().__init__(parent)
        self._files = cell.files
        self._text = ElidedLabel()
        self._text.setObjectName('configuration_changed')
        colour(self._text, 'quiet')
        reload = QPushButton(icon('reload'), 'Reload (F5)')
        reload.setObjectName('reload_changed')
        reload.setToolTip('Read the configuration again; what runs stays as it is until Apply')
        reload.clicked.connect(cell.reload)
        layout = QHBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.addWidget(self._text, 1)
        layout.addWidget(reload)
        self._files.changed.connect(self._show)
        self._show()

    def _show(self) -> None:
        outdated = self._files.outdated
        names = ', '.join(map(os.path.basename, outdated))
        self._text.setText(f'{names} {"has" if len(outdated) == 1 else "have"} changed')
        self._text.setToolTip('\n'.join(outdated))
        self.setVisible(bool(outdated))
