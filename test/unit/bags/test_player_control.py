# SPDX-License-Identifier: BSD-3-Clause
"""The player's commands where they depend on each other."""
from __future__ import annotations

from typing import Any

import pytest
from bags_fake_clock import FakeClock

from process_visualizer.playback.player_control import PlayerControl
from process_visualizer.playback.timeline import Timeline


@pytest.fixture
def control() -> PlayerControl:
    playback: Any = None  # only steps need it
    return PlayerControl(Timeline(0, 10 ** 10, FakeClock()), playback)


def test_toggled_twice_before_the_start_it_stands(control: PlayerControl) -> None:
    assert not control.pause_requested
    control.toggle_paused()
    assert not control.pause_requested
    control.toggle_paused()
    assert control.pause_requested


def test_play_after_a_pause_does_not_stand(control: PlayerControl) -> None:
    control.pause()
    assert control.pause_requested
    control.toggle_paused()
    assert not control.pause_requested
