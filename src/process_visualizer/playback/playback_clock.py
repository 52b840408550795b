# SPDX-License-Identifier: BSD-3-Clause
"""The clock of playback: converts wall time to recording time from the player's states."""
from __future__ import annotations

from typing import NamedTuple, Optional, Tuple

SILENT_AFTER_S = 1.0  # without a state from the player, which sends ten per second
_MEMORY = 64  # states: some seconds
_MAX_POSITION_S, _MAX_RATE = 1e9, 1e3
_LAST_DATA_S, _SWITCH_S = 0.3, 3.0
"""Time [s] after a player's last state in which its data may still arrive, and maximum time [s]
until another player's first state when recordings are switched; after longer, a live cell may have
run.
"""
_PAUSED_SPEED = 1e-5
"""Speed of the data clock while playback is paused: 0.4 s in ten hours."""


class ClockState(NamedTuple):
    """The player's own state (process_visualizer/PlayerState)."""

    stamp_s: float  # wall time for which the position holds
    position_s: float  # seconds from the beginning of the recording
    rate: float  # seconds of recording per second; negative means backward
    paused: bool
    segment: int  # grows when the position jumps
    since_s: float = 0.0  # wall time since which the state holds; 0: since the stamp
    recording: str = ''  # its files

    def is_usable(self) -> bool:
        """Return whether a player can be at this position, and play at this rate."""
        return abs(self.position_s) < _MAX_POSITION_S and abs(self.rate) < _MAX_RATE

    def begin_s(self) -> float:
        """Return the wall time [s] from which the state holds."""
        return min(self.since_s, self.stamp_s) if self.since_s else self.stamp_s

    def position_at(self, wall_s: float) -> float:
        """Return the position [s] at a wall time, assuming that the state holds then."""
        if self.since_s > self.stamp_s:  # play begins slightly later
            return self.position_s + max(wall_s - self.since_s, 0.0) * self.speed()
        return self.position_s + (wall_s - self.stamp_s) * self.speed()

    def speed(self) -> float:
        """Return the bag seconds per second: the rate, or 0 while paused."""
        return 0.0 if self.paused else self.rate


class BagTime(NamedTuple):
    """A time of the recording; times of different segments must not be compared."""

    segment: int
    time_s: float
    rate: float = 1.0  # bag seconds per second; 0 while paused


class PlaybackClock:
    """Maps wall times to bag times; without a player, times stay as they are.

    Each state holds until the next one begins. A playing state is extrapolated at its rate, but not
    past the position at which the next one begins, which is closer if the player could not keep up.

    States come from one thread; reading is safe from others.
    """

    def __init__(self) -> None:
        self._states: Tuple[ClockState, ...] = ()
        self._age_basis = (0.0, 0.0, 1.0)  # wall time, data time, data seconds per second
        self._begin = (0.0, 0.0)  # of the present player: wall time, data time

    def add(self, state: ClockState) -> None:
        """Add the player's next state; start over if its clock was set back.

        An unusable state changes nothing: NaN would stay in all later times.
        """
        if not state.is_usable():
            return
        last = self.state
        is_other = last is None or state.begin_s() > last.stamp_s and (
            state.recording != last.recording
            or state.stamp_s - last.stamp_s >= SILENT_AFTER_S)
        if is_other:
            begin_s = state.begin_s()
            if last is not None and begin_s - last.stamp_s < _SWITCH_S:
                begin_s = min(begin_s, last.stamp_s + _LAST_DATA_S)  # it was sending before
            self._begin = begin_s, self.data_time_s(begin_s)
        if last is not None and state.stamp_s < last.stamp_s:
            self._states = ()
        self._states = (*self._states[-(_MEMORY - 1):], state)
        # Slow playback must not make data look old.
        self._age_basis = (state.stamp_s, self.data_time_s(state.stamp_s),
                           min(max(abs(state.speed()), _PAUSED_SPEED), 1.0))

    @property
    def state(self) -> Optional[ClockState]:
        """Return the player's last state; None without a player."""
        return self._states[-1] if self._states else None

    def follows_player(self, now_s: float) -> bool:
        """Return whether a player has sent a state recently."""
        return bool(self._states) and now_s - self._states[-1].stamp_s < SILENT_AFTER_S

    def bag_time(self, wall_s: float) -> Optional[BagTime]:
        """Return the bag time played at a wall time [s]; None without a player."""
        following: Optional[ClockState] = None
        for state in reversed(self._states):
            if state.begin_s() <= wall_s:
                return _extrapolated(state, wall_s, following)
            following = state
        if following is None:
            return None
        return BagTime(following.segment, following.position_at(following.begin_s()),
                       following.speed())

    def present(self, wall_s: float) -> Optional[BagTime]:
        """Return the bag time at the present wall time [s]; None without a player.

        The newest state holds now, even if its stamp is ahead of this machine's clock: with a
        clock 2 ms behind the player's, a pause at 4x would otherwise be off by 8 ms until it ends.
        """
        state = self.state
        return None if state is None else _extrapolated(state, max(wall_s, state.begin_s()), None)

    def age_s(self, arrival_s: float, wall_s: float) -> float:
        """Return the age [s] at a wall time of data that arrived at a time of the data clock.

        Data from before the player began is not part of its recording: it also ages while playback
        is paused.
        """
        begin_s, data_s = self._begin
        if self.is_from_before(arrival_s):
            return max(wall_s - begin_s, 0.0) + data_s - arrival_s
        return max(self.data_time_s(wall_s) - arrival_s, 0.0)

    def is_from_before(self, arrival_s: float) -> bool:
        """Return whether data arrived before the present player began; see ``age_s``."""
        return bool(self._states) and arrival_s < self._begin[1]

    def data_time_s(self, wall_s: float) -> float:
        """Return the data clock [s], which times the arrival of data; see ``age_s``.

        This clock nearly stops while playback is paused (it only keeps the order of arrivals), and
        is slow while playback is slow. Without a player, or when the player is lost, it runs like
        the wall clock.
        """
        basis_s, data_s, speed = self._age_basis
        elapsed_s = max(wall_s - basis_s, 0.0)
        followed_s = min(elapsed_s, SILENT_AFTER_S)
        return data_s + followed_s * speed + (elapsed_s - followed_s)


def _extrapolated(state: ClockState, wall_s: float,
                  following: Optional[ClockState]) -> BagTime:
    time_s = state.position_at(wall_s)
    if (following is not None and following.segment == state.segment
            and not state.paused and not following.paused):  # a step pauses, and may go backward
        nearer = min if state.rate > 0.0 else max
        time_s = nearer(time_s, following.position_at(following.begin_s()))
    return BagTime(state.segment, time_s, state.speed())
