# SPDX-License-Identifier: BSD-3-Clause
"""Seeks on their way to the player."""
from __future__ import annotations

from typing import Callable, Optional

from process_visualizer.gui.models.playback.newest_call import Newest
from process_visualizer.gui.models.playback.playback_state import Sought
from process_visualizer.gui.models.playback.player_commands import PlayerCommands


class SeekCommands:
    """Asks for one seek at a time, and knows when the newest one was sent."""

    def __init__(self, client: PlayerCommands, clock: Callable[[], float],
                 newest: Newest) -> None:
        """Take what commands the player, and what makes a call that takes the newest value.

        ``clock`` returns the wall time [s].
        """
        self._client = client
        self._clock = clock
        self._sent_s = 0.0
        self._calls = newest(self._send)

    @property
    def wanted(self) -> Optional[Sought]:
        """The newest seek, as long as the player has not done it; else None."""
        return self._calls.wanted

    @property
    def done_since_s(self) -> Optional[float]:
        """Return when the newest seek was sent [wall s]; None while it is under way."""
        return self._sent_s if self._calls.wanted is None else None

    def request(self, sought: Sought) -> None:
        """Go to a position, unless a newer seek comes before its turn."""
        self._calls.request(sought)

    def _send(self, sought: Sought) -> None:
        self._sent_s = self._clock()
        self._client.seek(sought.position_s)
