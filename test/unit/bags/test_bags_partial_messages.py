# SPDX-License-Identifier: BSD-3-Clause
"""After a seek all frames, markers and joints are there, though each message has only some."""
from __future__ import annotations

from io import BytesIO
from pathlib import Path
from typing import Any, Dict, List, NamedTuple, Sequence, Tuple

import genpy
import pytest
import rosbag
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from geometry_msgs.msg import Point, TransformStamped
from hypothesis import given
from hypothesis import strategies as st
from sensor_msgs.msg import JointState
from std_msgs.msg import ColorRGBA
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import Marker, MarkerArray

from process_visualizer.bagio.message_definition import Connection
from process_visualizer.bagio.message_layout import MessageDamaged
from process_visualizer.bagio.message_parts import CLEARS, parts_reader
from process_visualizer.bagio.recording import Recording
from process_visualizer.playback.message_loader import LoadedMessage, MessageLoader
from process_visualizer.playback.playback_event import EventMaker
from process_visualizer.playback.scene import MAX_AGE_NS, MAX_SEARCHED, MIN_SEARCHED

PERIOD_S = 0.02
Seen = Dict[Tuple[str, str], float]
"""A value by topic and by frame, or by the marker's namespace and id."""


class Told(NamedTuple):
    """Message of a node at a time [s], with some frames or markers."""

    time_s: float
    topic: str
    caller: str
    message: Any


def transforms(value: float, frames: Sequence[str]) -> TFMessage:
    """A message with the transforms of some frames, each with a value."""
    message = TFMessage()
    for frame in frames:
        transform = TransformStamped(child_frame_id=frame)
        transform.header.frame_id = 'world'
        transform.transform.translation.x = value
        transform.transform.rotation.w = 1.0
        message.transforms.append(transform)
    return message


def marker(value: float, number: int, action: int = Marker.ADD, lifetime_s: float = 0.0) -> Marker:
    """A marker with a value, and with points, colors and texts before the next marker."""
    result = Marker(ns='ns', id=number, type=Marker.LINE_STRIP, action=action, text='text',
                    points=[Point()] * 2, colors=[ColorRGBA()] * 2, mesh_resource='package://a')
    result.header.frame_id = 'world'
    result.lifetime = genpy.Duration(lifetime_s)
    result.pose.position.x = value
    return result


def joints(value: float, names: Sequence[str]) -> JointState:
    """The positions of some joints."""
    return JointState(name=list(names), position=[value] * len(names), effort=[1.0] * len(names))


def diagnostics(value: float, names: Sequence[str]) -> DiagnosticArray:
    """The states of some parts of a driver."""
    return DiagnosticArray(status=[
        DiagnosticStatus(0, name, str(value), 'id', [KeyValue('key', 'value')]) for name in names])


def write(path: Path, told: Sequence[Told]) -> str:
    """A bag with the messages."""
    with rosbag.Bag(str(path), 'w') as bag:
        for it in told:
            header = {'topic': it.topic, 'type': it.message._type, 'md5sum': it.message._md5sum,
                      'message_definition': it.message._full_text, 'callerid': it.caller}
            bag.write(it.topic, it.message, genpy.Time(1000 + it.time_s),
                      connection_header=header)
    return str(path)


def see(seen: Seen, topic: str, message: Any) -> None:
    """Process a message as RViz and tf2 do."""
    if message._type == TFMessage._type:
        for it in message.transforms:
            seen[topic, it.child_frame_id] = it.transform.translation.x
        return
    if message._type == JointState._type:
        seen.update(((topic, name), value) for name, value in zip(message.name, message.position))
        return
    if message._type == DiagnosticArray._type:
        seen.update(((topic, it.name), float(it.message)) for it in message.status)
        return
    for it in message.markers if message._type == MarkerArray._type else [message]:
        if it.action == Marker.DELETEALL:
            for key in [key for key in seen if key[0] == topic]:
                del seen[key]
        elif it.action == Marker.DELETE:
            seen.pop((topic, f'{it.ns} {it.id}'), None)
        else:
            seen[topic, f'{it.ns} {it.id}'] = it.pose.position.x


class Player:
    """Playback events of a bag, and the viewer's scene after they are published."""

    def __init__(self, *paths: str) -> None:
        self.recording = Recording(paths)
        self.events = EventMaker(self.recording.index, MessageLoader(self.recording),
                                 self.recording.begin_ns)

    def show(self, seen: Seen, messages: Sequence[LoadedMessage]) -> None:
        """Publish messages."""
        types = {it._type: it for it in (TFMessage, Marker, MarkerArray, JointState,
                                         DiagnosticArray)}
        for it in messages:
            connection = self.recording.index.connections[it.connection]
            if not it.withdrawn:
                see(seen, connection.topic, types[connection.type]().deserialize(bytes(it.data)))


@st.composite
def tellings(draw: Any) -> List[Told]:
    """Messages of nodes that send frames and markers either in one message or in several."""
    told = []
    for number in range(draw(st.integers(1, 30))):
        value, time_s = float(number), number * PERIOD_S
        kind = draw(st.sampled_from(['tf', 'marker', 'array', 'joints', 'diagnostics']))
        if kind in ('joints', 'diagnostics'):
            parts = draw(st.lists(st.sampled_from('abcd'), min_size=1, max_size=3, unique=True))
            told.append(Told(time_s, f'/{kind}', draw(st.sampled_from(['/a', '/b'])),
                             (joints if kind == 'joints' else diagnostics)(value, parts)))
            continue
        if kind == 'tf':
            caller, names = draw(st.sampled_from([('/a', 'abc'), ('/b', 'de')]))
            frames = draw(st.lists(st.sampled_from(names), min_size=1, max_size=3, unique=True))
            told.append(Told(time_s, '/tf', caller, transforms(value, frames)))
            continue
        actions = st.sampled_from([Marker.ADD, Marker.ADD, Marker.DELETE, Marker.DELETEALL])
        markers = [marker(value, draw(st.integers(0, 3)), draw(actions))
                   for _ in range(draw(st.integers(1, 3)) if kind == 'array' else 1)]
        told.append(Told(time_s, f'/{kind}', '/a',
                         MarkerArray(markers) if kind == 'array' else markers[0]))
    return told


def scanned(told: Sequence[Told], count: int) -> Seen:
    """The scene after some messages; it also has frames that are first sent soon after."""
    seen: Seen = {}
    for it in told[:count]:
        see(seen, it.topic, it.message)
    return seen


@given(tellings(), st.data())
def test_a_seek_and_a_way_back_show_what_was_there(tmp_path_factory: pytest.TempPathFactory,
                                                   told: List[Told], data: Any) -> None:
    player = Player(write(tmp_path_factory.mktemp('bags') / 'a.bag', told))
    soon = sum(it.time_s <= 0.2 for it in told)  # frames this early may be there from the start
    count = data.draw(st.integers(min(soon, len(told)), len(told)))
    seen: Seen = {}
    player.show(seen, player.events.scene(count).messages)
    assert seen == scanned(told, count)
    for position in reversed(range(min(soon, count), count)):
        player.show(seen, player.events.backward(position).messages)
        assert seen.items() >= scanned(told, position).items()


def test_what_is_seldom_told_is_found_once_it_is_known(tmp_path: Path) -> None:
    told = [Told(number * 0.01, '/tf', '/a',
                 transforms(float(number), ['seldom' if number % 100 == 0 else 'often']))
            for number in range(1000)]
    player = Player(write(tmp_path / 'a.bag', told))
    for count in (500, 999, 260):
        seen: Seen = {}
        player.show(seen, player.events.scene(count).messages)
        assert seen == scanned(told, count)


def test_a_joint_that_was_told_of_long_ago_is_where_it_was(tmp_path: Path) -> None:
    told = [Told(number * 0.01, '/joints', '/a',
                 joints(float(number), ['torso' if number == 7 else 'arm']))
            for number in range(5000)]
    player = Player(write(tmp_path / 'a.bag', told))
    for count in (4900, 5000, 20):
        seen: Seen = {}
        player.show(seen, player.events.scene(count).messages)
        assert seen == {('/joints', 'torso'): 7.0, ('/joints', 'arm'): count - 1.0}


def test_a_joint_of_another_node_that_sends_seldom_is_where_it_was(tmp_path: Path) -> None:
    """For example that of a gripper, on the same topic as the arm's driver."""
    arm = [Told(number * 0.01, '/joints', '/arm', joints(float(number), ['arm']))
           for number in range(4000)]
    gripper = [Told(25.005, '/joints', '/gripper', joints(2.0, ['finger']))]
    player = Player(*(write(tmp_path / f'{told[0].caller[1:]}.bag', told)
                      for told in (arm, gripper)))
    for count, finger in ((3901, True), (2400, False)):
        seen: Seen = {}
        player.show(seen, player.events.scene(count).messages)
        found = {('/joints', 'finger'): 2.0} if finger else {}
        assert seen == {**found, ('/joints', 'arm'): 3899.0 if finger else 2399.0}


def test_what_holds_of_joints_before_a_time_is_the_newest_of_each(tmp_path: Path) -> None:
    told = [Told(number * 0.01, '/joints', '/a',
                 joints(float(number), ['torso' if number == 7 else 'arm']))
            for number in range(100)]
    told += [Told(number * 0.01, '/whole', '/b', joints(0.0, ['a', 'b'])) for number in range(9)]
    events = Player(write(tmp_path / 'a.bag', told)).events
    begin_ns = 1000 * 10 ** 9
    alone = Player(write(tmp_path / 'b.bag', told[:100])).events
    assert alone.held('/joints', begin_ns + 505_000_000) == [7, 50]
    assert alone.held('/joints', begin_ns + 35_000_000) == [3]  # no torso joint so far
    assert alone.held('/joints', begin_ns) == []
    assert len(events.held('/whole', begin_ns + 500_000_000)) == 1
    assert events.held('/none', begin_ns) == []


def test_efforts_without_positions_replace_no_positions(tmp_path: Path) -> None:
    told = [Told(0.0, '/joints', '/a', joints(1.0, ['arm'])),
            Told(0.5, '/joints', '/a', JointState(name=['arm'], effort=[2.0]))]
    player = Player(write(tmp_path / 'a.bag', told))
    seen: Seen = {}
    player.show(seen, player.events.scene(2).messages)
    assert seen == {('/joints', 'arm'): 1.0}


@pytest.mark.parametrize('tell', [
    lambda value, name: MarkerArray([marker(value, ord(name))]),
    lambda value, name: diagnostics(value, [name])], ids=['markers', 'diagnostics'])
def test_what_was_told_once_holds_until_it_is_told_again(tmp_path: Path, tell: Any) -> None:
    """A marker stays until it is removed; RViz does not check its age."""
    told = [Told(number * 1.0, '/parts', '/a', tell(float(number), 'a' if number == 3 else 'b'))
            for number in range(60)]
    player = Player(write(tmp_path / 'a.bag', told))
    for count in (60, 30, 20):
        seen: Seen = {}
        player.show(seen, player.events.scene(count).messages)
        assert seen == scanned(told, count)


@pytest.mark.parametrize('kind', ['control_msgs/DynamicJointState', 'maker_msgs/JointStates'])
def test_joint_states_of_other_types_tell_of_the_joints_that_they_name(kind: str) -> None:
    definition = ('# the state of joints\n\nstd_msgs/Header header  # when\n'
                  'string[] joint_names\nInterfaceValue[] interface_values\n')
    buffer = BytesIO()
    joints(1.0, ['arm', 'torso']).serialize(buffer)
    connection = Connection('/a', kind, '', definition, False, '/n')
    read = parts_reader(connection)
    assert read is not None
    assert [it.key for it in read(buffer.getvalue())] == [b'arm', b'torso']
    assert parts_reader(connection._replace(message_definition='string[] names\n')) is None
    assert parts_reader(connection._replace(type='maker_msgs/Names')) is None


def test_how_much_is_read_is_bounded(tmp_path: Path) -> None:
    told = [Told(number * 0.01, '/tf', '/a', transforms(float(number), ['often']))
            for number in range(1000)]
    player = Player(write(tmp_path / 'a.bag', told))
    reads: List[int] = []
    read = player.recording.message
    player.recording.message = lambda position: reads.append(position) or read(position)
    player.events.scene(900)
    assert len(reads) <= min(MAX_SEARCHED, MAX_AGE_NS * 1e-9 / 0.01) + 5
    reads.clear()
    player.events.scene(700)
    assert len(reads) <= MIN_SEARCHED + 5


def test_a_marker_whose_time_is_over_does_not_come_back(tmp_path: Path) -> None:
    told = [Told(0.0, '/m', '/a', marker(1.0, 1, lifetime_s=0.5)),
            Told(0.1, '/m', '/a', marker(2.0, 2)),
            Told(0.4, '/m', '/a', marker(3.0, 3)),
            Told(1.0, '/m', '/a', marker(4.0, 3))]
    player = Player(write(tmp_path / 'a.bag', told))
    for count, expected in ((3, {'ns 1', 'ns 2', 'ns 3'}), (4, {'ns 2', 'ns 3'})):
        seen: Seen = {}
        player.show(seen, player.events.scene(count).messages)
        assert {key for _, key in seen} == expected


@given(tellings())
def test_parts_are_those_that_the_real_types_have(told: List[Told]) -> None:
    for it in told:
        buffer = BytesIO()
        it.message.serialize(buffer)
        read = parts_reader(Connection(it.topic, it.message._type, it.message._md5sum, '', False,
                                       it.caller))
        assert read is not None
        expected: Seen = {}
        for single in getattr(it.message, 'markers', [it.message]):
            if getattr(single, 'action', None) == Marker.DELETEALL:
                expected['', ''] = 0.0
            elif getattr(single, 'action', None) == Marker.DELETE:
                expected['', f'{single.ns} {single.id}'] = 0.0
            else:
                see(expected, '', single)
        assert len({part.key for part in read(buffer.getvalue())}) == len(expected)
        for length in range(len(buffer.getvalue())):
            with pytest.raises(MessageDamaged):
                read(buffer.getvalue()[:length])


def test_other_types_are_whole_states() -> None:
    assert parts_reader(Connection('/a', 'std_msgs/String', '', '', False, '/n')) is None
    assert CLEARS.key == b''
