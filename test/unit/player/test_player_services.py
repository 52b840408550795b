# SPDX-License-Identifier: BSD-3-Clause
"""The services of the player: effects, answers, refusals, and its state."""
from __future__ import annotations

from typing import Any, Callable, List

import numpy as np
import pytest
from recorded_rows import BEGIN_S, Row, cell_rows
from simulated_player import SimulatedPlayer
from std_msgs.msg import Float32MultiArray, String
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import Marker

from process_visualizer.bagio.recorder_topics import MARKS
from process_visualizer.msg import PlayerState
from process_visualizer.playback.topic_choice import TopicChoice
from process_visualizer.player.bag_player import HEAD_START_NS, PlayerSettings
from process_visualizer.ros_names import PLAYBACK_RATE
from process_visualizer.srv import (
    ReadTopicRequest,
    SeekRequest,
    SetLoopRequest,
    SetRateRequest,
    StepRequest,
)

HEAD_START_S = HEAD_START_NS * 1e-9
NAN, INF = float('nan'), float('inf')
Play = Callable[..., SimulatedPlayer]


def numbers(player: SimulatedPlayer) -> List[float]:
    """The numbers sent on /tcf."""
    return [round(Float32MultiArray().deserialize(data).data[0], 4) for data in player.of('/tcf')]


def kept(state: PlayerState) -> List[Any]:
    """The state that a refused command leaves unchanged."""
    return [state.position, state.rate, state.paused, state.loop, state.segment]


def test_a_seek_while_paused_sends_the_scene(play: Play, cell_bag: str) -> None:
    player = play(cell_bag)
    for position_s, tcf_s, frames in ((0.7, 0.696, 3), (0.35, 0.344, 2), (0.1, 0.096, 2)):
        player.received.clear()
        answer = player.seek(position_s)
        assert (answer.success, answer.message) == (True, f'at {position_s:.3f} s')
        assert numbers(player) == [tcf_s]
        assert Marker().deserialize(player.of('/marker')[0]).action == Marker.DELETEALL
        assert len(TFMessage().deserialize(player.of('/tf_static')[-1]).transforms) == frames
        assert all(it.time_s == player.node.wall_s() for it in player.received)
        assert (player.state.position, player.state.paused) == (position_s, True)


def test_steps(play: Play, cell_bag: str) -> None:
    player = play(cell_bag, settings=PlayerSettings(TopicChoice(['/tcf', '/image'])))
    player.seek(0.5)
    for arguments, shown_s in (((1, '/tcf'), 0.504), ((3, '/tcf'), 0.528), ((-2, '/tcf'), 0.512),
                               ((0, '', 0.1), 0.608), ((0, '', -0.2), 0.408),
                               ((1, '/image'), 0.440)):
        answer = player.step(*arguments)
        assert answer.success, answer.message
        assert numbers(player)[-1] == shown_s, arguments
    assert answer.message == 'at 0.444 s'


def test_a_step_pauses(play: Play, cell_bag: str) -> None:
    player = play(cell_bag, plays=True)
    player.node.advance(HEAD_START_S + 0.3)
    assert player.step(0, '', 0.1).message == 'at 0.400 s'
    player.node.advance(1.0)
    assert (player.state.paused, player.state.position) == (True, 0.4)


def test_a_pause_before_play_begins_counts(play: Play, cell_bag: str) -> None:
    for name in ('pause', 'stop'):
        player = play(cell_bag, starts=False)
        assert player.call(name).success
        player.start(plays=True)
        player.node.advance(1.0)
        assert (player.state.paused, player.state.position) == (True, 0.0)
        assert player.of('/text')


def test_pause_rate_loop_and_stop(play: Play, cell_bag: str) -> None:
    player = play(cell_bag)
    assert player.set_rate(0.1).message == 'rate 0.1'
    assert player.node.params[PLAYBACK_RATE] == 0.1
    assert player.play().message == 'playing 0.000 s'
    player.node.advance(HEAD_START_S + 1.0)
    assert player.state.position == pytest.approx(0.1, abs=0.01)
    assert player.call('toggle_paused').message == 'paused 0.100 s'
    player.node.advance(1.0)
    assert (player.state.position, player.state.achieved_rate) == (0.1, 0.0)
    assert player.set_loop(True, 0.2, 0.4).message == 'loop from 0.200 to 0.400 s'
    assert (player.state.loop_begin, player.state.loop_end) == (0.2, 0.4)
    player.set_rate(-1.0)
    player.seek(0.3)
    player.received.clear()
    segment = player.state.segment
    player.play()
    player.node.advance(HEAD_START_S + 0.1 + 2 * (HEAD_START_S + 0.2))  # loop rounds, backward
    assert player.state.segment == segment + 3
    assert {0.2, 0.4} <= set(numbers(player)) <= {round(0.008 * it, 4) for it in range(25, 51)}
    assert player.set_loop(False).message == 'no loop'
    assert player.call('stop').message == 'stopped at 0.000 s'
    assert (player.state.paused, player.state.position, player.state.loop) == (True, 0.0, False)
    player.close()
    assert player.node.params[PLAYBACK_RATE] == 1.0


def test_what_is_shown_is_sent_once_more_for_a_cell_that_has_changed(play: Play,
                                                                     cell_bag: str) -> None:
    player = play(cell_bag, start_s=0.4)
    player.node.advance(1.0)
    player.received.clear()
    assert player.call('repeat').message == 'shown again 0.400 s'
    assert numbers(player) == [0.4]


@pytest.mark.parametrize('name, request_, reason', [
    ('set_rate', SetRateRequest(0.0), 'must not be 0'),
    ('set_rate', SetRateRequest(NAN), 'must be a number'),
    ('set_rate', SetRateRequest(2e6), 'from 1e-06 to 1e+06'),
    ('seek', SeekRequest(NAN), 'must be a number'),
    ('seek', SeekRequest(INF), 'must be a number'),
    ('seek', SeekRequest(1e308), 'out of range'), ('seek', SeekRequest(-1e308), 'out of range'),
    ('step', StepRequest(0, '', 1e308), 'out of range'),
    ('set_rate', SetRateRequest(-1e308), 'from 1e-06 to 1e+06'),
    ('set_loop', SetLoopRequest(True, 0.1, 1e308), 'out of range'),
    ('step', StepRequest(0, '', 0.0), 'a count'),
    ('step', StepRequest(1, '/nothing', 0.0), 'not in the recording'),
    ('step', StepRequest(0, '', INF), 'must be a number'),
    ('set_loop', SetLoopRequest(True, 0.5, 0.4), 'at least'),
    ('set_loop', SetLoopRequest(True, NAN, 0.4), 'must be a number')])
def test_what_cannot_be_met_changes_nothing_and_says_why(play: Play, cell_bag: str, name: str,
                                                         request_: Any, reason: str) -> None:
    player = play(cell_bag, start_s=0.5)
    before = kept(player.state)
    player.received.clear()
    answer = player.call(name, request_)
    assert not answer.success
    assert reason in answer.message
    assert kept(player.state) == before
    assert player.received == []


@pytest.mark.parametrize('position_s, end_s', [(7.0, 1.0), (-1.0, 0.0)])
def test_a_position_outside_is_moved_to_the_nearer_end(play: Play, cell_bag: str,
                                                       position_s: float, end_s: float) -> None:
    player = play(cell_bag, start_s=0.5)
    answer = player.seek(position_s)
    assert answer.success
    assert 'outside of the recording' in answer.message
    assert player.state.position == end_s


def test_at_the_beginning_nothing_comes_from_elsewhere(play: Play, bag_of: Any) -> None:
    player = play(bag_of([*cell_rows(), Row('/late_text', 500, String('late')),
                          Row('/late_number', 600, Float32MultiArray(data=[1.0]))],
                         latched=('/late_text',)), start_s=1.0)
    player.received.clear()
    assert player.seek(0.0).message == 'at 0.000 s; nothing yet on /late_text, /late_number'
    assert numbers(player) == [0.0]
    assert len(player.of('/image')) == 1  # it was recorded at 4 ms
    assert player.state.not_begun == ['/late_text', '/late_number']
    assert player.late('/late_text') == []
    frames = [it.child_frame_id for it in TFMessage().deserialize(
        player.late('/tf_static')[0]).transforms]
    assert frames == ['fixed0', 'fixed1']
    player.seek(0.55)
    assert player.state.not_begun == ['/late_number']


def test_no_service_takes_commands_before_it_is_prepared_or_after_its_end(play: Play,
                                                                          cell_bag: str) -> None:
    player = play(cell_bag)
    offered = set(player.node.services)
    assert offered == {f'/bag_player/{name}' for name in (
        'play', 'pause', 'toggle_paused', 'stop', 'repeat', 'seek', 'set_rate', 'step', 'set_loop',
        'read')}
    player.close()
    assert set(player.node.services) == offered  # rospy unregisters them when the node ends
    assert player.play().message == player.call('read', ReadTopicRequest()).message == (
        'the player is ending')


def test_reading_of_the_recording_is_seen_by_nobody(play: Play, cell_bag: str) -> None:
    player = play(cell_bag, plays=True)
    player.node.advance(HEAD_START_S + 0.3)
    before = len(player.received)
    state = player.player.state_message()
    assert player.read('/image', 0.0, 1.0).success
    assert (player.player.state_message(), len(player.received)) == (state, before)
    player.node.advance(0.301)
    assert numbers(player) == [round(0.008 * it, 4) for it in range(76)]


# Its state


def test_the_position_of_a_state_is_that_of_its_stamp(play: Play, cell_bag: str) -> None:
    player = play(cell_bag, rate=0.25, plays=True)
    player.states.clear()
    player.node.advance(HEAD_START_S + 3.0)
    assert len(player.states) > 30
    for state in player.states[2:]:
        assert state.position == pytest.approx(
            0.25 * (state.stamp - state.since).to_sec(), abs=1e-8)
        assert state.stamp.to_sec() <= player.node.wall_s()


def test_the_state_comes_ten_times_a_second(play: Play, cell_bag: str) -> None:
    player = play(cell_bag)
    player.node.advance(2.0)
    times_s = [it.stamp.to_sec() for it in player.states]
    assert len(times_s) > 20
    assert np.diff(times_s).max() < 0.1
    last = player.state
    assert (last.files, last.duration, last.begin.secs) == ([cell_bag], 1.0, BEGIN_S)


def test_the_state_comes_at_once_after_a_command(play: Play, cell_bag: str) -> None:
    player = play(cell_bag)
    player.states.clear()
    player.set_rate(3.0)
    assert [(it.rate, it.stamp.to_sec()) for it in player.states] == [(3.0, player.node.wall_s())]


def test_the_end_is_told_at_once(play: Play, cell_bag: str) -> None:
    player = play(cell_bag, plays=True)
    player.end()
    assert [it.position for it in player.states if it.paused and it.stamp == it.since] == [1.0]


def test_the_state_counts_the_messages_of_each_topic(play: Play, cell_bag: str) -> None:
    choice = TopicChoice(['/tcf', '/image'], remap={'/image': '/picture'})
    player = play(cell_bag, plays=True, settings=PlayerSettings(choice, keep_alive=True))
    player.node.advance(HEAD_START_S + 1.05)
    assert {it.name: it.published for it in player.state.topics} == {'/tcf': 126, '/picture': 25}
    assert player.state.published == 151
    player.seek(0.5)
    player.node.advance(0.09)
    assert {it.name: it.published for it in player.state.topics} == {'/tcf': 127, '/picture': 26}


def test_the_state_names_the_last_mark(play: Play, bag_of: Any) -> None:
    player = play(bag_of([*cell_rows(), Row(MARKS, 500, String('the seam tears'))]))
    for position_s, mark in ((0.4, ''), (0.5, 'the seam tears'), (1.0, 'the seam tears')):
        player.seek(position_s)
        assert player.state.mark == mark
        assert player.player.status().mark == mark
