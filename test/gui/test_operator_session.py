# SPDX-License-Identifier: BSD-3-Clause
"""A session of an operator with the simulated cell, from the first tick to the last click."""
from __future__ import annotations

import re
from pathlib import Path
from typing import Any, Iterator, List, Optional, Sequence, Set

import pytest
import rospy
from operator_at_work import Operator, nodes, processes, registrations
from PyQt5.QtCore import QPoint, Qt
from PyQt5.QtWidgets import QDoubleSpinBox, QTreeWidget

from process_visualizer.bags.catalogue import read_catalogue
from process_visualizer.curves.live.live_curves import LiveWindow
from process_visualizer.gui.models.recording.live_curves_model import LiveCurvesModel
from process_visualizer.gui.models.recording.recording_types import Phase
from process_visualizer.gui.ros.snapshots import DisplaySnapshot, PlayerSnapshot
from process_visualizer.gui.views.cell.devices_view import DevicesView
from process_visualizer.gui.views.live.live_timeline import LiveTimeline
from process_visualizer.ros_names import PLAYBACK_RATE
from process_visualizer.rviz.window_geometry import Rectangle

CONFIG = str(Path(__file__).parents[2] / 'sewing_cell' / 'devices' / 'simulated.xml')
RECORDED_S = 10.0
LAUNCH_S = 60.0
REALTIME = 'In real-time mode.'
"""What nodes say follows, as that of the simulator where the computer is too busy for it."""
RVIZ = Rectangle(460, 0, 1140, 620)


@pytest.fixture
def operator(qtbot: Any) -> Iterator[Operator]:
    person = Operator(qtbot)
    yield person
    person.close()


class Player:
    """What the player says, beside the window."""

    def __init__(self, operator: Operator) -> None:
        self._operator = operator
        self.states: List[PlayerSnapshot] = []
        operator.launcher.link.player_state.connect(self.states.append)

    @property
    def now(self) -> Optional[PlayerSnapshot]:
        return self.states[-1] if self.states else None

    def next(self) -> PlayerSnapshot:
        """A state that comes after now."""
        count = len(self.states)
        self._operator.wait(lambda: len(self.states) > count, 'a state of the player')
        return self.states[-1]

    def wait(self, condition: Any, what: str) -> PlayerSnapshot:
        self._operator.wait(lambda: self.now is not None and condition(self.now), what)
        assert self.now is not None
        return self.now


def shown_position_s(operator: Operator) -> float:
    """The position as the window writes it."""
    match = re.search(r'(\d+):(\d\d\.\d\d\d)', operator.text('time'))
    assert match is not None, operator.text('time')
    return 60.0 * int(match[1]) + float(match[2])


def test_session(operator: Operator, tmp_path: Path) -> None:
    player = Player(operator)
    open_the_cell(operator)
    launch(operator)
    save_the_view(operator)
    follow_the_curves(operator)
    bag = record(operator, tmp_path)
    shown_by = operator.beside(shown_by_whom)
    play_back(operator, bag)
    assert operator.beside(shown_by_whom) == shown_by != set()
    pause_and_play(operator, player)
    step(operator, player)
    scrub(operator, player)
    change_speed(operator, player)
    loop(operator, player)
    leave_a_topic_out(operator, player)
    backwards(operator, player)
    to_live_and_back(operator, player)
    assert operator.beside(shown_by_whom) == shown_by
    quit_all(operator)
    operator.close()
    assert {it for it in processes('GUI_TEST_MARK') if 'Xvfb' not in it} == set()
    blocks = operator.blocks()
    assert not blocks, '\n'.join(blocks)


def open_the_cell(operator: Operator) -> None:
    operator.launcher.cell.open(CONFIG, {'image_rate': '10'})
    devices = operator.widget('devices', DevicesView)
    operator.wait(lambda: devices.topLevelItemCount() == 6, 'six devices')
    operator.wait(lambda: operator.widget('launch').isEnabled(), 'the master')
    assert operator.text('status') == 'Idle'
    kinect = devices.topLevelItem(2)
    assert kinect.text(0) == 'kinect (depth_sensor)'
    operator.click_check_box(devices, kinect)
    assert [device.name for device in operator.launcher.cell.chosen] == [
        'ur_rt_upper', 'ur_rt_lower', 'sewing_machine', 'cell_stand', 'simulator']


def launch(operator: Operator) -> None:
    displays: List[Any] = []
    operator.launcher.link.displays.connect(lambda found: displays.append(found))
    operator.click('launch')
    assert operator.text('status') == 'Launching nodes…'
    operator.wait(lambda: operator.text('status').startswith(REALTIME), 'everything is up',
                  LAUNCH_S)
    assert operator.text('launch') == 'Quit all nodes'
    found = operator.beside(nodes)
    assert {'/rviz', '/bag_recorder', '/cell_frames', '/ur_rt_upper/robot_proc',
            '/sewing_machine/sewing_machine', '/simulator'} <= found
    assert '/kinect/depth_proc' not in found
    devices = operator.widget('devices', DevicesView)
    operator.wait(lambda: devices.state_text('ur_rt_upper') == 'running', 'the robot runs')
    assert devices.state_text('kinect') == ''
    topics = devices.topLevelItem(0)
    operator.wait(lambda: any(re.fullmatch(r'1[12]\d\u2009Hz', topics.child(row).text(1))
                              for row in range(topics.childCount())), 'a topic of 125 Hz')
    operator.wait(lambda: bool(displays) and not bad(displays[-1]), 'every display of RViz is OK',
                  LAUNCH_S, lambda: displays and bad(displays[-1]))


def save_the_view(operator: Operator) -> None:
    """What RViz says of itself: where there is little room, it shows the scene and no lists."""
    view = operator.launcher.view
    view.save('mine')
    operator.wait(lambda: view.chosen == 'mine', 'the view is saved')
    geometry = (view.content or {})['Window Geometry']
    assert (geometry['X'], geometry['Width']) == (RVIZ.x, RVIZ.width)
    assert geometry['Hide Left Dock'] and geometry['Hide Right Dock']
    view.choose(None)
    operator.wait(lambda: view.chosen is None, 'the generated view is chosen')


def follow_the_curves(operator: Operator) -> None:
    model, timeline = operator.launcher.live, operator.widget('live_timeline', LiveTimeline)
    names = ['ur_rt_upper  tool speed v', 'ur_rt_upper  tool force F', 'ur_rt_lower  tool speed v',
             'ur_rt_lower  tool force F', 'sewing_machine  feed', 'sewing_machine  upper edge',
             'sewing_machine  lower edge']
    operator.wait(lambda: set(names) <= {lane.label for lane in timeline.stack.lanes}, 'curves',
                  instead=lambda: [lane.label for lane in timeline.stack.lanes])
    assert not operator.text('live_state') and timeline.isVisible()
    begins_s: List[float] = []

    def note() -> None:
        begins_s.append(shown(model).begin_s)

    model.changed.connect(note)
    operator.wait(lambda: len(begins_s) >= 10, 'they go on')
    model.changed.disconnect(note)
    assert 0.05 < begins_s[-1] - begins_s[0] < 20.0 and begins_s == sorted(begins_s)
    speeds = [lane for lane in timeline.stack.lanes if lane.label.endswith('tool speed v')]
    operator.wait(lambda: all(0.01 < lane.extent[1] < 2.0 for lane in speeds), 'a robot moves')


def shown(model: LiveCurvesModel) -> LiveWindow:
    assert model.window is not None
    return model.window


def bad(displays: Sequence[DisplaySnapshot]) -> List[DisplaySnapshot]:
    return [display for display in displays if display.level != 0]


def record(operator: Operator, folder: Path) -> str:
    operator.launcher.recording.choices.set_folder(str(folder))
    operator.wait(lambda: operator.widget('record').isEnabled(), 'ready to record')
    operator.click('record')
    operator.wait(lambda: 'Recording data' in operator.text('status'), 'recording')
    operator.wait(lambda: operator.launcher.recording.elapsed_s > RECORDED_S / 2, 'half of it')
    operator.press(Qt.Key_M)
    operator.wait(lambda: operator.launcher.recording.elapsed_s > RECORDED_S, 'all of it')
    operator.click('record')
    operator.wait(lambda: operator.launcher.recording.phase is Phase.IDLE, 'recorded')
    assert operator.text('status').startswith(REALTIME)
    assert 'Recording' not in operator.text('status')
    [path] = folder.glob('*.bag')
    found = operator.beside(lambda: read_catalogue([str(path)]))
    assert found.duration_s > RECORDED_S - 2.0
    counts = {topic.name: topic.message_count for topic in found.topics}
    assert counts['/ur_rt_upper/q_act'] > 90 * RECORDED_S
    assert [mark.label for mark in found.marks] == ['mark 1']
    operator.wait(lambda: [it.label for it in shown(operator.launcher.live).marks] == ['mark 1'],
                  'the mark is on the curves')
    return str(path)


def quit_all(operator: Operator) -> None:
    operator.click('launch')
    operator.wait(lambda: operator.text('status') == 'Idle',
                  'everything has ended', LAUNCH_S)
    left = operator.beside(registrations)
    assert set(left) == {'/process_visualizer', '/rosout'}, left


def play_back(operator: Operator, bag: str) -> None:
    """While the cell runs: only what differs is stopped and started."""
    operator.launcher.bag.open([bag])
    operator.wait(lambda: operator.launcher.bag.path == bag, 'the bag is read')
    operator.click('playback')
    operator.wait(lambda: operator.text('status').startswith('In playback mode.'), 'playback',
                  LAUNCH_S)
    found = operator.beside(nodes)
    assert '/bag_player' in found
    assert not {'/bag_recorder', '/simulator'} & found
    operator.wait(lambda: bool(operator.launcher.bag.curves.curves), 'curves')


def pause_and_play(operator: Operator, player: Player) -> None:
    if player.next().paused:
        operator.click('play')
    player.wait(lambda it: not it.paused and it.position_s > 0.5, 'it plays')
    operator.wait(lambda: 'Playing at 1×' in operator.text('status'), 'the status says so')
    operator.press(Qt.Key_Space)
    paused = player.wait(lambda it: it.paused, 'paused')
    operator.wait(lambda: abs(shown_position_s(operator) - paused.position_s) < 0.001, 'its time')
    assert 'Paused' in operator.text('status')


def step(operator: Operator, player: Player) -> None:
    before = player.next().position_s
    operator.click('step_forward')
    after = player.wait(lambda it: it.position_s > before, 'one step forward')
    assert after.paused and after.position_s - before < 0.1
    operator.wait(lambda: abs(shown_position_s(operator) - after.position_s) < 0.001, 'its time')
    operator.press(Qt.Key_Left)
    back = player.wait(lambda it: it.position_s < after.position_s, 'one step back')
    operator.wait(lambda: abs(shown_position_s(operator) - back.position_s) < 0.001, 'its time')


def scrub(operator: Operator, player: Player) -> None:
    timeline = operator.widget('timeline')
    middle = QPoint(timeline.width() // 2, 24)
    operator.drag(timeline, middle, [middle + QPoint(part * timeline.width() // 80, 0)
                                     for part in range(1, 20)])
    length = player.next().duration_s
    there = player.wait(lambda it: it.paused and it.position_s > 0.6 * length, 'it is there')
    operator.wait(lambda: abs(shown_position_s(operator) - there.position_s) < 0.002, 'its time')


def change_speed(operator: Operator, player: Player) -> None:
    operator.press(Qt.Key_Home)
    player.wait(lambda it: it.position_s == 0.0, 'the beginning')
    operator.widget('rate', QDoubleSpinBox).setValue(0.5)
    player.wait(lambda it: it.rate == 0.5, 'half the speed')
    operator.press(Qt.Key_Space)
    begin = player.wait(lambda it: not it.paused and it.position_s > 0.1, 'it plays')
    end = player.wait(lambda it: it.stamp_s > begin.stamp_s + 2.0, 'two seconds later')
    speed = (end.position_s - begin.position_s) / (end.stamp_s - begin.stamp_s)
    assert speed == pytest.approx(0.5, abs=0.1)
    operator.press(Qt.Key_BracketRight)
    player.wait(lambda it: it.rate > 0.5, 'faster')
    operator.press(Qt.Key_Space)
    player.wait(lambda it: it.paused, 'paused')


def loop(operator: Operator, player: Player) -> None:
    operator.press(Qt.Key_Home)
    player.wait(lambda it: it.position_s == 0.0, 'the beginning')
    for key in (Qt.Key_Right, Qt.Key_Right):
        operator.press(key, Qt.ShiftModifier)
    player.wait(lambda it: it.position_s == pytest.approx(2.0, abs=0.01), '2 s')
    operator.click('loop_begin')
    operator.press(Qt.Key_Right, Qt.ShiftModifier)
    player.wait(lambda it: it.position_s == pytest.approx(3.0, abs=0.01), '3 s')
    operator.click('loop_end')
    segment = player.wait(lambda it: it.loop == pytest.approx((2.0, 3.0), abs=0.02),
                          'it will loop').segment
    operator.click('play')
    player.wait(lambda it: it.segment >= segment + 2, 'it has jumped back twice')
    assert 1.98 <= player.next().position_s <= 3.02
    operator.click('loop')
    player.wait(lambda it: it.loop is None, 'no loop any more')


def leave_a_topic_out(operator: Operator, player: Player) -> None:
    """Only the player is started again, and it goes on where it was."""
    operator.click('loop')
    player.wait(lambda it: it.loop is not None, 'it loops again')
    operator.press(Qt.Key_Space)
    before = player.wait(lambda it: it.paused, 'paused')
    shown_by = operator.beside(shown_by_whom)
    operator.click('bag_details')
    topics = operator.widget('bag_topics', QTreeWidget)
    row = topics.findItems('/edge_finder_lower', Qt.MatchExactly)[0]
    operator.click_check_box(topics, row)
    assert operator.text('apply') == 'Apply: restart the player'
    operator.click('apply')
    after = player.wait(lambda it: row.text(0) not in dict(it.topics) and it.segment > 0
                        and it.loop is not None and it.paused
                        and abs(it.position_s - before.position_s) < 0.01, 'it is there again')
    assert (after.rate, after.loop) == (before.rate, pytest.approx(before.loop, abs=1e-6))
    operator.wait(lambda: 'Paused' in operator.text('status'), 'the status says so', LAUNCH_S)
    assert operator.beside(shown_by_whom) == shown_by != set()
    operator.click('bag_details')
    operator.click('loop')
    player.wait(lambda it: it.loop is None, 'no loop any more')


def shown_by_whom() -> Set[str]:
    """The processes of RViz and of the nodes that draw in it."""
    return {it for it in processes('GUI_TEST_MARK') if re.search(r'/(rviz|robot_proc)\b', it)}


def backwards(operator: Operator, player: Player) -> None:
    operator.press(Qt.Key_End)
    player.wait(lambda it: it.position_s > 5.0, 'the end')
    operator.click('play_backwards')
    begin = player.wait(lambda it: it.rate < 0.0 and not it.paused, 'it plays backwards')
    player.wait(lambda it: it.position_s < begin.position_s - 1.0, 'one second less')
    assert 'backwards' in operator.text('status')
    operator.press(Qt.Key_Space)
    player.wait(lambda it: it.paused, 'paused')


def to_live_and_back(operator: Operator, player: Player) -> None:
    """One click each way; playback goes on at the same place."""
    before = player.next()
    operator.click('realtime')
    operator.wait(lambda: operator.text('status').startswith(REALTIME), 'live', LAUNCH_S)
    assert {'/simulator', '/bag_recorder'} <= operator.beside(nodes)
    assert '/bag_player' not in operator.beside(nodes)
    assert before.rate < 0.0 and operator.beside(lambda: rospy.get_param(PLAYBACK_RATE)) == 1.0
    live = operator.launcher.live
    operator.wait(lambda: live.window is not None and bool(live.window.curves), 'live curves')
    operator.click('playback')
    player.wait(lambda it: it.paused and it.rate == before.rate
                and abs(it.position_s - before.position_s) < 0.01, 'the same place')
