# SPDX-License-Identifier: BSD-3-Clause
"""The speed of playback as a number."""
from __future__ import annotations

from typing import Optional

from PyQt5.QtCore import Qt
from PyQt5.QtWidgets import QDoubleSpinBox, QWidget

from process_visualizer.gui.models.playback.playback_model import PlaybackModel
from process_visualizer.playback.timeline import MAX_RATE, MIN_RATE


class RateBox(QDoubleSpinBox):
    """The speed as a number; its arrows go through the usual speeds, Enter gives the keys back."""

    def __init__(self, playback: PlaybackModel, parent: Optional[QWidget] = None) -> None:
        super().__init__(parent)
        self._playback = playback
        self._is_being_written = False
        self.setObjectName('rate')
        self.setAccessibleName('Speed')
        self.setToolTip('Speed; 1 is that of the recording  ([ slower, ] faster)')
        self.setRange(MIN_RATE, MAX_RATE)
        self.setDecimals(2)
        self.setSuffix(' ×')
        self.setPrefix('−')
        self.setFixedWidth(self.sizeHint().width())  # so that nothing moves when it turns round
        self.setKeyboardTracking(False)
        self.setFocusPolicy(Qt.StrongFocus)
        self.valueChanged.connect(playback.set_speed)
        self.lineEdit().textEdited.connect(lambda _text: self._set_written(True))
        self.editingFinished.connect(lambda: self._set_written(False))
        self.lineEdit().returnPressed.connect(self.clearFocus)

    def show_rate(self, rate: float) -> None:
        """Show a rate without requesting it; text that is being edited stays."""
        if not self._is_being_written:
            self.blockSignals(True)
            self.setPrefix('−' if rate < 0.0 else '')
            self.setValue(abs(rate))
            self.blockSignals(False)

    def _set_written(self, is_being_written: bool) -> None:
        self._is_being_written = is_being_written

    def stepBy(self, steps: int) -> None:
        """Go to the next usual speed."""
        for _ in range(abs(steps)):
            self._playback.faster() if steps > 0 else self._playback.slower()
        self.clearFocus()
