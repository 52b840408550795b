# SPDX-License-Identifier: BSD-3-Clause
"""The topics of the devices: live in real-time mode, as recorded in playback."""
from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from shutil import rmtree
from typing import Any, Iterator, List

import pytest
import rosbag
from genpy import Time
from held_tasks import HeldTasks
from recording_stand_in import seen
from session_stand import open_cell
from std_msgs.msg import Float64, String

from process_visualizer.bagio.catalog import Catalog, read_catalog
from process_visualizer.cell.errors import Location
from process_visualizer.cell.model import Cell, Device, DeviceType, Topic, TopicFunction
from process_visualizer.gui.cell.device_states_model import DeviceStatesModel, WarningsModel
from process_visualizer.gui.cell.launch_model import LaunchModel
from process_visualizer.gui.ros.snapshots import PlayerSnapshot, RecorderSnapshot
from process_visualizer.gui.session import Session
from process_visualizer.health.device_state import Level, Line
from process_visualizer.health.node_warnings import NodeWarnings
from process_visualizer.launching.part_report import NodeReport, NodeState, PartReport, PartState

HERE = Location('cell.xml', 1)
NAMES = ('/heat', '/name', '/door', '/absent')
OVEN = Device(DeviceType.OTHER, 'oven', HERE,
              topics=tuple(Topic(name, None, None, True, HERE) for name in NAMES))


@pytest.fixture
def session() -> Session:
    return Session()


@pytest.fixture
def states(qtbot: Any, session: Session, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
           ) -> Iterator[DeviceStatesModel]:
    monkeypatch.setenv('ROS_HOME', str(tmp_path))
    launch = LaunchModel(HeldTasks(), session)
    launch.reports = {'oven': PartReport('oven', PartState.RUNNING, (
        NodeReport('/oven/driver', NodeState.RUNNING),))}
    yield DeviceStatesModel(launch, WarningsModel(NodeWarnings(), session), session)
    rmtree(launch.folder)


@pytest.fixture
def recording(tmp_path: Path) -> Catalog:
    """The heat at 50 Hz, a latched name, and a door that was opened once."""
    path = str(tmp_path / 'a.bag')
    with rosbag.Bag(path, 'w') as bag:
        for number in range(101):
            bag.write('/heat', Float64(number), Time.from_sec(1000.0 + number / 50))
        header = {'topic': '/name', 'type': String._type, 'md5sum': String._md5sum,
                  'message_definition': String._full_text, 'latching': '1'}
        for second in (0.0, 1.0):
            bag.write('/name', String('x'), Time.from_sec(1000.0 + second),
                      connection_header=header)
        bag.write('/door', String('open'), Time.from_sec(1001.0))
    return read_catalog([path])


def player(recording: Catalog, counts: List[int], **values: Any) -> PlayerSnapshot:
    return PlayerSnapshot(stamp_s=1.0, begin_s=1000.0, duration_s=2.0, position_s=1.0, rate=0.25,
                          achieved_rate=0.0, paused=True, files=recording.paths,
                          topics=tuple(zip(NAMES, counts)), **values)


def shown(states: DeviceStatesModel) -> List[str]:
    topics = states.state(OVEN).topics
    return [topics[name].text.replace('\u2009', ' ') for name in NAMES]


def test_in_playback_rates_are_those_of_the_recording(states: DeviceStatesModel, session: Session,
                                                      recording: Catalog) -> None:
    """Paused, the scene is repeated now and then; it was shown as 0.987 Hz, and latched as 0 Hz."""
    session.set_recording(recording)
    for count in range(5):
        session.take_player(player(recording, [100 + count, 1, 1]))
        assert shown(states) == ['50 Hz', 'latched', 'once', '']


def test_a_recording_that_the_player_does_not_play_yet(states: DeviceStatesModel, session: Session,
                                                       recording: Catalog) -> None:
    session.set_recording(recording)
    session.take_player(player(recording._replace(paths=('/other.bag',)), [1, 1]))
    assert shown(states) == ['', '', '', '']


def test_what_cannot_be_played_is_told(states: DeviceStatesModel, session: Session,
                                       recording: Catalog) -> None:
    session.set_recording(recording)
    session.take_player(player(recording, [100]))
    assert shown(states)[:2] == ['50 Hz', 'not played']
    assert states.state(OVEN).summary.text == 'running'


def test_a_robot_whose_joints_the_recording_lacks(states: DeviceStatesModel, session: Session,
                                                  recording: Catalog) -> None:
    place = OVEN.location
    oven = replace(OVEN, type=DeviceType.ROBOT, topics=(
        Topic('/heat', None, None, True, place),
        Topic('/q', TopicFunction.JOINT_STATES, None, True, place)))
    open_cell(session, Cell('cell.xml', 'world', (oven,)))
    session.set_recording(recording)
    session.take_player(player(recording, [100, 1, 1]))
    state = states.state(oven)
    assert state.topics['/q'].text == 'not in the recording'
    assert state.summary == Line(
        Level.WARNING, 'The recording lacks its joints: its pose is unknown')
    assert not states.silent(oven), 'a restart of the device does not help'


def test_without_a_recorder_that_counts_rates_are_forgotten_and_silences_stay(
        states: DeviceStatesModel) -> None:
    for messages in range(0, 100, 10):  # learns the usual rate
        states.take_recorder(RecorderSnapshot('idle', topics=tuple(
            seen(name, messages=messages) for name in NAMES[:2])))
    states.take_recorder(RecorderSnapshot('idle', topics=(
        seen(NAMES[0], messages=110), seen(NAMES[1], 0.0, 60.0, messages=100))))
    assert shown(states)[:2] == ['125 Hz', 'no data for 60.0 s']
    states.forget_topics()
    assert shown(states)[:2] == ['', 'no data for 60.0 s']


def test_a_recorder_that_hung_sees_silences_that_are_its_own(states: DeviceStatesModel) -> None:
    """Its first states after that neither cause an alarm nor count as usual afterward."""
    def told(silence_s: float, messages: int) -> None:
        states.take_recorder(RecorderSnapshot('idle', topics=(
            seen(NAMES[0], 125.0 if silence_s < 1.0 else 0.0, silence_s, messages=messages),)))

    for messages in range(0, 100, 10):
        told(0.01, messages)
    states.forget_topics()
    told(3.4, 100)
    assert states.state(OVEN).summary.text == 'running'
    told(0.01, 500)
    told(0.01, 550)
    assert shown(states)[0] == '125 Hz'
    told(1.5, 560)
    assert shown(states)[0] == 'no data for 1.5 s'
