# SPDX-License-Identifier: BSD-3-Clause
"""The window as a whole, without a master: its questions, and the screen space it needs."""
from __future__ import annotations

import ast
from pathlib import Path
from types import SimpleNamespace
from typing import Any, Iterator, List, Optional, Tuple

import pytest
from PyQt5.QtCore import QPoint, QRect, QSize, Qt
from PyQt5.QtWidgets import (
    QAbstractButton,
    QApplication,
    QLabel,
    QLineEdit,
    QMessageBox,
    QPlainTextEdit,
    QPushButton,
    QStackedWidget,
)
from rospy import Time

from process_visualizer.cell.model import Mode
from process_visualizer.clients.bag_recorder import RecordingOptions
from process_visualizer.gui.app import launcher_app
from process_visualizer.gui.app.launcher import Launcher
from process_visualizer.gui.app.launcher_app import LauncherApp
from process_visualizer.gui.app.main import CaughtError, ErrorDialog
from process_visualizer.gui.app.quitting import GRACE_S, Quitting
from process_visualizer.gui.app.settings import Settings
from process_visualizer.gui.app.window_places import MIN_LAUNCHER_PX
from process_visualizer.gui.cell.alarm_strip import AlarmChip
from process_visualizer.gui.cell.launch_model import LaunchPhase
from process_visualizer.gui.recording.recording_types import RecordingPhase
from process_visualizer.gui.toolkit import dialogs
from process_visualizer.gui.toolkit.labels import with_details
from process_visualizer.gui.toolkit.scrolling import TextPlace
from process_visualizer.health.device_state import Level
from process_visualizer.health.near_objects import HOLD_S, times
from process_visualizer.msg import DetectedObject, DetectedObjects

REPOSITORY = Path(__file__).resolve().parents[3]
DEVICES = ''.join(f'<device type="other" name="oven_{number}"/>' for number in range(8))
VALID, BROKEN = f'<visualizer>{DEVICES}</visualizer>', f'<visualizer>{3 * DEVICES}</visualizer>'
MIN_SCREEN_PX = 800 - 32  # 1280x800 without a title bar: a lower one scrolls
SCROLL_BAR_PX = 20


@pytest.fixture
def config(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv('ROS_HOME', str(tmp_path))
    path = tmp_path / 'cell.xml'
    path.write_text(VALID)
    return path


@pytest.fixture
def window(qtbot: Any, config: Path) -> Iterator[LauncherApp]:
    launcher = Launcher()
    app = LauncherApp(launcher, Settings(str(config.parent / 'settings')))
    below = QStackedWidget()  # as in WindowKeeper
    below.addWidget(app.playback.below)
    for widget in (app, below):
        qtbot.addWidget(widget)
    app.show()
    yield app
    launcher.close()


def load(window: LauncherApp, qtbot: Any, path: Path, content: str) -> None:
    path.write_text(content)
    with qtbot.waitSignal(window._launcher.cell.loaded):
        window._launcher.cell.open(str(path))


def settle() -> None:
    """Let each layout follow the one inside it."""
    for _ in range(5):
        QApplication.processEvents()


def note(window: LauncherApp) -> str:
    """The note above the devices, if both devices and problems are visible."""
    label = window.findChild(QLabel, 'problems_note')
    return label.text() if window.devices.isVisible() and label.isVisible() else ''


def test_problems_and_devices_fit_on_a_small_screen(window: LauncherApp, qtbot: Any,
                                                    config: Path) -> None:
    load(window, qtbot, config, VALID)
    load(window, qtbot, config, BROKEN)
    assert 'Keeping the last valid configuration' in note(window)
    column = window.centralWidget().widget()
    assert column.minimumSizeHint().height() <= MIN_SCREEN_PX
    assert column.minimumSizeHint().width() <= MIN_LAUNCHER_PX - SCROLL_BAR_PX


def test_nothing_is_scrolled_to_before_everything_has_given_way(window: LauncherApp, qtbot: Any,
                                                                config: Path) -> None:
    load(window, qtbot, config, VALID)
    window._launcher.session.set_mode(Mode.PLAYBACK)
    window.launch.status.setText('In playback mode.\nA warning\nof two lines')
    area = window.centralWidget()
    settle()
    least = area.widget().minimumSizeHint().height()
    for height, is_scrolled in ((least + 20, False), (least - 60, True)):
        window.resize(470, height + window.statusBar().height())
        settle()
        assert (area.verticalScrollBar().maximum() > 0) is is_scrolled


@pytest.mark.parametrize('mode', list(Mode))
def test_a_panel_keeps_its_height_on_a_low_screen(window: LauncherApp, qtbot: Any, config: Path,
                                                  mode: Mode) -> None:
    load(window, qtbot, config, VALID)
    window._launcher.session.set_mode(mode)
    area, panels = window.centralWidget(), window.panels
    window.resize(window.minimumSizeHint().width(), 500)
    settle()
    assert panels.height() >= panels.minimumSizeHint().height()
    assert panels.geometry().bottom() < area.widget().height()
    assert area.verticalScrollBar().maximum() > 0


def test_no_button_moves_whatever_is_told(window: LauncherApp, qtbot: Any, config: Path) -> None:
    load(window, qtbot, config, VALID)
    launcher, launch = window._launcher, window.launch
    window.resize(window.minimumSizeHint().width(), MIN_SCREEN_PX)
    still = (launch.realtime, launch.apply, launch.launch, launch.view, window.panels.tabBar(),
             window.devices)

    def places() -> List[QRect]:
        settle()
        return [QRect(it.mapTo(window, QPoint()), it.size()) for it in still[:-1]] + [
            QRect(still[-1].mapTo(window, QPoint()), QSize(still[-1].width(), 0))]

    before = places()
    launcher.launch.running, launcher.launch.phase = launcher.choice(), LaunchPhase.RUNNING
    launcher.launch.changed.emit()
    for device in launcher.session.devices[:7]:
        launcher.cell.tick(device.name, False)
    assert launch.apply.text().endswith('oven_6') and places() == before
    launch.show_status('In real-time mode.\n' + 'A warning that goes on and on. ' * 20)
    assert places() == before
    for notice in (window.mixture, window.tool, window.made):
        notice._text.setText('Something that takes many words to tell. ' * 5)
        notice.show()
    window.devices.topLevelItem(0).setExpanded(True)
    window._questions.show_briefly('The disk is full')
    assert places() == before
    for page in range(window.panels.count()):
        window.panels.setCurrentIndex(page)
        assert places() == before
    launcher.session.set_mode(Mode.PLAYBACK)
    assert places() == before
    launcher.launch.running, launcher.launch.phase = None, LaunchPhase.IDLE
    launcher.launch.changed.emit()
    assert places() == before


def test_no_button_moves_with_the_height_of_the_window(window: LauncherApp, qtbot: Any,
                                                       config: Path) -> None:
    load(window, qtbot, config, VALID)
    launch = window.launch
    found = []
    for height in (1000, 700):
        window.resize(470, height)
        settle()
        found.append([it.mapTo(window, QPoint()) for it in (
            launch.realtime, launch.playback, launch.apply, launch.launch, window.panels.tabBar())])
    assert found[0] == found[1]


def test_a_status_that_does_not_fit_is_scrolled_to(window: LauncherApp) -> None:
    place = window.launch.findChild(TextPlace)
    window.launch.show_status('\n'.join(map(str, range(9))))
    settle()
    assert place.verticalScrollBar().maximum() > 0
    window.launch.show_status('Idle')
    settle()
    assert place.verticalScrollBar().maximum() == 0


def test_which_devices_are_in_force(window: LauncherApp, qtbot: Any, config: Path) -> None:
    load(window, qtbot, config, BROKEN)
    assert (note(window), window.devices.isVisible()) == ('', False)
    load(window, qtbot, config, VALID)
    load(window, qtbot, config.with_name('other.xml'), BROKEN)
    assert note(window) == 'The devices are still those of cell.xml:'
    load(window, qtbot, config, VALID)
    assert (note(window), window.devices.isVisible()) == ('', True)


def lose_master(window: LauncherApp, other: Optional[int] = None) -> None:
    """Make the connected master silent, or replace it by another one."""
    master = window._launcher.master
    if not master.is_lost:
        master.is_connected, master._process_id = True, 17
    for _ in range(3):
        master._count(other)


def run_nodes(window: LauncherApp) -> None:
    launch = window._launcher.launch
    launch.running, launch.phase = window._launcher.choice(), LaunchPhase.RUNNING
    launch.changed.emit()


def test_a_master_that_was_started_anew_is_told_and_the_launcher_can_start_again(
        window: LauncherApp, qtbot: Any, config: Path) -> None:
    load(window, qtbot, config, VALID)
    run_nodes(window)
    lose_master(window)
    assert window.launch.status.text().startswith('The ROS master is not responding\n')
    lose_master(window, other=18)
    offer_remedy(window)
    question = window.findChild(QMessageBox, 'question')
    assert question.text().startswith(
        'The ROS master was restarted. It does not know the running nodes: they continue')
    answer(window, qtbot, is_yes=False)
    assert window.launch.status.text().startswith(
        'The ROS master was restarted and does not know the running nodes: stop the cell and '
        'start it again\n')
    window._launcher.launch._ended(None)
    offer_remedy(window)
    assert window.findChild(QMessageBox, 'question').text() == (
        'The ROS master was restarted. Nothing can be launched until the launcher starts '
        'again. Start it again?')
    answer(window, qtbot, is_yes=False)
    assert 'Restart the launcher' in window.launch.status.text()
    assert window.launch.launch.isEnabled() and not window.restarts
    window.launch.launch.click()
    answer(window, qtbot, is_yes=True)
    assert window.restarts and not window.isVisible()


def test_the_mode_of_nodes_whose_master_is_lost_cannot_be_chosen(
        window: LauncherApp, qtbot: Any, config: Path) -> None:
    load(window, qtbot, config, VALID)
    run_nodes(window)
    assert window.launch.playback.isEnabled()
    lose_master(window, other=18)
    assert not window.launch.playback.isEnabled()
    assert 'does not know the running nodes' in window.launch.playback.toolTip()
    window._launcher.launch._ended(None)
    assert window.launch.playback.isEnabled(), 'the mode in which the nodes are launched again'


def offer_remedy(window: LauncherApp) -> None:
    button = window.lost.findChild(QAbstractButton, 'lost_master_remedy')
    assert not window.lost.isHidden()
    button.click()


def test_a_question_about_the_master_goes_when_its_text_is_outdated(window: LauncherApp, qtbot: Any
                                                                    ) -> None:
    lose_master(window)
    offer_remedy(window)
    question = window.findChild(QMessageBox, 'question')
    assert question.defaultButton() is question.button(QMessageBox.Cancel)
    lose_master(window, other=18)
    qtbot.waitUntil(lambda: window.findChild(QMessageBox, 'question') is None)
    assert 'was restarted' in window.lost.findChild(QLabel, 'lost_master_text').text()
    assert not window.restarts


def test_what_nobody_asked_for_takes_no_keys(window: LauncherApp, qtbot: Any) -> None:
    label = window.recording.findChild(QLineEdit, 'mark_label')
    label.setEnabled(True)
    window.activateWindow()
    label.setFocus()
    qtbot.waitUntil(label.hasFocus)
    lose_master(window)
    assert QApplication.focusWidget() is label
    window._launcher.failed.emit('the disk is full')
    errors = ErrorDialog('', window)
    errors.add(CaughtError('an error', '', ''))
    for dialog in (window.findChild(QMessageBox, 'message'), errors):
        assert dialog.isVisible() and dialog.testAttribute(Qt.WA_ShowWithoutActivating)
    assert QApplication.activeModalWidget() is None
    assert window.findChild(QMessageBox, 'question') is None


def test_question_about_the_master_answers_itself(window: LauncherApp, qtbot: Any,
                                                  config: Path) -> None:
    load(window, qtbot, config, VALID)
    run_nodes(window)
    lose_master(window)
    offer_remedy(window)
    assert 'start the launcher again?' in window.findChild(QMessageBox, 'question').text()
    window._launcher.master.returned.emit()
    qtbot.waitUntil(lambda: window.findChild(QMessageBox, 'question') is None)
    assert window.statusBar().currentMessage() == 'The ROS master responds again'
    assert not window.restarts


def test_details_of_a_message_are_shown_to_who_asks(window: LauncherApp) -> None:
    window._launcher.failed.emit(with_details('a part is unreadable', ['at byte 5', 'at byte 9']))
    box = window.findChild(QMessageBox, 'message')
    assert (box.text(), box.detailedText()) == ('A part is unreadable', 'at byte 5\nat byte 9')
    assert window.statusBar().currentMessage() == 'A part is unreadable'


def test_a_message_covers_nothing_that_can_be_clicked(window: LauncherApp,
                                                      monkeypatch: pytest.MonkeyPatch) -> None:
    """It was above the tabs, and received a click on one of them."""
    class Screen:
        @staticmethod
        def availableGeometry() -> QRect:
            return QRect(0, 0, 1920, 1080)

    monkeypatch.setattr(dialogs.QGuiApplication, 'primaryScreen', Screen)
    window.show()
    window.setGeometry(0, 0, 460, 700)
    window._launcher.failed.emit('the disk is full')
    box = window.findChild(QMessageBox, 'message')
    assert not box.frameGeometry().intersects(window.frameGeometry())
    box.close()
    window.move(1400, 0)
    window._launcher.failed.emit('the folder is gone')
    (box,) = [it for it in window.findChildren(QMessageBox, 'message') if it.isVisible()]
    assert box.frameGeometry().right() < window.frameGeometry().left()


def test_the_button_of_a_message_stays_when_others_follow(window: LauncherApp) -> None:
    def place() -> QPoint:
        button = window.findChild(QMessageBox, 'message').button(QMessageBox.Ok)
        return button.mapToGlobal(QPoint(0, 0))

    window._launcher.failed.emit('the disk is full')
    window.findChild(QMessageBox, 'message').move(200, 300)
    QApplication.processEvents()
    before = place()
    window._launcher.failed.emit('the folder is gone, which is said in a line that is longer')
    QApplication.processEvents()
    assert place() == before


def test_a_message_that_comes_again_is_shown_once(window: LauncherApp) -> None:
    for text in ('the disk is full', 'the folder is gone', 'the disk is full'):
        window._launcher.failed.emit(text)
    assert window.findChild(QMessageBox, 'message').text() == (
        'The disk is full\n\nThe folder is gone')
    assert window.statusBar().currentMessage() == 'The disk is full'


def test_what_the_status_bar_says_goes_by_itself(window: LauncherApp, qtbot: Any,
                                                 monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(launcher_app, '_BRIEF_MS', 1)
    window._launcher.failed.emit('the disk is full')
    qtbot.waitUntil(lambda: window.statusBar().currentMessage() == '')


@pytest.mark.parametrize('width', [460, 1366, 1920])
def test_a_message_that_does_not_fit_says_so_and_can_be_read(window: LauncherApp, qtbot: Any,
                                                             width: int) -> None:
    window.resize(width, 800)
    settle()
    bar, text = window.statusBar(), 'The disk is full, and so on. ' * 20
    window.tell('The disk is full')
    assert (bar.shown_text, bar.toolTip()) == ('The disk is full', '')
    qtbot.mouseClick(bar, Qt.LeftButton)
    assert window.findChild(QMessageBox, 'message') is None
    window.tell(text)
    assert bar.shown_text.endswith('…') and text.startswith(bar.shown_text[:-1])
    assert bar.fontMetrics().horizontalAdvance(bar.shown_text) < bar.width()
    assert bar.toolTip() == text
    qtbot.mouseClick(bar, Qt.LeftButton)
    assert window.findChild(QMessageBox, 'message').text() == text


def test_the_window_is_not_closed_while_a_recording_goes_on_unless_that_is_wanted(
        window: LauncherApp, qtbot: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(type(window._launcher.recording), 'is_recording',
                        property(lambda _: True))
    for button, is_open in ((QMessageBox.Cancel, True), (QMessageBox.Yes, False)):
        window.close()
        assert window.isVisible()
        question = window.findChild(QMessageBox, 'question')
        assert question.text() == (
            'A recording is in progress. Finish and keep it, quit all nodes and close?')
        (question.button(button) or window.findChild(QAbstractButton, 'yes')).click()
        assert window.isVisible() is is_open
        qtbot.waitUntil(lambda: window.findChild(QMessageBox, 'question') is None)


UNSAVED = """<visualizer>
  <device type="depth_sensor" name="kinect">
    <base frame="kinect_link" />
    <topic ns="kinect" name="cloud" type="pointcloud" />
    <roi frame="kinect_link" xyz="1 0 0" size="1 1 1" />
  </device>
</visualizer>
"""


def answer(window: LauncherApp, qtbot: Any, is_yes: bool) -> None:
    question = window.findChild(QMessageBox, 'question')
    (window.findChild(QAbstractButton, 'yes') if is_yes else question.button(QMessageBox.Cancel)
     ).click()
    qtbot.waitUntil(lambda: window.findChild(QMessageBox, 'question') is None)


def test_what_is_not_saved_is_asked_about_when_the_window_closes(
        window: LauncherApp, qtbot: Any, config: Path) -> None:
    load(window, qtbot, config, UNSAVED)
    launcher = window._launcher
    for model in (launcher.calibration, launcher.region):
        model.choose('kinect')
        model.set_value(0, 0.5)
    window.close()
    question = window.findChild(QMessageBox, 'question')
    assert question.text() == ('Not saved: the pose of kinect and the crop box of kinect. '
                               'Close without saving the pose of kinect and the crop box of '
                               'kinect?')
    assert question.defaultButton() is question.button(QMessageBox.Cancel)
    answer(window, qtbot, is_yes=False)
    assert window.isVisible() and launcher.calibration.pose.xyz[0] == 0.5
    window.close()
    answer(window, qtbot, is_yes=True)
    assert not window.isVisible() and launcher.settings()['unsaved'] == {}


def test_closing_asks_while_what_is_shared_is_being_written(
        window: LauncherApp, qtbot: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(type(window._launcher.compare), 'is_writing', property(lambda _: True))
    window.close()
    assert window.findChild(QMessageBox, 'question').text() == (
        'A run that is shared is still being written. Close?')
    answer(window, qtbot, is_yes=False)
    assert window.isVisible()
    window.close()
    answer(window, qtbot, is_yes=True)
    assert not window.isVisible()


def test_what_is_not_saved_outlives_an_end_that_nobody_can_be_asked_about(
        window: LauncherApp, qtbot: Any, config: Path) -> None:
    """SIGTERM, a crash, or a lost master."""
    load(window, qtbot, config, UNSAVED)
    launcher = window._launcher
    launcher.region.choose('kinect')
    launcher.region.set_value(0, 0.5)
    lose_master(window)
    offer_remedy(window)
    assert window.findChild(QMessageBox, 'question').text().endswith(
        'Not saved, but offered again then: the crop box of kinect.')
    window.leave()
    assert not window.isVisible()
    kept = launcher.settings()
    launcher.unsaved.discard()
    launcher.restore(kept)
    assert window.findChild(QLabel, 'unsaved_text').text() == (
        'Left unsaved: the crop box of kinect.')
    window.findChild(QPushButton, 'unsaved_take').click()
    assert launcher.region.region is not None and launcher.region.region.center[0] == 0.5
    assert not launcher.unsaved.offered and launcher.settings() == kept


class QuitCommand:
    """The quit command in a window whose nodes run; nothing is started or ended."""

    def __init__(self, window: LauncherApp, monkeypatch: pytest.MonkeyPatch) -> None:
        self.now_s, self.quits = 100.0, 0
        self._window = window
        launcher = window._launcher
        launcher.launch.running, launcher.launch.phase = launcher.choice(), LaunchPhase.RUNNING
        monkeypatch.setattr(launcher.launch, 'quit', self._note)
        self.command = Quitting(window, launcher, lambda: self.now_s)

    def _note(self) -> None:
        self.quits += 1

    def wait(self, seconds: float) -> None:
        for _ in range(round(seconds * 10)):
            self.now_s += 0.1
            self.command.grace.poll()

    def question(self) -> str:
        found = self._window.findChild(QMessageBox, 'question')
        return '' if found is None else str(found.text())


@pytest.fixture
def quitting(window: LauncherApp, qtbot: Any, config: Path,
             monkeypatch: pytest.MonkeyPatch) -> Iterator[QuitCommand]:
    load(window, qtbot, config, UNSAVED)
    yield QuitCommand(window, monkeypatch)
    window._launcher.launch.running, window._launcher.launch.phase = None, LaunchPhase.IDLE


def test_quitting_can_be_taken_back_for_some_seconds(quitting: QuitCommand) -> None:
    quitting.command.quit()
    quitting.wait(GRACE_S - 0.5)
    assert (quitting.quits, quitting.command.grace.left_s) == (0, 1)
    quitting.command.quit()
    quitting.wait(10.0)
    assert (quitting.quits, quitting.command.grace.is_waiting) == (0, False)
    quitting.command.quit()
    quitting.wait(GRACE_S + 0.1)
    assert (quitting.quits, quitting.question()) == (1, '')


def test_quitting_asks_where_something_would_be_lost(
        quitting: QuitCommand, window: LauncherApp, qtbot: Any,
        monkeypatch: pytest.MonkeyPatch) -> None:
    launcher = window._launcher
    monkeypatch.setattr(type(launcher.live_comparison), 'reference',
                        property(lambda _: 'other.bag#2'))  # without any comparison
    monkeypatch.setattr(type(launcher.live_comparison), 'judged_with',
                        property(lambda _: 'seam.bag#3'))
    quitting.command.quit()
    assert quitting.question() == (
        'The running cell is being compared with seam.bag#3. Quit all nodes?')
    answer(window, qtbot, is_yes=False)
    quitting.wait(GRACE_S + 0.1)
    assert quitting.quits == 0
    monkeypatch.setattr(type(launcher.live_comparison), 'judged_with',
                        property(lambda _: ''))
    quitting.command.quit()  # nothing would be lost
    launcher.region.choose('kinect')
    launcher.region.set_value(0, 0.5)  # now something would
    quitting.wait(GRACE_S + 0.1)
    assert quitting.question() == (
        'Not saved, but kept in this window: the crop box of kinect. Quit all nodes?')
    answer(window, qtbot, is_yes=True)
    assert quitting.quits == 1


def test_quitting_asks_while_something_is_recorded(
        quitting: QuitCommand, window: LauncherApp, qtbot: Any,
        monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(type(window._launcher.recording), 'is_recording',
                        property(lambda _: True))
    for is_yes in (False, True):
        quitting.command.quit()
        assert quitting.question() == (
            'A recording is in progress. Finish and keep it and quit all nodes?')
        assert window.findChild(QAbstractButton, 'yes').text() == 'Finish and quit'
        answer(window, qtbot, is_yes)
        quitting.wait(GRACE_S + 0.1)
        assert quitting.quits == is_yes
    monkeypatch.undo()


def test_time_in_which_the_window_is_held_up_does_not_quit(quitting: QuitCommand) -> None:
    """The operator's click waits behind the operation that blocks the window."""
    quitting.command.quit()
    quitting.now_s += GRACE_S + 1.0
    quitting.command.grace.poll()
    quitting.command.quit()  # cancels it
    quitting.wait(GRACE_S + 1.0)
    assert quitting.quits == 0


def test_the_button_says_that_quitting_can_be_undone(window: LauncherApp) -> None:
    button = window.launch.launch
    window.launch.show_phase(LaunchPhase.RUNNING, True, '')
    width = button.minimumSizeHint().width()
    window.launch.show_phase(LaunchPhase.RUNNING, True, '', 4)
    assert button.text() == 'Keep running (quits in 4 s)'
    window.launch.show_phase(LaunchPhase.RUNNING, True, '')
    assert (button.text(), button.minimumSizeHint().width()) == ('Quit all nodes', width)


NEAR = """<visualizer>
  <device type="depth_sensor" name="kinect">
    <base frame="kinect_link" />
    <topic ns="kinect" name="cloud" type="pointcloud" />
    <objects warn="0.5" stop="0.2" />
  </device>
</visualizer>
"""


def near(*levels_and_distances: Tuple[int, float]) -> DetectedObjects:
    """Return the message of a depth sensor about objects near the hand of a robot."""
    message = DetectedObjects(objects=[
        DetectedObject(number=3, link='arm/hand', distance=distance_m, level=level)
        for level, distance_m in levels_and_distances])
    for it in message.objects:
        it.size.x, it.size.y, it.size.z = 0.24, 0.18, 0.3
    message.header.stamp = Time(1000)
    return message


def test_an_object_near_a_robot_is_told_until_it_is_gone(
        window: LauncherApp, qtbot: Any, config: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    launcher = window._launcher
    link, followed = launcher.objects.link, []  # type: Any, List[Tuple[str, ...]]
    monkeypatch.setattr(link, 'follow', followed.append)
    now_s = [1000.0]
    monkeypatch.setattr(launcher.objects.model, '_wall_s', lambda: now_s[0])
    load(window, qtbot, config, NEAR)
    launcher.launch.running, launcher.launch.phase = launcher.choice(), LaunchPhase.RUNNING
    launcher.launch.changed.emit()
    qtbot.waitUntil(lambda: followed == [('kinect',)])

    def chips() -> List[str]:
        return [it.text.text().split('  ')[1] for it in window.findChildren(AlarmChip)
                if it.isVisible()]

    link._take(near((DetectedObject.WARN, 0.31)), 'kinect')
    assert chips() == ["kinect: object 3 is 0.31 m from arm's hand: 24 × 18 × 30 cm"]
    link._take(near((DetectedObject.STOP, 0.12)), 'kinect')
    assert launcher.alarms.alarms[0].condition.level is Level.BAD
    qtbot.waitUntil(lambda: [it[:29] for it in chips()] == ['kinect: object 3 is 0.12 m fr'])
    assert any(it.isVisible() for it in window.findChildren(QPushButton, 'alarm_replay'))
    link._take(near(), 'kinect')
    now_s[0] += HOLD_S
    qtbot.waitUntil(lambda: chips() == [])
    window.findChild(QAbstractButton, 'show_events').click()
    events = window.findChild(QPlainTextEdit, 'events_text').toPlainText()
    assert [line.split('  ')[1][:24] for line in events.splitlines() if 'object' in line] == [
        'kinect: object 3 is 0.31', 'kinect: object 3 is 0.12', 'kinect: object 3 is 0.12']
    spans = window.live.timeline.near
    assert len(times(spans, Level.WARNING)) == len(times(spans, Level.BAD)) == 1
    launcher.launch.running, launcher.launch.phase = None, LaunchPhase.IDLE
    launcher.launch.changed.emit()


def test_what_a_sensor_sees_is_written_and_offered_to_be_applied(
        window: LauncherApp, qtbot: Any, config: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    launcher = window._launcher
    monkeypatch.setattr(launcher.objects.link, 'follow', lambda _names: None)
    load(window, qtbot, config, NEAR)
    launcher.launch.running, launcher.launch.phase = launcher.choice(), LaunchPhase.RUNNING
    launcher.launch.changed.emit()
    message = near((DetectedObject.CLEAR, 0.9))
    message.objects[0].is_seen = message.objects[0].is_confirmed = True
    launcher.objects.link._take(message, 'kinect')
    assert window.devices._seen == {'kinect': 1}
    window.devices.expect_wanted.emit('kinect')
    (question,) = [it for it in window.findChildren(QMessageBox) if it.isVisible()]
    assert "0.90 m from arm's hand" in question.text()
    with qtbot.waitSignal(launcher.cell.loaded):
        question.findChild(QPushButton, 'yes').click()
    assert config.read_text().count('<expected ') == 1
    assert launcher.pending() == 'restart kinect'
    with qtbot.waitSignal(launcher.cell.loaded):
        window.expected.findChild(QPushButton, 'expected_revert').click()
    assert (config.read_text(), launcher.pending()) == (NEAR, '')
    launcher.launch.running, launcher.launch.phase = None, LaunchPhase.IDLE
    launcher.launch.changed.emit()


def test_a_button_that_its_click_disables_gives_the_keyboard_to_no_other(
        window: LauncherApp, qtbot: Any, config: Path) -> None:
    load(window, qtbot, config, VALID)
    window.activateWindow()
    for button in (window.launch.launch, window.recording.findChild(QPushButton, 'record')):
        assert button is not None
        button.setEnabled(True)
        button.setFocus()
        assert window.focusWidget() is button
        button.setEnabled(False)
        assert window.focusWidget() is None
    button.setEnabled(True)
    button.setFocus()
    window.focusNextPrevChild(True)  # by Tab
    assert window.focusWidget() not in (None, button)


def test_a_window_with_nothing_to_quit_closes_at_the_first_click(window: LauncherApp) -> None:
    assert window.close() and not window.isVisible()


def chains(path: Path) -> Iterator[List[str]]:
    """The chains of names in a program that are joined by dots, each from its first name."""
    for node in ast.walk(ast.parse(path.read_text(encoding='utf-8'))):
        names: List[str] = []
        while isinstance(node, ast.Attribute):
            names.insert(0, node.attr)
            node = node.value
        if isinstance(node, ast.Name) and names:
            yield [node.id, *names]


@pytest.mark.parametrize('script', ['window_pictures.py', 'compare_picture.py'])
def test_the_programs_that_take_pictures_name_what_there_is(window: LauncherApp, script: str
                                                            ) -> None:
    launcher = window._launcher
    known = {'launcher': launcher, 'playback': launcher.playback, 'replay': launcher.replay,
             'self': SimpleNamespace(launcher=launcher, window=window)}
    seen = 0
    for begin, *names in chains(REPOSITORY / 'scripts' / script):
        it = known.get(begin)
        if begin == 'self' and names[0] not in ('launcher', 'window'):
            continue
        for name in names:
            if it is None:  # it is unknown until the cell runs
                break
            assert hasattr(it, name), '.'.join([begin, *names])
            it, seen = getattr(it, name), seen + 1
    assert seen > 20


def test_a_message_about_a_refused_recording_goes_when_one_starts(window: LauncherApp) -> None:
    recording = window._launcher.recording
    recording._enter(recording.state._replace(refused_options=RecordingOptions()))
    recording.failed.emit('a.bag exists already')
    (box,) = window.findChildren(QMessageBox, 'message')
    assert box.isVisible()
    recording._enter(recording.state._replace(phase=RecordingPhase.RECORDING))
    assert not box.isVisible()
