# SPDX-License-Identifier: BSD-3-Clause
"""The time of the recording on /clock, for nodes with use_sim_time."""
from __future__ import annotations

from typing import Any, Callable, List

import pytest
import rospy
from recorded_rows import BEGIN_S, cell_rows, serialized
from simulated_player import SimulatedPlayer
from std_msgs.msg import Float32MultiArray

from process_visualizer.player.bag_player import HEAD_START_NS, PlayerSettings
from process_visualizer.player.bag_publishers import SETTLING_S

HEAD_START_S = HEAD_START_NS * 1e-9
SIMULATED = PlayerSettings(restamp=False, clock_hz=50.0)
Play = Callable[..., SimulatedPlayer]


def told(player: SimulatedPlayer) -> List[float]:
    """The times on /clock so far [s from the beginning]."""
    return [round(it.clock.secs - BEGIN_S + it.clock.nsecs * 1e-9, 6)
            for it in player.node.sent('/clock')]


def falls(values: List[float]) -> List[int]:
    """Indices where a value is less than its predecessor."""
    return [index for index in range(1, len(values)) if values[index] < values[index - 1]]


def numbers(player: SimulatedPlayer) -> List[float]:
    """The numbers sent on /tcf."""
    return [round(Float32MultiArray().deserialize(data).data[0], 4) for data in player.of('/tcf')]


def test_it_stands_while_paused_and_is_told_all_the_same(play: Play, cell_bag: str) -> None:
    player = play(cell_bag, start_s=0.5, settings=SIMULATED)
    player.node.sent('/clock').clear()
    player.node.advance(1.0)
    assert told(player) == [0.5] * 50


def test_it_runs_as_fast_as_the_recording_is_played(play: Play, cell_bag: str) -> None:
    player = play(cell_bag, rate=0.5, plays=True, settings=SIMULATED)
    player.node.advance(HEAD_START_S)
    player.node.sent('/clock').clear()
    player.node.advance(1.0)
    times_s = told(player)
    assert len(times_s) == 50
    steps_s = [later - earlier for earlier, later in zip(times_s, times_s[1:])]
    assert steps_s == pytest.approx([0.01] * 49, abs=1e-6)


def test_a_seek_is_told_before_its_scene_with_recorded_stamps(play: Play, cell_bag: str) -> None:
    player = play(cell_bag, settings=SIMULATED)
    heard: List[str] = []
    for topic in ('/clock', '/image'):
        player.node.receiver.subscribe(topic, rospy.AnyMsg,
                                       lambda _message, it=topic: heard.append(it))
    player.seek(0.9)
    assert told(player)[-1] == 0.9
    assert heard == ['/clock', '/image']
    recorded = [row for row in cell_rows() if row.topic == '/image' and row.time_ms <= 900][-1]
    assert player.of('/image')[-1] == serialized(recorded.message)


def test_after_a_jump_back_the_scene_comes_again_once_it_was_discarded(play: Play,
                                                                       cell_bag: str) -> None:
    player = play(cell_bag, start_s=0.9, settings=SIMULATED)
    player.node.advance(2.0)
    player.received.clear()
    player.seek(0.1)
    player.node.advance(SETTLING_S - 0.03)
    count = len(player.of('/image'))
    player.node.advance(0.06)
    assert len(player.of('/image')) == count + 1
    assert told(player)[-1] == 0.1


def test_it_goes_back_once_at_a_seek_back_while_it_plays(play: Play, bag_of: Any) -> None:
    player = play(bag_of(cell_rows(4000)), plays=True, settings=SIMULATED)
    player.node.advance(2.5)
    player.received.clear()
    player.seek(1.0)
    player.node.advance(1.6)
    assert len(falls(told(player))) == 1
    assert told(player)[falls(told(player))[0]] == 1.0
    shown = numbers(player)[numbers(player).index(1.0):]
    assert sorted({it for it in shown if it < 2.0}) == [
        round(0.008 * it, 4) for it in range(125, 250)]


def test_a_late_one_does_not_delay_those_that_follow(play: Play, cell_bag: str) -> None:
    player = play(cell_bag, start_s=0.5, settings=SIMULATED)
    begin_s, receiver = player.node.now_s, player.node.receiver
    told_ms: List[int] = []

    def hear(_message: Any) -> None:
        told_ms.append(round(1000 * (receiver.now_s - begin_s)))
        if len(told_ms) == 3:
            receiver.now_s += 0.025  # a delay of the machine

    receiver.subscribe('/clock', rospy.AnyMsg, hear)
    receiver.advance(0.15)
    assert told_ms == [20, 40, 60, 85, 100, 120, 140]


def test_without_it_there_is_none(play: Play, cell_bag: str) -> None:
    player = play(cell_bag, plays=True)
    player.node.advance(0.5)
    assert '/clock' not in player.node.publishers
