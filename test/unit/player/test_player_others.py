# SPDX-License-Identifier: BSD-3-Clause
"""The player next to nodes that publish its topics: reported at once, and paused in the cell."""
from __future__ import annotations

from typing import Callable, List

import pytest
from sensor_msgs.msg import Image
from simulated_player import SimulatedOthers, SimulatedPlayer
from std_msgs.msg import Float32MultiArray, String

from process_visualizer.health.other_publishers import LOOK_PERIOD_S
from process_visualizer.playback.topic_choice import TopicChoice
from process_visualizer.player.bag_player import PlayerSettings

MIXED = ['/tcf is published by /driver']
WARNING = ('/tcf is published by /driver, in addition to the recording: stop it, or play under '
           'other names (-p PREFIX)')
CELL = PlayerSettings(TopicChoice(['/tcf', '/tf', '/other_tcf']), keep_alive=True,
                      pauses_beside_others=True)
Play = Callable[..., SimulatedPlayer]


def others(*topics: str) -> SimulatedOthers:
    """A node /driver that publishes some topics and sends no connection header."""
    found = SimulatedOthers()
    found.nodes = {topic: ['/driver'] for topic in topics}
    return found


def warnings(player: SimulatedPlayer) -> List[str]:
    """The warnings."""
    return [text for kind, text in player.node.log if kind == 'warn']


def test_a_driver_that_runs_keeps_it_from_playing(play: Play, cell_bag: str) -> None:
    player = play(cell_bag, settings=CELL, others=others('/tcf'), loop=True, plays=True)
    player.node.advance(1.0)
    assert (player.state.others, player.state.paused, player.state.position) == (MIXED, True, 0.0)


def test_a_driver_that_starts_is_told_and_pauses_once(play: Play, cell_bag: str) -> None:
    player = play(cell_bag, settings=CELL, loop=True, plays=True)
    player.node.advance(0.4)
    assert (player.state.others, player.state.paused) == ([], False)
    player.others.nodes = {'/tcf': ['/driver']}
    player.node.advance(LOOK_PERIOD_S)
    assert (player.state.others, player.state.paused) == (MIXED, True)
    assert warnings(player) == [f'{WARNING}; playback is paused']
    player.play()  # the operator wants it anyway
    player.node.advance(5 * LOOK_PERIOD_S)
    assert not player.state.paused, 'it was told already'
    player.others.nodes = {'/tcf': ['/driver', '/second']}
    player.node.advance(LOOK_PERIOD_S)
    assert player.state.paused
    assert warnings(player)[1:] == [f'{WARNING.replace("driver", "second")}; playback is paused']
    player.others.nodes = {}
    player.node.advance(LOOK_PERIOD_S)
    assert player.state.others == []
    assert len(warnings(player)) == 2


def test_what_the_recording_has_not_must_not_come_from_elsewhere(play: Play,
                                                                 cell_bag: str) -> None:
    player = play(cell_bag, settings=CELL, others=others('/other_tcf'))
    assert player.state.others == ['/other_tcf is published by /driver']


@pytest.mark.parametrize('prefix, topic', [('', '/tf'), ('/recorded', '/tcf')])
def test_shared_topics_and_other_names_are_no_mixture(play: Play, cell_bag: str, prefix: str,
                                                      topic: str) -> None:
    settings = PlayerSettings(TopicChoice(prefix=prefix), pauses_beside_others=True)
    player = play(cell_bag, settings=settings, others=others(topic), plays=True)
    player.node.advance(0.6)
    assert (player.state.others, player.state.paused) == ([], False)


def test_in_the_place_of_rosbag_play_it_warns_and_plays(play: Play, cell_bag: str) -> None:
    player = play(cell_bag, others=others('/tcf'), plays=True)
    player.end()
    assert warnings(player) == [WARNING]
    assert len(player.of('/tcf')) == 126


def test_after_its_end_it_looks_no_more(play: Play, cell_bag: str) -> None:
    player = play(cell_bag)
    player.close()
    player.others.nodes = {'/tcf': ['/driver']}
    player.node.advance(3 * LOOK_PERIOD_S)
    assert warnings(player) == []


# Topics that cannot be played next to other publishers

IMAGE = {'type': Image._type, 'md5sum': Image._md5sum}
ARRAY = {'type': Float32MultiArray._type, 'md5sum': Float32MultiArray._md5sum}


@pytest.mark.parametrize('topic, header, reason', [
    ('/tcf', {'type': String._type, 'md5sum': String._md5sum},
     '/tcf: left out, as it is std_msgs/Float32MultiArray in the recording, but std_msgs/String '
     'where /driver publishes it; give it another name (/tcf:=/other) or a prefix (-p)'),
    ('/image', {**IMAGE, 'md5sum': '0' * 32},
     f'/image: left out, as the definition of sensor_msgs/Image in the recording '
     f'({Image._md5sum}) is not that of /driver ({"0" * 32})')])
def test_types_and_definitions_that_differ_are_left_out(
        play: Play, cell_bag: str, topic: str, header: dict, reason: str) -> None:
    beside = others(topic)
    beside.headers = {'/driver': header}
    player = play(cell_bag, others=beside, plays=True)
    player.end()
    assert player.of(topic) == []
    assert any(reason in it for it in player.player.problems)
    assert not player.player.is_complete


@pytest.mark.parametrize('headers', [{}, {'/driver': ARRAY}])
def test_who_publishes_the_same_or_does_not_answer_is_no_reason(play: Play, cell_bag: str,
                                                                headers: dict) -> None:
    beside = others('/tcf')
    beside.headers = headers
    player = play(cell_bag, others=beside, plays=True)
    player.end()
    assert len(player.of('/tcf')) == 126
    assert player.player.is_complete
