# SPDX-License-Identifier: BSD-3-Clause
"""One notice below the record button: what the recorder waits for, has finished, or fails at."""
from __future__ import annotations

import os
from typing import NamedTuple, Optional

from PyQt5.QtCore import QSize, Qt, pyqtSignal
from PyQt5.QtWidgets import QHBoxLayout, QLabel, QPushButton, QToolButton, QWidget

from process_visualizer.gui.models.recording.finished_verdict import BagVerdict
from process_visualizer.gui.models.recording.recording_advice import NOT_RESPONDING
from process_visualizer.gui.models.recording.recording_model import RecordingModel
from process_visualizer.gui.models.recording.recording_types import FinishedBag, Phase
from process_visualizer.gui.models.recording.topic_ticks import TopicHealth
from process_visualizer.gui.toolkit.icons import icon
from process_visualizer.gui.toolkit.sentences import sentence
from process_visualizer.gui.toolkit.theme_following import colour
from process_visualizer.health.figures import clock_text, count_text

_ICON_PX = 18
_LINES = {
    Phase.OFF: 'Launch the devices in real-time mode to record them.',
    Phase.WAITING: 'The recorder is starting…',
    Phase.STARTING: 'Waiting until every publisher is connected…',
    Phase.GONE: 'The recorder has ended. Restart it from its alarm.',
}
_SILENT = {True: 'It may still be recording. Commands take effect when it responds.',
           False: 'Wait until it responds.'}
"""By whether it does anything."""


class Notice(NamedTuple):
    """An icon (or ''), a text, and its tooltip."""

    icon: str
    text: str
    hint: str = ''


class RecordingNotice(QWidget):
    """Shows the state in words; a finished bag can be played from here."""

    play_wanted = pyqtSignal(str)

    def __init__(self, model: RecordingModel, parent: Optional[QWidget] = None) -> None:
        super().__init__(parent)
        self._model = model
        self._icon = QLabel()
        self._text = QLabel()
        self._text.setObjectName('record_notice')
        self._text.setWordWrap(True)
        self._text.setTextInteractionFlags(Qt.TextSelectableByMouse)
        self._play = QPushButton(icon('play'), 'Play it')
        self._play.setObjectName('play_recording')
        self._play.setToolTip('Quit the nodes and play this bag')
        self._play.clicked.connect(self._on_play)
        self._dismiss = QToolButton()
        self._dismiss.setObjectName('dismiss_notice')
        self._dismiss.setText('×')
        self._dismiss.setToolTip('Dismiss')
        self._dismiss.setAutoRaise(True)
        self._dismiss.clicked.connect(model.dismiss)
        self._lay_out()
        model.changed.connect(self.refresh)
        self.refresh()

    def refresh(self) -> None:
        """Show the present notice."""
        notice = notice_of(self._model)
        if notice.text != self._text.text():
            self._text.setText(notice.text)
        self._text.setToolTip(notice.hint)
        self._icon.setVisible(bool(notice.icon))
        if notice.icon:
            self._icon.setPixmap(icon(notice.icon).pixmap(QSize(_ICON_PX, _ICON_PX)))
        colour(self._text, 'text' if notice.icon else 'quiet')
        state = self._model.state
        is_idle = state.phase in (Phase.IDLE, Phase.OFF)
        self._play.setVisible(is_idle and state.finished is not None)
        self._dismiss.setVisible(bool(state.error))

    def _on_play(self) -> None:
        bag = self._model.state.finished
        if bag is not None:
            self.play_wanted.emit(bag.files[0])

    def _lay_out(self) -> None:
        layout = QHBoxLayout(self)
        layout.setContentsMargins(0, 2, 0, 2)
        layout.addWidget(self._icon)
        layout.addWidget(self._text, 1)
        layout.addWidget(self._play)
        layout.addWidget(self._dismiss, 0, Qt.AlignTop)


def notice_of(model: RecordingModel) -> Notice:
    """Return the present notice."""
    state = model.state
    if state.error:
        return Notice('warning', sentence(state.error))
    if state.is_silent:
        return Notice('warning', f'{NOT_RESPONDING}. {_SILENT[state.is_busy]}')
    if state.is_saving:
        return Notice('', 'Saving the last seconds…')
    if state.phase is Phase.STOPPING:
        return Notice('', 'Writing what has arrived, and finishing the file…')
    if state.phase is Phase.RECORDING:
        return _while_recording(model)
    if state.finished is not None and state.phase in (Phase.IDLE, Phase.OFF):
        return _finished(state.finished, model.verdict.verdict)
    if state.phase is Phase.IDLE:
        ticked = sum(row.is_ticked for row in model.choices.topics)
        return Notice('', f'Ready to record {count_text(ticked, "topic")}.' if ticked else '')
    return Notice('warning' if state.phase is Phase.GONE else '', _LINES[state.phase])


def _while_recording(model: RecordingModel) -> Notice:
    silent = [row.name for row in model.choices.topics
              if row.is_ticked and row.health is TopicHealth.SILENT]
    if silent:
        others = f' and {len(silent) - 1} more' if len(silent) > 1 else ''
        return Notice('warning', f'No data from {silent[0]}{others}. Is the driver still running?',
                      '\n'.join(silent))
    path, marks = model.state.path, model.state.marks
    if not marks:
        return Notice('', f'Into {os.path.basename(path)}', path)
    lines = [f'{clock_text(time_s)}  {label}' for time_s, label in marks]
    time_s, label = marks[-1]
    return Notice('mark', f'{label} at {clock_text(time_s)}', '\n'.join(lines))


def _finished(bag: FinishedBag, verdict: Optional[BagVerdict]) -> Notice:
    """The tick is the verdict of `cell report`, so that both say the same."""
    parts = f' ({len(bag.files)} files)' if len(bag.files) > 1 else ''
    text = f'{os.path.basename(bag.files[0])}{parts}'
    judgement = 'checking whether it is complete…' if verdict is None else verdict.text
    hint = '\n'.join([*bag.files, judgement, *bag.problems])
    if verdict is None or not verdict.is_good:
        return Notice('' if verdict is None else 'warning', f'{text}: {judgement}', hint)
    if not bag.problems:
        return Notice('ok', text, hint)
    return Notice('warning', f'{text}: {count_text(len(bag.problems), "problem")}. '
                             f'{sentence(bag.problems[-1])}', hint)
