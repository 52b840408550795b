# SPDX-License-Identifier: BSD-3-Clause
"""Playback commands queued for the player: motion, seeks and steps."""
from __future__ import annotations

from typing import Any, Callable, NamedTuple, Optional, Protocol

from process_visualizer.gui.playback.playback_state import SeekTarget, StepUnit
from process_visualizer.gui.toolkit.tasks import Newest


class PlayerCommands(Protocol):
    """Commands to the player (PlayerClient in clients/player_client.py); each call may block."""

    def wait_until_ready(self, timeout_s: float) -> Any:
        """Wait until the player takes commands."""

    def play(self) -> Any:
        """Play."""

    def pause(self) -> Any:
        """Pause."""

    def stop(self) -> Any:
        """Pause at the beginning."""

    def seek(self, position_s: float) -> Any:
        """Go to a position [s]."""

    def set_rate(self, rate: float) -> Any:
        """Change the rate; below 0 backwards."""

    def step(self, count: int, topic: str = '', duration_s: float = 0.0) -> Any:
        """Pause and move by messages or by a time [s]."""

    def set_loop(self, loop: bool, begin_s: float = 0.0, end_s: float = 0.0) -> Any:
        """Repeat the part between two positions [s], or end repeating."""


class PlayMotion(NamedTuple):
    """A rate, below 0 backwards, and whether to play then; else playing or paused as before."""

    rate: float
    plays: bool = False


class MotionCommands:
    """Sends one motion at a time, so that the player never plays in an outdated direction.

    A command to pause also keeps a waiting motion from playing.
    """

    def __init__(self, set_rate: Callable[[float], Any], play: Callable[[], Any],
                 newest: Newest) -> None:
        """Take the player's commands, and a maker of calls with the newest value."""
        self._set_rate = set_rate
        self._play = play
        self._calls = newest(self._send)

    @property
    def rate(self) -> Optional[float]:
        """The requested rate until the player has taken it, then None."""
        wanted = self._calls.wanted
        return None if wanted is None else wanted.rate

    def change_rate(self, rate: float) -> None:
        """Change the rate; playing or paused as before."""
        waiting = self._calls.waiting
        self._calls.request(PlayMotion(rate, waiting is not None and waiting.plays))

    def play(self, rate: float) -> None:
        """Play as soon as the player has the rate."""
        self._calls.request(PlayMotion(rate, plays=True))

    def stand(self) -> None:
        """Keep a waiting motion from playing."""
        waiting = self._calls.waiting
        if waiting is not None:
            self._calls.request(waiting._replace(plays=False))

    def _send(self, motion: PlayMotion) -> None:
        self._set_rate(motion.rate)
        if motion.plays:
            self._play()


class SeekCommands:
    """Sends one seek at a time, and knows when the newest one was sent."""

    def __init__(self, client: PlayerCommands, clock: Callable[[], float],
                 newest: Newest) -> None:
        """Take the client of the player, and a maker of calls with the newest value.

        ``clock`` returns the wall time [s].
        """
        self._client = client
        self._clock = clock
        self._sent_s = 0.0
        self._calls = newest(self._send)

    @property
    def wanted(self) -> Optional[SeekTarget]:
        """The newest seek until the player has done it, then None."""
        return self._calls.wanted

    @property
    def done_since_s(self) -> Optional[float]:
        """The wall time [s] at which the newest seek was sent; None while it is under way."""
        return self._sent_s if self._calls.wanted is None else None

    def request(self, sought: SeekTarget) -> None:
        """Go to a position, unless a newer seek comes before its turn."""
        self._calls.request(sought)

    def _send(self, sought: SeekTarget) -> None:
        self._sent_s = self._clock()
        self._client.seek(sought.position_s)


class Steps(NamedTuple):
    """A number of steps forward, or (below 0) back."""

    number: int
    unit: StepUnit


class StepCommands:
    """Sends one step at a time; waiting steps of the same unit are merged, so that none pile up."""

    def __init__(self, client: PlayerCommands, newest: Newest) -> None:
        """Take the client of the player, and a maker of calls with the newest value."""
        self._client = client
        self._calls = newest(self._send)

    def request(self, count: int, unit: StepUnit) -> None:
        """Move this number of steps forward, or (below 0) back."""
        waiting = self._calls.waiting
        waits = waiting.number if waiting is not None and waiting.unit == unit else 0
        self._calls.request(Steps(waits + count, unit))

    def _send(self, steps: Steps) -> None:
        count, unit = steps
        if unit.duration_s:
            self._client.step(0, '', count * unit.duration_s)
        elif count:
            self._client.step(count, unit.topic, 0.0)
