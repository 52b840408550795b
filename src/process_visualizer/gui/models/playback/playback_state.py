# SPDX-License-Identifier: BSD-3-Clause
"""The state of playback as an operator sees it, as a value: what changes it returns another one."""
from __future__ import annotations

from typing import NamedTuple, Optional, Tuple

from process_visualizer.gui.models.playback.loop_points import LoopPoints, points_of
from process_visualizer.gui.models.playback.marks import Marks
from process_visualizer.gui.models.playback.step_unit import MESSAGE, StepUnit
from process_visualizer.gui.ros.snapshots import PlayerSnapshot

_KEPT_SHARE = 0.95  # of the rate; what is reached above this is not worth telling


class Sought(NamedTuple):
    """A position [s from the beginning] that was asked for in a segment, which this is to end."""

    position_s: float
    segment: int


class PlaybackState(NamedTuple):
    """The player's last state, None where there is none, and the operator's choices.

    ``sought`` is where a seek leads that no state of the player tells of yet; ``points`` stay
    while the loop is off; ``resumes`` says whether it plays on after dragging; ``files`` are
    those of the player that was there last.
    """

    snapshot: Optional[PlayerSnapshot] = None
    sought: Optional[Sought] = None
    points: LoopPoints = LoopPoints()
    resumes: bool = False
    unit: StepUnit = MESSAGE
    marks: Marks = Marks()
    files: Tuple[str, ...] = ()

    @property
    def duration_s(self) -> float:
        """Return how long the recording is; 0 while there is no player."""
        return 0.0 if self.snapshot is None else self.snapshot.duration_s

    @property
    def is_playing(self) -> bool:
        """Return whether the position moves."""
        return self.snapshot is not None and not self.snapshot.paused

    @property
    def loop(self) -> Optional[Tuple[float, float]]:
        """Return what the player repeats [s from the beginning]; None if it does not."""
        return None if self.snapshot is None else self.snapshot.loop

    @property
    def rate(self) -> float:
        """The player's rate; below 0 backwards."""
        return 1.0 if self.snapshot is None else self.snapshot.rate

    @property
    def reached_rate(self) -> Optional[float]:
        """The rate that the machine reaches, if that is less than the rate wanted."""
        if self.snapshot is None or self.snapshot.paused:
            return None
        reached = self.snapshot.achieved_rate
        return None if abs(reached) >= _KEPT_SHARE * abs(self.snapshot.rate) else reached

    @property
    def dropped(self) -> int:
        """Return how many messages slow subscribers did not get."""
        return 0 if self.snapshot is None else self.snapshot.dropped

    @property
    def problems(self) -> Tuple[str, ...]:
        """Return what the player cannot play."""
        return () if self.snapshot is None else self.snapshot.gaps

    def within(self, position_s: float) -> float:
        """Return a position [s], or the nearer end of the recording where it lies outside."""
        return min(max(position_s, 0.0), self.duration_s)

    def updated(self, snapshot: Optional[PlayerSnapshot], asks_for_loop: bool) -> PlaybackState:
        """Take the newest state of the player.

        Another recording has no points; those of this one stay while its player is away. A loop
        that somebody else has set is taken over, unless one is being asked for.
        """
        files = self.files if self.snapshot is None else self.snapshot.files
        before, state = self, self._replace(snapshot=snapshot, files=files)
        if _files(self.snapshot) != _files(snapshot):
            before = PlaybackState()
        if snapshot is not None and snapshot.files != files:
            state = state._replace(points=LoopPoints())
        return state if asks_for_loop or state.loop == before.loop else state.with_players_loop()

    def sought_at(self, position_s: float) -> Sought:
        """Return a seek from here to a position [s], or to the nearer end."""
        segment = 0 if self.snapshot is None else self.snapshot.segment
        return Sought(self.within(position_s), segment)

    def arrived(self, sent_s: Optional[float]) -> PlaybackState:
        """Forget a seek that was sent at a wall time [s], once the player's state tells of it.

        None: it is under way.
        """
        if self.snapshot is None or (self.sought is not None
                                     and _tells(self.snapshot, self.sought, sent_s)):
            return self._replace(sought=None)
        return self

    def failed(self, wanted: Optional[Sought]) -> PlaybackState:
        """Return to what the player does, but for a seek that it is still asked for."""
        sought = None if self.snapshot is None else wanted
        return self._replace(sought=sought).with_players_loop()

    def with_players_loop(self) -> PlaybackState:
        """Take the points of the loop that the player repeats, if it does."""
        if self.loop is None:
            return self
        return self._replace(points=points_of(self.loop, self.duration_s))

    def differs_from(self, other: PlaybackState) -> bool:
        """Return whether the player says anything else but another position."""
        return _without_position(self.snapshot) != _without_position(other.snapshot)


def _files(snapshot: Optional[PlayerSnapshot]) -> Optional[Tuple[str, ...]]:
    return None if snapshot is None else snapshot.files


def _tells(snapshot: PlayerSnapshot, sought: Sought, sent_s: Optional[float]) -> bool:
    return (sent_s is not None and snapshot.stamp_s >= sent_s
            and snapshot.segment != sought.segment)


def _without_position(snapshot: Optional[PlayerSnapshot]) -> Optional[PlayerSnapshot]:
    if snapshot is None:
        return None
    return snapshot._replace(stamp_s=0.0, position_s=0.0, published=0, segment=0,
                             achieved_rate=round(snapshot.achieved_rate, 2))
