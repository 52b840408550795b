# SPDX-License-Identifier: BSD-3-Clause
"""The commands for rate and direction, which belong to those for playing and standing still."""
from __future__ import annotations

from typing import Any, Callable, NamedTuple, Optional

from process_visualizer.gui.models.playback.newest_call import Newest


class Motion(NamedTuple):
    """A rate, below 0 backwards, and whether it is to play then, or to do as before."""

    rate: float
    plays: bool = False


class MotionCommands:
    """Asks for one motion at a time, so that it never plays in a direction that was left.

    What stands still also keeps a rate that waits for its turn from playing.
    """

    def __init__(self, set_rate: Callable[[float], Any], play: Callable[[], Any],
                 newest: Newest) -> None:
        """Take the player's commands, and what makes a call that takes the newest value."""
        self._set_rate = set_rate
        self._play = play
        self._calls = newest(self._send)

    @property
    def rate(self) -> Optional[float]:
        """The rate that the player does not have yet; None if it has the one last asked for."""
        wanted = self._calls.wanted
        return None if wanted is None else wanted.rate

    def change_rate(self, rate: float) -> None:
        """Take a rate, playing or not as before."""
        waiting = self._calls.waiting
        self._calls.request(Motion(rate, waiting is not None and waiting.plays))

    def play(self, rate: float) -> None:
        """Play, once the player has the rate."""
        self._calls.request(Motion(rate, plays=True))

    def stand(self) -> None:
        """Do not play any more when the turn of a rate that waits comes."""
        waiting = self._calls.waiting
        if waiting is not None:
            self._calls.request(waiting._replace(plays=False))

    def _send(self, motion: Motion) -> None:
        self._set_rate(motion.rate)
        if motion.plays:
            self._play()
