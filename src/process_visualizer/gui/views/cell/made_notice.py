# SPDX-License-Identifier: BSD-3-Clause
"""Summarises a new configuration, and opens it for open decisions."""
from __future__ import annotations

from typing import Optional

from PyQt5.QtCore import pyqtSignal
from PyQt5.QtWidgets import QPushButton, QWidget

from process_visualizer.gui.models.cell.new_configuration_model import NewConfigurationModel
from process_visualizer.gui.toolkit.icons import icon
from process_visualizer.gui.views.parts.notice_frame import NoticeFrame


class MadeNotice(NoticeFrame):
    """Stays until it is closed or another configuration is open."""

    open_wanted = pyqtSignal(str, int)
    """A file should be opened in the editor at a line."""

    def __init__(self, model: NewConfigurationModel, parent: Optional[QWidget] = None) -> None:
        super().__init__('made', 'good', parent, symbol='ok')
        self._path = ''
        edit = QPushButton(icon('open'), 'Open it in the editor')
        edit.setObjectName('made_edit')
        edit.setToolTip('Your editor (VISUAL or EDITOR); afterwards, F5 reads the file again')
        edit.clicked.connect(lambda: self.open_wanted.emit(self._path, 1))
        close = QPushButton('Close')
        close.setObjectName('made_close')
        close.clicked.connect(self.hide)
        self.add_buttons(edit, close)
        self.hide()
        model.summary_ready.connect(self._text.setText)
        model.made.connect(self._show_made)

    def follow(self, path: str) -> None:
        """Hide if another configuration is open; ``path`` is that of the open one."""
        if path != self._path:
            self.hide()

    def _show_made(self, path: str) -> None:
        self._path = path
        self.setToolTip(path)
        self.show()
