# SPDX-License-Identifier: BSD-3-Clause
"""The real-time panel: everything about recording."""
from __future__ import annotations

from typing import Optional

from PyQt5.QtCore import Qt, pyqtSignal
from PyQt5.QtGui import QResizeEvent
from PyQt5.QtWidgets import (
    QFrame,
    QHBoxLayout,
    QLineEdit,
    QPushButton,
    QVBoxLayout,
    QWidget,
)

from process_visualizer.gui.models.recording.recording_model import RecordingModel
from process_visualizer.gui.models.recording.recording_state import RECENT_S
from process_visualizer.gui.models.recording.recording_types import Phase
from process_visualizer.gui.toolkit.icons import icon
from process_visualizer.gui.views.parts.still_scroll import StillScroll
from process_visualizer.gui.views.recording.disk_bar import DiskBar
from process_visualizer.gui.views.recording.name_options import NameOptions
from process_visualizer.gui.views.recording.record_bar import RecordBar
from process_visualizer.gui.views.recording.recording_notice import RecordingNotice
from process_visualizer.gui.views.recording.topic_list import TopicList

_ROOMY = 30  # lines of text: then the topics are open


class RecordingPanel(StillScroll):
    """Options, topics, the record button, the disk, marks, and the state."""

    play_wanted = pyqtSignal(str)
    """The operator wants to see the bag at this path."""

    def __init__(self, model: RecordingModel, parent: Optional[QWidget] = None) -> None:
        super().__init__(parent)
        self._model = model
        self.names = NameOptions(model.choices)
        self.topics = TopicList(model.choices)
        self.bar = RecordBar(model)
        self.disk = DiskBar()
        self.notice = RecordingNotice(model)
        self._label = QLineEdit()
        self._mark = QPushButton(icon('mark'), 'Mark')
        self._save = QPushButton(icon('save'), f'Save last {RECENT_S:.0f} s')
        self._are_topics_chosen = False
        self._set_up()
        self._lay_out()
        model.changed.connect(self.refresh)
        self.refresh()

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Open the list of topics if there is room, until the operator decides."""
        super().resizeEvent(event)
        if not self._are_topics_chosen:
            self.topics.open(event.size().height() > _ROOMY * self.fontMetrics().height())

    def _choose_topics(self) -> None:
        self._are_topics_chosen = True

    def refresh(self) -> None:
        """Show what is possible now."""
        model = self._model
        state = model.state
        is_recording = state.phase is Phase.RECORDING
        self.names.setEnabled(not state.is_busy)
        self.names.refresh()
        self.topics.lock(state.is_busy)
        self.topics.refresh()
        room = model.room
        self.disk.show_room(room.free_bytes, model.choices.total_bytes, room.time_left_s,
                            room.is_low)
        self._mark.setEnabled(is_recording)
        self._label.setEnabled(is_recording)
        self._label.setPlaceholderText(state.next_label if is_recording else 'Mark label')
        if self._label.text().strip() != state.label:
            self._label.setText(state.label)
        self._show_save()

    def _show_save(self) -> None:
        recent_s = self._model.state.recent_s
        self._save.setEnabled(recent_s >= 1.0)
        seconds = recent_s if 1.0 <= recent_s < RECENT_S else RECENT_S
        self._save.setText(f'Save last {int(seconds)} s')

    def _on_mark(self) -> None:
        """Mark, and give the keys back to the window."""
        self._model.mark()
        self.setFocus()

    def _set_up(self) -> None:
        self.setAccessibleName('Recording')
        self.setFrameShape(QFrame.NoFrame)
        self.setWidgetResizable(True)
        self.setHorizontalScrollBarPolicy(Qt.ScrollBarAlwaysOff)
        self._label.setObjectName('mark_label')
        self._label.setAccessibleName('Mark label')
        self._label.setToolTip('The label of the next mark; without one it gets a number')
        self._label.textEdited.connect(self._model.set_label)
        self._label.returnPressed.connect(self._on_mark)
        self._mark.setObjectName('mark')
        self._mark.setToolTip('Write a labelled moment into the recording (M)')
        self._mark.clicked.connect(self._on_mark)
        self._save.setObjectName('save_recent')
        self._save.setToolTip('Write what just happened into a separate bag')
        self._save.clicked.connect(self._model.save_recent)
        self.topics.chosen.connect(self._choose_topics)
        self.notice.play_wanted.connect(self.play_wanted)

    def _lay_out(self) -> None:
        marks = QHBoxLayout()
        marks.addWidget(self._label, 1)
        marks.addWidget(self._mark)
        marks.addSpacing(8)
        marks.addWidget(self._save)
        body = QWidget()
        layout = QVBoxLayout(body)
        layout.setContentsMargins(0, 4, 0, 4)
        layout.setSpacing(8)
        for widget in (self.names, self.topics, self.bar, self.disk):
            layout.addWidget(widget, 1 if widget is self.topics else 0)
        layout.addLayout(marks)
        layout.addWidget(self.notice)
        layout.addStretch(0)
        self.setWidget(body)
