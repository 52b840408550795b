# SPDX-License-Identifier: BSD-3-Clause
"""The progress of the curves, with buttons to skip them, or to read them after all."""
from __future__ import annotations

from typing import Optional

from PyQt5.QtWidgets import QHBoxLayout, QLabel, QProgressBar, QSizePolicy, QToolButton, QWidget

from process_visualizer.gui.models.playback.curves_model import CurvesModel


class CurvesRow(QWidget):
    """Visible only while there is something to show."""

    def __init__(self, curves: CurvesModel, parent: Optional[QWidget] = None) -> None:
        super().__init__(parent)
        self._curves = curves
        self._shown: Optional[object] = None
        self.text = QLabel()
        self.bar = QProgressBar()
        self.bar.setObjectName('curves_progress')
        self.bar.setRange(0, 1000)
        self.bar.setTextVisible(False)
        self.bar.setMaximumHeight(8)
        self.button = QToolButton()
        self.button.setObjectName('curves_button')
        self.button.setAutoRaise(True)
        self.button.clicked.connect(self._on_button)
        self.setSizePolicy(QSizePolicy.Preferred, QSizePolicy.Fixed)
        layout = QHBoxLayout(self)
        layout.setContentsMargins(12, 2, 12, 2)
        for widget, stretch in ((self.text, 0), (self.bar, 1), (self.button, 0)):
            layout.addWidget(widget, stretch)
        curves.changed.connect(self._show)
        self._show()

    def _on_button(self) -> None:
        if self._curves.reading is not None:
            self._curves.cancel()
        else:
            self._curves.read()

    def _show(self) -> None:
        progress = self._curves.reading
        self.setVisible(progress is not None or self._curves.is_cancelled)
        self.text.setText('Reading curves' if progress is not None else 'No curves')
        self.button.setText('Cancel' if progress is not None else 'Read them')
        self.button.setToolTip('Play without curves' if progress is not None
                               else 'Read the curves of the process variables')
        self.bar.setVisible(progress is not None)
        if progress is not None and progress is not self._shown:
            self.bar.setValue(0)
            progress.changed.connect(lambda part: self.bar.setValue(round(1000 * part)))
        self._shown = progress
