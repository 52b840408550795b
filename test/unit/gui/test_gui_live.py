# SPDX-License-Identifier: BSD-3-Clause
"""The curves of the running cell: model and panel, with a list as the recorder's memory."""
from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any, List, Optional, Sequence, Tuple

import numpy as np
import pytest
from cycle_bags import write_bag
from held_tasks import HeldTasks
from playback_stand import PlaybackStand
from PyQt5.QtCore import QObject, QPoint, QPointF, Qt, pyqtSignal
from PyQt5.QtGui import QColor, QWheelEvent
from PyQt5.QtTest import QTest
from PyQt5.QtWidgets import QApplication
from pytestqt.qtbot import QtBot
from recent_parts import part_of, parts_of
from session_stand import open_cell, run
from timeline_bench import TRACK_Y

from process_visualizer.bagio.message_definition import Connection
from process_visualizer.bagio.recorder_topics import MARKS
from process_visualizer.cell.model import Mode
from process_visualizer.cell.xml_parser import XmlParser
from process_visualizer.clients.service_connection import ServiceUnreachable
from process_visualizer.curves.live_curves import RecentPart
from process_visualizer.gui.compare.compare_model import CompareModel
from process_visualizer.gui.compare.live_comparison_model import LiveComparisonModel
from process_visualizer.gui.lanes import lane_picture
from process_visualizer.gui.lanes.lane_choice import LaneChoices
from process_visualizer.gui.lanes.timeline_lanes import lane_of, lane_texts
from process_visualizer.gui.live.live_curves_model import LiveCurvesModel
from process_visualizer.gui.live.live_panel import LivePanel
from process_visualizer.gui.live.live_timeline import LiveValue
from process_visualizer.gui.live.replay_model import ReplayPhase
from process_visualizer.gui.session import Session
from process_visualizer.gui.toolkit.theme import theme
from process_visualizer.health.device_state import Level
from process_visualizer.health.near_objects import NearSpan
from process_visualizer.launching.part_report import PartState

MARK = Connection(MARKS, 'std_msgs/String', '', 'string data', False, '/recorder')


class ListedMemory:
    """Memory that returns one part per request; an exception in the list is raised."""

    def __init__(self) -> None:
        self.parts: List[Any] = []
        self.asked: List[Tuple[str, ...]] = []
        self.restarts = 0

    def read(self, topics: Sequence[str]) -> Tuple[RecentPart, bool]:
        self.asked.append(tuple(topics))
        found = self.parts.pop(0)
        if isinstance(found, Exception):
            raise found
        return found

    def restart(self) -> None:
        self.restarts += 1


class Replay(QObject):
    """Stand-in for ReplayModel."""

    changed = pyqtSignal()
    copied = pyqtSignal()

    def __init__(self) -> None:
        super().__init__()
        self.playback = PlaybackStand().model
        self.phase, self.time_s, self.trouble = ReplayPhase.LIVE, 0.0, ''

    @property
    def is_live(self) -> bool:
        return self.phase is ReplayPhase.LIVE

    def leave(self) -> None:
        self.phase = ReplayPhase.LIVE
        self.changed.emit()


class Replayed(QObject):
    """Stand-in for ValuesModel: the same value for all curves; None if unknown."""

    changed = pyqtSignal()
    number: Optional[float] = 12.5

    def value(self, _key: Any) -> Optional[float]:
        return self.number


class Stand:
    """Panel of a cell with three variables."""

    def __init__(self, qtbot: QtBot, folder: Path) -> None:
        self.now_s = 0.0
        self.parts = list(parts_of(write_bag(folder), 8.0))
        self.tasks, self.memory, self.choices = HeldTasks(), ListedMemory(), LaneChoices()
        self.session = Session()
        self.model = LiveCurvesModel(  # type: ignore[arg-type]
            self.tasks, self.memory, self.session)
        self.replay = Replay()
        self.tasks_of_runs = HeldTasks()
        self.compare = CompareModel(  # type: ignore[arg-type]
            self.tasks_of_runs, self.session)
        self.comparison = LiveComparisonModel(self.compare, self.model)
        self.replayed = Replayed()
        self.panel = LivePanel(self.model, self.choices, self.replay,  # type: ignore[arg-type]
                               self.comparison, self.replayed,  # type: ignore[arg-type]
                               wall_s=lambda: self.now_s)
        self.wanted: List[float] = []
        self.panel.replay_wanted.connect(self.wanted.append)
        qtbot.addWidget(self.panel)
        self.panel.resize(900, 300)
        open_cell(self.session, XmlParser().parse(str(folder / 'cell.xml')))
        self.panel.show()
        qtbot.waitExposed(self.panel)

    @property
    def timeline(self) -> Any:
        return self.panel.timeline

    def come(self, *parts: Any) -> None:
        """Deliver parts; the last one ends the request."""
        self.memory.parts += [(it, row + 1 < len(parts)) if isinstance(it, RecentPart) else it
                              for row, it in enumerate(parts)]
        if not self.model.is_running:
            run(self.session, Mode.REALTIME)
        elif self.model._timer.isActive():
            self.model._timer.timeout.emit()
        self.tasks.end_all()


@pytest.fixture
def stand(qtbot: QtBot, tmp_path: Path) -> Stand:
    return Stand(qtbot, tmp_path)


def test_ticks_that_are_not_applied_leave_the_curves_alone(stand: Stand) -> None:
    stand.come(stand.parts[0])
    lanes, restarts = len(stand.timeline.stack.lanes), stand.memory.restarts
    stand.session.choose(())
    stand.come(stand.parts[1])
    assert (len(stand.timeline.stack.lanes), stand.memory.restarts) == (lanes, restarts)
    assert lanes == 3
    run(stand.session, Mode.REALTIME)  # applied
    stand.tasks.end_all()
    assert stand.memory.restarts == restarts + 1


def test_curves_are_drawn_as_they_come(stand: Stand) -> None:
    assert 'while they run' in stand.panel.state.text()
    stand.come(stand.parts[0])
    assert stand.memory.asked[-1] == ('/feed', '/ft', MARKS, '/tcf', '/tf_static')
    assert [lane.label for lane in stand.timeline.stack.lanes] == [
        'arm  tool speed v', 'arm  tool force F', 'machine  feed']
    assert stand.panel.state.text() == ''
    before = stand.timeline.stack.lanes[2]
    assert stand.timeline.lane_texts(2).at_position == '0.05 m/s'
    stand.come(stand.parts[1])
    assert stand.timeline.stack.lanes[2].at(0.99) == before.at(0.99) == pytest.approx(0.05)
    assert stand.timeline.stack.lanes[2].at(0.8) == 0.0  # 6 s ago, in the pause


def test_what_comes_in_several_parts_is_one_picture(stand: Stand) -> None:
    shown: List[int] = []
    stand.model.changed.connect(lambda: shown.append(len(stand.timeline.stack.lanes)))
    stand.come(*stand.parts)
    assert shown[-1] == 3 and shown.count(3) == 1


def test_it_is_held_and_goes_on(stand: Stand) -> None:
    stand.come(stand.parts[0])
    QTest.mouseClick(stand.panel.hold, Qt.LeftButton)
    held = stand.model.window
    stand.come(stand.parts[1])
    assert stand.model.window is held and 'On hold' in stand.panel.state.text()
    QTest.mouseClick(stand.panel.hold, Qt.LeftButton)
    stand.come(stand.parts[2])
    assert stand.model.window is not held
    assert stand.timeline.stack.lanes[2].at(0.6) == 0.0  # nothing was lost in the meantime


def test_the_present_moves_away_from_curves_that_stand_still(stand: Stand) -> None:
    stand.come(stand.parts[0])
    assert stand.timeline.time_text(0.0, 0) == 'now'
    stand.now_s = stand.panel._end_s() + 1.5
    QTest.mouseClick(stand.panel.hold, Qt.LeftButton)
    assert stand.timeline.time_text(-2.0, 2) == '−3.50 s'
    assert stand.panel._clock.isActive()
    stand.now_s += 1.0
    stand.panel._clock.timeout.emit()
    assert stand.timeline.time_text(-2.0, 2) == '−4.50 s'
    QTest.mouseClick(stand.panel.hold, Qt.LeftButton)
    assert stand.timeline.time_text(0.0, 0) == 'now' and not stand.panel._clock.isActive()


@pytest.mark.parametrize('time_s, on_axis, at_mouse', [
    (-7.05, '−7 s', '−7.05 s'), (-120.93, '−2:01 min', '−2:00.93 min'),
    (-120.0, '−2:00 min', '−2:00.00 min'), (-119.999, '−2:00 min', '−2:00.00 min'),
    (-69.96, '−1:10 min', '−1:09.96 min'), (-0.004, 'now', 'now')])
def test_times_are_written_alike_on_the_axis_and_at_the_mouse(
        stand: Stand, time_s: float, on_axis: str, at_mouse: str) -> None:
    texts = [stand.timeline.time_text(time_s, decimals) for decimals in (0, 2)]
    assert texts == [on_axis, at_mouse]


def test_nobody_who_does_not_look_is_read_to(stand: Stand) -> None:
    stand.come(stand.parts[0])
    stand.panel.hide()
    assert not stand.model._timer.isActive()
    stand.memory.parts.append((stand.parts[1], False))
    stand.panel.show()
    stand.tasks.end_all()
    assert stand.memory.parts == []


def test_a_recorder_that_is_silent_is_told_and_asked_again(stand: Stand) -> None:
    stand.come(ServiceUnreachable('gone'))
    assert 'is not responding' in stand.panel.state.text()
    stand.come(stand.parts[0])
    assert stand.panel.state.text() == ''


def test_a_silent_recorder_leaves_no_old_values_as_if_they_were_present(stand: Stand) -> None:
    stand.come(stand.parts[0])
    stand.now_s = stand.panel._end_s() + 4.0
    stand.come(ServiceUnreachable('gone'))
    assert stand.timeline.time_text(0.0, 0) == '−4 s'
    assert stand.timeline.lane_texts(2).at_position == 'no data for 4 s'
    stand.now_s += 3.0
    stand.panel._clock.timeout.emit()
    assert stand.timeline.time_text(0.0, 0) == '−7 s'
    stand.come(stand.parts[1])
    assert stand.timeline.time_text(0.0, 0) == 'now'
    assert stand.timeline.lane_texts(2).at_position == '0.05 m/s'


def test_on_hold_a_silence_is_that_of_the_held_moment(stand: Stand) -> None:
    stand.come(stand.parts[0])
    key = stand.timeline.stack.lanes[2].curves[0].key
    stand.timeline._values = {**stand.timeline._values, key: LiveValue(np.nan, 5.0)}
    stand.model.hold(True)
    stand.timeline._values = {**stand.timeline._values, key: LiveValue(np.nan, 5.0)}
    stand.now_s = stand.panel._end_s() + 8.0
    stand.panel._clock.timeout.emit()
    assert stand.timeline.time_text(0.0, 0) == '−8 s'
    assert stand.timeline.lane_texts(2).at_position == 'no data for 5 s'


def test_curves_end_at_their_data_before_it_is_known_that_the_recorder_hangs(
        stand: Stand) -> None:
    stand.come(stand.parts[0])
    stand.model._timer.timeout.emit()  # asks a recorder that does not answer
    assert stand.timeline.time_text(0.0, 0) == 'now'
    stand.now_s = stand.panel._end_s() + 1.0
    stand.model._late.timeout.emit()
    assert stand.timeline.time_text(0.0, 0) == '−1 s'
    assert stand.timeline.lane_texts(2).at_position == 'no data for 1 s'
    assert stand.panel.state.text() == ''
    stand.now_s += 1.0
    stand.panel._clock.timeout.emit()
    assert stand.timeline.time_text(0.0, 0) == '−2 s'
    stand.memory.parts.append((stand.parts[1], False))
    stand.tasks.end_all()
    assert stand.timeline.time_text(0.0, 0) == 'now'
    assert stand.timeline.lane_texts(2).at_position == '0.05 m/s'


def test_a_recorder_that_has_ended_is_not_said_to_go_on_by_itself(stand: Stand) -> None:
    stand.come(stand.parts[0])
    run(stand.session, Mode.REALTIME, PartState.FAILED)
    assert stand.panel.state.text() == (
        'The recorder has ended. Restart it from its alarm to continue the curves')
    run(stand.session, Mode.REALTIME)
    assert stand.panel.state.text() == ''


def test_a_moved_device_keeps_its_curves(stand: Stand, tmp_path: Path) -> None:
    """To save a calibration cleared them, as the configuration is another one then."""
    stand.come(stand.parts[0])
    before = stand.model.window
    text = (tmp_path / 'cell.xml').read_text(encoding='utf-8')

    def change(old: str, new: str) -> None:
        other = tmp_path / 'saved.xml'
        other.write_text('\n' + text.replace(old, new), encoding='utf-8')
        cell = XmlParser().parse(str(other))
        open_cell(stand.session, cell)
        run(stand.session, Mode.REALTIME)

    change('xyz="1 0 0"', 'xyz="1.02 0 0"')
    assert stand.model.window is before is not None
    change('label="feed"', 'label="rate"')
    assert stand.model.window is None


def test_an_end_leaves_the_last_picture_and_a_launch_begins_anew(stand: Stand) -> None:
    stand.come(stand.parts[0])
    run(stand.session, None)
    assert len(stand.timeline.stack.lanes) == 3 and 'Stopped' in stand.panel.state.text()
    restarts = stand.memory.restarts
    stand.come(stand.parts[1])
    assert stand.memory.restarts == restarts + 1
    assert stand.timeline.stack.lanes[2].at(0.5) != stand.timeline.stack.lanes[2].at(0.5)  # NaN


@pytest.mark.parametrize('before', [(part_of((), [], 10 ** 9), False),
                                    ServiceUnreachable('it has ended')])
def test_a_look_at_the_recorder_before_says_nothing_about_the_new_one(qtbot: QtBot,
                                                                      before: Any) -> None:
    tasks, memory, session = HeldTasks(), ListedMemory(), Session()
    model = LiveCurvesModel(tasks, memory, session)  # type: ignore[arg-type]
    judged: List[Any] = []
    model.judged.connect(judged.append)
    model.set_judged(True)
    memory.parts = [before, (part_of((), [], 2 * 10 ** 9), False)]
    run(session, Mode.REALTIME)
    tasks.end_one()
    run(session, None)
    run(session, Mode.REALTIME)
    tasks.end_one()  # the request that was in progress
    assert (judged, model.window, model.problem) == ([], None, '')
    tasks.end_all()
    assert len(judged) == 1 and model.window is not None and model.problem == ''
    assert memory.restarts == 2 and memory.parts == []


def test_more_of_the_past_by_wheel_and_list(stand: Stand) -> None:
    stand.come(stand.parts[0])
    turn = QWheelEvent(QPointF(200, 20), QPointF(200, 20), QPoint(), QPoint(0, -120),
                       Qt.NoButton, Qt.NoModifier, Qt.NoScrollPhase, False)
    stand.memory.parts.append((stand.parts[1], False))
    QApplication.sendEvent(stand.timeline, turn)
    stand.tasks.end_all()
    assert stand.model.duration_s == 60.0 and stand.panel.durations.currentText() == '1 min'
    assert stand.model.window is not None and stand.model.window.duration_s == 60.0
    row = stand.panel.durations.findText('10 min')
    stand.memory.parts.append((stand.parts[2], False))
    stand.panel.durations.setCurrentIndex(row)
    stand.panel.durations.activated.emit(row)
    stand.tasks.end_all()
    assert stand.model.window.duration_s == 600.0
    stand.model.set_duration(120.0)  # the value of the last session
    assert stand.panel.durations.currentText() == '2 min'
    stand.model.set_duration(None)  # there was none
    assert stand.model.duration_s == 120.0


def test_a_curve_is_hidden_and_the_choice_is_that_of_playback(stand: Stand) -> None:
    stand.come(stand.parts[0])
    stand.timeline.menu_at(1).actions()[0].trigger()
    assert [lane.label for lane in stand.timeline.stack.lanes] == [
        'arm  tool speed v', 'machine  feed']
    assert ('arm', 'F', '/ft') in stand.choices.choice.hidden


def test_values_at_the_mouse_and_marks(stand: Stand) -> None:
    stand.come(stand.parts[0])
    x = stand.timeline.axis.x(-7.5)
    QTest.mouseMove(stand.timeline, QPoint(round(x), 100))
    stand.timeline._hover_x = x
    assert float(stand.timeline.lane_texts(2).at_mouse) == 0.0
    last = stand.parts[0]
    text = b'leather in'
    stand.come(part_of((*last.connections, MARK), [(
        len(last.connections), last.now_ns + 10 ** 9, len(text).to_bytes(4, 'little') + text)],
        last.now_ns + 3 * 10 ** 9))
    mark, = stand.timeline._marks
    assert mark.label == 'leather in' and mark.position_s == pytest.approx(-2.0, abs=0.05)
    assert not stand.timeline.grab().isNull()


def test_a_drag_wants_a_replay_of_what_is_under_the_mouse_and_holds_the_curves(
        stand: Stand) -> None:
    stand.come(*stand.parts)
    timeline, window = stand.timeline, stand.model.window
    end_s = window.epoch_s + window.begin_s + window.duration_s
    point = QPoint(int(timeline.axis.x(-10.0)), 40)
    QTest.mousePress(timeline, Qt.LeftButton, pos=point)
    QTest.mouseRelease(timeline, Qt.LeftButton, pos=point)
    assert stand.wanted == [pytest.approx(end_s - 10.0, abs=0.1)]
    assert stand.model.is_held
    stand.replay.phase, stand.replay.time_s = ReplayPhase.SHOWN, end_s - 10.0
    stand.replay.changed.emit()
    assert not stand.panel.replay.isHidden()
    assert timeline._replay_s == pytest.approx(-10.0)
    assert timeline.lane_texts(0).at_position != ''
    assert timeline.lane_texts(0).at_position.startswith('12.5'), 'as in the scene'
    stand.replayed.number = None
    assert timeline.lane_texts(0).at_position.startswith('…')
    timeline.show_replay(-10.0)
    stand.panel.replay.back.click()
    stand.replay.leave()
    assert not stand.model.is_held and timeline._replay_s is None


@pytest.mark.parametrize(('away_s', 'x'), [(-45.0, 0.0), (12.0, 1.0)])
def test_a_replayed_moment_beside_the_curves_has_no_line_in_them(stand: Stand, away_s: float,
                                                                 x: float) -> None:
    """It stood at the edge, so that the curves seemed to be those of the scene."""
    stand.come(*stand.parts)
    timeline, color = stand.timeline, QColor(theme().warning)
    axis = timeline.axis

    def colored(moment_s: float) -> 'tuple[bool, bool]':
        timeline.show_replay(moment_s)
        image = timeline.grab().toImage()
        edge = round(axis.left + x * axis.width)
        line = any(image.pixelColor(column, timeline.height() - 20) == color
                   for column in range(edge - 3, edge + 3) if column < image.width())
        return line, any(image.pixelColor(column, row) == color for row in range(19, 34)
                         for column in range(int(axis.left), int(axis.right)))

    assert colored(-timeline._duration_s if x == 0.0 else 0.0) == (True, False)
    assert colored(away_s) == (False, True)


def test_a_replay_goes_on_behind_the_curves_that_were_held(stand: Stand) -> None:
    """The recorder copies its memory slightly later than the curves are held."""
    stand.come(*stand.parts[:-1])
    stand.model.hold(True)
    held = stand.model.window
    stand.come(stand.parts[-1])
    assert stand.model.window is held
    stand.replay.copied.emit()
    copied = stand.model._newest
    stand.come(stand.parts[-1])  # the replay is ready much later
    end_s = held.epoch_s + held.begin_s + held.duration_s
    stand.replay.phase, stand.replay.time_s = ReplayPhase.SHOWN, end_s + 0.2
    stand.replay.changed.emit()
    assert stand.model.is_held and stand.model.window is copied is not held
    assert -stand.model.duration_s < stand.timeline._replay_s <= 0.0
    assert stand.timeline.lane_texts(0).at_position[0] != '…'


def test_keys_after_a_click_on_the_curves_are_not_for_the_list_above(stand: Stand) -> None:
    stand.come(*stand.parts)
    QApplication.setActiveWindow(stand.panel)
    assert stand.panel.focusWidget() is stand.timeline
    QTest.keyClick(stand.panel.focusWidget(), Qt.Key_End)
    assert stand.panel.durations.currentIndex() == 0
    stand.panel.durations.setFocus()
    QTest.mousePress(stand.timeline, Qt.LeftButton, pos=QPoint(300, 40))
    assert stand.panel.focusWidget() is stand.timeline


def test_without_a_cell_there_is_no_replay(stand: Stand) -> None:
    stand.come(*stand.parts)
    run(stand.session, None)
    QTest.mousePress(stand.timeline, Qt.LeftButton, pos=QPoint(300, 40))
    assert stand.wanted == [] and not stand.model.is_held

def test_objects_near_robots_are_bars_below_the_slider(stand: Stand) -> None:
    stand.come(*stand.parts)
    end_s = stand.panel._end_s()
    stand.panel.set_near([NearSpan('kinect', Level.WARNING, end_s - 3.0, end_s - 1.0),
                          NearSpan('kinect', Level.BAD, end_s - 2.0, end_s - 1.5)])
    assert [(it.level, round(it.begin_s, 3)) for it in stand.timeline.near] == [
        (Level.WARNING, -3.0), (Level.BAD, -2.0)]
    picture, below = stand.timeline.grab().toImage(), TRACK_Y + 9
    colors = [picture.pixelColor(round(stand.timeline.axis.x(at_s)), below).name()
              for at_s in (-3.5, -2.5, -1.7, -1.2)]
    assert colors[1:] == [theme().warning, theme().bad, theme().warning]
    assert colors[0] not in (theme().warning, theme().bad)


def test_a_replay_moves_no_curve(stand: Stand) -> None:
    stand.come(stand.parts[0])
    QApplication.processEvents()
    before = stand.timeline.mapTo(stand.panel, QPoint())
    stand.panel.replay.show()
    stand.panel.layout().activate()
    assert stand.timeline.mapTo(stand.panel, QPoint()) == before


def test_a_curve_without_values_in_sight_keeps_its_decimals() -> None:
    nothing = lane_of('speed', 'm/s', (0.0, 1.0, 0.0), np.full(4, np.nan), np.full(4, np.nan), 1.0)
    assert lane_texts(nothing, 0.02, 0.06, None).at_position == '0.0600 m/s'


def test_a_lane_that_is_not_redrawn_in_time_shows_its_values_at_their_time(
        qtbot: QtBot, stand: Stand, monkeypatch: pytest.MonkeyPatch) -> None:
    stand.panel.resize(900, 500)
    monkeypatch.setattr(lane_picture, '_TURN_S', -1.0)  # one lane per paint event
    timeline = stand.timeline

    def show(now_s: float) -> None:
        pulse = np.where(np.arange(100) == round(175.0 - now_s), 1.0, 0.0)
        lanes = [lane_of(name, 'N', (1.0, 0.0, 0.0), pulse, pulse, 1.0) for name in 'ab']
        lanes = [replace(it, key=('', it.label, '')) for it in lanes]
        timeline.show_lanes(100.0, lanes, {it.key: LiveValue(0.0, 0.0) for it in lanes}, (), now_s)

    def pulses() -> List[float]:
        """Return the position of the pulse in each lane [px]."""
        image = timeline.grab().toImage()
        found = []
        for row in range(2):
            place = timeline.lane_rect(row)
            y = place.bottom() - place.height() // 3
            red = [x for x in range(place.left() + 40, place.right())
                   for color in [image.pixelColor(x, y)] if color.red() > color.green() + 60]
            found.append(sum(red) / max(len(red), 1))
        return found

    show(100.0)
    QApplication.processEvents()
    qtbot.waitUntil(lambda: timeline.stack.is_drawn)
    before = pulses()
    assert before[0] == pytest.approx(before[1], abs=1.0) and before[0] > 0.5 * timeline.width()
    show(150.0)
    after = pulses()
    assert after[0] == pytest.approx(after[1], abs=3.0) and after[0] < 0.5 * timeline.width()
