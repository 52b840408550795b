# SPDX-License-Identifier: BSD-3-Clause
"""The playback model and a player, after any sequence of actions of operator, player and tasks."""
from __future__ import annotations

from typing import List, Tuple

import pytest
from held_tasks import HeldTasks, Refused
from hypothesis import given, settings
from hypothesis import strategies as st
from playback_stand import PAUSED
from PyQt5.QtWidgets import QApplication

from process_visualizer.gui.playback.playback_model import PlaybackModel
from process_visualizer.gui.playback.playback_state import MIN_LOOP_S
from process_visualizer.gui.ros.snapshots import PlayerSnapshot

LENGTH_S = PAUSED.duration_s


class SmallPlayer:
    """Player that obeys at once, unless it is away or refuses the next command."""

    def __init__(self) -> None:
        self.now_s = PAUSED.stamp_s
        self.state = PAUSED
        self.refuses = self.is_away = False

    def updated(self) -> PlayerSnapshot:
        """Its current state."""
        return self.state._replace(stamp_s=self.now_s, achieved_rate=(
            0.0 if self.state.paused else self.state.rate))

    def go_on(self, duration_s: float) -> None:
        """Play for a time [s]."""
        self.now_s += duration_s
        if not self.state.paused:
            position_s = self.state.position_s + duration_s * self.state.rate
            self.state = self.state._replace(position_s=min(max(position_s, 0.0), LENGTH_S))

    def change(self, **changes: object) -> None:
        """Carry out a command, or refuse it."""
        refuses, self.refuses = self.refuses, False
        if refuses or self.is_away:
            raise Refused('no')
        self.state = self.state._replace(**changes)

    def jump(self, position_s: float, **changes: object) -> None:
        self.change(position_s=min(max(position_s, 0.0), LENGTH_S),
                    segment=self.state.segment + 1, **changes)

    def play(self) -> None:
        self.change(paused=False)

    def pause(self) -> None:
        self.change(paused=True)

    def stop(self) -> None:
        self.jump(0.0, paused=True)

    def seek(self, position_s: float) -> None:
        self.jump(position_s)

    def set_rate(self, rate: float) -> None:
        self.change(rate=rate)

    def step(self, count: int, _topic: str = '', duration_s: float = 0.0) -> None:
        position_s = self.state.position_s + count * 0.1 + duration_s
        self.change(paused=True, position_s=min(max(position_s, 0.0), LENGTH_S))

    def set_loop(self, loop: bool, begin_s: float = 0.0, end_s: float = 0.0) -> None:
        assert end_s - begin_s >= MIN_LOOP_S - 1e-6
        self.change(loop=(begin_s, end_s) if loop else None)


class Play:
    """Model, its player, and all possible actions, each with a number from 0 to 1."""

    def __init__(self) -> None:
        self.player = SmallPlayer()
        self.tasks = HeldTasks()
        self.model = PlaybackModel(self.tasks, self.player, Refused, lambda: self.player.now_s)

    def time_passes(self, share: float) -> None:
        self.player.go_on(share)

    def player_tells(self, _share: float) -> None:
        self.player.is_away = False
        self.model.take_state(self.player.updated())

    def player_goes(self, _share: float) -> None:
        self.player.is_away = True
        self.model.take_state(None)

    def player_refuses(self, _share: float) -> None:
        self.player.refuses = True

    def task_ends(self, _share: float) -> None:
        if self.tasks.held:
            self.tasks.end_one()

    def somebody_loops(self, share: float) -> None:
        self.player.state = self.player.state._replace(loop=(10.0 * share, 19.0))

    def seek(self, share: float) -> None:
        self.model.seek(share * LENGTH_S)
        assert self.model.position_s == (share * LENGTH_S if self.model.state.is_available else 0.0)

    def jump(self, share: float) -> None:
        self.model.seek(self.model.position_s + 4.0 * share - 2.0)

    def drag(self, share: float) -> None:
        self.model.begin_scrub()
        self.seek(share)

    def drop(self, _share: float) -> None:
        self.model.end_scrub()

    def step(self, share: float) -> None:
        self.model.step(round(4.0 * share) - 2)

    def toggle(self, share: float) -> None:
        self.model.toggle() if share < 0.5 else self.model.toggle_backwards()

    def set_rate(self, share: float) -> None:
        self.model.set_rate(8.0 * share - 4.0)

    def set_begin(self, share: float) -> None:
        self.model.set_loop_begin(share * LENGTH_S)

    def set_end(self, share: float) -> None:
        self.model.set_loop_end(share * LENGTH_S)

    def move_point(self, share: float) -> None:
        self.model.move_loop_point('A' if share < 0.5 else 'B', share * LENGTH_S)

    def toggle_loop(self, share: float) -> None:
        self.model.toggle_loop() if share < 0.7 else self.model.clear_loop()

    def check(self) -> None:
        """Check the conditions that hold at any time."""
        model = self.model
        assert 0.0 <= model.position_s <= model.state.duration_s
        if model.state.is_available:
            assert model.state.points.is_long_enough(LENGTH_S)
        else:
            assert not model.state.is_playing

    def end(self) -> None:
        """Answer all calls, and let the player send its state once more."""
        self.tasks.end_all()
        self.player.go_on(0.1)
        self.player.state = self.player.state._replace(paused=True)
        self.player_tells(0.0)


ACTIONS = [name for name in vars(Play) if name not in ('check', 'end') and not name.startswith('_')]


@settings(max_examples=300)
@given(actions=st.lists(st.tuples(st.sampled_from(ACTIONS), st.floats(0.0, 1.0)), max_size=40))
def test_once_all_is_answered_the_model_is_where_the_player_is(
        qapp: QApplication, actions: List[Tuple[str, float]]) -> None:
    play = Play()
    play.player_tells(0.0)
    for name, share in actions:
        getattr(play, name)(share)
        play.check()
    play.end()
    model, player = play.model, play.player.state
    assert (model.position_s, model.rate) == (player.position_s, player.rate)
    assert (model.state.is_playing, model.is_looping) == (False, player.loop is not None)
    if player.loop is not None:
        assert model.state.points.bounds(LENGTH_S) == pytest.approx(player.loop, abs=1e-5)
