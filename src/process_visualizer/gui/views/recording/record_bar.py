# SPDX-License-Identifier: BSD-3-Clause
"""The big button with the elapsed time."""
from __future__ import annotations

from typing import Optional

from PyQt5.QtCore import QSize, QTimer
from PyQt5.QtWidgets import QFrame, QHBoxLayout, QLabel, QPushButton, QVBoxLayout, QWidget

from process_visualizer.gui.models.recording.recording_model import RecordingModel
from process_visualizer.gui.models.recording.recording_types import Phase
from process_visualizer.gui.toolkit.icons import icon
from process_visualizer.gui.toolkit.style import tabular_font
from process_visualizer.gui.toolkit.theme import theme
from process_visualizer.gui.toolkit.theme_following import ThemeFollower, colour, set_sheet
from process_visualizer.gui.views.parts.labels import small
from process_visualizer.health.figures import clock_text, count_text, size_text

_CLOCK_PERIOD_MS = 100
_ICON_PX = 20
_TEXTS = {Phase.STARTING: 'Starting…', Phase.RECORDING: 'Stop', Phase.STOPPING: 'Stopping…'}


class RecordBar(QFrame):
    """Record or stop; red while something is recorded."""

    def __init__(self, model: RecordingModel, parent: Optional[QWidget] = None) -> None:
        super().__init__(parent)
        self._model = model
        self.setObjectName('record_bar')
        self._button = QPushButton()
        self._button.setObjectName('record')
        self._button.setIconSize(QSize(_ICON_PX, _ICON_PX))
        self._button.setMinimumSize(150, 40)
        self._button.clicked.connect(model.toggle)
        self._dot = QLabel()
        self._clock = QLabel()
        self._clock.setObjectName('record_time')
        self._figures = small(QLabel())
        self._figures.setObjectName('record_figures')
        self._timer = QTimer(self)
        self._timer.setInterval(_CLOCK_PERIOD_MS)
        self._timer.timeout.connect(self._show_clock)
        self._style_text()
        self._lay_out()
        model.changed.connect(self.refresh)
        ThemeFollower(self, self.refresh)
        self.refresh()

    def refresh(self) -> None:
        """Show the state of the recorder."""
        phase = self._model.phase
        is_recording = phase is Phase.RECORDING
        self._button.setText('Saving…' if self._model.state.is_saving
                             else _TEXTS.get(phase, 'Record'))
        self._button.setIcon(icon('stop' if is_recording else 'record'))
        self._button.setEnabled(phase in (Phase.IDLE, Phase.RECORDING))
        self._button.setToolTip('Stop and finish the file (R)' if is_recording
                                else 'Record the ticked topics (R)')
        self._dot.setVisible(is_recording)
        self._show_clock()
        self._show_figures()
        self._paint(is_recording)
        if is_recording != self._timer.isActive():
            self._timer.start() if is_recording else self._timer.stop()

    def _show_clock(self) -> None:
        text = clock_text(self._model.elapsed_s)
        if text != self._clock.text():
            self._clock.setText(text)

    def _show_figures(self) -> None:
        state = self._model.state
        figures, incoming = state.figures, state.snapshot.rate
        is_known = figures is not None and state.phase is not Phase.STARTING
        colour(self._clock, 'text' if state.is_busy or is_known else 'quiet')
        if figures is None or not is_known:
            self._figures.setText(f'{size_text(incoming)}/s incoming' if incoming else ' ')
            return
        parts = [size_text(figures.bytes), count_text(figures.messages, 'message')]
        parts += [f'<span style="color:{theme().bad}"><b>{count_text(number)} {word}</b></span>'
                  if number else f'{number} {word}'
                  for number, word in ((figures.dropped, 'dropped'), (figures.lost, 'lost'))]
        self._figures.setText(' · '.join(parts))

    def _style_text(self) -> None:
        font = tabular_font(self._clock.font())
        font.setPointSizeF(font.pointSizeF() * 1.9)
        self._clock.setFont(font)
        bold = self._button.font()
        bold.setBold(True)
        self._button.setFont(bold)
        self._dot.setPixmap(icon('record').pixmap(QSize(_ICON_PX, _ICON_PX)))
        colour(self._figures, 'quiet')

    def _lay_out(self) -> None:
        time = QHBoxLayout()
        time.addStretch(1)
        time.addWidget(self._dot)
        time.addWidget(self._clock)
        right = QVBoxLayout()
        right.setSpacing(0)
        right.addLayout(time)
        row = QHBoxLayout()
        row.addWidget(self._button)
        row.addLayout(right, 1)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(8, 8, 8, 6)
        layout.setSpacing(4)
        layout.addLayout(row)
        layout.addWidget(self._figures)

    def _paint(self, is_recording: bool) -> None:
        border, background = ('<bad>', '<behind_bad>') if is_recording else ('<line>', '<paper>')
        set_sheet(self, f'QFrame#record_bar {{ border: 1px solid {border}; border-radius: 5px; '
                        f'background: {background}; }}')
