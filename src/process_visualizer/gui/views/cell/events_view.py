# SPDX-License-Identifier: BSD-3-Clause
"""Events since the launcher was opened, and the alarms of the open recording."""
from __future__ import annotations

from typing import Optional

from PyQt5.QtCore import Qt, QTimer
from PyQt5.QtGui import QShowEvent
from PyQt5.QtWidgets import QPlainTextEdit, QWidget

from process_visualizer.gui.models.cell.alarms_model import AlarmsModel, RecordedAlarms
from process_visualizer.gui.views.parts.text_dialog import TextDialog
from process_visualizer.health.event_text import events_text
from process_visualizer.playback.time_text import format_time


class EventsView(TextDialog):
    """A window with all events, kept up to date; deletes itself."""

    def __init__(self, model: AlarmsModel, parent: Optional[QWidget] = None) -> None:
        super().__init__('events', 'Events', parent)
        self.setAttribute(Qt.WA_DeleteOnClose)
        self._model = model
        self.text.setLineWrapMode(QPlainTextEdit.WidgetWidth)
        self.text.setPlaceholderText('Nothing has happened yet.')
        self.text.setAccessibleName('Events')
        model.happened.connect(self.refresh)
        model.changed.connect(self.refresh)
        self.refresh()

    def showEvent(self, event: QShowEvent) -> None:
        """Begin at the newest: only now the text has its lines."""
        super().showEvent(event)
        QTimer.singleShot(0, self._go_to_end)

    def _go_to_end(self) -> None:
        self.text.verticalScrollBar().setValue(self.text.verticalScrollBar().maximum())

    def refresh(self) -> None:
        """Show all events, the last one in sight; a selection stays."""
        recorded = recorded_text(self._model.recorded)
        text = '\n\n'.join(filter(None, [recorded, events_text(self._model.events)]))
        if text != self.text.toPlainText() and not self.text.textCursor().hasSelection():
            self.show_text('Events (newest last)', text)
            self._go_to_end()


def recorded_text(alarms: RecordedAlarms) -> str:
    """Return the alarms of a recording, each with its place and length."""
    lines = [f'{format_time(begin_s)}  {device}: {text}, for {end_s - begin_s:.1f} s'
             for device, text, begin_s, end_s in alarms]
    return '\n'.join(['In the recording:', *lines]) if lines else ''
