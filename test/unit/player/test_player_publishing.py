# SPDX-License-Identifier: BSD-3-Clause
"""Messages that subscribers receive, and when: the whole player on a simulated clock."""
from __future__ import annotations

import struct
from typing import Any, Callable, Dict, List, Tuple

import pytest
from recorded_rows import Row, cell_rows, serialized
from sensor_msgs.msg import LaserScan
from simulated_player import Received, SimulatedPlayer
from std_msgs.msg import Float32MultiArray, String
from tf2_msgs.msg import TFMessage

from process_visualizer.playback.topic_choice import TopicChoice
from process_visualizer.player.bag_player import HEAD_START_NS, REPEAT_S, PlayerSettings

HEAD_START_S = HEAD_START_NS * 1e-9
STAMPED_AT: Dict[str, int] = {'/image': 4, '/info': 4, '/tf': 8, '/tf_static': 8, '/marker': 4}
Play = Callable[..., SimulatedPlayer]


def without_stamp(topic: str, data: bytes) -> Tuple[str, bytes, bytes]:
    """The topic, and the bytes before and after the stamp; /tf_static has all frames so far."""
    at = STAMPED_AT.get(topic)
    if at is None or topic == '/tf_static':
        return topic, b'' if at else data, b''
    return topic, data[:at], data[at + 8:]


def stamp_s(message: Received) -> float:
    """The stamp in a message."""
    seconds, nanoseconds = struct.unpack_from('<II', message.data, STAMPED_AT[message.topic])
    return seconds + nanoseconds * 1e-9


def numbers(player: SimulatedPlayer) -> List[float]:
    """The numbers sent on /tcf."""
    return [round(Float32MultiArray().deserialize(data).data[0], 4) for data in player.of('/tcf')]


def frames_in(data: bytes) -> List[str]:
    """The frames in a message with transforms."""
    return [it.child_frame_id for it in TFMessage().deserialize(data).transforms]


def check_played(player: SimulatedPlayer) -> None:
    """Assert that every message came once, in order and on time, unchanged except its stamp."""
    removal, *came = player.received  # of all markers, before the first message
    assert removal.topic == '/marker'
    begin_s = removal.time_s + HEAD_START_S
    rows = cell_rows()
    assert [without_stamp(it.topic, it.data) for it in came] == [
        without_stamp(row.topic, serialized(row.message)) for row in rows]
    assert frames_in(player.of('/tf_static')[-1]) == ['fixed0', 'fixed1', 'fixed2']
    assert [it.time_s - begin_s for it in came] == pytest.approx(
        [row.time_ms / 1000 for row in rows], abs=1e-6)


@pytest.mark.parametrize('compression', ['none', 'bz2', 'lz4'])
def test_every_message_comes_once_in_order_and_when_it_is_due(play: Play, bag_of: Any,
                                                              compression: str) -> None:
    player = play(bag_of(cell_rows(), compression=compression), plays=True)
    player.end()
    check_played(player)
    assert (player.player.is_complete, player.player.summary()) == (True, ())


def test_split_bags_are_one_recording(play: Play, bag_of: Any) -> None:
    rows = cell_rows()
    half = len(rows) // 2
    player = play(bag_of(rows[half:], 'later.bag'), bag_of(rows[:half], 'earlier.bag'),
                  plays=True)
    player.end()
    check_played(player)


def test_stamps_move_to_the_present_and_equal_ones_stay_equal(play: Play, cell_bag: str) -> None:
    player = play(cell_bag, plays=True)
    player.end()
    images, infos = ([it for it in player.received if it.topic == topic]
                     for topic in ('/image', '/info'))
    assert [stamp_s(it) for it in images] == [stamp_s(it) for it in infos]
    for image in images[1:]:  # no stamp is earlier than the start of play
        assert image.time_s - stamp_s(image) == pytest.approx(0.003, abs=1e-6)


def test_recorded_stamps_stay_if_wanted(play: Play, cell_bag: str) -> None:
    player = play(cell_bag, plays=True, settings=PlayerSettings(restamp=False))
    player.end()
    assert player.of('/image') == [serialized(row.message) for row in cell_rows()
                                   if row.topic == '/image']


def test_who_comes_late_gets_what_was_latched(play: Play, cell_bag: str) -> None:
    player = play(cell_bag, start_s=0.55, plays=True)
    player.node.advance(HEAD_START_S + 0.01)
    text, = player.late('/text')
    assert String().deserialize(text).data == 'changed'
    static, = player.late('/tf_static')
    assert frames_in(static) == ['fixed0', 'fixed1']
    player.node.advance(0.06)
    assert frames_in(player.late('/tf_static')[-1]) == ['fixed0', 'fixed1', 'fixed2']
    assert player.late('/tcf') == []


def test_who_comes_late_while_paused_sees_the_scene(play: Play, cell_bag: str) -> None:
    player = play(cell_bag, start_s=0.5)
    player.node.advance(0.5)
    player.received.clear()
    player.late('/image')
    image, = (it for it in player.received if it.topic == '/image')
    assert stamp_s(image) == pytest.approx(player.node.wall_s(), abs=1e-6)
    assert image.time_s == player.node.wall_s()
    assert numbers(player) == [0.496]


def test_while_paused_the_scene_comes_again_for_what_has_started_meanwhile(play: Play,
                                                                           cell_bag: str) -> None:
    player = play(cell_bag, start_s=0.4)
    player.node.advance(1.0)
    player.received.clear()
    for _ in range(3):
        player.node.advance(REPEAT_S)
    assert numbers(player) == [0.4] * 3
    player.play()
    player.node.advance(0.3)
    player.received.clear()
    player.node.advance(0.3)
    assert numbers(player) == sorted(set(numbers(player)))  # nothing is repeated while it plays


def test_a_scene_with_recorded_stamps_does_not_come_again(play: Play, cell_bag: str) -> None:
    player = play(cell_bag, start_s=0.4, settings=PlayerSettings(restamp=False))
    player.node.advance(1.0)
    player.received.clear()
    player.node.advance(3 * REPEAT_S)
    assert player.received == []


def test_choice_prefix_and_remapping(play: Play, cell_bag: str) -> None:
    choice = TopicChoice(['/text', '/tcf', '/image'], ['/im*'], 'old', {'/tcf': '/other'})
    player = play(cell_bag, plays=True, settings=PlayerSettings(choice))
    player.end()
    assert {it.topic for it in player.received} == {'/old/other', '/old/text'}
    assert len(player.of('/old/other')) == 126
    assert {it.name: it.published for it in player.state.topics} == {'/old/other': 126,
                                                                     '/old/text': 2}


def test_two_types_on_one_topic(play: Play, bag_of: Any) -> None:
    texts = bag_of([Row('/x', 0, String('a')), Row('/x', 20, String('b'))], 'texts.bag')
    player = play(texts, bag_of([Row('/x', 10, Float32MultiArray())], 'numbers.bag'), plays=True)
    player.end()
    assert [String().deserialize(data).data for data in player.of('/x')] == ['a', 'b']
    assert '/x: left out where it is std_msgs/Float32MultiArray' in player.player.problems[0]
    assert not player.player.is_complete


def test_a_start_at_the_end_plays_the_last_message(play: Play, cell_bag: str) -> None:
    player = play(cell_bag, plays=True, start_s=1.0)
    player.end()
    assert numbers(player) == [0.992, 1.0]  # the scene, and the rest


AGE_MS = 25
"""Age of a scan when it is recorded."""


def robot_and_scans() -> List[Row]:
    """A robot without stamps, and scans; each has the time [s] at which it was measured."""
    rows = [Row('/tcf', time_ms, Float32MultiArray(data=[time_ms / 1000.0]))
            for time_ms in range(0, 4000, 8)]
    for time_ms in range(0, 4000 - AGE_MS, 33):
        scan = LaserScan(ranges=[time_ms / 1000.0])
        scan.header.stamp.secs, scan.header.stamp.nsecs = divmod(
            1_600_000_000 * 10 ** 9 + time_ms * 10 ** 6, 10 ** 9)
        rows.append(Row('/scan', time_ms + AGE_MS, scan))
    return rows


@pytest.mark.parametrize('rate', [1.0, -1.0, -0.5, -2.0])
def test_at_the_stamp_of_a_scan_the_robot_is_where_it_was_measured(play: Play, bag_of: Any,
                                                                   rate: float) -> None:
    player = play(bag_of(robot_and_scans()), start_s=0.5 if rate > 0 else 3.5)
    player.play(rate)
    player.node.advance(0.5)
    player.received.clear()
    player.node.advance(1.3)
    robot = [(it.time_s, Float32MultiArray().deserialize(it.data).data[0])
             for it in player.received if it.topic == '/tcf']
    scans = [LaserScan().deserialize(data) for data in player.of('/scan')]
    scans = [it for it in scans if it.header.stamp.to_sec() > robot[0][0]]
    assert len(scans) > 15
    for scan in scans:
        place_s = [place_s for time_s, place_s in robot
                   if time_s <= scan.header.stamp.to_sec() + 1e-5][-1]
        assert abs(place_s - scan.ranges[0]) < 0.0161  # two states of the robot
