# SPDX-License-Identifier: BSD-3-Clause
"""A restarted player continues where the previous one was stopped."""
from __future__ import annotations

from typing import Any, List

import pytest
from playback_stand import PAUSED, PlaybackStand

from process_visualizer.gui.playback.playback_state import LoopPoints

FIRST = PAUSED._replace(segment=0, paused=True)


@pytest.fixture
def stand(qtbot: Any) -> PlaybackStand:
    them = PlaybackStand()
    them.model.follow_player(True)
    return them


def restart(stand: PlaybackStand, **changes: Any) -> List[Any]:
    """Stop the player and start another one; return the commands that it gets."""
    stand.model.follow_player(False)
    stand.model.take_state(None)
    stand.snapshot = FIRST
    stand.state(**changes)  # it reports its state before it accepts commands
    assert stand.commands() == []
    stand.model.follow_player(True)
    stand.state(**changes)
    return stand.commands()


def test_it_plays_on_from_there_at_the_rate_and_with_the_loop(stand: PlaybackStand) -> None:
    stand.play(rate=-0.5, position_s=7.0, loop=(5.0, 10.0))
    assert restart(stand) == [
        ('wait_until_ready', 10.0), ('pause',), ('set_loop', True, 5.0, 10.0), ('seek', 7.0),
        ('set_rate', -0.5), ('play',)]
    stand.state(position_s=7.0, segment=1)
    assert stand.commands() == []


def test_it_stays_paused_there(stand: PlaybackStand) -> None:
    stand.state(position_s=7.0)
    assert restart(stand) == [
        ('wait_until_ready', 10.0), ('pause',), ('seek', 7.0), ('set_rate', 1.0)]
    assert stand.model.position_s == 7.0


def test_a_and_b_stay_while_the_loop_is_off(stand: PlaybackStand) -> None:
    stand.state(position_s=7.0, loop=(5.0, 10.0))
    stand.state(loop=None)
    restart(stand)
    assert stand.model.state.points == LoopPoints(5.0, 10.0)


def test_a_player_that_was_not_stopped_is_left_alone(stand: PlaybackStand) -> None:
    """The change may have affected other nodes only."""
    stand.play(position_s=7.0)
    stand.model.take_state(None)
    stand.play(position_s=8.0)
    assert stand.commands() == []


def test_another_recording_begins_at_its_beginning(stand: PlaybackStand) -> None:
    stand.play(position_s=7.0)
    assert restart(stand, files=('/bags/b.bag',)) == []


def test_after_all_nodes_were_quit_it_begins_at_the_beginning(stand: PlaybackStand) -> None:
    stand.play(position_s=7.0, loop=(5.0, 10.0))
    stand.model.forget_player()
    assert restart(stand) == []
    assert stand.model.state.points == LoopPoints()
