# SPDX-License-Identifier: BSD-3-Clause
"""Options of `rosbag play` on a simulated clock: the messages and their times."""
from __future__ import annotations

import threading
from typing import Any, Callable, List, Tuple

import pytest
from geometry_msgs.msg import PointStamped
from recorded_rows import Row, stamp, write_bag
from rospy import Time
from simulated_node import any_message
from simulated_player import SimulatedPlayer
from std_msgs.msg import Int32

from process_visualizer.playback.timeline import MAX_REQUESTED_RATE, CommandRefused
from process_visualizer.player.bag_player import HEAD_START_NS, PlayerSettings

HEAD_START_S = HEAD_START_NS * 1e-9
TIMES_MS = [*range(0, 1000, 50), 3500, *range(4000, 4500, 50)]
RECORDED = PlayerSettings(restamp=False)
Play = Callable[..., SimulatedPlayer]


@pytest.fixture(scope='module')
def bag(tmp_path_factory: pytest.TempPathFactory) -> str:
    """Numbers equal to their times [ms], with gaps of half a second and two seconds."""
    rows = [Row('/number', time_ms, Int32(time_ms)) for time_ms in TIMES_MS]
    return write_bag(tmp_path_factory.mktemp('numbers') / 'numbers.bag',
                     [*rows, Row('/mark', 725, Int32(725))])


def numbers(player: SimulatedPlayer, topic: str = '/number') -> List[int]:
    """The numbers received on a topic."""
    return [Int32().deserialize(data).data for data in player.of(topic)]


def played(player: SimulatedPlayer) -> Tuple[List[int], float]:
    """The numbers received until the end, and the time from the first one to the last [s]."""
    player.end()
    times_s = [it.time_s for it in player.received]
    return numbers(player), times_s[-1] - times_s[0]


@pytest.mark.parametrize('options, expected_ms, duration_s', [
    ({'rate': MAX_REQUESTED_RATE}, TIMES_MS, 0.0),
    ({'rate': 50.0}, TIMES_MS, 4.45 / 50.0),
    ({'settings': RECORDED._replace(end_s=0.72)}, list(range(0, 701, 50)), 0.7),
    ({'settings': RECORDED._replace(skip_empty_s=1.0)}, TIMES_MS, 1.9 + HEAD_START_S)])
def test_what_comes_in_which_time(play: Play, bag: str, options: Any, expected_ms: List[int],
                                  duration_s: float) -> None:
    came, elapsed_s = played(play(bag, plays=True, **{'settings': RECORDED, **options}))
    assert came == expected_ms
    assert elapsed_s == pytest.approx(duration_s, abs=1e-4)


def test_it_pauses_before_the_messages_of_some_topics(play: Play, bag: str) -> None:
    player = play(bag, plays=True, settings=RECORDED._replace(pause_topics=('/mark',)))
    player.node.advance(10.0)
    assert (numbers(player)[-1], numbers(player, '/mark')) == (700, [])
    player.play()
    player.node.advance(10.0)
    assert numbers(player) == [*range(0, 701, 50), 700, *TIMES_MS[15:]]  # the scene of the pause
    assert numbers(player, '/mark') == [725]


def done_at(time: Any) -> PointStamped:
    """The message of the node that controls the rate."""
    message = PointStamped()
    message.header.stamp = time
    return message


def controlled(**settings: Any) -> PlayerSettings:
    """Settings to play at most 0.3 s ahead of the node's progress, plus one message."""
    return PlayerSettings(rate_control_topic='/done', rate_control_max_delay_s=0.3, **settings)


def raw(message: Any) -> Any:
    """A message as rospy passes it on, with its definition."""
    found = any_message(message)
    found._connection_header['message_definition'] = message._full_text
    return found


def test_it_waits_for_the_node_that_controls_the_rate(play: Play, bag: str) -> None:
    player = play(bag, plays=True, settings=controlled(restamp=False))
    player.node.advance(10.0)
    assert numbers(player)[-1] == 350
    player.node.send('/done', raw(done_at(stamp(400))))
    player.node.advance(10.0)
    assert numbers(player)[-1] == 700
    player.node.send('/done', raw(done_at(stamp(10_000))))
    player.node.advance(10.0)
    assert numbers(player) == TIMES_MS


def test_that_node_tells_stamps_as_it_got_them(play: Play, bag: str) -> None:
    player = play(bag, plays=True, settings=controlled())
    player.node.advance(HEAD_START_S + 0.25)
    player.node.send('/done', raw(done_at(Time.from_sec(player.node.wall_s() - 0.05))))
    player.node.advance(10.0)
    assert numbers(player)[-1] == 550


def test_a_stamp_of_that_node_belongs_to_how_it_played_then(play: Play, bag: str) -> None:
    player = play(bag, plays=True, settings=controlled())
    player.node.advance(HEAD_START_S + 0.25)
    player.set_rate(0.1)
    player.node.advance(1.0)
    player.node.send('/done', raw(done_at(Time.from_sec(player.node.wall_s() - 1.13))))
    player.node.advance(5.0)
    assert numbers(player)[-1] == 450


def test_what_that_node_tells_of_before_a_jump_does_not_count(play: Play, bag: str) -> None:
    player = play(bag, plays=True, settings=controlled())
    player.node.advance(HEAD_START_S + 0.25)
    before = Time.from_sec(player.node.wall_s() - 0.05)
    player.seek(0.0)
    player.node.advance(0.1)
    player.node.send('/done', raw(done_at(before)))
    player.node.advance(10.0)
    assert numbers(player)[-1] == 350


def test_a_node_whose_messages_have_no_header_controls_nothing(play: Play, bag: str) -> None:
    player = play(bag, plays=True, settings=controlled(restamp=False))
    for _ in range(3):
        player.node.send('/done', raw(Int32(400)))
    player.node.advance(10.0)
    assert numbers(player)[-1] == 350
    assert player.node.log == [('warn', '/done cannot control the rate: its messages do not begin '
                                        'with a header')]


def test_it_waits_for_a_subscriber_of_each_topic(play: Play, bag: str) -> None:
    player = play(bag, starts=False)
    player.publishers.all_subscribed = False
    answers: List[bool] = []
    waiting = threading.Thread(
        target=lambda: answers.append(player.player.wait_for_subscribers(0.0, True)))
    waiting.start()
    assert answers == []
    player.publishers.all_subscribed = True
    player.player.on_subscribe()
    waiting.join(60.0)
    assert answers == [True]
    player.player.quit()
    assert not player.player.wait_for_subscribers(60.0, True)
    player.start()


@pytest.mark.parametrize('rate, start_s, loop, first_s', [
    (1.0, None, (0.0, 4.45), 0.0), (1.0, 1.0, (1.0, 4.45), 1.0),
    (-1.0, None, (0.0, 4.45), 4.45), (-1.0, 1.0, (0.0, 1.0), 1.0)])
def test_a_loop_repeats_what_is_played_without_it(play: Play, bag: str, rate: float, start_s: Any,
                                                  loop: Tuple[float, float],
                                                  first_s: float) -> None:
    player = play(bag, rate=rate, start_s=start_s, loop=True, plays=True)
    assert (player.player.status().loop, player.player.status().position_s) == (loop, first_s)
    length_s = loop[1] - loop[0]
    for _ in range(2):
        player.node.advance(length_s / 2 + HEAD_START_S)
        assert loop[0] < player.state.position < loop[1]
        player.node.advance(length_s / 2)
    assert player.state.segment == player.states[0].segment + 2


def test_backwards_there_is_no_loop_before_the_beginning(play: Play, bag: str) -> None:
    with pytest.raises(CommandRefused, match='a loop from 0.000 to 0.000 s: its end must be'):
        play(bag, rate=-1.0, start_s=0.0, loop=True)
