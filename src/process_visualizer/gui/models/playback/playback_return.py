# SPDX-License-Identifier: BSD-3-Clause
"""Lets a player that was started again go on where the one before it was stopped."""
from __future__ import annotations

from typing import Optional

from process_visualizer.gui.models.playback.player_commands import PlayerCommands
from process_visualizer.gui.ros.snapshots import PlayerSnapshot

_READY_S = 10.0


class PlaybackReturn:
    """Remembers the last state, until a player of the same recording takes the place of another."""

    def __init__(self) -> None:
        self._last: Optional[PlayerSnapshot] = None
        self._is_up = True
        self._was_down = False

    def follow(self, is_up: bool) -> None:
        """Take whether the player runs, rather than being stopped or started."""
        self._is_up = is_up
        self._was_down = self._was_down or not is_up

    def forget(self) -> None:
        """Let the next player begin at the beginning."""
        self._last, self._was_down = None, False

    def take(self, snapshot: PlayerSnapshot) -> Optional[PlayerSnapshot]:
        """Take the newest state of a player; return the one to go back to, if the player is new."""
        if not self._is_up:
            return None  # of the one that is being stopped, or of one that is still beginning
        before, self._last = self._last, snapshot
        was_down, self._was_down = self._was_down, False
        is_same = before is not None and before.files == snapshot.files
        return before if was_down and is_same else None


def hold(client: PlayerCommands, spot: PlayerSnapshot) -> None:
    """Stand still, with the loop of a former state; blocks until the player takes commands."""
    client.wait_until_ready(_READY_S)
    client.pause()
    if spot.loop is not None:
        client.set_loop(True, *spot.loop)


def go_on(client: PlayerCommands, spot: PlayerSnapshot) -> None:
    """Take the rate of a former state, and play if that did."""
    client.set_rate(spot.rate)
    if not spot.paused:
        client.play()
