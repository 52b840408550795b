# SPDX-License-Identifier: BSD-3-Clause
"""Names the frame of a robot's poses, and offers to write it into the configuration."""
from __future__ import annotations

import os
from typing import Optional

from PyQt5.QtWidgets import QPushButton, QWidget

from process_visualizer.gui.models.cell.tool_model import ToolModel
from process_visualizer.gui.toolkit.icons import icon
from process_visualizer.gui.toolkit.sentences import sentence
from process_visualizer.gui.views.parts.notice_frame import NoticeFrame


class ToolNotice(NoticeFrame):
    """Shows a tool model; hidden while nothing is offered."""

    def __init__(self, model: ToolModel, parent: Optional[QWidget] = None) -> None:
        super().__init__('tool', 'warning', parent)
        self._model = model
        self._write = QPushButton(icon('save'), 'Write')
        self._write.setObjectName('tool_write')
        self._write.setToolTip('Write it into the file and keep a backup beside it; the rest of '
                               'the file stays as it is. Apply restarts the robot.')
        self._write.clicked.connect(model.write)
        self._dismiss = QPushButton('Not now')
        self._dismiss.setObjectName('tool_dismiss')
        self._dismiss.setToolTip('Leave the file as it is; you are not asked again until the '
                                 'launcher is closed')
        self._dismiss.clicked.connect(model.dismiss)
        self.add_buttons(self._write, self._dismiss)
        model.changed.connect(self._show)
        self._show()

    def _show(self) -> None:
        offered = self._model.offered
        if offered is not None:
            file = os.path.basename(offered.file)
            self._text.setText(f'{sentence(offered.text)}. Write {offered.element} into {file}?')
            self._write.setText(f'Write into {file}')
            self._write.setAccessibleName(f'Write {offered.element} into {offered.file}')
            self.setAccessibleName(f'Tool frame of {offered.device}')
        self._write.setEnabled(not self._model.is_saving)
        self.setVisible(offered is not None)
