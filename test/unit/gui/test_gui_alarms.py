# SPDX-License-Identifier: BSD-3-Clause
"""Alarms in a strip that never moves, and the list of events."""
from __future__ import annotations

import re
import time
from dataclasses import replace
from pathlib import Path
from shutil import rmtree
from typing import Any, Iterator, List, Tuple

import pytest
import rosbag
from genpy import Time
from held_tasks import HeldTasks
from PyQt5.QtCore import QEvent, QObject, QPoint, Qt, pyqtSignal
from PyQt5.QtGui import QCursor, QHoverEvent
from PyQt5.QtWidgets import QApplication, QMessageBox, QPlainTextEdit, QPushButton
from recording_stand_in import seen
from session_stand import choose, play
from std_msgs.msg import Float64

from process_visualizer.bagio.bag_errors import BagError
from process_visualizer.cell.errors import Location
from process_visualizer.cell.model import (
    Cell,
    Device,
    DeviceType,
    Mode,
    Topic,
    Variable,
    WarningLimits,
)
from process_visualizer.generate.choice import Choice
from process_visualizer.generate.plan import BAG_PART, RVIZ_PART
from process_visualizer.gui.app.event_notes import EventNotes, events_path, write_events
from process_visualizer.gui.cell.alarm_strip import AlarmChip, AlarmStrip, EventsView
from process_visualizer.gui.cell.alarms_model import AlarmsModel
from process_visualizer.gui.cell.device_states_model import DeviceStatesModel, WarningsModel
from process_visualizer.gui.cell.launch_model import LaunchModel, LaunchPhase
from process_visualizer.gui.playback.bag_model import CurvesModel
from process_visualizer.gui.recording.recording_state import RecordingState
from process_visualizer.gui.recording.recording_types import RecordedMark
from process_visualizer.gui.ros.snapshots import RecorderSnapshot, TopicSnapshot
from process_visualizer.gui.session import Session
from process_visualizer.health.alarm_board import Action, Alarm, Condition
from process_visualizer.health.alarm_conditions import object_conditions
from process_visualizer.health.device_state import Level
from process_visualizer.health.near_objects import NearObject, SeenObject
from process_visualizer.health.node_history import STEADY_AFTER_S
from process_visualizer.health.node_warnings import NodeWarnings, Severity
from process_visualizer.launching.cell_watch import MASTER_SILENT, CellLook
from process_visualizer.launching.part_report import NodeReport, NodeState, PartReport, PartState
from process_visualizer.ros_names import (
    CONCERNED_KEY,
    CONFLICT_KEY,
    EXCESS_KEY,
    LIMIT_KEY,
    SCENE_WATCH,
    SILENT_NODE_KEY,
    STALE_POINTS_KEY,
)

ARM = Device(DeviceType.ROBOT, 'arm', Location('cell.xml', 1))
CELL = Cell('cell.xml', 'world', (ARM,))
NOON_S = 1_800_000_000.0
RECORDED = (('arm', 'edge is above 335, up to 424', 7.0, 9.0),)


class Stand:
    """Cell with a running arm; its clock is set by hand."""

    def __init__(self) -> None:
        self.now_s = 100.0
        self.said = NodeWarnings()
        self.session = Session()
        self.warnings = WarningsModel(self.said, self.session, clock_s=lambda: self.now_s)
        self.launch = LaunchModel(HeldTasks(), self.session, clock_s=lambda: self.now_s)
        self.states = DeviceStatesModel(self.launch, self.warnings, self.session)
        self.model = AlarmsModel(self.launch, self.states, lambda: NOON_S + self.now_s,
                                 lambda: self.now_s, lambda: 'anna')
        self.strip = AlarmStrip(self.model)
        self.wanted: List[Tuple[Action, Condition]] = []
        self.strip.action_wanted.connect(lambda *wanted: self.wanted.append(wanted))
        self.run(Mode.REALTIME)

    def run(self, mode: Mode) -> None:
        self.launch.running = Choice(CELL, mode, (ARM,))
        self.launch.phase = LaunchPhase.RUNNING
        self.report('arm', NodeState.RUNNING)

    def report(self, part: str, state: NodeState, code: 'int | None' = None) -> None:
        nodes = tuple(NodeReport(f'/arm/{name}', state, code)
                      for name in ('driver', 'variable_proc'))[:2 if part == 'arm' else 1]
        self.launch.reports = {**self.launch.reports,
                               part: PartReport(part, PartState.RUNNING, nodes)}
        self.launch.changed.emit()

    def beyond(self, is_beyond: bool, reach: str = 'up to 424', by: str = '') -> None:
        self.said.take_state('/arm/variable_proc', 'limits of edge',
                             Severity.ERROR if is_beyond else None, 'edge is above 335',
                             self.now_s, {LIMIT_KEY: reach, EXCESS_KEY: by, 'for_s': '2.0'})
        self.warnings.look()

    def texts(self) -> List[str]:
        return [chip.text.text().split('  ')[1] for chip in self.chips()]

    def says_no_alarms(self) -> bool:
        return self.strip.summary.isVisible() and self.strip.summary.text() == 'No alarms'

    def chips(self) -> List[AlarmChip]:
        return [chip for chip in self.strip.findChildren(AlarmChip) if not chip.isHidden()]


@pytest.fixture
def stand(qtbot: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Stand]:
    monkeypatch.setenv('ROS_HOME', str(tmp_path))
    made = Stand()
    qtbot.addWidget(made.strip)
    made.strip.show()
    yield made
    rmtree(made.launch.folder)


def test_the_end_of_an_alarm_with_its_value_fits_beside_the_buttons(stand: Stand) -> None:
    stand.strip.resize(400, stand.strip.height())
    stand.beyond(True)
    QApplication.processEvents()
    chip = stand.chips()[0]
    shown = chip.text.shown_text(chip.text.width())
    assert shown.replace('\n', ' ').endswith('edge is above 335, up to 424'), shown
    assert 2 * chip.text.fontMetrics().lineSpacing() <= chip.text.height()


def test_a_node_that_hangs_is_an_alarm_until_it_answers(stand: Stand) -> None:
    for device, source in (('arm', 'arm'), ('', 'Frames')):
        for node in ('/scene_watch', '/cell_frames'):  # both may report it
            stand.said.take_state(node, '/x/variable_proc', Severity.WARNING,
                                  'variable_proc does not answer: no limits', stand.now_s,
                                  {SILENT_NODE_KEY: '/x/variable_proc', CONCERNED_KEY: device})
        stand.warnings.look()
        assert stand.texts() == [f'{source}: variable_proc does not answer: no limits']
        for node in ('/scene_watch', '/cell_frames'):
            stand.said.take_state(node, '/x/variable_proc', None, '', stand.now_s, {})
        stand.warnings.look()
        assert stand.says_no_alarms()


def test_a_window_that_was_closed_while_it_was_asked_does_not_hang(stand: Stand) -> None:
    """RViz hangs for seconds while it ends; the last node that asked it reports this afterward."""
    def report(state: NodeState, code: 'int | None' = None) -> None:
        stand.launch.reports = {**stand.launch.reports, RVIZ_PART: PartReport(
            RVIZ_PART, PartState.RUNNING, (NodeReport('/rviz', state, code),))}
        stand.launch.changed.emit()

    report(NodeState.RUNNING)
    report(NodeState.EXITED, 0)
    stand.states.take_look(CellLook(silent=frozenset({'/rviz'})))
    stand.said.take_state('/scene_watch', '/rviz', Severity.WARNING, 'rviz is not responding',
                          stand.now_s, {SILENT_NODE_KEY: '/rviz', CONCERNED_KEY: ''})
    stand.warnings.look()
    assert [it.text for it in stand.model.events] == ['RViz was closed']
    assert [it.condition.text for it in stand.model.alarms] == ['was closed']


def test_nodes_that_contradict_each_other_are_an_alarm(stand: Stand) -> None:
    said = '/arm/joints: 2 nodes send positions of a that are up to 1.2 apart'
    stand.said.take_state('/arm/driver', '/arm/driver', Severity.WARNING,
                          f'{said}, and much more', stand.now_s, {CONFLICT_KEY: said})
    stand.warnings.look()
    assert stand.texts() == [f'arm: {said}']


def test_nothing_is_wrong(stand: Stand) -> None:
    assert (stand.says_no_alarms(), stand.texts()) == (True, [])


def test_a_variable_beyond_its_limit(stand: Stand) -> None:
    stand.beyond(True)
    assert stand.texts() == ['arm: edge is above 335, up to 424']
    assert not stand.says_no_alarms()
    assert stand.model.alarms[0].since_s == NOON_S + 98.0


def test_a_variable_that_was_beyond_its_limit_is_acknowledged(stand: Stand, qtbot: Any) -> None:
    stand.beyond(True)
    stand.now_s += 1.0
    stand.beyond(False)
    stand.now_s += 60.0
    stand.model.look()
    (chip,) = stand.chips()
    assert re.fullmatch(r'\d\d:\d\d:\d\d–\d\d:\d\d:\d\d  arm: edge is above 335, up to 424',
                        chip.text.text())
    buttons = {it.text(): it for it in chip.findChildren(QPushButton)}
    assert list(buttons) == ['Replay', 'Ack']
    qtbot.mouseClick(buttons['Replay'], Qt.LeftButton)
    assert stand.wanted[0][1].since_s == NOON_S + 98.0
    qtbot.mouseClick(buttons['Ack'], Qt.LeftButton)
    stand.model.acknowledge(stand.wanted[1][1])
    assert (stand.says_no_alarms(), stand.texts()) == (True, [])
    assert [event.text for event in stand.model.events] == [
        'arm: edge is above 335, up to 424',
        'arm: edge is above 335, up to 424: over after 3.0 s',
        'arm: edge is above 335, up to 424: acknowledged by anna']


def test_a_limit_of_which_nobody_says_anything_any_more_is_not_over(stand: Stand) -> None:
    stand.beyond(True)
    stand.now_s += 6.0  # its node hangs: the state is not repeated
    stand.warnings.look()
    assert stand.model.events[-1].text == (
        'arm: edge is above 335, up to 424: no data after 8.0 s')
    stand.beyond(True)
    stand.beyond(False)
    assert stand.model.events[-1].text.endswith(': over after 2.0 s')


def restart(stand: Stand) -> None:
    for state, nodes in ((PartState.STOPPED, ()), (PartState.STARTING, (
            NodeReport('/arm/driver'), NodeReport('/arm/variable_proc')))):
        stand.launch.reports = {'arm': PartReport('arm', state, nodes)}
        stand.launch.changed.emit()
    stand.report('arm', NodeState.RUNNING)
    stand.warnings.look()


def test_a_restart_is_no_new_alarm_of_old_values(stand: Stand) -> None:
    stand.beyond(True)
    stand.now_s += 1.0
    restart(stand)
    assert [it.text.partition(': ')[2] for it in stand.model.events] == [
        'edge is above 335, up to 424',
        'edge is above 335, up to 424: no data after 3.0 s']
    stand.beyond(True)
    assert len(stand.model.events) == 3


def test_a_restart_ends_no_silence(stand: Stand) -> None:
    device = replace(ARM, topics=(Topic(
        '/heat', None, 'std_msgs/Float64', True, ARM.location),))
    stand.launch.running = Choice(CELL, Mode.REALTIME, (device,))

    def count(messages: int, silence_s: float) -> None:
        stand.states.take_recorder(RecorderSnapshot('idle', topics=(TopicSnapshot(
            '/heat', 'std_msgs/Float64', 1, messages, 5.0, 0, 0, 0, silence_s),)))

    for messages in range(20):
        count(messages, 0.1)
    restart(stand)
    assert stand.says_no_alarms()
    count(20, 19.5)
    assert stand.texts() == ['arm: No data from /heat']
    restart(stand)
    assert [it.text for it in stand.model.events] == ['arm: No data from /heat']
    count(30, 0.1)
    assert 'data resumed' in stand.model.events[-1].text


@pytest.mark.parametrize('lost, end', [([], 'over'), (['kinect'], 'no data')])
def test_an_object_that_the_sensor_cannot_see_any_more_is_not_gone(
        stand: Stand, lost: List[str], end: str) -> None:
    seen_object = SeenObject(1, 'arm/hand', 0.3, (0.2, 0.2, 0.2), Level.BAD)
    stand.model.set_objects(object_conditions('kinect', [
        NearObject(seen_object, Level.BAD, NOON_S + 98.0)]), [])
    stand.model.set_objects([], [], lost)
    assert stand.model.events[-1].text.endswith(f': {end} after 2.0 s')


def test_what_was_wrong_in_the_live_cell_is_not_over_in_playback(stand: Stand) -> None:
    stand.beyond(True)
    stand.launch.running = replace(stand.launch.running, mode=Mode.PLAYBACK)
    stand.launch.changed.emit()
    assert stand.model.events[-1].text.endswith(': no data after 2.0 s')


def test_what_was_wrong_when_the_nodes_were_quit_is_not_over(stand: Stand) -> None:
    for messages in range(0, 100, 10):  # learns the usual rate
        stand.states.take_recorder(RecorderSnapshot('idle', topics=(
            seen('/arm/q', messages=messages),)))
    topic = Topic('/arm/q', None, None, True, Location('cell.xml', 1))
    stand.launch.running = replace(stand.launch.running, devices=(replace(ARM, topics=(topic,)),))
    stand.states.take_recorder(RecorderSnapshot('idle', topics=(
        seen('/arm/q', 0.0, 60.0, messages=100),)))
    assert stand.model.events[-1].text == 'arm: No data from /arm/q'
    stand.beyond(True)
    stand.launch.phase = LaunchPhase.QUITTING
    stand.launch.changed.emit()
    assert {it.text for it in stand.model.events[-2:]} == {
        'arm: No data from /arm/q: the nodes were quit after 60.0 s',
        'arm: edge is above 335, up to 424: the nodes were quit after 2.0 s'}


def test_what_the_recorder_does_not_remember_is_not_offered_for_replay(stand: Stand) -> None:
    stand.model.take_recorder(RecorderSnapshot('idle', recent_s=0.0, remembered_s=30.0))
    stand.beyond(True)  # for 2 s
    replay = stand.chips()[0].findChild(QPushButton, 'alarm_replay')
    stand.now_s += 27.0
    stand.model.look()
    assert replay.isEnabled() and replay.toolTip() == 'Replay'
    stand.now_s += 2.0
    stand.model.look()
    assert not replay.isEnabled()
    assert replay.toolTip() == "Its beginning is no longer in the recorder's memory"


def test_nothing_is_replayed_while_no_cell_runs(stand: Stand) -> None:
    stand.beyond(True)
    replay = stand.chips()[0].findChild(QPushButton, 'alarm_replay')
    assert replay.isEnabled()
    stand.beyond(False)
    stand.launch.phase = LaunchPhase.IDLE
    stand.launch.changed.emit()
    assert not stand.chips()[0].findChild(QPushButton, 'alarm_replay').isEnabled()


def test_an_alarm_that_begins_again_is_as_old_as_that(stand: Stand) -> None:
    for began_s in (98.0, 159.0):
        stand.beyond(True)
        assert stand.model.alarms[0].since_s == NOON_S + began_s
        stand.beyond(False)
        stand.now_s += 61.0


def test_an_alarm_that_came_again_says_how_often_and_since_when(stand: Stand) -> None:
    stand.strip.resize(400, stand.strip.height())
    for _ in range(3):
        stand.beyond(True)
        stand.beyond(False)
        stand.now_s += 61.0
    QApplication.processEvents()
    (chip,) = stand.chips()
    shown = chip.text.shown_text(chip.text.width()).replace('\n', ' ')
    first, last = (time.strftime('%H:%M:%S', time.localtime(NOON_S + it)) for it in (98.0, 222.0))
    assert shown.split(None, 2) == [f'{first}–{last}', '(3×)', 'arm: edge is above 335, up to 424']


def test_the_worst_value_of_all_times_is_shown(stand: Stand) -> None:
    for reach, by in (('up to 398', '63.0'), ('up to 355', '20.0')):
        stand.beyond(True, reach, by)
        stand.beyond(False)
        stand.now_s += 61.0
    assert stand.texts() == ['arm: edge is above 335, up to 398']
    assert 'up to 355: over' in stand.model.events[-1].text
    stand.model.acknowledge(stand.model.alarms[0].condition)
    assert stand.model.events[-1].text == (
        'arm: edge is above 335, up to 398 (2×): acknowledged by anna')


def hover(stand: Stand, is_over: bool) -> None:
    event = QEvent.HoverEnter if is_over else QEvent.HoverLeave
    QApplication.sendEvent(stand.strip, QHoverEvent(event, QPoint(5, 5), QPoint(4, 5)))


@pytest.mark.parametrize('uses_keys', [False, True])
def test_alarms_keep_their_places_however_long_the_mouse_rests(
        stand: Stand, qtbot: Any, uses_keys: bool) -> None:
    stand.beyond(True)
    (chip,) = stand.chips()
    acknowledge = chip.findChild(QPushButton, 'alarm_acknowledge')
    if uses_keys:
        qtbot.waitExposed(stand.strip)
        acknowledge.setFocus(Qt.TabFocusReason)
        qtbot.waitUntil(acknowledge.hasFocus)
    else:
        hover(stand, True)
    stand.beyond(False)
    for part in ('arm', RVIZ_PART):
        stand.report(part, NodeState.EXITED, 1)  # comes before an alarm that is over
    stand.strip._rest.timeout.emit()
    assert stand.chips()[0] is chip and len(stand.chips()) == 4
    assert stand.strip.more.accessibleName() == '2 new below'
    stand.beyond(True)  # begins again
    qtbot.mouseClick(acknowledge, Qt.LeftButton)
    assert [it.about for _, it in stand.wanted] == ['edge is above 335']
    stand.beyond(False)
    acknowledge.clearFocus()
    hover(stand, False)
    assert stand.chips()[0] is chip
    qtbot.waitUntil(lambda: stand.chips()[0] is not chip)
    assert not stand.strip.more.text()


def test_a_click_on_an_alarm_takes_no_focus(stand: Stand) -> None:
    stand.beyond(True)
    assert {it.focusPolicy() for it in stand.chips()[0].findChildren(QPushButton)} == {Qt.TabFocus}


def test_alarms_keep_their_places_under_the_mouse(stand: Stand, qtbot: Any) -> None:
    stand.beyond(True)
    stand.report('arm', NodeState.EXITED, -9)
    first, second = stand.texts()[:2]
    hover(stand, True)
    chips = stand.chips()
    stand.report('arm', NodeState.RUNNING)  # one alarm ends, and another one begins
    stand.report(RVIZ_PART, NodeState.EXITED, 1)
    assert stand.texts()[:2] == [first, second]
    assert stand.chips()[:len(chips)] == chips
    gone = next(it for it in chips if 'SIGKILL' in it.text.text())
    assert not any(it.isEnabled() for it in gone.findChildren(QPushButton))
    hover(stand, False)
    qtbot.waitUntil(lambda: len(stand.chips()) == len(stand.model.alarms) == 2)


def test_alarms_keep_their_places_while_a_message_box_has_the_mouse(stand: Stand,
                                                                    qtbot: Any) -> None:
    stand.beyond(True)
    hover(stand, True)
    (chip,) = stand.chips()
    box = QMessageBox(stand.strip.window())
    box.open()
    hover(stand, False)  # as Qt tells the strip
    stand.strip._rest.timeout.emit()
    stand.beyond(False)
    stand.report(RVIZ_PART, NodeState.EXITED, 1)
    assert stand.chips()[0] is chip
    QCursor.setPos(stand.strip.mapToGlobal(stand.strip.rect().bottomRight() + QPoint(50, 50)))
    box.close()
    stand.report('arm', NodeState.EXITED, 1)
    assert stand.chips()[0] is not chip


def test_no_button_moves_when_there_are_more_alarms_than_fit(stand: Stand, qtbot: Any) -> None:
    stand.strip.resize(400, stand.strip.height())
    stand.beyond(True)
    QApplication.processEvents()

    def places() -> List[int]:
        """The x coordinate of a button, and the y coordinate below the strip."""
        button = stand.chips()[0].findChild(QPushButton, 'alarm_acknowledge')
        return [button.mapTo(stand.strip, QPoint()).x(), stand.strip.height()]
    before = places()
    stand.report('arm', NodeState.EXITED, 1)
    stand.report(RVIZ_PART, NodeState.EXITED, 1)
    QApplication.processEvents()
    assert places() == before


def test_there_is_one_window_with_events(stand: Stand) -> None:
    for _ in range(2):
        EventsView.open(stand.model, stand.strip)
    assert len(stand.strip.findChildren(EventsView)) == 1


def test_a_chip_stays_while_its_text_changes(stand: Stand) -> None:
    stand.beyond(True)
    (chip,) = stand.chips()
    stand.now_s += 1.0
    stand.beyond(True, 'up to 430')
    assert stand.chips() == [chip]
    assert stand.texts() == ['arm: edge is above 335, up to 430']


def test_a_click_that_has_begun_counts_though_the_alarm_grows_worse(qtbot: Any) -> None:
    chip = AlarmChip()
    qtbot.addWidget(chip)
    wanted: List[Action] = []
    chip.action_wanted.connect(lambda action, _condition: wanted.append(action))
    hanging = Condition('arm', '', 'is late', Level.WARNING, (Action.RESTART_DEVICE,), 'arm')
    chip.show_alarm(Alarm(hanging, NOON_S), True, False)
    chip.show()
    (button,) = chip.findChildren(QPushButton)
    qtbot.mousePress(button, Qt.LeftButton)
    dead = Condition('arm', '', 'stopped', Level.BAD, (Action.RESTART_DEVICE, Action.SHOW_LOG),
                     'arm')
    chip.show_alarm(Alarm(dead, NOON_S), True, False)
    qtbot.mouseRelease(button, Qt.LeftButton)
    assert wanted == [Action.RESTART_DEVICE]
    assert [it.toolTip() for it in chip.findChildren(QPushButton)] == ['Restart device', 'Show log']


def test_a_dead_node_is_red_and_can_be_restarted(stand: Stand, qtbot: Any) -> None:
    stand.report('arm', NodeState.EXITED, -9)
    assert stand.texts()[0] == 'arm: driver killed by SIGKILL'
    buttons = {it.toolTip(): it for it in stand.chips()[0].findChildren(QPushButton)}
    assert list(buttons) == ['Restart device', 'Show log']
    qtbot.mouseClick(buttons['Show log'], Qt.LeftButton)
    action, condition = stand.wanted[0]
    assert (action, condition.part, condition.node) == (Action.SHOW_LOG, 'arm', '/arm/driver')


def test_rviz_that_has_died(stand: Stand) -> None:
    stand.report(RVIZ_PART, NodeState.EXITED, -11)
    assert [it.condition.actions[0] for it in stand.model.alarms] == [Action.RESTART_RVIZ]
    assert stand.model.alarms[0].condition.source == 'RViz'


def test_losses_of_the_recorder_are_amber(stand: Stand) -> None:
    stand.model.take_recorder(RecorderSnapshot('recording', dropped=3))
    assert stand.texts() == ['recording: messages are missing: 3 dropped']
    stand.model.take_recorder(RecorderSnapshot('idle', dropped=3))
    assert stand.texts() == []


def test_losses_end_with_a_recorder_that_has_died(stand: Stand) -> None:
    stand.report(BAG_PART, NodeState.RUNNING)
    stand.model.take_recorder(RecorderSnapshot('recording', lost=37))
    assert 'recording: messages are missing: 37 lost' in stand.texts()
    stand.report(BAG_PART, NodeState.EXITED, -9)
    assert not any('messages are missing' in it for it in stand.texts())


def test_the_strip_keeps_its_height(stand: Stand) -> None:
    height = stand.strip.height()
    stand.beyond(True)
    stand.report('arm', NodeState.EXITED, 1)
    stand.report(RVIZ_PART, NodeState.EXITED, 1)
    assert len(stand.chips()) == 4
    QApplication.processEvents()
    assert stand.strip.height() == height


def test_quitting_ends_all_alarms(stand: Stand) -> None:
    stand.report('arm', NodeState.EXITED, 1)
    stand.launch.phase = LaunchPhase.QUITTING
    stand.launch.changed.emit()
    assert stand.texts() == []


def test_alarms_at_the_position_of_a_recording(stand: Stand, qtbot: Any) -> None:
    stand.run(Mode.PLAYBACK)
    stand.beyond(True)  # a node's current report does not count
    assert stand.says_no_alarms()
    stand.model.set_recorded(RECORDED)
    assert stand.texts() == []
    assert stand.strip.summary.text() == (
        'No alarms here; the recording has 1, in color on the timeline')
    stand.model.take_position(8.0)
    (chip,) = stand.chips()
    assert chip.text.text() == '0:07.000  arm: edge is above 335, up to 424'
    qtbot.mouseClick(chip.findChild(QPushButton), Qt.LeftButton)
    assert (stand.wanted[0][0], stand.wanted[0][1].position_s) == (Action.GO_THERE, 7.0)
    stand.model.take_position(9.5)
    assert stand.texts() == []


# Events

def test_the_events_are_listed(stand: Stand, qtbot: Any) -> None:
    stand.model.set_recorded(RECORDED)
    view = EventsView(stand.model)
    qtbot.addWidget(view)
    text = view.findChild(QPlainTextEdit, 'events_text')
    assert text.toPlainText() == ('In the recording:\n'
                                  '0:07.000  arm: edge is above 335, up to 424, for 2.0 s')
    stand.model.note('mark: seam begins')
    assert text.toPlainText().endswith('  mark: seam begins')


def test_the_list_of_events_opens_at_the_newest(stand: Stand, qtbot: Any) -> None:
    for number in range(200):
        stand.model.note(f'mark: seam {number} ' + 40 * 'long ')
    view = EventsView(stand.model)
    qtbot.addWidget(view)
    view.show()
    bar = view.findChild(QPlainTextEdit, 'events_text').verticalScrollBar()
    qtbot.waitUntil(lambda: bar.maximum() > 0 and bar.value() == bar.maximum())


class Recording(QObject):
    """Recording model that the test sets."""

    changed = pyqtSignal()
    finished = pyqtSignal(str)
    broken_off = pyqtSignal(str)
    state = RecordingState()

    def become(self, **values: Any) -> None:
        self.state = self.state._replace(**values)
        self.changed.emit()


class DoneTasks:
    """Stand-in for Tasks that runs each task at once."""

    def run(self, _line: str, work: Any, _on_result: Any, on_error: Any) -> None:
        try:
            work()
        except BagError as error:
            on_error(error)


@pytest.fixture
def noted(stand: Stand) -> Tuple[Stand, Recording]:
    recording = Recording()
    EventNotes(DoneTasks(), stand.model, stand.launch, recording,  # type: ignore[arg-type]
               lambda: NOON_S + stand.now_s)
    return stand, recording


def test_launching_and_restarting(noted: Tuple[Stand, Recording]) -> None:
    stand, _ = noted
    for phase in (
        LaunchPhase.QUITTING,
        LaunchPhase.IDLE,
        LaunchPhase.LAUNCHING,
        LaunchPhase.RUNNING,
    ):
        stand.launch.phase = phase
        stand.launch.changed.emit()
    for state in (PartState.STOPPING, PartState.STOPPED, PartState.STARTING, PartState.RUNNING):
        stand.launch.reports = {'arm': PartReport('arm', state)}
        stand.launch.changed.emit()
    assert [event.text for event in stand.model.events] == [
        'quitting all nodes', 'all nodes have ended', 'launching in real-time mode: arm',
        'launched', 'arm is stopping', 'arm is starting']


def test_what_is_applied_is_noted_and_not_what_stays(noted: Tuple[Stand, Recording]) -> None:
    stand, _ = noted
    press = Device(DeviceType.OTHER, 'press', Location('cell.xml', 2))
    for change, said in (({'devices': (ARM, press)}, 'start press'),
                         ({'mode': Mode.PLAYBACK, 'bag': '/a/seam.bag'},
                          'change to playback; play seam.bag')):
        stand.run(Mode.REALTIME)
        stand.launch.apply(replace(stand.launch.running, **change))
        assert stand.model.events[-1].text == f'applying: {said}'



def test_events_are_saved_beside_the_bag(noted: Tuple[Stand, Recording], tmp_path: Path) -> None:
    stand, recording = noted
    stand.model.note('before')
    stand.now_s += 10.0
    path = str(tmp_path / 'seam.bag')
    recording.become(path=path)
    stand.beyond(True)
    recording.become(marks=(RecordedMark(1.0, 'seam begins'),))
    recording.become(path='')
    recording.finished.emit(path)
    lines = Path(events_path(path)).read_text(encoding='utf-8').splitlines()
    assert [line.split('  ')[1] for line in lines] == [
        'recording seam.bag', 'mark: seam begins', 'recorded seam.bag']


def test_events_of_a_recording_that_its_recorder_did_not_finish(
        noted: Tuple[Stand, Recording], tmp_path: Path) -> None:
    stand, recording = noted
    path, copy = str(tmp_path / 'seam.bag'), str(tmp_path / 'seam.reindexed.bag')
    recording.become(path=path)
    recording.become(marks=(RecordedMark(1.0, 'seam begins'),))
    recording.become(path='')
    recording.broken_off.emit(path)
    recording.become(path=str(tmp_path / 'next.bag'))  # before the first one is recovered
    recording.finished.emit(copy)
    lines = Path(events_path(path)).read_text(encoding='utf-8').splitlines()
    assert [line.split('  ')[1] for line in lines] == [
        'recording seam.bag', 'mark: seam begins', 'seam.bag was not finished']
    assert Path(events_path(copy)).read_text(encoding='utf-8').splitlines() == lines


def test_an_alarm_that_began_before_the_recording(noted: Tuple[Stand, Recording],
                                                  tmp_path: Path) -> None:
    stand, recording = noted
    stand.beyond(True)
    stand.now_s += 60.0
    path = str(tmp_path / 'seam.bag')
    recording.become(path=path)
    recording.finished.emit(path)
    assert 'arm: edge is above 335, up to 424 (already present when recording began)' in Path(
        events_path(path)).read_text(encoding='utf-8')


def test_where_events_cannot_be_saved(noted: Tuple[Stand, Recording], tmp_path: Path) -> None:
    stand, recording = noted
    recording.finished.emit(str(tmp_path / 'absent' / 'seam.bag'))
    assert 'seam.bag.events.txt' in stand.model.events[-1].text
    with pytest.raises(BagError):
        write_events(str(tmp_path / 'absent' / 'seam.bag'), '')


# A recording

def heated(high: float) -> Device:
    variable = Variable('/heat', 'data', 'oven', (1.0, 0.0, 0.0), (1.0, 0.0, 0.0), '', 1.0, 0.0,
                        'heat', Location('cell.xml', 1),
                        limits=WarningLimits(None, high, (1.0, 0.0, 0.0)))
    return Device(DeviceType.OTHER, 'oven', Location('cell.xml', 1), variables=(variable,))


def test_alarms_of_a_recording_follow_the_limits(qtbot: Any, tmp_path: Path) -> None:
    path = str(tmp_path / 'a.bag')
    with rosbag.Bag(path, 'w') as bag:
        for number in range(500):
            bag.write('/heat', Float64(number), Time.from_sec(1000.0 + number / 50))
    tasks = HeldTasks()
    session = Session()
    model = CurvesModel(tasks, session)
    choose(session, [heated(1e6)])
    play(session, path)
    model.read()
    while tasks.held:
        tasks.end_one()
    assert (len(model.curves), model.alarms) == (1, ())
    choose(session, [heated(250.0)])
    while tasks.held:
        tasks.end_one()
    (alarm,) = model.alarms
    assert (alarm.text, round(alarm.begin_s, 1)) == ('heat is above 250, up to 499', 5.0)


def test_a_lost_master_stays_an_alarm_when_the_nodes_are_quit(stand: Stand) -> None:
    stand.states.take_look(CellLook(master_problem=MASTER_SILENT))
    stand.model.set_master(is_lost=True, is_other=False)
    assert stand.texts() == [f'ROS master {MASTER_SILENT}']
    stand.launch.phase, stand.launch.running = LaunchPhase.IDLE, None
    stand.states.take_look(CellLook())
    stand.launch.changed.emit()
    assert stand.texts() == ['ROS master is not responding; restart the launcher ("Launch nodes" '
                             'offers this)']
    assert len(stand.model.events) == 1, 'it goes on'
    stand.model.set_master(is_lost=False, is_other=False)
    assert stand.says_no_alarms()
    assert 'quit' not in stand.model.events[-1].text


def test_a_cloud_that_does_not_come_is_an_alarm_unless_it_is_said_why(stand: Stand) -> None:
    def say(severity: 'Severity | None') -> None:
        stand.said.take_state(f'/{SCENE_WATCH}', 'points of arm', severity, 'no cloud is arriving',
                              stand.now_s, {STALE_POINTS_KEY: 'arm', 'for_s': '2.5'})
        stand.warnings.look()

    say(Severity.WARNING)
    assert stand.texts() == ['arm: no cloud is arriving']
    assert stand.model.alarms[0].since_s == NOON_S + stand.now_s - 2.5, 'the last cloud came then'
    say(None)
    assert stand.says_no_alarms()
    assert stand.model.events[-1].text.startswith(
        'arm: no cloud is arriving: clouds are arriving again')
    stand.report('arm', NodeState.EXITED, 1)
    say(Severity.WARNING)
    assert 'arm: no cloud is arriving' not in stand.texts()
    stand.report('arm', NodeState.RUNNING)
    say(Severity.WARNING)
    stand.report('arm', NodeState.EXITED, 1)  # the reason comes later: there is still no cloud
    assert 'arm: no cloud is arriving' in stand.texts()
    say(None)
    assert 'arm: no cloud is arriving' not in stand.texts()
    assert 'clouds are arriving again' in stand.model.events[-1].text


@pytest.mark.parametrize('missing', ['cloud', 'topic'])
def test_data_that_a_launch_delays_is_no_alarm_but_one_from_before_stays(
        stand: Stand, missing: str) -> None:
    topic = Topic('/arm/q', None, None, True, Location('cell.xml', 1))
    stand.launch.running = replace(stand.launch.running, devices=(replace(ARM, topics=(topic,)),))
    for messages in range(0, 100, 10):  # learns the usual rate
        stand.states.take_recorder(RecorderSnapshot('idle', topics=(
            seen('/arm/q', messages=messages),)))

    def say(is_missing: bool) -> None:
        if missing == 'cloud':
            stand.said.take_state(f'/{SCENE_WATCH}', 'points of arm',
                                  Severity.WARNING if is_missing else None, 'no cloud is arriving',
                                  stand.now_s, {STALE_POINTS_KEY: 'arm', 'for_s': '0.0'})
            stand.warnings.look()
        else:
            stand.states.take_recorder(RecorderSnapshot('idle', topics=(
                seen('/arm/q', 0.0, 60.0, messages=100) if is_missing
                else seen('/arm/q', messages=110),)))

    def launch(phase: LaunchPhase) -> None:
        stand.launch.phase = phase
        stand.launch.changed.emit()

    say(False)
    launch(LaunchPhase.LAUNCHING)
    say(True)
    assert stand.says_no_alarms()
    launch(LaunchPhase.RUNNING)
    assert len(stand.texts()) == 1
    launch(LaunchPhase.LAUNCHING)  # an Apply
    assert len(stand.texts()) == 1
    say(False)
    assert stand.says_no_alarms()


def test_a_node_that_is_started_again_and_again_stays_an_alarm(stand: Stand) -> None:
    def driver(restarts: int, state: NodeState, code: 'int | None' = None) -> None:
        node = NodeReport('/arm/driver', state, code, restarts)
        stand.launch.reports = {'arm': PartReport('arm', PartState.RUNNING, (node,))}
        stand.launch.changed.emit()

    for restarts in range(3):
        driver(restarts, NodeState.EXITED, 3)
        driver(restarts + 1, NodeState.RUNNING)
    count = len(stand.model.events)
    assert stand.texts() == ['arm: driver ended with code 3, and was started again 3 times']
    stand.now_s += STEADY_AFTER_S
    stand.model.look()
    assert stand.says_no_alarms()
    assert len(stand.model.events) == count + 1
