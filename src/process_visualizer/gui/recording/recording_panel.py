# SPDX-License-Identifier: BSD-3-Clause
"""The panel of recording in real-time mode."""
from __future__ import annotations

import html
import os
from typing import Dict, NamedTuple, Optional, Sequence

from PyQt5.QtCore import QSize, Qt, QTimer, pyqtSignal
from PyQt5.QtGui import QMouseEvent, QResizeEvent
from PyQt5.QtWidgets import (
    QButtonGroup,
    QFileDialog,
    QFrame,
    QHBoxLayout,
    QLabel,
    QLineEdit,
    QProgressBar,
    QPushButton,
    QRadioButton,
    QToolButton,
    QVBoxLayout,
    QWidget,
)

from process_visualizer.figures import clock_text, count_text, size_text
from process_visualizer.gui.recording.recording_choices import (
    DiskRoom,
    NameChoice,
    RecordingChoices,
    TopicHealth,
)
from process_visualizer.gui.recording.recording_model import BagVerdict, RecordingModel
from process_visualizer.gui.recording.recording_state import (
    NOT_RESPONDING,
    RECENT_S,
    RecordingState,
)
from process_visualizer.gui.recording.recording_types import (
    FinishedBag,
    RecordedMark,
    RecordingPhase,
)
from process_visualizer.gui.recording.topic_list import TopicList
from process_visualizer.gui.toolkit.icons import icon
from process_visualizer.gui.toolkit.labels import (
    html_label,
    listing,
    plain_label,
    plain_tip,
    sentence,
)
from process_visualizer.gui.toolkit.scrolling import StillScroll, TextPlace
from process_visualizer.gui.toolkit.theme import (
    ThemeFollower,
    color,
    set_sheet,
    tabular_font,
    theme,
)
from process_visualizer.gui.toolkit.widgets import (
    ElidedLabel,
    MeaningGuard,
    WrappedLabel,
    in_column,
    in_row,
    small,
    tool_button,
)

_CLOCK_PERIOD_MS = 100
_BUTTON_ICON_PX = 20
_BUTTON_TEXTS = {
    RecordingPhase.STARTING: 'Starting…',
    RecordingPhase.RECORDING: 'Stop',
    RecordingPhase.STOPPING: 'Stopping…',
}


class RecordBar(QFrame):
    """The button to record or stop, with time and figures; red while recording."""

    def __init__(self, model: RecordingModel, parent: Optional[QWidget] = None) -> None:
        super().__init__(parent)
        self._model = model
        self.setObjectName('record_bar')
        self._button = QPushButton()
        self._button.setObjectName('record')
        self._button.setIconSize(QSize(_BUTTON_ICON_PX, _BUTTON_ICON_PX))
        self._button.setMinimumSize(150, 40)
        self._button.clicked.connect(model.toggle)
        self._meaning = MeaningGuard(self._button)
        self._dot = plain_label()
        self._clock = plain_label()
        self._clock.setObjectName('record_time')
        self._figures = small(html_label())
        self._figures.setObjectName('record_figures')
        self._timer = QTimer(self)
        self._timer.setInterval(_CLOCK_PERIOD_MS)
        self._timer.timeout.connect(self._show_clock)
        self._style_text()
        self._lay_out()
        model.changed.connect(self.refresh)
        ThemeFollower(self, self.refresh)
        self.refresh()

    def press(self) -> None:
        """Record or stop for a key, unless that had the other meaning just before."""
        if not self._meaning.is_ignoring:
            self._model.toggle()

    def refresh(self) -> None:
        """Show the state of the recorder."""
        phase = self._model.phase
        is_recording = phase is RecordingPhase.RECORDING
        self._button.setText('Saving…' if self._model.state.is_saving
                             else _BUTTON_TEXTS.get(phase, 'Record'))
        self._meaning.show({RecordingPhase.IDLE: 'record',
                            RecordingPhase.RECORDING: 'stop'}.get(phase, ''))
        self._button.setIcon(icon('stop' if is_recording else 'record'))
        self._button.setEnabled(phase in (RecordingPhase.IDLE, RecordingPhase.RECORDING))
        self._button.setToolTip('Stop and finish the file (R)' if is_recording
                                else 'Record the ticked topics (R)')
        self._dot.setVisible(is_recording)
        self._show_clock()
        self._show_figures()
        self._paint(is_recording)
        if is_recording != self._timer.isActive():
            self._timer.start() if is_recording else self._timer.stop()

    def _show_clock(self) -> None:
        text = clock_text(self._model.elapsed_s, 1)
        if text != self._clock.text():
            self._clock.setText(text)

    def _show_figures(self) -> None:
        state = self._model.state
        figures, incoming = state.figures, self._model.incoming
        is_known = figures is not None and state.phase is not RecordingPhase.STARTING
        color(self._clock, 'text' if state.is_busy or is_known else 'quiet')
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
        self._dot.setPixmap(icon('record').pixmap(QSize(_BUTTON_ICON_PX, _BUTTON_ICON_PX)))
        color(self._figures, 'text')  # readable on the red of a recording, too

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


_HEIGHT_PX = 5
_STEPS = 1000


class DiskBar(QWidget):
    """A thin bar for the used space, with free space and remaining time below."""

    def __init__(self, parent: Optional[QWidget] = None) -> None:
        super().__init__(parent)
        self._bar = QProgressBar()
        self._bar.setObjectName('disk_bar')
        self._bar.setTextVisible(False)
        self._bar.setRange(0, _STEPS)
        self._bar.setFixedHeight(_HEIGHT_PX)
        self._room = small(plain_label())
        self._room.setObjectName('disk_room')
        self._time = small(ElidedLabel(Qt.ElideRight))
        self._time.setObjectName('disk_time_left')
        self._time.setAlignment(Qt.AlignRight | Qt.AlignVCenter)
        row = in_row(self._room, self._time, wide=self._time)
        row.addStrut(self._time.fontMetrics().height())  # even without texts
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(3)
        layout.addWidget(self._bar)
        layout.addLayout(row)
        color(self._room, 'quiet')
        self._paint(False)

    def show_room(self, room: DiskRoom, total_bytes: Optional[int]) -> None:
        """Show the free space, and how long it lasts; warn if it does not last long."""
        is_known = room.free_bytes is not None and bool(total_bytes)
        used = 1.0 - (room.free_bytes or 0) / (total_bytes or 1) if is_known else 0.0
        self._bar.setValue(round(used * _STEPS))
        self._room.setText(room.free_text)
        font = self._time.font()
        font.setBold(room.is_low)
        self._time.setFont(font)
        self._time.setText(room.time_text)
        self._time.setToolTip(plain_tip('\n'.join(filter(None, (room.time_text, room.limit_text)))))
        color(self._time, 'bad' if room.is_low else 'quiet')
        self._paint(room.is_low)

    def _paint(self, is_low: bool) -> None:
        filled = '<bad>' if is_low else '<used>'
        set_sheet(self._bar, 'QProgressBar { border: 0; border-radius: 2px; background: <line>; }'
                  f'QProgressBar::chunk {{ border-radius: 2px; background: {filled}; }}')


# One notice below the record button: what the recorder waits for, has finished, or failed to do.

_ICON_PX = 18
_NOTICE_LINES = 3  # always reserved, so that nothing above moves
_LINES = {
    RecordingPhase.OFF: 'The devices can be recorded while they run in real-time mode.',
    RecordingPhase.WAITING: 'The recorder is starting…',
    RecordingPhase.STARTING: 'Waiting until every publisher is connected…',
    RecordingPhase.GONE: 'The recorder has ended. Restart it from its alarm.',
}
_SILENT = {True: 'It may still be recording. Commands take effect when it responds.',
           False: 'Wait until it responds.'}
"""Text by whether the recorder is busy."""
_NAMED_MARKS = 2
_THEIR = {False: 'its time', True: 'their times'}


class Notice(NamedTuple):
    """An icon (or ''), a text, and its tooltip."""

    icon: str
    text: str
    hint: str = ''


class RecordingNotice(QWidget):
    """The state of the recorder in words, with a button to play the finished bag."""

    play_wanted = pyqtSignal(str)

    def __init__(self, model: RecordingModel, parent: Optional[QWidget] = None) -> None:
        super().__init__(parent)
        self._model = model
        self._icon = plain_label()
        self._text = WrappedLabel('record_notice')
        self._play = QPushButton(icon('play'), 'Play it')
        self._play.setObjectName('play_recording')
        self._play.setToolTip('Quit the nodes and play this bag')
        self._play.clicked.connect(self._on_play)
        self._recover = QPushButton('Recover')
        self._recover.setObjectName('recover_recording')
        self._recover.setToolTip('Make a bag of what was recorded before the recorder ended')
        self._recover.clicked.connect(model.recover)
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
        """Show the current notice."""
        notice = notice_of(self._model)
        if notice.text != self._text.text():
            self._text.setText(notice.text)
        self._text.setToolTip(plain_tip(notice.hint))
        self._icon.setVisible(bool(notice.icon))
        if notice.icon:
            self._icon.setPixmap(icon(notice.icon).pixmap(QSize(_ICON_PX, _ICON_PX)))
        color(self._text, 'text' if notice.icon else 'quiet')
        state = self._model.state
        self._play.setVisible(_can_play(state) and state.refused_options is None)
        is_recovering = state.recovered is not None
        self._recover.setVisible(bool(state.unfinished) and not is_recovering)
        self._dismiss.setVisible(bool(state.error) and not is_recovering)

    def _on_play(self) -> None:
        bag = self._model.state.finished
        if bag is not None:
            self.play_wanted.emit(bag.files[0])

    def _lay_out(self) -> None:
        layout = QHBoxLayout(self)
        layout.setContentsMargins(0, 2, 0, 2)
        layout.addWidget(self._icon, 0, Qt.AlignTop)
        layout.addWidget(TextPlace(_NOTICE_LINES, self._text), 1)
        layout.addWidget(self._play, 0, Qt.AlignTop)
        layout.addWidget(self._recover, 0, Qt.AlignTop)
        layout.addWidget(self._dismiss, 0, Qt.AlignTop)


def notice_of(model: RecordingModel) -> Notice:
    """Return the current notice."""
    state = model.state
    if state.recovered is not None and not state.is_busy:
        name = os.path.basename(state.unfinished)
        return Notice('', f'Recovering {name}… {state.recovered:.0%}', state.unfinished)
    if state.error:
        return Notice('warning', sentence(state.error))
    if state.is_silent:
        return _while_silent(state)
    if state.is_saving:
        return Notice('', 'Saving the last seconds…')
    if state.phase is RecordingPhase.STOPPING:
        return Notice('', 'Writing what has arrived, and finishing the file…')
    if state.phase is RecordingPhase.RECORDING:
        return _while_recording(model)
    if state.finished is not None and _can_play(state):
        return _finished(state.finished, model.verdict.verdict)
    if state.phase is RecordingPhase.IDLE:
        ticked = sum(row.is_ticked for row in model.choices.topics)
        return Notice('', f'Ready to record {count_text(ticked, "topic")}.' if ticked else '')
    return Notice('warning' if state.phase is RecordingPhase.GONE else '', _LINES[state.phase])


def _can_play(state: RecordingState) -> bool:
    """Return whether the finished bag is offered; that of a recorder that has ended, too."""
    if state.finished is None:
        return False
    return state.phase in (RecordingPhase.IDLE, RecordingPhase.OFF) or (
        state.phase is RecordingPhase.GONE and bool(state.finished.recovery))


def _while_silent(state: RecordingState) -> Notice:
    """Return a notice about the effect of the operator's actions while the recorder is silent."""
    marks, text = state.unwritten, _SILENT[state.is_busy]
    if marks:
        kept = listing([it.label for it in marks]) if len(marks) <= _NAMED_MARKS else (
            count_text(len(marks), 'mark'))
        text = f'When it responds, it writes {kept}, with {_THEIR[len(marks) > 1]}.'
    return Notice('warning', f'{NOT_RESPONDING}. {text}', _mark_lines(marks))


def _mark_lines(marks: Sequence[RecordedMark]) -> str:
    return '\n'.join(f'{clock_text(it.time_s, 1)}  {it.label}' for it in marks)


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
    last = marks[-1]
    text = f'{last.label} at {clock_text(last.time_s, 1)}{"" if last.is_written else "…"}'
    return Notice('mark', text, _mark_lines(marks))


def _finished(bag: FinishedBag, verdict: Optional[BagVerdict]) -> Notice:
    """Return a notice with the verdict of `cell report`, so that both agree."""
    parts = f' ({len(bag.files)} files)' if len(bag.files) > 1 else ''
    text = f'{os.path.basename(bag.files[0])}{parts}'
    judgement = 'checking whether it is complete…' if verdict is None else verdict.text
    hint = '\n'.join(filter(None, [*bag.files, bag.recovery, judgement, *bag.problems]))
    if bag.recovery:
        return Notice('ok', bag.recovery, hint)
    if verdict is None or not verdict.is_good:
        return Notice('' if verdict is None else 'warning', f'{text}: {judgement}', hint)
    if not bag.problems:
        return Notice('ok', text, hint)
    return Notice('warning', f'{text}: {count_text(len(bag.problems), "problem")}. '
                             f'{sentence(bag.problems[-1])}', hint)


_TOOLTIPS = {
    NameChoice.DATE: 'Use standard file name: the current date and time',
    NameChoice.PREFIX: 'Use a prefix, followed by date and time',
    NameChoice.NAME: 'Use the following file name'}
_NAME_TEXTS = {NameChoice.DATE: 'Date and time',
               NameChoice.PREFIX: 'Prefix:', NameChoice.NAME: 'Custom name:'}


_PROBLEM_LINES = 2  # always reserved, so that the buttons below do not move


class NameOptions(QWidget):
    """Radio buttons and texts for the name, the folder, and problems with them."""

    def __init__(self, choices: RecordingChoices, parent: Optional[QWidget] = None) -> None:
        super().__init__(parent)
        self._choices = choices
        self._buttons: Dict[NameChoice, QRadioButton] = {}
        self._group = QButtonGroup(self)
        for choice in NameChoice:
            self._add_button(choice)
        self._prefix = _line('record_prefix', 'Prefix', 'seam', 'Put before date and time')
        self._name = _line('record_name', 'File name', 'seam',
                           'File name; existing files are never overwritten')
        self._folder = _line('record_folder', 'Folder', '',
                             'Recordings go here; created if it does not exist')
        self._browse = tool_button('choose_record_folder', 'folder', 'Choose the folder',
                                   self._choose_folder)
        self._problem = small(html_label())
        self._problem.setObjectName('record_problem')
        self._lay_out()
        self._connect()

    def refresh(self) -> None:
        """Show the choices."""
        choice = self._choices.name_choice
        self._buttons[choice].setChecked(True)
        for line, text in ((self._prefix, self._choices.prefix), (self._name, self._choices.name),
                           (self._folder, self._choices.folder)):
            if not line.hasFocus() and line.text() != text:
                line.setText(text)
        self._show_problem()

    def _show_problem(self) -> None:
        problem, free_name = self._choices.problem, self._choices.free_name
        if not self.isEnabled():  # the file that is being recorded exists, of course
            text = ''
        elif free_name:
            text = (f'{html.escape(self._choices.name)}.bag exists already.  '
                    f'<a href="free">Use {html.escape(free_name)}</a>')
        else:
            text = html.escape(problem[:1].upper() + problem[1:])
        if text != self._problem.text():
            self._problem.setText(text)

    def _use_free_name(self) -> None:
        name = self._choices.free_name
        self._choices.set_name(name)
        self._name.setText(name)

    def _choose(self, choice: NameChoice) -> None:
        self._choices.choose_name(choice)
        line = {NameChoice.PREFIX: self._prefix, NameChoice.NAME: self._name}.get(choice)
        if line is not None:
            line.setFocus()

    def _choose_folder(self) -> None:
        dialog = QFileDialog(self, 'Folder for recordings', self._choices.folder)
        dialog.setFileMode(QFileDialog.Directory)
        dialog.setOption(QFileDialog.ShowDirsOnly)
        dialog.setAttribute(Qt.WA_DeleteOnClose)
        dialog.fileSelected.connect(self._take_folder)
        dialog.open()

    def _take_folder(self, folder: str) -> None:
        """Adopt a folder from the dialog; a focused line would otherwise restore its own text."""
        self._folder.setText(folder)
        self._choices.set_folder(folder)

    def _add_button(self, choice: NameChoice) -> None:
        button = QRadioButton(_NAME_TEXTS[choice])
        button.setObjectName(f'record_by_{choice.value}')
        button.setToolTip(plain_tip(_TOOLTIPS[choice]))
        button.clicked.connect(lambda: self._choose(choice))
        self._group.addButton(button)
        self._buttons[choice] = button

    def _connect(self) -> None:
        self._prefix.chosen.connect(lambda: self._choices.choose_name(NameChoice.PREFIX))
        self._name.chosen.connect(lambda: self._choices.choose_name(NameChoice.NAME))
        self._prefix.textEdited.connect(self._choices.set_prefix)
        self._name.textEdited.connect(self._choices.set_name)
        self._folder.editingFinished.connect(
            lambda: self._choices.set_folder(self._folder.text()))
        self._problem.linkActivated.connect(lambda _: self._use_free_name())

    def _lay_out(self) -> None:
        in_column(self, 4, self._buttons[NameChoice.DATE],
                  _row(self._buttons[NameChoice.PREFIX], self._prefix, _hint('+ date and time')),
                  _row(self._buttons[NameChoice.NAME], self._name, _hint('.bag')),
                  _row(plain_label('Folder:'), self._folder, self._browse),
                  TextPlace(_PROBLEM_LINES, self._problem))
        self._problem.setWordWrap(True)
        color(self._problem, 'warning')


def _row(before: QWidget, line: QLineEdit, after: QWidget) -> QHBoxLayout:
    layout = in_row(before, line, after, wide=line)
    layout.setSpacing(6)
    return layout


class _Line(QLineEdit):
    """A line that emits ``chosen`` when it is clicked or edited."""

    chosen = pyqtSignal()

    def __init__(self) -> None:
        super().__init__()
        self.textEdited.connect(lambda _text: self.chosen.emit())

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """See Qt."""
        super().mousePressEvent(event)
        self.chosen.emit()


def _line(name: str, accessible_name: str, placeholder: str, hint: str) -> _Line:
    line = _Line()
    line.setObjectName(name)
    line.setAccessibleName(accessible_name)
    line.setPlaceholderText(placeholder)
    line.setToolTip(plain_tip(hint))
    return line


def _hint(text: str) -> QLabel:
    label = plain_label(text)
    color(label, 'quiet')
    return label


_ROOMY = 30  # lines of text: from this height on the topics are open


class RecordingPanel(StillScroll):
    """The panel: name and folder, topics, the record button, the disk, marks, and the notice."""

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
        self._save.setMinimumWidth(self._save.sizeHint().width())  # with fewer digits too
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
        """Show the state, and enable what is possible now."""
        model = self._model
        state = model.state
        is_recording = state.phase is RecordingPhase.RECORDING
        self.names.setEnabled(not state.is_busy)
        self.names.refresh()
        self.topics.lock(state.is_busy)
        self.topics.refresh()
        self.disk.show_room(model.room, model.choices.total_bytes)
        self._mark.setEnabled(is_recording)
        self._label.setEnabled(is_recording)
        self._label.setPlaceholderText(state.next_label if is_recording else 'Mark label')
        if self._label.text().strip() != state.label:
            self._label.setText(state.label)
        self._show_save()

    def _show_save(self) -> None:
        recent_s, obstacle = self._model.state.recent_s, self._model.state.save_obstacle
        self._save.setEnabled(not obstacle)
        self._save.setToolTip(plain_tip(obstacle or 'Write what just happened into a separate bag'))
        seconds = recent_s if 1.0 <= recent_s < RECENT_S else RECENT_S
        self._save.setText(f'Save last {int(seconds)} s')

    def _on_mark(self) -> None:
        """Write a mark, and return the keyboard focus to the window."""
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
        self._mark.setToolTip('Write a labeled moment into the recording (M)')
        self._mark.clicked.connect(self._on_mark)
        self._save.setObjectName('save_recent')
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
