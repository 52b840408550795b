# SPDX-License-Identifier: BSD-3-Clause
"""The commands of playback on their way to the player: motion, seeks and steps."""
from __future__ import annotations

from typing import Any, Callable, NamedTuple, Optional, Protocol

from process_visualizer.gui.playback.playback_state import SeekTarget, StepUnit
from process_visualizer.gui.toolkit.tasks import Newest


class PlayerCommands(Protocol):
    """Commands to the player (PlayerClient in clients/player_client.py); each call may block."""

    def wait_until_ready(self, timeout_s: float) -> Any:
        """Wait until the player takes commands."""

    def play(self) -> Any:
        """Play on."""

    def pause(self) -> Any:
        """Stand still."""

    def stop(self) -> Any:
        """Stand still at the beginning."""

    def seek(self, position_s: float) -> Any:
        """Go to a position [s]."""

    def set_rate(self, rate: float) -> Any:
        """Change the rate; below 0 backwards."""

    def step(self, count: int, topic: str = '', duration_s: float = 0.0) -> Any:
        """Pause and move by messages or by a time [s]."""

    def set_loop(self, loop: bool, begin_s: float = 0.0, end_s: float = 0.0) -> Any:
        """Repeat what is between two positions [s], or no more."""


class PlayMotion(NamedTuple):
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
        self._calls.request(PlayMotion(rate, waiting is not None and waiting.plays))

    def play(self, rate: float) -> None:
        """Play, once the player has the rate."""
        self._calls.request(PlayMotion(rate, plays=True))

    def stand(self) -> None:
        """Do not play any more when the turn of a rate that waits comes."""
        waiting = self._calls.waiting
        if waiting is not None:
            self._calls.request(waiting._replace(plays=False))

    def _send(self, motion: PlayMotion) -> None:
        self._set_rate(motion.rate)
        if motion.plays:
            self._play()


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
    def wanted(self) -> Optional[SeekTarget]:
        """The newest seek, as long as the player has not done it; else None."""
        return self._calls.wanted

    @property
    def done_since_s(self) -> Optional[float]:
        """Return when the newest seek was sent [wall s]; None while it is under way."""
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
