# SPDX-License-Identifier: BSD-3-Clause
"""A session of an operator with the simulated cell: launched, recorded, and played back."""
from __future__ import annotations

import re
from pathlib import Path
from typing import Any, Iterator, List, Optional, Sequence

import pytest
from operator_at_work import Operator, nodes, processes, registrations
from PyQt5.QtCore import QPoint, Qt

from process_visualizer.bagio.catalog import read_catalog
from process_visualizer.curves.live_curves import LiveWindow
from process_visualizer.gui.cell.devices_panel import DevicesView
from process_visualizer.gui.live.live_curves_model import LiveCurvesModel
from process_visualizer.gui.live.live_timeline import LiveTimeline
from process_visualizer.gui.recording.recording_types import RecordingPhase
from process_visualizer.gui.ros.snapshots import DisplaySnapshot, PlayerSnapshot

CONFIG = str(Path(__file__).parents[2] / 'sewing_cell' / 'devices' / 'simulated.xml')
RECORDED_S = 6.0
REALTIME = 'In real-time mode.'
"""Messages of nodes may follow, such as the simulator's if the computer is too busy for it."""


@pytest.fixture
def operator(qtbot: Any) -> Iterator[Operator]:
    person = Operator(qtbot)
    yield person
    person.close()


def test_session(operator: Operator, tmp_path: Path) -> None:
    player = Player(operator)
    open_the_cell(operator)
    launch(operator)
    follow_the_curves(operator)
    bag = record(operator, tmp_path)
    play_back(operator, bag)
    pause_and_play(operator, player)
    seek(operator, player)
    quit_all(operator)
    operator.close()
    assert {it for it in processes('GUI_TEST_MARK') if 'Xvfb' not in it} == set()


class Player:
    """Follows the player's states, beside the window."""

    def __init__(self, operator: Operator) -> None:
        self._operator = operator
        self.states: List[PlayerSnapshot] = []
        operator.launcher.link.player_state.connect(self.states.append)

    @property
    def now(self) -> Optional[PlayerSnapshot]:
        return self.states[-1] if self.states else None

    def next(self) -> PlayerSnapshot:
        """Return the next state that arrives."""
        count = len(self.states)
        self._operator.wait(lambda: len(self.states) > count, 'a state of the player')
        return self.states[-1]

    def wait(self, condition: Any, what: str) -> PlayerSnapshot:
        self._operator.wait(lambda: self.now is not None and condition(self.now), what)
        assert self.now is not None
        return self.now


def shown_position_s(operator: Operator) -> float:
    """Return the position as the window writes it."""
    match = re.search(r'(\d+):(\d\d\.\d\d\d)', operator.text('time'))
    assert match is not None, operator.text('time')
    return 60.0 * int(match[1]) + float(match[2])


def open_the_cell(operator: Operator) -> None:
    operator.launcher.cell.open(CONFIG, {'image_rate': '10'})
    devices = operator.widget('devices', DevicesView)
    operator.wait(lambda: devices.topLevelItemCount() == 6, 'six devices')
    operator.wait(lambda: operator.widget('launch').isEnabled(), 'the master')
    assert operator.text('status') == 'Idle'
    kinect = devices.topLevelItem(2)
    assert kinect.text(0) == 'kinect (depth_sensor)'
    operator.click_check_box(devices, kinect)
    assert [device.name for device in operator.launcher.session.chosen] == [
        'ur_rt_upper', 'ur_rt_lower', 'sewing_machine', 'cell_stand', 'simulator']


def launch(operator: Operator) -> None:
    displays: List[Any] = []
    operator.launcher.link.displays.connect(lambda found: displays.append(found))
    operator.click('launch')
    assert operator.text('status') == 'Launching nodes…'
    operator.wait(lambda: operator.text('status').startswith(REALTIME), 'everything is up')
    assert operator.text('launch') == 'Quit all nodes'
    found = operator.beside(nodes)
    assert {'/rviz', '/bag_recorder', '/cell_frames', '/ur_rt_upper/robot_proc',
            '/sewing_machine/sewing_machine', '/simulator'} <= found
    assert '/kinect/depth_proc' not in found
    devices = operator.widget('devices', DevicesView)
    operator.wait(lambda: devices.state_text('ur_rt_upper') == 'running', 'the robot runs')
    assert devices.state_text('kinect') == ''
    topics = devices.topLevelItem(0)
    operator.wait(lambda: any(re.fullmatch(r'\d+\u2009Hz', topics.child(row).text(1))
                              for row in range(topics.childCount())), 'the rate of a topic')
    operator.wait(lambda: bool(displays) and not bad(displays[-1]), 'every display of RViz is OK',
                  lambda: displays and bad(displays[-1]))


def bad(displays: Sequence[DisplaySnapshot]) -> List[DisplaySnapshot]:
    return [display for display in displays if display.level != 0]


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
    assert begins_s[0] < begins_s[-1] and begins_s == sorted(begins_s)
    speeds = [lane for lane in timeline.stack.lanes if lane.label.endswith('tool speed v')]
    operator.wait(lambda: all(0.01 < lane.extent[1] < 2.0 for lane in speeds), 'a robot moves')


def shown(model: LiveCurvesModel) -> LiveWindow:
    assert model.window is not None
    return model.window


def record(operator: Operator, folder: Path) -> str:
    operator.launcher.recording.choices.set_folder(str(folder))
    operator.wait(lambda: operator.widget('record').isEnabled(), 'ready to record')
    operator.click('record')
    operator.wait(lambda: 'Recording' in operator.text('status'), 'recording')
    operator.wait(lambda: operator.launcher.recording.elapsed_s > RECORDED_S / 2, 'half of it')
    operator.press(Qt.Key_M)
    operator.wait(lambda: operator.launcher.recording.elapsed_s > RECORDED_S, 'all of it')
    operator.click('record')
    operator.wait(lambda: operator.launcher.recording.phase is RecordingPhase.IDLE, 'recorded')
    assert operator.text('status').startswith(REALTIME)
    assert 'Recording' not in operator.text('status')
    [path] = folder.glob('*.bag')
    found = operator.beside(lambda: read_catalog([str(path)]))
    assert found.duration_s > RECORDED_S / 2
    assert {'/ur_rt_upper/q_act', '/ft_lower/ft', '/feed_rate_est'} <= {
        topic.name for topic in found.topics}
    assert [mark.label for mark in found.marks] == ['mark 1']
    operator.wait(lambda: [it.label for it in shown(operator.launcher.live).marks] == ['mark 1'],
                  'the mark is on the curves')
    return str(path)


def play_back(operator: Operator, bag: str) -> None:
    """Play while the cell runs: only what differs is stopped and started."""
    operator.launcher.bag.open([bag])
    operator.wait(lambda: operator.launcher.session.paths == (bag,), 'the bag is read')
    operator.click('playback')
    operator.wait(lambda: operator.text('status').startswith('In playback mode.'), 'playback')
    found = operator.beside(nodes)
    assert '/bag_player' in found
    assert not {'/bag_recorder', '/simulator'} & found
    operator.wait(lambda: bool(operator.launcher.bag.curves.curves), 'curves')
    operator.wait(lambda: operator.widget('play').isEnabled(), 'the player')


def pause_and_play(operator: Operator, player: Player) -> None:
    if player.next().paused:
        operator.click('play')
    player.wait(lambda it: not it.paused and it.position_s > 0.5, 'it plays')
    operator.wait(lambda: 'Playing at 1×' in operator.text('status'), 'the status says so')
    operator.press(Qt.Key_Space)
    paused = player.wait(lambda it: it.paused, 'paused')
    operator.wait(lambda: abs(shown_position_s(operator) - paused.position_s) < 0.001, 'its time')
    assert 'Paused' in operator.text('status')


def seek(operator: Operator, player: Player) -> None:
    timeline = operator.widget('timeline')
    middle = QPoint(timeline.width() // 2, 24)
    operator.drag(timeline, middle, [middle + QPoint(part * timeline.width() // 80, 0)
                                     for part in range(1, 20)])
    length = player.next().duration_s
    player.wait(lambda it: it.paused and it.position_s > 0.6 * length, 'it is on its way')
    operator.wait(lambda: abs(shown_position_s(operator) - player.states[-1].position_s) < 0.002
                  and shown_position_s(operator) > 0.6 * length, 'where it is, as its time')


def quit_all(operator: Operator) -> None:
    operator.click('launch')
    operator.wait(lambda: operator.text('status') == 'Idle',
                  'everything has ended')
    left = operator.beside(registrations)
    assert set(left) == {'/process_visualizer', '/rosout'}, left
