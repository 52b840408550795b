# SPDX-License-Identifier: BSD-3-Clause
"""Steps on their way to the player."""
from __future__ import annotations

from typing import NamedTuple

from process_visualizer.gui.models.playback.newest_call import Newest
from process_visualizer.gui.models.playback.player_commands import PlayerCommands
from process_visualizer.gui.models.playback.step_unit import StepUnit


class Steps(NamedTuple):
    """A number of steps forward, or (below 0) back."""

    number: int
    unit: StepUnit


class StepCommands:
    """Asks for one step at a time; those of a unit that wait become one, so none pile up."""

    def __init__(self, client: PlayerCommands, newest: Newest) -> None:
        """Take what commands the player, and what makes a call that takes the newest value."""
        self._client = client
        self._calls = newest(self._send)

    def request(self, count: int, unit: StepUnit) -> None:
        """Go so many steps on, or (below 0) back."""
        waiting = self._calls.waiting
        waits = waiting.number if waiting is not None and waiting.unit == unit else 0
        self._calls.request(Steps(waits + count, unit))

    def _send(self, steps: Steps) -> None:
        count, unit = steps
        if unit.duration_s:
            self._client.step(0, '', count * unit.duration_s)
        elif count:
            self._client.step(count, unit.topic, 0.0)
