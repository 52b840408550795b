# SPDX-License-Identifier: BSD-3-Clause
"""Offers the values that an earlier session left unsaved."""
from __future__ import annotations

from typing import Optional

from PyQt5.QtWidgets import QPushButton, QWidget

from process_visualizer.gui.models.cell.unsaved_model import UnsavedModel
from process_visualizer.gui.toolkit.sentences import listing
from process_visualizer.gui.views.parts.notice_frame import NoticeFrame


class UnsavedNotice(NoticeFrame):
    """Stays until it is answered."""

    def __init__(self, model: UnsavedModel, parent: Optional[QWidget] = None) -> None:
        super().__init__('unsaved', 'warning', parent)
        self._model = model
        take = QPushButton('Use')
        take.setObjectName('unsaved_take')
        take.setToolTip('Edit them again in the tab Calibration; nothing is written into a file')
        take.clicked.connect(model.take)
        discard = QPushButton('Discard')
        discard.setObjectName('unsaved_discard')
        discard.clicked.connect(model.discard_offer)
        self.add_buttons(take, discard)
        model.changed.connect(self._show)
        self._show()

    def _show(self) -> None:
        offered = self._model.offered
        if offered:
            self._text.setText(f'Left unsaved: {listing(offered)}.')
        self.setVisible(bool(offered))
