# SPDX-License-Identifier: BSD-3-Clause
"""The recording panel, used as by an operator."""
from __future__ import annotations

from pathlib import Path
from typing import Any, Callable, Iterator, Type

import pytest
from PyQt5.QtCore import QEvent, QPoint, QPointF, Qt
from PyQt5.QtGui import QMouseEvent, QTextDocument
from PyQt5.QtWidgets import (
    QApplication,
    QFileDialog,
    QLabel,
    QLineEdit,
    QPushButton,
    QRadioButton,
    QToolButton,
    QTreeWidget,
    QWidget,
)
from recording_stand_in import StandInRecorder, devices, seen, told
from session_stand import choose, run

from process_visualizer.cell.model import Mode
from process_visualizer.clients.bag_recorder import RecorderError
from process_visualizer.gui.recording.recording_choices import BagTarget, NameChoice
from process_visualizer.gui.recording.recording_model import BagVerdict, RecordingModel
from process_visualizer.gui.recording.recording_panel import Notice, RecordingPanel, notice_of
from process_visualizer.gui.recording.recording_types import RecordingPhase
from process_visualizer.gui.session import Session
from process_visualizer.gui.toolkit.tasks import Tasks
from process_visualizer.gui.toolkit.widgets import MeaningGuard
from process_visualizer.launching.part_report import PartState

Find = Callable[[Type[QWidget], str], Any]


@pytest.fixture
def session() -> Session:
    return Session()


@pytest.fixture
def model(client: StandInRecorder, session: Session, tmp_path: Path,
          qtbot) -> Iterator[RecordingModel]:
    tasks = Tasks()
    recording = RecordingModel(tasks, client, session, judge=client.judge)
    recording.choices.set_folder(str(tmp_path))
    choose(session, devices())
    yield recording
    tasks.close()


@pytest.fixture
def find(model: RecordingModel, qtbot) -> Iterator[Find]:
    panel = RecordingPanel(model)
    qtbot.addWidget(panel)
    panel.show()
    panel.played = played = []
    panel.play_wanted.connect(played.append)

    def widget(kind: Type[QWidget], name: str) -> Any:
        return panel if not name else panel.findChild(kind, name)

    return widget


@pytest.fixture
def running(model: RecordingModel, session: Session, find: Find) -> RecordingModel:
    run(session, Mode.REALTIME)
    model.take_state(told())
    return model


def text(find: Find, name: str) -> str:
    return str(find(QLabel, name).text()).replace('\u2009', ' ')


def click(find: Find, name: str, kind: Type[QWidget] = QPushButton) -> None:
    find(kind, name).click()


def test_nothing_runs(find):
    assert not find(QPushButton, 'record').isEnabled()
    assert text(find, 'record_notice') == (
        'The devices can be recorded while they run in real-time mode.')  # also while they start
    assert find(QLineEdit, 'record_folder').isEnabled()


def test_record_mark_stop_play(find, running, client, qtbot):
    click(find, 'record')
    qtbot.waitUntil(lambda: find(QPushButton, 'record').text() == 'Stop')
    running.take_state(told('recording', files=(client.path,), duration_s=63.6, messages=18230,
                            bytes=42_100_000, time_left_s=7200.0, free_bytes=10 ** 11))
    assert text(find, 'record_figures') == '42.1 MB · 18 230 messages · 0 dropped · 0 lost'
    assert text(find, 'record_time').startswith('1:03.')
    assert text(find, 'disk_room') == '100 GB free'
    assert text(find, 'disk_time_left') == '2 h 0 min left at this rate'
    assert not find(QRadioButton, 'record_by_date').isEnabled()
    qtbot.keyClicks(find(QLineEdit, 'mark_label'), 'the seam tears')
    click(find, 'mark')
    assert text(find, 'record_notice').startswith('the seam tears at 1:03.')
    assert find(QLineEdit, 'mark_label').text() == ''
    assert find(QLineEdit, 'mark_label').placeholderText() == 'mark 2'
    click(find, 'record')
    qtbot.waitUntil(lambda: find(QPushButton, 'record').text() == 'Record')
    assert 'mark the seam tears' in client.commands
    qtbot.waitUntil(lambda: text(find, 'record_notice') == 'seam.bag')
    click(find, 'play_recording')
    assert find(QWidget, '').played == [client.path]


def test_a_double_click_on_stop_starts_nothing(find, running, client, qtbot):
    """The bag may be finished before the second press."""
    button = find(QPushButton, 'record')
    qtbot.mouseClick(button, Qt.LeftButton)
    qtbot.waitUntil(lambda: running.phase is RecordingPhase.RECORDING)
    qtbot.mouseClick(button, Qt.LeftButton)  # impatient: meant for Record
    assert running.phase is RecordingPhase.RECORDING
    qtbot.waitUntil(lambda: not button.findChild(MeaningGuard).is_ignoring)
    qtbot.mouseClick(button, Qt.LeftButton)
    qtbot.waitUntil(lambda: button.text() == 'Record')
    place = QPointF(button.rect().center())
    for kind, held in ((QEvent.MouseButtonDblClick, Qt.LeftButton),
                       (QEvent.MouseButtonRelease, Qt.NoButton)):
        QApplication.sendEvent(button, QMouseEvent(kind, place, Qt.LeftButton, held,
                                                   Qt.NoModifier))
    assert running.phase is RecordingPhase.IDLE and client.commands == ['start', 'stop']
    qtbot.waitUntil(lambda: not button.findChild(MeaningGuard).is_ignoring)
    running.take_state(told())  # it is not silent
    qtbot.mouseClick(button, Qt.LeftButton)
    assert running.phase is RecordingPhase.STARTING


def test_the_file_that_is_being_recorded_is_not_said_to_exist_already(
        find, running, client, tmp_path, qtbot):
    running.choices.choose_name(NameChoice.NAME)
    running.choices.set_name('good')
    click(find, 'record')
    qtbot.waitUntil(lambda: running.phase is RecordingPhase.RECORDING)
    (tmp_path / 'good.bag.active').touch()
    running.choices.look()
    qtbot.waitUntil(lambda: running.choices.free_name == 'good-2')
    assert text(find, 'record_problem') == ''
    click(find, 'record')
    qtbot.waitUntil(lambda: 'good.bag exists already' in text(find, 'record_problem'))


def test_a_problem_with_a_name_is_shown_as_it_is_written(find, model, tmp_path, qtbot):
    model.choices.choose_name(NameChoice.NAME)
    model.choices.set_name('<b>&amp;')
    (tmp_path / '<b>&amp;.bag').touch()
    model.choices.look()
    qtbot.waitUntil(lambda: bool(text(find, 'record_problem')))
    document = QTextDocument()
    document.setHtml(text(find, 'record_problem'))
    assert document.toPlainText().endswith('Use <b>&amp;-2')
    assert document.toPlainText().startswith('<b>&amp;.bag exists already.')


def test_the_states_between(find, running, client, qtbot):
    client.gate.clear()
    click(find, 'record')
    assert find(QPushButton, 'record').text() == 'Starting…'
    assert not find(QPushButton, 'record').isEnabled()
    client.gate.set()
    qtbot.waitUntil(lambda: running.phase is RecordingPhase.RECORDING)
    client.gate.clear()
    click(find, 'record')
    assert find(QPushButton, 'record').text() == 'Stopping…'
    client.gate.set()
    qtbot.waitUntil(lambda: running.phase is RecordingPhase.IDLE)


def test_the_name(find, running, qtbot, tmp_path):
    assert find(QRadioButton, 'record_by_date').isChecked()
    (tmp_path / 'seam.bag').touch()
    qtbot.mouseClick(find(QLineEdit, 'record_name'), Qt.LeftButton)
    assert find(QRadioButton, 'record_by_name').isChecked()
    assert 'Write a name' in text(find, 'record_problem')
    qtbot.keyClicks(find(QLineEdit, 'record_name'), 'seam')
    qtbot.waitUntil(lambda: 'seam.bag exists already' in text(find, 'record_problem'))
    find(QLabel, 'record_problem').linkActivated.emit('free')
    qtbot.waitUntil(lambda: not text(find, 'record_problem'))
    assert running.choices.name == find(QLineEdit, 'record_name').text() == 'seam-2'


def test_a_name_that_is_written_is_chosen(find, running, qtbot):
    qtbot.keyClicks(find(QLineEdit, 'record_prefix'), 'run')
    assert find(QRadioButton, 'record_by_prefix').isChecked() and running.choices.prefix == 'run'
    find(QRadioButton, 'record_by_date').click()
    assert find(QRadioButton, 'record_by_date').isChecked()
    assert find(QLineEdit, 'record_prefix').text() == 'run'


def test_a_folder_that_is_chosen_stays_whatever_was_written_before(find, running, qtbot, tmp_path):
    panel, line = find(RecordingPanel, ''), find(QLineEdit, 'record_folder')
    panel.activateWindow()
    line.setFocus()
    qtbot.waitUntil(line.hasFocus)
    line.setText('bags')
    find(QToolButton, 'choose_record_folder').click()
    dialog = panel.findChild(QFileDialog)
    dialog.fileSelected.emit(str(tmp_path))
    dialog.close()
    line.clearFocus()
    assert running.choices.folder == line.text() == str(tmp_path)


def test_no_button_moves_with_the_problem_of_a_name_or_folder(find, running, qtbot, tmp_path):
    """It may have several lines if the folder cannot be used."""
    panel = find(RecordingPanel, '')
    panel.resize(400, 600)

    def places():
        for _ in range(5):
            QApplication.processEvents()
        return [find(QPushButton, name).mapTo(panel, QPoint()) for name in ('record', 'mark')]

    before = places()
    label = find(QLabel, 'record_problem')
    assert label.text() == ''
    label.setText('Nothing can be written there, for a reason that takes some words. ' * 3)
    assert places() == before


@pytest.mark.parametrize('height', [300, 600, 900])
def test_nothing_moves_with_what_the_recorder_does(find, running, client, qtbot, height):
    panel = find(RecordingPanel, '')
    panel.resize(400, height)
    still = [find(QPushButton, it) for it in ('record', 'mark', 'save_recent')] + [
        find(QLineEdit, 'mark_label'), find(QToolButton, 'choose_record_folder')]

    def places():
        for _ in range(5):
            QApplication.processEvents()
        return [(it.mapTo(panel, QPoint()), it.size()) for it in still]

    before = places()
    click(find, 'record')
    qtbot.waitUntil(lambda: running.phase is RecordingPhase.RECORDING)
    running.take_state(told('recording', files=(client.path,), time_left_s=200.0,
                            free_bytes=5 * 10 ** 9))
    assert places() == before
    client.judging.clear()
    client.verdict = BagVerdict(False, f'not complete: {"messages of /a_topic are missing; " * 9}')
    click(find, 'record')
    qtbot.waitUntil(lambda: 'checking' in text(find, 'record_notice'))
    assert places() == before
    client.judging.set()
    qtbot.waitUntil(lambda: 'not complete' in text(find, 'record_notice'))
    assert places() == before
    client.error = RecorderError('not recording, because the disk is full. ' * 9)
    click(find, 'record')
    qtbot.waitUntil(lambda: text(find, 'record_notice').startswith('Not recording, because'))
    assert places() == before


def test_what_is_cut_beside_the_free_space_is_in_the_tooltip(find, running):
    panel, label = find(RecordingPanel, ''), find(QLabel, 'disk_time_left')
    panel.resize(380, 600)
    QApplication.processEvents()
    choices = running.choices
    choices._take_target(choices.options(), BagTarget('', 4 * 10 ** 9, 10 ** 11))
    running.take_state(told())
    shown = label.shown_text(label.width()).replace('\u2009', ' ')
    assert shown.startswith('Would stop in about 2 min')
    assert label.text() in label.toolTip() and 'stops when free space drops' in label.toolTip()


def test_a_name_is_taken_as_it_is_written(find, running, qtbot):
    click(find, 'record_by_prefix', QRadioButton)
    qtbot.keyClicks(find(QLineEdit, 'record_prefix'), 'run')
    assert (running.choices.name_choice, running.choices.prefix) == (NameChoice.PREFIX, 'run')


def item(find: Find, device: int, topic: int) -> Any:
    return find(QTreeWidget, 'record_topics').topLevelItem(device).child(topic)


def test_topics_are_ticked(find, running):
    click(find, 'fold_topics', QToolButton)
    assert find(QTreeWidget, 'record_topics').isVisible()
    assert item(find, 0, 0).text(1).replace('\u2009', ' ') == '125 Hz'
    assert item(find, 1, 1).checkState(0) == Qt.Unchecked
    item(find, 1, 1).setCheckState(0, Qt.Checked)
    assert '/kinect/points' in running.choices.options().topics
    find(QTreeWidget, 'record_topics').topLevelItem(0).setCheckState(0, Qt.Unchecked)
    assert running.choices.options().topics == ('/kinect/image', '/kinect/points')
    click(find, 'preset_topics', QToolButton)
    assert item(find, 0, 0).checkState(0) == Qt.Checked
    assert item(find, 1, 1).checkState(0) == Qt.Unchecked


def test_a_silent_topic_is_seen(find, running, client, qtbot):
    click(find, 'record')
    qtbot.waitUntil(lambda: running.phase is RecordingPhase.RECORDING)
    silent = (seen('/robot/q_act', 0.0, 4.0), seen('/robot/tcf'), seen('/kinect/image'))
    running.take_state(told('recording', files=(client.path,), topics=silent))
    assert item(find, 0, 0).text(1).replace('\u2009', ' ') == 'no data for 4 s'
    assert text(find, 'record_notice').startswith('No data from /robot/q_act')
    assert not item(find, 0, 0).flags() & Qt.ItemIsUserCheckable


def test_a_recorder_that_says_nothing_is_told_until_it_speaks(find, running, client, qtbot):
    click(find, 'record')
    qtbot.waitUntil(lambda: running.phase is RecordingPhase.RECORDING)
    running._silence.silent.emit()
    assert text(find, 'record_notice') == (
        'The recorder is not responding. It may still be recording. Commands take effect when it '
        'responds.')
    assert find(QPushButton, 'record').text() == 'Stop'
    running.take_state(told('recording', files=(client.path,)))
    assert text(find, 'record_notice') == 'Into seam.bag'


def test_a_mark_that_a_recorder_has_not_taken_is_told_to_wait(find, running, client, qtbot):
    click(find, 'record')
    qtbot.waitUntil(lambda: running.phase is RecordingPhase.RECORDING)
    client.gate.clear()
    running._silence.silent.emit()
    told_of = []
    for _ in range(3):
        click(find, 'mark')
        told_of.append(text(find, 'record_notice').partition('it writes ')[2])
    assert told_of == ['mark 1, with its time.', 'mark 1 and mark 2, with their times.',
                       '3 marks, with their times.']
    running.take_state(told('recording', files=(client.path,)))
    assert text(find, 'record_notice').startswith('mark 3 at ')
    assert text(find, 'record_notice').endswith('…')
    client.gate.set()
    qtbot.waitUntil(lambda: not text(find, 'record_notice').endswith('…'))


@pytest.mark.parametrize('is_ended', [False, True])
def test_rates_are_not_shown_without_a_recorder_that_counts(find, running, session, is_ended):
    running.take_state(told())
    assert text(find, 'record_figures').endswith('/s incoming')
    assert item(find, 0, 0).text(1)
    if is_ended:
        run(session, Mode.REALTIME, PartState.FAILED)
    else:
        running._silence.silent.emit()
    assert text(find, 'record_figures').strip() == ''
    assert item(find, 0, 0).text(1) == ''
    assert running.room.time_left_s is None


@pytest.mark.parametrize('free_bytes, left_s, expected', [
    (5 * 10 ** 9, 200.0, 'Stops in about 3 min, at 1.00 GB free'),
    (1_100_000_000, 1.3, 'Stops in about 1 s, at 1.07 GB free'),
    (1_100_000_000, 0.4, 'Stops in about 1 s, at 1.09 GB free'),
    (1_050_000_000, 0.0, 'Stops now at 1.07 GB free'),
    (4 * 10 ** 9, 200.0, 'Stops in about 3 min, when the disk is full')])
def test_low_disk_warns_of_where_the_recorder_stops(find, running, client, qtbot, free_bytes,
                                                    left_s, expected):
    """The limit is the recorder's own, computed from its figures; its rate is 20 MB/s."""
    click(find, 'record')
    qtbot.waitUntil(lambda: running.phase is RecordingPhase.RECORDING)
    running.take_state(told('recording', files=(client.path,), time_left_s=left_s,
                            free_bytes=free_bytes))
    assert text(find, 'disk_time_left') == expected
    assert find(QLabel, 'disk_time_left').font().bold()
    assert text(find, 'disk_room').replace('\u2009', ' ') == f'{free_bytes / 1e9:.2f} GB free'


@pytest.mark.parametrize('free_bytes, expected', [
    (4 * 10 ** 9, 'Would stop in about 2 min, at 1.07 GB free'),
    (10 ** 9, 'A recording needs 73.7 MB more'),
    (2 ** 30 - 2 * 10 ** 6, 'A recording needs 2.0 MB more')])  # beside "1.07 GB free"
def test_low_disk_warns_before_the_start(find, running, free_bytes, expected):
    choices = running.choices
    choices._take_target(choices.options(), BagTarget('', free_bytes, 10 ** 11))
    running.take_state(told())
    assert text(find, 'disk_time_left') == expected
    assert find(QLabel, 'disk_time_left').font().bold()


def test_nothing_is_saved_while_the_recorder_hangs(find, running, client):
    running.take_state(told(recent_s=30.0))
    save = find(QPushButton, 'save_recent')
    assert save.isEnabled()
    running._silence.silent.emit()
    assert not save.isEnabled()
    assert save.toolTip() == 'The recorder is not responding. Save when it responds'
    running.save_recent()
    assert client.commands == []
    running.take_state(told(recent_s=30.0))
    assert save.isEnabled() and save.toolTip() == 'Write what just happened into a separate bag'


def test_a_failure_is_shown_until_it_is_seen(find, running, client, qtbot):
    client.error = RecorderError('not recording, because /robot/q_act does not send')
    click(find, 'record')
    qtbot.waitUntil(lambda: text(find, 'record_notice').startswith('Not recording, because'))
    click(find, 'dismiss_notice', QToolButton)
    assert text(find, 'record_notice') == 'Ready to record 3 topics.'


def test_a_refused_command_leaves_the_last_recording_as_it_was(find, running, client, qtbot):
    click(find, 'record')
    qtbot.waitUntil(lambda: running.phase is RecordingPhase.RECORDING)
    running.take_state(told('recording', files=(client.path,), duration_s=2.0))
    click(find, 'record')
    qtbot.waitUntil(lambda: text(find, 'record_notice') == 'seam.bag')
    running.take_state(told(files=(client.path,), duration_s=2.2, recent_s=13.0))
    client.error = RecorderError('nothing is in memory')
    click(find, 'save_recent')
    qtbot.waitUntil(lambda: text(find, 'record_notice') == 'Nothing is in memory')
    assert text(find, 'record_time') == '0:02.2'
    assert not find(QPushButton, 'play_recording').isVisible()
    click(find, 'dismiss_notice', QToolButton)
    assert text(find, 'record_notice') == 'seam.bag'
    assert find(QPushButton, 'play_recording').isVisible()


def test_the_tick_is_the_verdict_of_the_report(find, running, client, qtbot):
    """A bag that the report calls not complete has no tick, though the recorder had no problem."""
    client.verdict = BagVerdict(False, 'not complete: 5 lost on /ft')
    click(find, 'record')
    qtbot.waitUntil(lambda: running.phase is RecordingPhase.RECORDING)
    click(find, 'record')
    qtbot.waitUntil(lambda: '5 lost' in text(find, 'record_notice'))
    assert client.judged == [(client.path,)]
    assert notice_of(running) == Notice('warning', 'seam.bag: not complete: 5 lost on /ft',
                                        f'{client.path}\nnot complete: 5 lost on /ft')


def test_there_is_no_tick_before_the_verdict(find, running, client, qtbot):
    click(find, 'record')
    qtbot.waitUntil(lambda: running.phase is RecordingPhase.RECORDING)
    client.judging.clear()
    click(find, 'record')
    qtbot.waitUntil(lambda: running.state.finished is not None)
    assert notice_of(running).icon == ''
    client.judging.set()
    qtbot.waitUntil(lambda: notice_of(running).icon == 'ok')


def test_figures_are_those_of_the_bag_that_is_named(find, running, client, qtbot, session):
    """After quitting and launching again it was "0 B · 34 815 messages" with nothing recorded."""
    click(find, 'record')
    qtbot.waitUntil(lambda: running.phase is RecordingPhase.RECORDING)
    running.take_state(told('recording', files=(client.path,), bytes=900_000, messages=1000,
                            duration_s=2.0))
    click(find, 'record')
    qtbot.waitUntil(lambda: running.state.finished is not None)
    running.take_state(told(files=(client.path,), bytes=1_000_000, messages=1100, duration_s=2.2))
    whole = '1.0 MB · 1 100 messages · 0 dropped · 0 lost'
    assert (text(find, 'record_figures'), text(find, 'record_time')) == (whole, '0:02.2')
    run(session, None)
    assert text(find, 'record_figures') == whole
    run(session, Mode.REALTIME)
    running.take_state(told(messages=34_815))  # this many are in another recorder's memory
    assert (text(find, 'record_figures'), text(find, 'record_time')) == (whole, '0:02.2')
    assert 'seam.bag' in text(find, 'record_notice')
    running.dismiss()
    assert text(find, 'record_figures') == '20.0 MB/s incoming'
    assert text(find, 'record_time') == '0:00.0'


def test_a_bag_that_was_finished_while_quitting_has_no_figures(find, running, client, session,
                                                               qtbot):
    click(find, 'record')
    qtbot.waitUntil(lambda: running.phase is RecordingPhase.RECORDING)
    Path(client.path).touch()
    run(session, None)
    running.take_end_of_run()
    qtbot.waitUntil(lambda: running.state.finished is not None)
    assert text(find, 'record_figures').strip() == ''
    assert text(find, 'record_notice').startswith('seam.bag')


def test_recover_is_offered_for_an_unfinished_recording(find, running, client, session, qtbot):
    click(find, 'record')
    qtbot.waitUntil(lambda: running.phase is RecordingPhase.RECORDING)
    assert not find(QPushButton, 'recover_recording').isVisible()
    run(session, Mode.REALTIME, PartState.FAILED)
    qtbot.waitUntil(find(QPushButton, 'recover_recording').isVisible)
    assert not find(QPushButton, 'play_recording').isVisible()
    click(find, 'recover_recording')  # there is no file
    qtbot.waitUntil(lambda: 'cannot be' in text(find, 'record_notice')
                    or 'No such' in text(find, 'record_notice'))


def test_save_the_last_seconds(find, running, client, qtbot):
    width = find(QPushButton, 'save_recent').minimumWidth()
    assert width >= find(QPushButton, 'save_recent').sizeHint().width()
    running.take_state(told(recent_s=7.4))
    assert find(QPushButton, 'save_recent').minimumWidth() == width  # nothing next to it moves
    running.take_state(told(recent_s=12.4))
    assert find(QPushButton, 'save_recent').text() == 'Save last 12 s'
    click(find, 'save_recent')
    qtbot.waitUntil(lambda: text(find, 'record_notice') == 'seam.bag')
    assert client.commands == ['save_recent']
    running.take_state(told(recent_s=0.0))
    assert not find(QPushButton, 'save_recent').isEnabled()
